"""A node as a process leaves as it should, however it is asked to."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.dds

GUARD_S = 600.0
PROGRAM = Path(__file__).parents[2] / "support/serving.py"


def begin(mode: str) -> subprocess.Popen[str]:
    command = [sys.executable, str(PROGRAM), mode]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, "eof"])
def test_it_is_there_until_somebody_stops_it_and_then_leaves(how: signal.Signals | str) -> None:
    with begin("eof" if how == "eof" else "plain") as process:
        assert process.stdout is not None
        assert process.stdin is not None
        assert process.stdout.readline() == "controller of `scan_cell`, this process\n"
        if isinstance(how, signal.Signals):
            process.send_signal(how)
        else:
            process.stdin.write("what is written there is nothing\n")
            process.stdin.flush()
            process.stdin.close()
        assert process.stdout.read() == "node closed\nbus closed\n"
        assert process.wait(GUARD_S) == 0
        assert process.stderr is not None
        assert process.stderr.read() == ""


def test_a_standard_input_from_which_nothing_can_come_has_ended() -> None:
    command = [sys.executable, str(PROGRAM), "eof"]
    ended = subprocess.run(
        command, check=False, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=GUARD_S
    )
    assert ended.stdout == "controller of `scan_cell`, this process\nnode closed\nbus closed\n"
    assert (ended.stderr, ended.returncode) == ("", 0)


def test_it_does_not_care_for_its_standard_input_unless_it_is_told_to() -> None:
    with begin("plain") as process:
        assert process.stdout is not None
        assert process.stdin is not None
        process.stdin.close()
        assert process.stdout.readline().startswith("controller of")
        process.send_signal(signal.SIGTERM)
        assert process.stdout.read() == "node closed\nbus closed\n"


def test_it_leaves_and_says_why_if_an_older_one_has_its_place() -> None:
    with begin("rival") as process:
        out, err = process.communicate(timeout=GUARD_S)
        lines = out.splitlines()
        assert lines[:3] == ["controller of `scan_cell`, this process", "node closed", "bus closed"]
        assert lines[3].startswith("a controller of `scan_cell` is already in this process: process ")
        assert lines[3].endswith("; stop it, or choose another domain with `--domain`")
        assert (err, process.returncode) == ("", 0)
