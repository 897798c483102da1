"""A node of ROS 2 on another vendor's DDS, for tests to speak with: `tests/peers/ros2_client`, built by Cargo."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

SOURCES = Path(__file__).parents[1] / "peers" / "ros2_client"
CARGO = (1, 88)
"""What ros2-client asks for."""

_GUARD_S = 600
"""After so long something hangs. No test waits for it."""


@pytest.fixture(scope="session")
def ros2_peer_program() -> Path:
    """The program, built.

    Without Cargo, or where its crates cannot be had, the tests that need it are skipped, also with SCBM_ALL_TOOLS=1:
    that speaks of tools of Debian, and its Cargo may be too old. Once they are there, it must build.
    """
    cargo = shutil.which("cargo")
    if cargo is None:
        pytest.skip("not installed: cargo")
    missing = _missing(cargo)
    if missing is not None:
        pytest.skip(missing)
    environment = {**os.environ, "CARGO_TARGET_DIR": str(SOURCES / "target")}
    subprocess.run([cargo, "build", "--quiet", "--locked", "--offline"], cwd=SOURCES, env=environment, check=True)
    return SOURCES / "target" / "debug" / "ros2_peer"


def _missing(cargo: str) -> str | None:
    version = subprocess.run([cargo, "--version"], capture_output=True, text=True, check=False).stdout
    numbers = re.match(r"cargo (\d+)\.(\d+)", version)
    if numbers is None or tuple(map(int, numbers.groups())) < CARGO:
        return f"not installed: cargo {CARGO[0]}.{CARGO[1]} or newer"
    environment = {**os.environ, "CARGO_NET_RETRY": "0", "CARGO_HTTP_TIMEOUT": "10"}
    fetched = subprocess.run(
        [cargo, "fetch", "--locked"],
        cwd=SOURCES, env=environment, capture_output=True, text=True, timeout=_GUARD_S, check=False,
    )  # fmt: skip
    if fetched.returncode == 0:
        return None
    message = next((line for line in fetched.stderr.splitlines() if line.startswith("error")), fetched.stderr)
    if "--locked" in message:
        pytest.fail(f"Cargo.lock does not go with Cargo.toml: {message}")
    return f"crates cannot be had: {message}"
