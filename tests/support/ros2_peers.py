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

_FETCH_S = 120


@pytest.fixture(scope="session")
def ros2_peer_program() -> Path:
    """The program, built.

    Without Cargo, or where its crates cannot be had, the tests that need it are skipped. Once they are there, it must
    build.
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
    command = [cargo, "fetch", "--locked"]
    try:
        subprocess.run(command, cwd=SOURCES, env=environment, capture_output=True, timeout=_FETCH_S, check=True)
    except (subprocess.CalledProcessError, subprocess.TimeoutExpired) as error:
        said = (error.stderr or b"").decode(errors="replace").splitlines()
        return f"crates cannot be had: {next((line for line in said if line.startswith('error')), error)}"
    return None
