"""Case files for the scanning cell, and the directory that they are in."""

from __future__ import annotations

from pathlib import Path

import pytest

PASSES = """\
# a comment
case: scans
model: cell.yaml
goal: scanned
"""

FAILS = """\
case: never_scans
model: cell.yaml
goal: scanned
requirements:
  never_executing: never scan_req_state == executing
expect:
  final: light == red
"""

WRONG = """\
case: wrong
model: cell.yaml
goal: scaned
initial: {light: pink}
"""


def lines_with(result: pytest.RunResult, part: str) -> list[str]:
    """Return the lines of what a session printed that contain a part."""
    return [line for line in result.stdout.lines if part in line]


def write(directory: Path, **texts: str) -> None:
    """Writes YAML files by their names; `__` stands for a directory."""
    for name, text in texts.items():
        path = directory / f"{name.replace('__', '/')}.yaml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
