"""`sum`, `min`, `max` and `count` over objects are terms: of comparisons, and all but `count` of actions."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import pytest

from scbm.files import read_model
from scbm.model import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from scbm.model import BehaviorModel, Value

MODEL = """\
behavior_model: cell
types: {robot: [r1, r2, r3], none: []}
variables:
  'load[robot]': {domain: 0..2, initial: 0}
  'at[robot]': {domain: [a, b], initial: a}
  'gone[none]': {domain: 0..2, initial: 0}
  x: {domain: 0..4, initial: 0}
operations:
  go: {pre: {g: true, a: ['ACTION']}, post: {g: true}}
goals:
  goal: GOAL
"""
ROBOTS = ("r1", "r2", "r3")


def cell(goal: str = "true", action: str = "x <- 1") -> BehaviorModel:
    return read_model(MODEL.replace("GOAL", goal).replace("ACTION", action))


def loads(state: Mapping[str, Value]) -> list[int]:
    return [int(state[f"load.{robot}"]) for robot in ROBOTS]


def number_at(state: Mapping[str, Value], zone: str) -> int:
    return sum(state[f"at.{robot}"] == zone for robot in ROBOTS)


@pytest.mark.parametrize(
    ("goal", "holds"),
    [
        ("sum r in robot. (load[r]) <= 3", lambda s: sum(loads(s)) <= 3),
        ("x - sum r in robot. (load.r + 1) >= 0 - 2", lambda s: s["x"] - sum(loads(s)) - 3 >= -2),
        ("max r in robot. (load[r]) < min(x, 2)", lambda s: max(loads(s)) < min(s["x"], 2)),
        ("min r in robot. (load[r]) == max r in robot. (load[r])", lambda s: len(set(loads(s))) == 1),
        ("exists o in robot. (load[o] > sum r in robot. (load[r]) - 1)", lambda s: max(loads(s)) > sum(loads(s)) - 1),
        ("sum r in robot, o in robot. (load[r]) == 3", lambda s: 3 * sum(loads(s)) == 3),
        ("sum e in none. (gone[e]) == x", lambda s: s["x"] == 0),
        ("count r in robot. (at[r] == a) <= x", lambda s: number_at(s, "a") <= s["x"]),
        ("2 <= count r in robot. (at[r] == a)", lambda s: number_at(s, "a") >= 2),
        ("x == 4 - count r in robot. (at[r] == a)", lambda s: s["x"] == 4 - number_at(s, "a")),
        ("count r in robot. (at[r] == a) < count r in robot. (at[r] == b)", lambda s: number_at(s, "a") < 2),
        ("count r in robot. (load[r] == max o in robot. (load[o])) == 1", lambda s: loads(s).count(max(loads(s))) == 1),
        (
            "count r in robot. (r != r1 && at[r] == a) + x != 1",
            lambda s: (s["at.r2"], s["at.r3"]).count("a") + s["x"] != 1,
        ),
    ],
)
def test_a_term_over_objects_has_this_value(goal: str, holds: Callable[[Mapping[str, Value]], bool]) -> None:
    model = cell(goal=f"'{goal}'")
    predicate = model.goal("goal")
    assert predicate is not None
    names = [variable.name for variable in model.variables]
    for values in product(*(variable.domain.values for variable in model.variables)):
        state = dict(zip(names, values, strict=True))
        assert predicate.holds(state) == holds(state), state


def test_an_action_assigns_a_term_over_objects() -> None:
    assert str(cell(action="x <- sum r in robot. (load[r]) - 1").operations[0].pre.a[0]) == (
        "x <- load.r1 + load.r2 + load.r3 - 1"
    )
    assert str(cell(action="x <- max r in robot. (load[r])").operations[0].pre.a[0]) == (
        "x <- max(load.r1, load.r2, load.r3)"
    )


@pytest.mark.parametrize(
    ("goal", "action", "error"),
    [
        ("count r in robot. (at[r] == a)", "x <- 1", "11:10+5 predicate-syntax"),
        ("count r in robot. (at[r] == a) + 1", "x <- 1", "11:10+5 predicate-syntax"),
        ("sum r in robot. (count o in robot. (at[o] == a)) == x", "x <- 1", "11:27+5 predicate-syntax"),
        ("true", "x <- count r in robot. (at[r] == a)", "9:33+5 action-syntax"),
        ("max e in none. (gone[e]) == x", "x <- 1", "11:10+3 predicate-syntax"),
        ("sum r in robot. load[r] == x", "x <- 1", "11:10+3 predicate-syntax"),
        ("x == sum in robot. (load[r])", "x <- 1", "11:15+3 predicate-syntax"),
        ("sum r in robots. (load[r]) == x", "x <- 1", "11:19+6 unknown-type"),
        ("sum r in robot. (load[q]) == x", "x <- 1", "11:32+1 unknown-object"),
        ("sum r in robot. (at[r]) == x", "x <- 1", "11:27+5 different-kinds"),
        ("count r in robot. (load[r] == 5) <= x", "x <- 1", "11:40+1 value-outside-domain"),
        ("count r in robot. (at[r] == a) <= y", "x <- 1", "11:44+1 unknown-variable"),
    ],
)
def test_a_wrong_term_over_objects_is_one_error(goal: str, action: str, error: str) -> None:
    with pytest.raises(InputError) as raised:
        cell(f"'{goal}'", action)
    found = [(each.place, each.slug) for each in raised.value.diagnostics]
    assert [f"{place.line}:{place.column}+{place.length} {slug}" for place, slug in found] == [error]


def test_a_count_with_too_many_cases_is_refused() -> None:
    text = MODEL.replace("r1, r2, r3", ", ".join(f"r{number}" for number in range(90)))
    with pytest.raises(InputError) as raised:
        read_model(text.replace("GOAL", "'count r in robot. (at[r] == a) <= x'").replace("ACTION", "x <- 1"))
    assert [each.slug.value for each in raised.value.diagnostics] == ["too-many-instances"]
