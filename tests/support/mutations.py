"""Ways in which a text gets broken on its way, and what must be true of the diagnostics then."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, TypeAlias

from hypothesis import strategies as st

from scbm.model import Diagnostic, Slug

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hypothesis.strategies import DrawFn

WORD = re.compile(r"[A-Za-z_][\w.]*")
VALUE = re.compile(r"(?<=: )\S.*$", re.MULTILINE)
LINE_END = re.compile(r"\r\n|\r|\n")

VALUES = [
    *("", "~", "null", "true", "[]", "{}", "0", "-1", "1.5", "1e999", "99999999999999999999", "0..5", "10 s", "10"),
    *("-1 s", "2 %", "130 %", "any", "lost"),
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
    return replace_one(draw, text, WORD, sorted(dict.fromkeys(WORD.findall(text))))


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
def malformed(draw: DrawFn, texts: Sequence[str], mutations: Sequence[Mutation], most: int) -> str:
    """One of the texts after a few mutations."""
    text = draw(st.sampled_from(texts))
    for mutation in draw(st.lists(st.sampled_from(mutations), min_size=1, max_size=most)):
        if VALUE.search(text) and WORD.search(text):  # there is still something to change
            text = mutation(draw, text)
    return text


def check_diagnostics(diagnostics: Sequence[Diagnostic], text: str, file: str) -> None:
    """There are some; their places lie in the text; each is reported once; they come from the top."""
    lines = LINE_END.split(text.removeprefix("\N{BYTE ORDER MARK}"))
    for diagnostic in diagnostics:
        _check_diagnostic(diagnostic, lines, file)
    assert diagnostics
    assert len({str(diagnostic) for diagnostic in diagnostics}) == len(diagnostics)
    assert list(diagnostics) == sorted(diagnostics, key=lambda diagnostic: diagnostic.order)


def _check_diagnostic(diagnostic: Diagnostic, lines: list[str], file: str) -> None:
    place = diagnostic.place
    assert place.file == file
    assert diagnostic.message.isprintable()
    assert (diagnostic.remedy or "").isprintable()
    if not place.line:
        assert diagnostic.slug in (Slug.FILE_EMPTY, Slug.FORMAT_VERSION)
        return
    assert 1 <= place.line <= len(lines)
    assert diagnostic.source_line == lines[place.line - 1]
    assert 1 <= place.column <= len(lines[place.line - 1]) + 1
    assert place.length >= 1
    assert place.column + place.length <= len(lines[place.line - 1]) + 2
