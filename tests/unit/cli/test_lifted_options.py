"""Options with names of instances: an index may be written as in model files, and quantifiers are refused."""

from __future__ import annotations

import pytest

from scbm.cases.coverage import Obligations, lifted_names
from scbm.cli.options.campaign_options import read_thresholds
from scbm.cli.options.option_values import read_goal, read_requirements, read_state
from scbm.files import read_model
from scbm.model import InputError, Slug

MODEL = read_model("""behavior_model: tanks
types: {tank: [t1, t2]}
variables:
  level[tank]: {domain: 0..3, initial: 0}
  joined[tank, tank]: {domain: bool, initial: false}
resources:
  pump[t in tank]: {}
operations:
  fill[t in tank]: {request: pump.t, effects: [level.t += 1]}
goals:
  full[t in tank]: level.t == 3
""")


@pytest.mark.parametrize(
    ("written", "ground"),
    [
        ("level[t1] == 2", "level.t1 == 2"),
        ("level[ t2 ] < 2 && joined[t1,t2] == true", "level.t2 < 2 && joined.t1.t2 == true"),
        ("pump_req_state[t1] == initial", "pump.t1_req_state == initial"),
        ("pump[t1]_req_state == initial", "pump.t1_req_state == initial"),
        ("level.t1 == 2", "level.t1 == 2"),
    ],
)
def test_a_goal_may_have_indices(written: str, ground: str) -> None:
    assert str(read_goal(written, MODEL)[1]) == ground


def test_a_state_and_a_requirement_may_have_indices() -> None:
    state = read_state(["level[t1]=2", "joined[t1, t2]=true"], MODEL)
    assert (state["level.t1"], state["joined.t1.t2"]) == (2, True)
    (requirement,) = read_requirements(["always fill[t1].state != failed"], MODEL)
    assert str(requirement) == "required_1: always fill.t1.state != failed"


@pytest.mark.parametrize("written", ["full[t1]", "full.t1"])
def test_a_goal_of_the_model_may_have_an_index(written: str) -> None:
    name, predicate = read_goal(written, MODEL)
    assert (name, str(predicate)) == ("full.t1", "level.t1 == 3")


@pytest.mark.parametrize(
    ("text", "slug", "column", "length"),
    [
        ("level[t1] == 2 && level[ t2 ] == x", Slug.UNKNOWN_NAME, 34, 1),
        ("level[t1] == 2 && levl[t2] == 1", Slug.UNKNOWN_VARIABLE, 19, 8),
        ("level[t1] == 2 &&", Slug.PREDICATE_SYNTAX, 17, 1),
        ("full[t3]", Slug.UNKNOWN_GOAL, 1, 8),
        ("level[t1]", Slug.NOT_A_PREDICATE, 1, 9),
    ],
)
def test_an_error_is_located_in_the_text_as_it_is_written(text: str, slug: Slug, column: int, length: int) -> None:
    with pytest.raises(InputError) as raised:
        read_goal(text, MODEL)
    (found,) = raised.value.diagnostics
    assert (found.slug, found.place.column, found.place.length, found.source_line) == (slug, column, length, text)


@pytest.mark.parametrize(
    ("text", "column"), [("forall t in tank. (level[t] == 2)", 1), ("!(exists t: tank. (true))", 3)]
)
def test_a_quantifier_is_for_model_files(text: str, column: int) -> None:
    with pytest.raises(InputError) as raised:
        read_goal(text, MODEL)
    (found,) = raised.value.diagnostics
    assert (found.slug, found.place.file, found.place.column) == (Slug.PREDICATE_SYNTAX, "--goal", column)


def test_the_hint_of_a_threshold_has_its_kind() -> None:
    with pytest.raises(InputError) as raised:
        read_thresholds(["lifted=abc"])
    assert [found.remedy for found in raised.value.diagnostics] == ["write for example `lifted=90`"]


def test_lifted_obligations_have_names_of_their_own() -> None:
    names = lifted_names(MODEL, Obligations.of(MODEL))
    assert "fill/failed" in names
    assert "fill" in names
    assert not any(".t1" in name for name in names)
