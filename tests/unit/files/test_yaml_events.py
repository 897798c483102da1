"""The parser in C gives the events of the parser in Python, or its events are not used."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from ruamel.yaml import YAML

from scbm.files import read_model
from scbm.files.codec import model_files
from scbm.files.yaml import yaml_events
from scbm.files.yaml.source_text import SourceText
from scbm.model import InputError, Slug
from support.step_limits import step_limit

ROOT = Path(__file__).parents[3]
TEXTS = [path.read_text() for path in sorted(ROOT.glob("tests/models/**/*.yaml")) if path.stat().st_size < 4_000]
CHARACTERS = " \t\n\r:-?{}[],#&*!|>'\"%@`~\\ab0é\u0085\u2028\ufeff"
PIECES = [*CHARACTERS, "---\n", "...\n", ": ", "- ", "<<: ", "!!str ", "|\n", "''"]
FEW_NODES, FEW_ENTRIES = 10_000, 1_000
UNUSUAL = ["a: b\t\n", "a:\n", "&b a: 1\n", "a: !b 1\n", "--- \na: 1\n", "%YAML 1.2\n---\na: 1\n", "\ufeffa: 1\n"]


def facts(events: object) -> list[tuple[object, ...]]:
    """Return all that the reader takes from events."""
    assert isinstance(events, list)
    names = ("value", "anchor", "tag", "style")
    given_by = ((event, [getattr(event, name, None) or "" for name in names]) for event in events)
    return [(type(e).__name__, *map(str, each), e.start_mark.index, e.end_mark.index) for e, each in given_by]


@st.composite
def broken_texts(draw: st.DrawFn) -> str:
    """Draw a part of a text of the corpus with some changes."""
    text = draw(st.sampled_from(TEXTS))
    begin = draw(st.integers(0, len(text)))
    text = text[begin : begin + draw(st.integers(0, 600))]
    for _ in range(draw(st.integers(0, 3))):
        at = draw(st.integers(0, len(text)))
        text = text[:at] + draw(st.sampled_from(PIECES)) + text[at + draw(st.integers(0, 2)) :]
    return text


@given(st.one_of(st.sampled_from(TEXTS), broken_texts()))
def test_fast_events_are_those_of_the_parser_in_python(text: str) -> None:
    fast = yaml_events.fast_events(SourceText(text, "model"))
    if fast is not None:
        assert facts(fast) == facts(list(YAML(typ="safe", pure=True).parse(text)))


def test_an_ordinary_model_is_read_by_the_parser_in_c() -> None:
    pytest.importorskip("_ruamel_yaml")
    text = (ROOT / "examples/robot_in_the_air/before.yaml").read_text()
    assert yaml_events.fast_events(SourceText(text, "model")) is not None


@pytest.mark.parametrize("text", UNUSUAL)
def test_the_parsers_may_differ(text: str) -> None:
    assert yaml_events.fast_events(SourceText(text, "model")) is None


@pytest.mark.parametrize(
    ("text", "line"),
    [
        (f"behavior_model: cell\nvariables: [{'a, ' * FEW_NODES}]\n", 2),
        ("behavior_model: cell\nvariables:\n" + "".join(f"  v{i}: {{}}\n" for i in range(FEW_ENTRIES + 1)), 1_003),
    ],
)
def test_a_model_that_is_too_large_is_refused_by_its_size(
    text: str, line: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = (yaml_events, "MAX_NODES", FEW_NODES) if line == 2 else (model_files, "_MAX_ENTRIES", FEW_ENTRIES)
    monkeypatch.setattr(*limits)  # as many as are allowed take seconds
    with pytest.raises(InputError) as caught:
        read_model(text)
    assert [(each.slug, each.place.line) for each in caught.value.diagnostics] == [(Slug.YAML_TOO_LARGE, line)]


@pytest.mark.parametrize("deep", ["[", "[a, ", "{", "{a: ", "{x: min(a, ["])
def test_brackets_beyond_the_limit_are_not_read(deep: str) -> None:
    with step_limit(10_000), pytest.raises(InputError) as caught:
        read_model(f"v: {deep * 50_000}")
    (found,) = caught.value.diagnostics
    with pytest.raises(InputError) as caught:
        read_model(f"v: {deep * 500} &b")  # by the parser in Python
    assert (found.slug, (found.place,)) == (Slug.YAML_TOO_LARGE, tuple(each.place for each in caught.value.diagnostics))


def test_brackets_in_texts_and_comments_are_no_levels() -> None:
    deep = "[" * 100
    text = f"a: '{deep}' # {deep}\nb: x{deep}\n# {deep}\n"
    assert len(list(yaml_events.events_of(SourceText(text, "model")))) == 10
