"""Places: whatever YAML does to a text before the parser of predicates gets it, the caret stands under the word."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.files import load_located, read_model
from scbm.files.yaml.source_text import SourceText
from scbm.model import InputError, Place, Slug
from support.profiles import examples

if TYPE_CHECKING:
    from pathlib import Path

    from hypothesis.strategies import DrawFn

HEAD = """# größe ∧ 模型
behavior_model: cell
variables:
  a: {domain: bool, initial: false}
  b: {domain: bool, initial: false}
operations: {}
goals:
"""
RIGHT = ("a == true", "!(b == true)", "(a == b)", "b in {true}", "a != false")
WRONG = "wrong"


@st.composite
def clauses(draw: DrawFn) -> list[str]:
    """A conjunction, word by word, with the wrong name once, and an alias to stand before it."""
    before = draw(st.lists(st.sampled_from(RIGHT), max_size=3))
    behind = draw(st.lists(st.sampled_from(RIGHT), max_size=3))
    return " && ".join([*before, f"{WRONG} == true", *behind]).split(" ")


def joined(draw: DrawFn, words: list[str], breaks: list[str]) -> str:
    """The words with something between them that YAML folds into blanks or line ends."""
    text = words[0]
    for word in words[1:]:
        between: str = draw(st.sampled_from(breaks))
        text += between + word
    return text


def plain(draw: DrawFn, words: list[str]) -> str:
    prefix: str = draw(st.sampled_from(["", "&wrought ", "&a-1   ", "\n    ", "&wrought # w\n    ", "# wr\n    "]))
    first = '"' if words[0].startswith("!") else ""  # a plain scalar cannot begin so
    return prefix + first + joined(draw, words, [" ", "   ", "\n    ", "\n\n     ", "  \n      "]) + first


def single_quoted(draw: DrawFn, words: list[str]) -> str:
    return "'" + joined(draw, words, [" ", "   ", "\n    ", "\n\n  \n     ", "\t"]) + "'"


def double_quoted(draw: DrawFn, words: list[str]) -> str:
    escapes = [
        " ",
        "\n    ",
        "\\n",
        "\\t  ",
        "\\\n    \\  ",
        " \\\n    ",
        "\\\n\\\n  \\x20",
        "\\x20",
        "\\u0020 ",
        "\\U00000020",
        "\n\n  ",
    ]
    escaped = [draw(st.sampled_from([word, escape(word)])) for word in words]
    return '&wrought "' + joined(draw, escaped, escapes) + '"'


def escape(word: str) -> str:
    return f"\\x{ord(word[0]):02x}{word[1:-1]}\\u{ord(word[-1]):04x}" if len(word) > 1 else word


def literal(draw: DrawFn, words: list[str]) -> str:
    header: str = draw(st.sampled_from(["|", "|-", "|+", "|2", "|2-", "| # wrr", "&wrought |", "&a\n    |"]))
    return f"{header}\n    " + joined(draw, words, [" ", "  ", "\n    ", "\n      ", "\n\n    ", "\n   \n    "]) + "\n"


def folded(draw: DrawFn, words: list[str]) -> str:
    header: str = draw(st.sampled_from([">", ">-", ">+", ">2", "&wrought >-", "> # w"]))
    return f"{header}\n    " + joined(draw, words, [" ", "  ", "\n    ", "\n      ", "\n\n    "]) + "\n"


STYLES = {style.__name__: style for style in (plain, single_quoted, double_quoted, literal, folded)}


def under(text: str, place: Place) -> str:
    line = re.split(r"\r\n|\r|\n", text)[place.line - 1]
    return line[place.column - 1 : place.column - 1 + place.length]


@pytest.mark.parametrize("style", STYLES)
@pytest.mark.parametrize("line_end", ["\n", "\r\n", "\r"], ids=["lf", "crlf", "cr"])
def test_the_caret_stands_under_the_wrong_word(style: str, line_end: str) -> None:
    @st.composite
    def texts(draw: DrawFn) -> str:
        written = STYLES[style](draw, draw(clauses()))
        return f"{HEAD}  other: true\n  done: {written}\n  more: a == true\n".replace("\n", line_end)

    @given(texts())
    @examples(40, usual=3)
    def check(text: str) -> None:
        with pytest.raises(InputError) as raised:
            read_model(text, "model.yaml")
        (diagnostic,) = raised.value.diagnostics
        assert diagnostic.slug is Slug.UNKNOWN_VARIABLE
        assert under(text, diagnostic.place) in {WRONG, escape(WRONG)}

    check()


@given(st.text(st.sampled_from("ab\n\r\x0b\x85\u2028 \t"), max_size=30))
def test_lines_end_where_editors_end_them_and_every_character_has_its_place(text: str) -> None:
    source = SourceText(text, "model.yaml")
    assert list(source.lines) == re.split(r"\r\n|\r|\n", text)
    for index, character in enumerate(text):
        place = source.place(index)
        if character not in "\r\n":
            assert source.lines[place.line - 1][place.column - 1] == character
        else:
            assert place.column == len(source.lines[place.line - 1]) + 1


@pytest.mark.parametrize(
    ("text", "line", "column"),
    [("", 1, 1), ("ab", 1, 3), ("ab\n", 1, 3), ("ab\n\n\r\n", 1, 3), ("\n\n", 1, 1), ("\n ", 2, 2)],
)
def test_the_end_of_a_text_is_behind_its_last_line_that_says_something(text: str, line: int, column: int) -> None:
    place = SourceText(text, "model.yaml").place(len(text))
    assert (place.line, place.column) == (line, column)


def test_a_stretch_does_not_leave_its_line() -> None:
    source = SourceText("abc\ndef", "model.yaml")
    assert source.stretch(1, 6) == Place("model.yaml", 1, 2, 2)
    assert source.stretch(3, 6) == Place("model.yaml", 1, 4, 1)
    assert source.stretch(5, 7) == Place("model.yaml", 2, 2, 2)


def test_a_diagnostic_of_a_model_that_loads_finds_its_place(tmp_path: Path) -> None:
    path = tmp_path / "model.yaml"
    path.write_text(f"{HEAD}  done: a == true\n  more: true\n", encoding="utf-8")
    _, places = load_located(path)
    assert places.find(("variables", "b")) == (Place(str(path), 5, 3, 1), "  b: {domain: bool, initial: false}")
    assert places.find(("variables", "b", "initial")) == (
        Place(str(path), 5, 21, 7),
        "  b: {domain: bool, initial: false}",
    )
    assert places.find(("goals", "more")) == (Place(str(path), 9, 3, 4), "  more: true")


def test_what_has_no_place_of_its_own_is_reported_at_what_holds_it(tmp_path: Path) -> None:
    path = tmp_path / "model.yaml"
    path.write_text(f"{HEAD}  done: a == true\n", encoding="utf-8")
    _, places = load_located(path)
    assert places.find(("variables", "c", "initial"))[0] == Place(str(path), 3, 1, 9)
    assert places.find(("requirements", "safe")) == (Place(str(path)), "")
    assert places.find(()) == (Place(str(path)), "")
