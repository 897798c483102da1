"""Whatever happens to a case file on its way, the loader answers with a case or with located errors."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scbm.cases import Case
from scbm.errors import Diagnostic, InputError, Slug
from scbm.notation import load_model, read_case, read_network, write_case

if TYPE_CHECKING:
    from collections.abc import Callable

    from hypothesis.strategies import DrawFn

MODELS = Path(__file__).parent.parent / "models"
CELL = load_model(MODELS / "cell.yaml")
TEXT = (MODELS / "valid_cases" / "everything.yaml").read_text(encoding="utf-8")

WORD = re.compile(r"[A-Za-z_][\w.]*")
LINE_END = re.compile(r"\r\n|\r|\n")
NAMES = sorted(set(WORD.findall(TEXT)))
VALUES = [
    *(
        "",
        "~",
        "true",
        "[]",
        "{}",
        "[[]]",
        "{a: {}}",
        "0",
        "-1",
        "1.5",
        "1e999",
        "99999999999999999999",
        "10 s",
        "-1 s",
    ),
    *(
        "130 %",
        "2 %",
        "any",
        "lost",
        "'x'",
        "!x",
        "*a",
        "&a",
        "|",
        "- x",
        "? x",
        "a: b",
        "[a",
        "{a: b",
        "a]",
        "a}",
        "<<",
    ),
    *(
        "a}",
        "<<",
        "==",
        "!",
        "(",
        "@",
        "`",
        "#",
        "---",
        "\\",
        "\t",
        "é",
        "\0",
        "\x85",
        "\u2028",
        "\ud800",
        "x" * 3000,
        "(" * 300,
    ),
]
CHARACTERS = [*"abz_019 .:,-[]{}()!&|*#>'\"%@`\\/=<+~?\t\n\r\0\x85\u2028\ufeff\ud800é", "\U0001f916"]

Mutation: TypeAlias = "Callable[[DrawFn, str], str]"


def insert_a_character(draw: DrawFn, text: str) -> str:
    at = draw(st.integers(0, len(text)))
    character: str = draw(st.sampled_from(CHARACTERS))
    return text[:at] + character + text[at:]


def truncate(draw: DrawFn, text: str) -> str:
    return text[: draw(st.integers(0, len(text)))]


def move_a_line(draw: DrawFn, text: str) -> str:
    lines = text.splitlines(keepends=True)
    line = lines.pop(draw(st.integers(0, len(lines) - 1)))
    indentation: str = draw(st.sampled_from(["", "  ", "    ", "      ", "\t"]))
    at = draw(st.integers(0, len(lines)))
    return "".join([*lines[:at], indentation + line.lstrip(" "), *lines[at:]])


def replace_a_word(draw: DrawFn, text: str, replacements: list[str]) -> str:
    begin, end = draw(st.sampled_from([match.span() for match in WORD.finditer(text)]))
    replacement: str = draw(st.sampled_from(replacements))
    return text[:begin] + replacement + text[end:]


def change_a_name(draw: DrawFn, text: str) -> str:
    return replace_a_word(draw, text, NAMES)


def change_a_word_to_anything(draw: DrawFn, text: str) -> str:
    return replace_a_word(draw, text, VALUES)


MUTATIONS: list[Mutation] = [insert_a_character, truncate, move_a_line, change_a_name, change_a_word_to_anything]


def check_answer(text: str) -> None:
    """A case that can be written and read again, or errors with places in the text, each told once, from the top."""
    answer = read(text)
    if isinstance(answer, Case):
        written = write_case(answer, CELL, None)
        assert write_case(read_case(written, CELL), CELL, None) == written
        return
    lines = LINE_END.split(text.removeprefix("\N{BYTE ORDER MARK}"))
    for diagnostic in answer:
        check_diagnostic(diagnostic, lines)
    assert answer
    assert len({str(diagnostic) for diagnostic in answer}) == len(answer)
    assert list(answer) == sorted(answer, key=lambda diagnostic: diagnostic.order)


def read(text: str) -> Case | tuple[Diagnostic, ...]:
    """Any other exception than `InputError` fails the test."""
    try:
        return read_case(text, CELL, "case.yaml")
    except InputError as error:
        return error.diagnostics


def check_diagnostic(diagnostic: Diagnostic, lines: list[str]) -> None:
    place = diagnostic.place
    assert place.file == "case.yaml"
    assert diagnostic.message.isprintable()
    assert (diagnostic.remedy or "").isprintable()
    if not place.line:
        assert diagnostic.slug is Slug.FILE_EMPTY
        return
    assert diagnostic.source_line == lines[place.line - 1]
    assert 1 <= place.column <= len(lines[place.line - 1]) + 1
    assert 1 <= place.length <= len(lines[place.line - 1]) + 2 - place.column


def test_a_character_that_is_missing_ends_in_a_case_or_in_located_errors() -> None:
    for at in range(0, len(TEXT), 3):  # a third of them is enough, and quick
        check_answer(TEXT[:at] + TEXT[at + 1 :])


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_one_mutation_ends_in_a_case_or_in_located_errors(mutation: Mutation) -> None:
    @st.composite
    def texts(draw: DrawFn) -> str:
        return mutation(draw, TEXT)

    @given(texts())
    @settings(deadline=None, max_examples=40)
    def check(text: str) -> None:
        check_answer(text)

    check()


@st.composite
def malformed(draw: DrawFn) -> str:
    text = TEXT
    for mutation in draw(st.lists(st.sampled_from(MUTATIONS), min_size=2, max_size=6)):
        if WORD.search(text) and text.splitlines():  # there is still something to change
            text = mutation(draw, text)
    return text


@given(malformed())
@settings(deadline=None, max_examples=80)
def test_many_mutations_end_in_a_case_or_in_located_errors(text: str) -> None:
    check_answer(text)


KEYS = ["goal", "initial", "outcomes", "injections", "network", "limits", "requirements", "expect", "drawn", "recorded"]


@given(st.sampled_from(KEYS), st.sampled_from(VALUES), st.sampled_from(["", "- ", "scanner: ", "set: ", "final: "]))
@settings(deadline=None, max_examples=120)
def test_anything_under_a_key_ends_in_a_case_or_in_located_errors(key: str, value: str, before: str) -> None:
    goal = "" if key == "goal" else "goal: scanned\n"
    check_answer(f"case: wrong\n{goal}{key}:\n  {before}{value}\n")


@given(st.lists(st.sampled_from([*VALUES, "loss", "jitter: 1 ms", "partitions", ": ", ", ", "{", "}"]), max_size=6))
@settings(deadline=None, max_examples=120)
def test_any_text_of_an_option_ends_in_a_network_or_in_errors_on_its_line(words: list[str]) -> None:
    text = "".join(words)
    line = re.sub(r"[\r\n]", " ", text)
    try:
        read_network(text, CELL)
    except InputError as error:
        for diagnostic in error.diagnostics:
            assert diagnostic.place.line in {0, 1}
            assert diagnostic.place.column <= len(line) + 1
