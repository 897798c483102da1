"""The driver that docs/reference/node-protocol.md shows is one: a cell is tested with it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.loops import GUARD_S
from support.node_processes import PATIENCE

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "reference" / "node-protocol.md"
MODEL = ROOT / "examples" / "robot_in_the_air" / "after.yaml"


def written(name: str, directory: Path) -> Path:
    """The block of the page that begins with this name, as a file."""
    pattern = re.compile(rf"^```\w+\n(# file: {re.escape(name)}\n.*?)^```$", re.DOTALL | re.MULTILINE)
    (block,) = pattern.findall(PAGE.read_text(encoding="utf-8"))
    path = directory / name
    path.write_text(block, encoding="utf-8")
    return path


@pytest.mark.dds
def test_a_cell_works_with_a_driver_of_nothing_but_cyclonedds(domain: int, tmp_path: Path) -> None:
    program, bindings = written("scanner_driver.py", tmp_path), written("scanner_driver.yaml", tmp_path)
    environment = {**os.environ, "ROS_DOMAIN_ID": str(domain)}
    words = [
        "--cases",
        "1",
        "--seed",
        "1",
        "--transport",
        "dds",
        "--bindings",
        str(bindings),
        "--real",
        "scanner",
        "--json",
        *PATIENCE,
    ]

    with subprocess.Popen([sys.executable, program], env=environment, stdout=subprocess.PIPE, text=True) as driver:
        try:
            tested = subprocess.run(
                [sys.executable, "-m", "scbm", "test", str(MODEL), *words],
                env=environment,
                capture_output=True,
                text=True,
                timeout=GUARD_S,
                check=False,
            )
        finally:
            driver.kill()
        output, _ = driver.communicate()

    assert tested.returncode == 0, tested.stderr
    assert [case["verdict"] for case in json.loads(tested.stdout)["cases"]] == ["reached"]
    assert re.fullmatch(r"(scanning for run_[0-9a-f]{32}-\d+\n)+", output), output
