"""What is printed: text of files and peers is shown as it is, and nothing in it acts on the terminal."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable
from io import BytesIO, StringIO, TextIOWrapper
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console
from rich.text import Text

from conftest import Ran
from scbm.cli.output.terminal import TerminalOutput, folded, write_json
from scbm.model import Diagnostic, Place, Slug
from scbm.model.visible_text import escaped, in_one_line
from scbm.nodes.verbs.node_setup import warn

ROOT = Path(__file__).parents[3]
CLEAR, RED_C1, BACKWARDS = "\x1b[2J", "\x9b31m", "\u202e"
ACTING = [chr(number) for number in (*range(32), *range(0x7F, 0xA0), 0x200E, 0x2028, 0x202E, 0x2066, 0x2069)]


@pytest.mark.parametrize("character", [character for character in ACTING if character not in "\t\n\r"])
def test_what_acts_on_a_terminal_is_shown_by_its_number(character: str) -> None:
    number = ord(character)
    shown = f"\\x{number:02x}" if number < 256 else f"\\u{number:04x}"
    assert escaped(f"a{character}b") == f"a{shown}b"
    out = StringIO()
    TerminalOutput(Console(file=out)).line(f"a{character}b")
    assert out.getvalue() == f"a{shown}b\n"


@pytest.mark.parametrize("text", ["", "plain", "größer → [bold]x[/bold] :smile:", "two\nlines"])
def test_all_else_stays_as_it_is_and_markup_is_no_markup(text: str) -> None:
    assert escaped(text) == text
    out = StringIO()
    TerminalOutput(Console(file=out, force_terminal=True, color_system="standard")).line(text)
    assert out.getvalue() == f"{text}\n"


def test_styles_stay_where_they_are_around_what_is_made_visible() -> None:
    out = StringIO()
    text = Text(f"a{CLEAR}b ").append(f"red{BACKWARDS}", style="red").append("plain")
    TerminalOutput(Console(file=out, force_terminal=True, color_system="standard")).line(text)
    assert out.getvalue() == "a\\x1b[2Jb \x1b[31mred\x1b[0m\\u202eplain\n"


@pytest.mark.parametrize("number", [7, 8, 11, 12, 13])
def test_in_text_with_styles_some_controls_are_left_out(number: int) -> None:
    """Rich does that: bells, backspaces, vertical tabs, form feeds, carriage returns."""
    out = StringIO()
    TerminalOutput(Console(file=out)).line(Text(f"a{chr(number)}b").append(f"c{chr(number)}d"))
    assert out.getvalue() == "abcd\n"


def test_each_line_of_a_report_stays_one_line() -> None:
    out = StringIO()
    TerminalOutput(Console(file=out)).lines([Text("x\nFAILED y"), Text("z")])
    assert out.getvalue() == "x\\nFAILED y\nz\n"


def test_a_diagnostic_shows_what_a_file_says_of_controls() -> None:
    out = StringIO()
    diagnostic = Diagnostic(Slug.BAD_OPTION, f"`{CLEAR}` z", Place(f"a{RED_C1}.yaml", 1, 1), "x\x07", "y")
    TerminalOutput(Console(file=out)).diagnostics([diagnostic])
    assert out.getvalue() == ("a\\x9b31m.yaml:1:1: error[bad-option]: `\\x1b[2J` z\n    y\n    ^\n    = x\\x07\n")


def test_what_a_peer_says_is_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    warn(f"x\nscbm: {CLEAR}y")
    assert capsys.readouterr().err == "scbm: x\\nscbm: \\x1b[2Jy\n"
    assert in_one_line("a\r\nb") == "a\\r\\nb"


def test_json_has_no_controls_either_and_says_the_same(capsys: pytest.CaptureFixture[str]) -> None:
    data: dict[str, Any] = {"text": f"{CLEAR}{RED_C1}{BACKWARDS} größer\n"}
    write_json(data)
    written = capsys.readouterr().out
    assert json.loads(written) == data
    assert escaped(written) == written
    assert "größer" in written


def test_a_model_file_cannot_clear_the_screen(scbm: Callable[..., Any], tmp_path: Path) -> None:
    path = tmp_path / "model.yaml"
    path.write_text('behavior_model: "\\e[2J"\nvariables: {"\\e[31m": {domain: bool}}\n', encoding="utf-8")
    ran = scbm("check", path)
    assert ran.code == 2
    assert "\\x1b[2J" in ran.err
    assert "\x1b" not in ran.err


@pytest.mark.parametrize(
    ("line", "shown"),
    [
        ("  op: a b c", ["  op: a b c"]),
        ("  words that are longer than a line", ["  words that are", "    longer than a", "    line"]),
        ("  1.0 s  a b c d e f g h i j k", ["  1.0 s  a b c d e f", "         g h i j k"]),
        ("word" * 6 + " next", ["word" * 6, "  next"]),
    ],
)
def test_a_long_line_of_a_report_is_broken_between_words(line: str, shown: list[str]) -> None:
    assert [text.plain for text in folded(Text(line), 20)] == shown


def test_a_command_is_never_broken() -> None:
    command = Text("  scbm close my/model.yaml   writes 3 cases", no_wrap=True)
    assert [text.plain for text in folded(command, 20)] == ["  # writes 3 cases", "  scbm close my/model.yaml"]
    assert [text.plain for text in folded(command, 80)] == [command.plain]


def test_a_picture_is_never_broken_whatever_its_blanks_are() -> None:
    picture = Text("  op: scan the item   ●   ○", no_wrap=True)
    assert [text.plain for text in folded(picture, 20)] == [picture.plain]


REPORT = ("test", "examples/robot_in_the_air/before.yaml", "--cases", "2")


def _assert_marks(out: bytes, encoding: str, bar: str) -> None:
    text = out.decode(encoding)
    missed = "○" if encoding == "utf-8" else "o"
    assert (f"%  {bar}" in text, f"Missed ({missed})" in text, "?" in text) == (True, True, False)
    assert [line for line in text.splitlines() if len(line) > 80] == []


@pytest.mark.slow
def test_marks_have_ascii_forms_where_the_output_of_a_process_lacks_them() -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "cp1252", "COLUMNS": "80"}
    command = [sys.executable, "-m", "scbm", *REPORT]
    done = subprocess.run(command, cwd=ROOT, env=environment, check=True, capture_output=True)
    _assert_marks(done.stdout, "cp1252", "#")


@pytest.mark.parametrize(("encoding", "bar"), [("cp1252", "#"), ("cp437", "█"), ("ascii", "#"), ("utf-8", "█")])
def test_marks_have_ascii_forms_where_the_output_lacks_them(
    encoding: str, bar: str, scbm: Callable[..., Ran], monkeypatch: pytest.MonkeyPatch
) -> None:
    out = BytesIO()
    stream = TextIOWrapper(out, encoding=encoding)
    monkeypatch.setattr("sys.stdout", stream)
    assert scbm(*REPORT).code == 0
    stream.flush()
    _assert_marks(out.getvalue(), encoding, bar)
