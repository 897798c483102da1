"""Whatever happens to a model file on its way, the loader answers with a model or with located errors."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from scbm.errors import Diagnostic, InputError, Slug
from scbm.model import BehaviorModel
from scbm.notation import read_model

if TYPE_CHECKING:
    from collections.abc import Callable

    from hypothesis.strategies import DrawFn

EXAMPLES = Path(__file__).parent.parent.parent / "examples" / "robot_in_the_air"
TEXTS = [(EXAMPLES / name).read_text(encoding="utf-8") for name in ("before.yaml", "after.yaml")]

WORD = re.compile(r"[A-Za-z_][\w.]*")
VALUE = re.compile(r"(?<=: )\S.*$", re.MULTILINE)
LINE_END = re.compile(r"\r\n|\r|\n")

NAMES = sorted({word for text in TEXTS for word in WORD.findall(text)})
VALUES = [
    *("", "~", "null", "true", "[]", "{}", "0", "-1", "1.5", "1e999", "99999999999999999999", "0..5", "10 s", "10"),
    *('"', "'x'", "!x", "!!str x", "*a", "&a", "&a b", "&&", "|", ">", "- x", "? x", "a: b", "[a", "{a: b", "a]", "a}"),
    *("==", "<-", "->", "!", "(", ")", "in {a}", "a in {a", "@", "`", "%", "#", " # ", "...", "---", "<<: {}", "\\"),
    *("\t", "é", "∧", "\0", "\x0b", "\x85", "\u2028", "\ufeff", "\ud800", "\U0001f916", "x" * 3000, "(" * 300),
]
CHARACTERS = [*"abz_019 .:,-[]{}()!&|*#>'\"%@`\\/=<+~^$;?\t\n\r\0\x0c\x85\xa0\u2028\ufeff\ud800é∧", "\U0001f916"]

Mutation: TypeAlias = "Callable[[DrawFn, str], str]"


def drop_a_character(draw: DrawFn, text: str) -> str:
    at = draw(st.integers(0, len(text) - 1))
    return text[:at] + text[at + 1 :]


def insert_a_character(draw: DrawFn, text: str) -> str:
    at = draw(st.integers(0, len(text)))
    character: str = draw(st.sampled_from(CHARACTERS))
    return text[:at] + character + text[at:]


def truncate(draw: DrawFn, text: str) -> str:
    return text[: draw(st.integers(0, len(text)))]


def lines_of(draw: DrawFn, text: str) -> tuple[list[str], int]:
    lines = text.splitlines(keepends=True)
    return lines, draw(st.integers(0, len(lines) - 1))


def drop_a_line(draw: DrawFn, text: str) -> str:
    lines, at = lines_of(draw, text)
    return "".join(lines[:at] + lines[at + 1 :])


def duplicate_a_line(draw: DrawFn, text: str) -> str:
    lines, at = lines_of(draw, text)
    to = draw(st.integers(0, len(lines)))
    return "".join([*lines[:to], lines[at], *lines[to:]])


def swap_two_lines(draw: DrawFn, text: str) -> str:
    lines, at = lines_of(draw, text)
    other = draw(st.integers(0, len(lines) - 1))
    lines[at], lines[other] = lines[other], lines[at]
    return "".join(lines)


def change_the_indentation(draw: DrawFn, text: str) -> str:
    lines, at = lines_of(draw, text)
    indentation: str = draw(st.sampled_from(["", " ", "  ", "   ", "    ", "      ", "\t"]))
    lines[at] = indentation + lines[at].lstrip(" ")
    return "".join(lines)


def replace_one(draw: DrawFn, text: str, pattern: re.Pattern[str], replacements: list[str]) -> str:
    begin, end = draw(st.sampled_from([match.span() for match in pattern.finditer(text)]))
    replacement: str = draw(st.sampled_from(replacements))
    return text[:begin] + replacement + text[end:]


def change_a_name(draw: DrawFn, text: str) -> str:
    return replace_one(draw, text, WORD, NAMES)


def change_a_value(draw: DrawFn, text: str) -> str:
    return replace_one(draw, text, VALUE, VALUES)


def change_a_word_to_anything(draw: DrawFn, text: str) -> str:
    return replace_one(draw, text, WORD, VALUES)


MUTATIONS: list[Mutation] = [
    drop_a_character,
    insert_a_character,
    truncate,
    drop_a_line,
    duplicate_a_line,
    swap_two_lines,
    change_the_indentation,
    change_a_name,
    change_a_value,
    change_a_word_to_anything,
]


@st.composite
def malformed(draw: DrawFn, mutations: list[Mutation], most: int) -> str:
    """One of the examples after a few mutations."""
    text = draw(st.sampled_from(TEXTS))
    for mutation in draw(st.lists(st.sampled_from(mutations), min_size=1, max_size=most)):
        if VALUE.search(text) and WORD.search(text):  # there is still something to change
            text = mutation(draw, text)
    return text


def check_answer(text: str) -> tuple[Diagnostic, ...]:
    """A model, or errors whose places lie in the text, each told once, from the top."""
    answer = read(text)
    if isinstance(answer, BehaviorModel):
        return ()
    lines = LINE_END.split(text.removeprefix("\N{BYTE ORDER MARK}"))
    for diagnostic in answer:
        check_diagnostic(diagnostic, lines)
    assert answer
    assert len({str(diagnostic) for diagnostic in answer}) == len(answer)
    assert list(answer) == sorted(answer, key=lambda diagnostic: diagnostic.order)
    return answer


def read(text: str) -> BehaviorModel | tuple[Diagnostic, ...]:
    """Any other exception than `InputError` fails the test."""
    try:
        return read_model(text, "model.yaml")
    except InputError as error:
        return error.diagnostics


def check_diagnostic(diagnostic: Diagnostic, lines: list[str]) -> None:
    place = diagnostic.place
    assert place.file == "model.yaml"
    assert diagnostic.message.isprintable()
    assert (diagnostic.remedy or "").isprintable()
    if not place.line:
        assert diagnostic.slug is Slug.FILE_EMPTY
        return
    assert 1 <= place.line <= len(lines)
    assert diagnostic.source_line == lines[place.line - 1]
    assert 1 <= place.column <= len(lines[place.line - 1]) + 1
    assert place.length >= 1
    assert place.column + place.length <= len(lines[place.line - 1]) + 2


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda mutation: mutation.__name__)
def test_one_mutation_ends_in_a_model_or_in_located_errors(mutation: Mutation) -> None:
    @given(malformed([mutation], 1))
    @settings(deadline=None, max_examples=25)
    def check(text: str) -> None:
        check_answer(text)

    check()


@given(malformed(MUTATIONS, 6))
@settings(deadline=None, max_examples=150)
def test_many_mutations_end_in_a_model_or_in_located_errors(text: str) -> None:
    check_answer(text)


FRAGMENTS = [*CHARACTERS, "  ", ": ", "- ", "\n  ", "a: ", "b: ", "&a ", "*a", "!x ", "---\n", "goals:\n"]


@given(st.lists(st.sampled_from(FRAGMENTS), max_size=40).map("".join))
@settings(deadline=None, max_examples=300)
@example("a: &a\n- *a\n? *a\n: !x &b *b")
@example("&a &b c")
@example("!x !y c")
@example("- &a\n- !x\n- &b !y\n- !z &c\n")
def test_any_text_ends_in_located_errors(text: str) -> None:
    assert check_answer(text)


CELL = """behavior_model: cell
variables:
  a: {domain: bool, initial: false}
  n: {domain: 0..3, initial: 0}
  at: {domain: [home, agv], initial: home}
