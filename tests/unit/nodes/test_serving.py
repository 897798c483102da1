"""A node as a process leaves as it should, however it is asked to."""

from __future__ import annotations

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from support.loops import GUARD_S
from support.wording import Wording

pytestmark = pytest.mark.dds

PROGRAM = Path(__file__).parents[2] / "support/serving.py"


def begin(mode: str) -> subprocess.Popen[str]:
    command = [sys.executable, str(PROGRAM), mode]
    return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM, "eof"])
def test_it_is_there_until_somebody_stops_it_and_then_leaves(how: signal.Signals | str, wording: Wording) -> None:
    with begin("eof" if how == "eof" else "plain") as process:
        assert process.stdout is not None
        assert process.stdin is not None
        wording(process.stdout.readline())
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


def test_a_standard_input_from_which_nothing_can_come_has_ended(wording: Wording) -> None:
    command = [sys.executable, str(PROGRAM), "eof"]
    ended = subprocess.run(
        command, check=False, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=GUARD_S
    )
    assert ended.stdout.splitlines()[1:] == ["node closed", "bus closed"]
    wording(ended.stdout)
    assert (ended.stderr, ended.returncode) == ("", 0)


def test_it_does_not_care_for_its_standard_input_unless_an_option_asks_for_it() -> None:
    with begin("plain") as process:
        assert process.stdout is not None
        assert process.stdin is not None
        process.stdin.close()
        assert "`scan_cell`" in process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        assert process.stdout.read() == "node closed\nbus closed\n"


def test_it_leaves_and_says_why_if_an_older_one_has_its_place(wording: Wording) -> None:
    with begin("rival") as process:
        out, err = process.communicate(timeout=GUARD_S)
        lines = out.splitlines()
        assert lines[1:3] == ["node closed", "bus closed"]
        wording(re.sub(r"process \d+ on \S+(?=;)", "process PID on HOST", line) for line in (lines[0], *lines[3:]))
        assert (err, process.returncode) == ("", 0)
