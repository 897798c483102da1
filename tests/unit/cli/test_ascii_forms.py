"""The marks of reports have ASCII forms for outputs whose encoding lacks them."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest

from conftest import Ran
from scbm.cli.main import ASCII_FORMS
from scbm.reports.figure_table import STATUS_MARKS
from scbm.reports.terminal.closing_report import FIGURE_SEGMENTS

SOURCE = Path(__file__).parents[3] / "src" / "scbm"
WRITE_FILES = ("reports/ci", "reports/html")
"""Packages whose texts go to files, which are UTF-8."""


def _is_documentation(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _literals(node: ast.AST) -> Iterator[str]:
    """Yield the string literals below a node without docstrings."""
    if isinstance(node, ast.Constant) and isinstance(node.value, str):
        yield node.value
    for child in ast.iter_child_nodes(node):
        if not _is_documentation(child):
            yield from _literals(child)


def _characters() -> Iterator[tuple[str, str]]:
    """Yield the characters beyond ASCII that texts for the terminal may contain, each with its file."""
    for path in sorted(SOURCE.rglob("*.py")):
        file = path.relative_to(SOURCE).as_posix()
        if not file.startswith(WRITE_FILES):
            for text in _literals(ast.parse(path.read_text("utf-8"))):
                yield from ((character, file) for character in text if not character.isascii())


@pytest.mark.slow
def test_each_character_that_reaches_the_terminal_has_an_ascii_form() -> None:
    unknown = {"\N{REPLACEMENT CHARACTER}"}  # stands for a character that is no text at all
    found = {each: file for each, file in _characters() if each.isprintable() and each not in unknown}
    assert "\N{CIRCLED DIVISION SLASH}" in found
    assert {each: file for each, file in found.items() if each not in ASCII_FORMS} == {}
    assert [form for form in ASCII_FORMS.values() if not form.isascii() or "?" in form] == []


@pytest.mark.parametrize(
    "marks", [list(STATUS_MARKS.values()), [segment.mark for segment in FIGURE_SEGMENTS]], ids=["statuses", "closing"]
)
def test_marks_of_one_legend_have_different_ascii_forms(marks: list[str]) -> None:
    forms = [ASCII_FORMS.get(mark, mark) for mark in marks]
    assert len(dict.fromkeys(forms)) == len(marks)


ZERO = """
behavior_model: small
variables: {at: {domain: [home, away], initial: home}}
operations:
  go: {pre: {g: at == home}, post: {g: "true", a: [at <- away]}}
goals: {leave: at == away}
"""


@pytest.mark.parametrize("encoding", ["ascii", "cp1252"])
def test_a_zero_of_the_mutation_report_is_not_shown_as_unknown(
    encoding: str, scbm: Callable[..., Ran], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    (tmp_path / "small.yaml").write_text(ZERO)
    out = BytesIO()
    stream = TextIOWrapper(out, encoding=encoding)
    monkeypatch.setattr("sys.stdout", stream)
    scbm("mutate", str(tmp_path / "small.yaml"), "--cases", "1")
    stream.flush()
    text = out.getvalue().decode(encoding)
    assert ("By operator" in text, "?" in text) == (True, False)
