"""No verb waits for a pipe: each refuses it as an input."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import pytest

from support.wording import Wording

MODEL = Path("examples/robot_in_the_air/before.yaml")


class Ran(Protocol):
    code: int
    err: str


Scbm = Callable[..., Ran]


@pytest.mark.parametrize(
    "command",
    [
        "check PIPE",
        "plan PIPE --goal GOAL",
        "run PIPE --goal GOAL",
        "test MODEL --transport dds --bindings PIPE",
        "test PIPE",
        "test MODEL PIPE",
        "test MODEL --store PIPE",
        "close PIPE",
        "close MODEL --suite PIPE",
        "close --check PIPE",
        "close MODEL --check PIPE",
        "explain PIPE robot_move_to_home/disabled",
        "replay PIPE",
        "trace PIPE --perfetto OUT",
        "report PIPE",
        "combine PIPE --out OUT",
        "export pddl PIPE",
    ],
)
def test_a_pipe_is_no_input(command: str, scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    pipe = tmp_path / "pipe.json"
    os.mkfifo(pipe)
    words = {"PIPE": pipe, "MODEL": MODEL, "OUT": tmp_path / "out.db"}
    ran = scbm(*(words.get(word, word) for word in command.split()))
    assert ran.code == 2, ran.err
    wording(ran.err)


@pytest.mark.parametrize("content", ["/dev/zero", "zeros"])
def test_a_certificate_is_read_within_a_limit(content: str, scbm: Scbm, tmp_path: Path) -> None:
    path = tmp_path / "x.json"
    if content == "zeros":
        path.touch()
        os.truncate(path, 2**38)
    else:
        path.symlink_to(content)
    ran = scbm("close", "--check", path)
    assert (ran.code, ran.err.count("\n")) == (2, 1)
