"""A real rclpy for tests to speak with: of an installation of ROS 2 whose `setup.bash` is sourced, else from wheels.

The wheels have a virtual environment of their own, because a file of theirs starts every Python there a second time.
It is cached, in a folder that is named by what is pinned.
"""

from __future__ import annotations

import fcntl
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

import pytest

from support.domains import LOOPBACK
from support.node_processes import NodeProcess

ROOT = Path(__file__).parents[2]
PINNED = ROOT / "tests" / "ros2" / "wheels"
PROGRAMS = ROOT / "tests" / "ros2" / "programs"
PYTHONS = ((3, 11), (3, 12))
"""The versions of Python that have wheels."""

_INSTALLS_S = 600


@dataclass(frozen=True)
class Rclpy:
    """An installation of rclpy.

    Attributes:
        python: the interpreter that imports it.
    """

    python: Path

    def environment(self, domain: int) -> dict[str, str]:
        """The environment of a process in a domain on loopback, which can import scbm, too."""
        paths = [
            str(ROOT / "src"),
            str(ROOT / "tests"),
            sysconfig.get_path("purelib"),
            os.environ.get("PYTHONPATH", ""),
        ]
        return {
            **os.environ,
            "PYTHONPATH": os.pathsep.join(filter(None, paths)),
            "CYCLONEDDS_URI": LOOPBACK,
            "ROS_DOMAIN_ID": str(domain),
            "ROS_AUTOMATIC_DISCOVERY_RANGE": "LOCALHOST",
        }

    def with_interfaces(self, bindings: str) -> str:
        """Return bindings that also find the types of wheels; those of a sourced workspace are found without a word."""
        share = self.python.parents[1] / "share"
        return f"interfaces: [{share}]\n{bindings}" if (share / "test_msgs").is_dir() else bindings

    @contextmanager
    def program(self, name: str, domain: int, *arguments: object) -> Iterator[NodeProcess]:
        """Start a program of `tests/ros2/programs`, wait until it says that it is up, and kill it at the end."""
        command = [str(self.python), "-u", str(PROGRAMS / f"{name}.py"), *map(str, arguments)]
        node = NodeProcess(command, PROGRAMS, self.environment(domain))
        try:
            node.says("up .*")
            yield node
        finally:
            node.end()

    def scbm(self, domain: int, directory: Path, *arguments: object) -> NodeProcess:
        """Start `scbm` in this Python."""
        command = [str(self.python), "-m", "scbm", *map(str, arguments)]
        return NodeProcess(command, directory, self.environment(domain))


def installed_rclpy(distribution: str) -> Rclpy:
    """Return a real rclpy; skip the test where there can be none.

    With SCBM_ALL_TOOLS=1 a failed installation fails the test if the registry of packages answers.
    """
    if os.environ.get("ROS_DISTRO"):
        return _sourced(os.environ["ROS_DISTRO"], distribution)
    if sys.platform != "linux" or platform.machine() != "x86_64" or sys.version_info[:2] not in PYTHONS:
        pytest.skip("there are no wheels of rclpy for this Python or this machine")
    pinned = PINNED / f"{distribution}.txt"
    digest = sha256(pinned.read_bytes() + sys.version.encode()).hexdigest()[:16]
    folder = _cache() / f"{distribution}-{digest}"
    folder.parent.mkdir(parents=True, exist_ok=True)
    with folder.with_suffix(".lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # another worker may be installing them
        if not (folder / "installed").exists():
            _install(folder, pinned)
    return Rclpy(folder / "bin" / "python")


def _sourced(sourced: str, wanted: str) -> Rclpy:
    if sourced != wanted and wanted == "kilted":
        pytest.skip(f"ROS 2 {sourced} is sourced, and this is a test of {wanted}")
    for python in (sys.executable, shutil.which("python3", path="/usr/bin")):
        if python is not None and _runs([python, "-c", "import rclpy"]):
            return Rclpy(Path(python))
    pytest.fail(f"ROS 2 {sourced} is sourced, but no Python can import rclpy")


def _cache() -> Path:
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "scbm-tests" / "rclpy"


def _install(folder: Path, pinned: Path) -> None:
    shutil.rmtree(folder, ignore_errors=True)
    base = getattr(sys, "_base_executable", sys.executable)
    subprocess.run([base, "-m", "venv", str(folder)], check=True, timeout=_INSTALLS_S)
    pip = [str(folder / "bin" / "pip"), "--disable-pip-version-check", "--quiet"]
    done = subprocess.run(
        [*pip, "install", "--no-deps", "--require-hashes", "--only-binary=:all:", "-r", str(pinned)],
        capture_output=True, text=True, timeout=_INSTALLS_S, check=False,
    )  # fmt: skip
    if done.returncode == 0:
        (folder / "installed").touch()
        return
    why = f"the wheels of rclpy cannot be installed: {done.stderr.strip()[-500:]}"
    if os.environ.get("SCBM_ALL_TOOLS") == "1" and _answers(pip, folder):
        pytest.fail(why)
    pytest.skip(why)


def _answers(pip: list[str], folder: Path) -> bool:
    """Return whether the registry of packages answers: it gives a small package."""
    return _runs([*pip, "download", "--no-deps", "--dest", str(folder), "six"])


def _runs(command: list[str]) -> bool:
    return subprocess.run(command, capture_output=True, timeout=_INSTALLS_S, check=False).returncode == 0
