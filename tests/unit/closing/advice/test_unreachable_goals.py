"""Why no plan reaches a goal: the conjunct that stays false, from the state that comes nearest."""

from __future__ import annotations

import pytest

from scbm.closing.advice.unreachable_goals import why_unreachable
from scbm.files import read_model
from scbm.planning import Planner
from support.wording import Wording

PLACING = """
behavior_model: placing
variables:
  at: {domain: [home, table], initial: home}
  held: {domain: bool, initial: false}
  lid: {domain: [open, closed], initial: closed, source: SOURCE}
  placed: {domain: bool, initial: false}
operations:
  go: {pre: {g: at == home}, post: {g: true, a: [at <- table]}}
  pick: {pre: {g: at == table && held == false}, post: {g: true, a: [held <- true]}}
  place: {pre: {g: held == true && lid == open}, post: {g: true, a: [placed <- true, held <- false]}}
AUTOMATIC
goals: {placed: placed == true}
"""


@pytest.mark.parametrize(
    ("source", "automatic"),
    [
        ("constant", ""),
        ("input", ""),
        ("state", "automatic_transitions: {opens: {g: held == true, a: [lid <- open]}}"),
    ],
)
def test_the_guard_on_the_way_is_named_that_stays_false(source: str, automatic: str, wording: Wording) -> None:
    model = read_model(PLACING.replace("SOURCE", source).replace("AUTOMATIC", automatic))
    goal, of_place, why = why_unreachable(Planner(model), model.nominal_state, model.goals[0][1])
    assert "placed == true" in goal
    assert of_place.startswith("place needs lid == open, which never holds in any of the 3 states")
    wording([goal, of_place, why])
