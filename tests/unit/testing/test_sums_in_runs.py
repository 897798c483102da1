"""Sums that leave a domain (semantics 2.4): in plans, in runs, and for closing and its check."""

from __future__ import annotations

import pytest

from scbm.cases import Case
from scbm.cases.trace import End
from scbm.closing.proofs.possible_values import possible_values, ruled_out
from scbm.files import parse_predicate, read_model
from scbm.files.language.scope import Scope
from scbm.model import BehaviorModel
from scbm.planning import Planner, Solved, Unsolvable
from scbm.proofcheck import ValuesArgument
from scbm.proofcheck.certificate import claimable_obligations
from scbm.proofcheck.values_check import check_values
from scbm.testing import Tester


def cell(more: str = "") -> BehaviorModel:
    """Two counters up to 3, and a sum of both up to 4."""
    return read_model(f"""
behavior_model: cell
variables:
  left: {{domain: 0..3, initial: 0}}
  right: {{domain: 0..3, initial: 0}}
  total: {{domain: 0..4, initial: 0}}
  ready: {{domain: bool, initial: true}}
operations:
  fill_left: {{pre: {{g: left < 3}}, post: {{g: true, a: [left += 1]}}}}
  fill_right: {{pre: {{g: right < 3}}, post: {{g: true, a: [right += 1]}}}}
  add: {{pre: {{g: true}}, post: {{g: true, a: [total <- left + right]}}}}
  wait:
    deadline: 1 s
    pre: {{g: ready == false}}
    post: {{g: true, gr: left == 0, a: [ready <- true]}}
    timedout: [total <- left + right]
goals: {{four: total == 4, five: left + right == 5, ready: ready == true}}
{more}""")


def test_an_operation_cannot_be_planned_where_its_sum_leaves_the_domain() -> None:
    model = cell()
    start = model.nominal_state.replace({"left": 3, "right": 2})
    goal = parse_predicate("total == 4", Scope.of(model))
    assert isinstance(Planner(model).plan(start, goal), Unsolvable)
    assert isinstance(Planner(model).plan(start.replace({"right": 1}), goal), Solved)


@pytest.mark.parametrize(("right", "end"), [(2, End.MODEL_ERROR), (1, End.REPLAN_LIMIT)])
def test_a_run_ends_where_a_sum_of_timedout_leaves_the_domain(right: int, end: End) -> None:
    model = cell()
    goal = model.goal("ready")
    assert goal is not None
    start = model.nominal_state.replace({"left": 3, "right": right, "ready": False})
    assert Tester(model).execute(Case("case", "ready", goal, start)).verdict.end is end


@pytest.mark.parametrize(
    ("action", "is_taken"), [("total <- left + right", False), ("total <- min(left + right, 4)", True)]
)
def test_an_automatic_transition_is_not_taken_where_its_sum_leaves_the_domain(action: str, is_taken: object) -> None:
    model = cell(more=f'automatic_transitions: {{sum_up: {{g: left + right >= 5, a: ["{action}"]}}}}')
    values = possible_values(model)
    claimed = [obligation for obligation, _ in ruled_out(model, values)]
    assert ("automatic/sum_up" in map(str, claimed)) is not is_taken
    known = {str(obligation): obligation for obligation in claimable_obligations(model)}
    argument = ValuesArgument(dict(values))
    assert list(check_values([known[str(each)] for each in claimed], argument, model)) == []
    wrong = check_values([known["automatic/sum_up"]], argument, model)
    assert bool(list(wrong)) is is_taken