resources: {arm: {}}
operations:
  scan: {pre: {g: true}, post: {g: true}}
"""
PLACES = [
    "goals: {done: 'WORDS'}",
    "initial_states: ['n in {WORDS}']",
    "requirements: {safe: 'WORDS'}",
    "requirements: {safe: 'always WORDS'}",
    "automatic_transitions: {rule: {g: '!(WORDS)', a: [n += 1]}}",
    "automatic_transitions: {rule: {g: true, a: ['WORDS']}}",
    "automatic_transitions: {rule: {g: true, a: ['a <- WORDS']}}",
]
OPERATORS = ["==", "!=", "<", ">=", "&&", "||", "->", "!", "(", ")", "in", "{", "}", ",", "<-", "+=", "-="]
NAMES_OF_THE_CELL = ["a", "n", "at", "scan.state", "current.name", "plan.state", "arm_req_state", "unknown"]
OTHER_WORDS = ["true", "2", "-9", "home", "scan", "failed", "none", "always", "leads to", "within", "10 s", "until"]


@pytest.mark.parametrize("place", PLACES)
def test_any_words_where_an_expression_belongs_are_resolved_or_complained_of(place: str) -> None:
    @given(st.lists(st.sampled_from([*OPERATORS, *NAMES_OF_THE_CELL, *OTHER_WORDS]), min_size=1, max_size=7))
    @settings(deadline=None, max_examples=60)
    @example(["n", "in", "{", "n", "}"])
    @example(["current.name", "==", "arm_req_state"])
    @example(["arm_req_state", "<-", "at"])
    def check(words: list[str]) -> None:
        check_answer(CELL + place.replace("WORDS", " ".join(words)) + "\n")

    check()


@given(st.binary(max_size=80))
@settings(deadline=None, max_examples=150)
def test_any_text_in_a_guard_ends_in_a_model_or_in_located_errors(data: bytes) -> None:
    guard = "".join(character if character.isprintable() else " " for character in data.decode("latin-1"))
    head = "behavior_model: cell\nvariables: {a: {domain: bool, initial: false}}\noperations: {}\n"
    for diagnostic in check_answer(f"{head}goals:\n  done: |\n    {guard}\n"):
        assert diagnostic.place.line >= 5
