"""The log of Cyclone DDS: in messages of ours while it starts, and in a file afterwards, if the user asks for it."""

from __future__ import annotations

import ctypes
import os
from pathlib import Path

import pytest

from scbm.nodes.buses.bus import BusError
from scbm.nodes.buses.dds.cyclone_log import LOG_FILE, captured_log
from support.wording import Wording

LINE = b"1795295511.381596 [99]     python: eth77: warning\n"


class CStream:
    """The `stderr` that C has when this is made, as a domain of Cyclone DDS keeps it."""

    def __init__(self) -> None:
        self._library = ctypes.CDLL(None)
        self._library.fputs.argtypes = (ctypes.c_char_p, ctypes.c_void_p)
        self._stream = ctypes.c_void_p.in_dll(self._library, "stderr").value

    def write(self, text: bytes) -> None:
        self._library.fputs(text, self._stream)


def test_lines_of_cyclone_are_collected_and_those_of_others_kept(capfd: pytest.CaptureFixture[str]) -> None:
    lines: list[str] = []
    with captured_log(lines):
        CStream().write(LINE + b"others\n")
        os.write(2, LINE + b"and these\n")
    CStream().write(b"afterwards\n")
    assert lines == ["eth77: warning"] * 2
    assert capfd.readouterr().err == "others\nand these\nafterwards\n"


def test_they_are_collected_too_when_it_fails(capfd: pytest.CaptureFixture[str]) -> None:
    lines: list[str] = []

    def fail() -> None:
        with captured_log(lines):
            CStream().write(LINE)
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert lines == ["eth77: warning"]
    assert capfd.readouterr().err == ""


def test_later_lines_of_a_domain_are_not_on_the_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    with captured_log([]):
        domain = CStream()
    domain.write(LINE)
    assert capfd.readouterr().err == ""


def test_a_file_gets_all_lines_if_the_user_asks(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    path = tmp_path / "dds.log"
    path.write_text("before\n", encoding="utf-8")
    monkeypatch.setenv(LOG_FILE, str(path))
    with captured_log([]):
        domain = CStream()
        domain.write(b"in the block\n")
    domain.write(LINE)
    assert path.read_bytes() == b"before\nin the block\n" + LINE


def test_a_file_that_cannot_be_written_is_an_error(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, wording: Wording
) -> None:
    monkeypatch.setenv(LOG_FILE, str(tmp_path))
    with pytest.raises(BusError) as raised, captured_log([]):
        pass
    wording(f"{raised.value}\n= {raised.value.remedy}\n")
