from __future__ import annotations

import os

import pytest

from scbm.nodes.buses.dds.participant import heard

LINE = b"1795295511.381596 [99]     python: eth77: warning\n"


def test_lines_of_cyclone_are_heard_and_those_of_others_kept(capfd: pytest.CaptureFixture[str]) -> None:
    lines: list[str] = []
    with heard(lines):
        os.write(2, LINE + b"others\n")
    os.write(2, b"afterwards\n")
    assert lines == ["eth77: warning"]
    assert capfd.readouterr().err == "others\nafterwards\n"


def test_they_are_heard_too_when_it_fails(capfd: pytest.CaptureFixture[str]) -> None:
    lines: list[str] = []

    def fail() -> None:
        with heard(lines):
            os.write(2, LINE)
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    os.write(2, b"afterwards\n")
    assert lines == ["eth77: warning"]
    assert capfd.readouterr().err == "afterwards\n"
