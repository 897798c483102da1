"""How a diagnostic shows itself: place, slug, message, the line with a caret, the remedy."""

from __future__ import annotations

import pytest

from scbm.model import Diagnostic, InputError, Place, ScbmError, Severity, Slug


def shown(line: str, column: int, length: int = 1) -> list[str]:
    """The two lines that show a source line and the caret under it, without their common indentation."""
    place = Place("model.yaml", 7, column, length)
    diagnostic = Diagnostic(Slug.UNKNOWN_VARIABLE, "message", place, source_line=line)
    head, *excerpt = str(diagnostic).split("\n")
    assert head == f"model.yaml:7:{column}: error[unknown-variable]: message"
    assert all(part == "" or part.startswith("    ") for part in excerpt)
    return [part[4:] for part in excerpt]


def test_a_diagnostic_shows_all_that_it_has() -> None:
    place = Place("model.yaml", 3, 5, 4)
    diagnostic = Diagnostic(Slug.UNKNOWN_VARIABLE, "message `b`", place, "remedy `a`", "g: (b1b2 == c)")
    assert str(diagnostic) == (
        "model.yaml:3:5: error[unknown-variable]: message `b`\n    g: (b1b2 == c)\n        ^~~~\n    = remedy `a`"
    )


def test_a_diagnostic_shows_no_more_than_it_has() -> None:
    place = Place("model.yaml")
    assert str(Diagnostic(Slug.FILE_EMPTY, "empty", place)) == "model.yaml: error[file-empty]: empty"


def test_a_warning_says_that_it_is_one() -> None:
    diagnostic = Diagnostic(Slug.UNUSED_VARIABLE, "unused", Place("m", 1), severity=Severity.WARNING)
    assert str(diagnostic) == "m:1: warning[unused-variable]: unused"


@pytest.mark.parametrize(
    ("place", "text"), [(Place("m"), "m"), (Place("m", 4), "m:4"), (Place("m", 4, 2), "m:4:2"), (Place("m", 0, 2), "m")]
)
def test_a_place_shows_what_is_known_of_it(place: Place, text: str) -> None:
    assert str(place) == text


def test_a_line_is_shown_only_under_a_column() -> None:
    diagnostic = Diagnostic(Slug.FILE_EMPTY, "empty", Place("m", 1), source_line="text")
    assert str(diagnostic) == "m:1: error[file-empty]: empty"


def test_the_caret_stands_under_the_first_character_and_its_tail_under_the_others() -> None:
    assert shown("g: abc == d", 4, 3) == ["g: abc == d", "   ^~~"]
    assert shown("abc", 1, 3) == ["abc", "^~~"]


def test_the_caret_can_stand_behind_the_line_and_its_tail_cannot() -> None:
    assert shown("abc", 4) == ["abc", "   ^"]
    assert shown("abc", 4, 9) == ["abc", "   ^"]
    assert shown("abc", 2, 99) == ["abc", " ^~"]
    assert shown("", 1, 5) == ["", "^"]


def test_tabs_before_the_caret_are_repeated_under_it() -> None:
    assert shown("\tg:\tabc", 5, 3) == ["\tg:\tabc", "\t  \t^~~"]


def test_tabs_behind_the_caret_do_not_matter() -> None:
    assert shown("abc\t# why", 1, 3) == ["abc\t# why", "^~~"]


@pytest.mark.parametrize("column", [1, 50, 51, 52, 100, 150, 951, 999, 1000, 1001])
def test_a_long_line_is_cut_around_the_caret(column: int) -> None:
    line = "".join(chr(ord("a") + index % 26) for index in range(1000))
    excerpt, caret = shown(line, column)
    assert len(excerpt) <= 100
    assert excerpt in line
    offset = caret.index("^")
    assert excerpt[offset : offset + 1] == line[column - 1 : column]


def test_a_line_of_a_hundred_characters_is_not_cut() -> None:
    assert shown("x" * 100, 100) == ["x" * 100, " " * 99 + "^"]


def test_the_tail_of_the_caret_ends_where_a_cut_line_ends() -> None:
    excerpt, caret = shown("x" * 1000, 11, 500)
    assert (len(excerpt), caret) == (100, " " * 10 + "^" + "~" * 89)


def test_a_cut_line_keeps_its_tabs_under_each_other() -> None:
    excerpt, caret = shown("\t" * 200 + "abc", 201, 3)
    assert excerpt == "\t" * 50 + "abc"
    assert caret == "\t" * 50 + "^~~"


def test_control_characters_are_replaced_so_that_they_do_nothing_to_the_terminal() -> None:
    excerpt, caret = shown("a\x1b[2J\x00\r\x07b\u202ec\x9b", 9)
    assert excerpt == "a\ufffd[2J\ufffd\ufffd\ufffdb\ufffdc\ufffd"
    assert caret == " " * 8 + "^"


def test_texts_are_printable_wherever_they_come_from() -> None:
    found = Diagnostic(Slug.BAD_PDDL, "`\x1b[2J\n\u202e`", Place("a\x9b.pddl"), "write `\u200b\udcff`, größer")
    assert (found.message, found.remedy) == ("`\\x1b[2J\\n\\u202e`", "write `\\u200b\\udcff`, größer")
    assert str(found).replace("\n", "").isprintable()


def test_a_line_keeps_its_letters_of_all_scripts() -> None:
    assert shown("größe: ∧ 模型", 1, 5) == ["größe: ∧ 模型", "^~~~~"]


def test_blanks_at_the_end_of_a_line_are_not_shown() -> None:
    assert shown("abc   ", 1) == ["abc", "^"]


def test_diagnostics_are_ordered_as_they_are_read() -> None:
    places = [Place("m", 2, 1), Place("m", 1, 9), Place("m"), Place("m", 1, 2)]
    diagnostics = [Diagnostic(Slug.WRONG_SHAPE, "wrong", place) for place in places]
    ordered = sorted(diagnostics, key=lambda diagnostic: diagnostic.order)
    assert [str(diagnostic.place) for diagnostic in ordered] == ["m", "m:1:2", "m:1:9", "m:2:1"]


def test_an_error_holds_its_diagnostics_and_says_them_all() -> None:
    diagnostics = [
        Diagnostic(Slug.WRONG_SHAPE, "one", Place("m", 1)),
        Diagnostic(Slug.UNKNOWN_KEY, "two", Place("m", 2)),
    ]
    error = InputError(diagnostics)
    assert isinstance(error, ScbmError)
    assert error.diagnostics == tuple(diagnostics)
    assert str(error) == "m:1: error[wrong-shape]: one\nm:2: error[unknown-key]: two"


def test_every_slug_is_lower_case_words_with_hyphens_and_its_own() -> None:
    assert len({slug.value for slug in Slug}) == len(Slug)
    assert all(slug.value == slug.name.lower().replace("_", "-") for slug in Slug)
