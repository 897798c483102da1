"""The table of the life of an operation is whole."""

from __future__ import annotations

from scbm.model import OperationState
from scbm.running.lifecycle import LIFECYCLE, OperationPart, PlanEffect


def test_every_state_has_rules_and_every_state_is_reached() -> None:
    assert {rule.source for rule in LIFECYCLE} == set(OperationState)
    assert {rule.target for rule in LIFECYCLE} == set(OperationState)


def test_only_the_last_rule_of_a_state_is_unconditional() -> None:
    for state in OperationState:
        rules = [rule for rule in LIFECYCLE if rule.source is state]
        assert all(rule.part is not OperationPart.NOTHING for rule in rules[:-1])


def test_an_operation_leaves_the_plan_exactly_when_it_becomes_initial() -> None:
    for rule in LIFECYCLE:
        assert (rule.target is OperationState.INITIAL) == (rule.plan is not PlanEffect.KEEP)


def test_only_completion_advances_the_plan() -> None:
    advancing = [rule.source for rule in LIFECYCLE if rule.plan is PlanEffect.ADVANCE]
    assert advancing == [OperationState.COMPLETED]


def test_only_states_with_a_timer_have_rules_that_need_it() -> None:
    timed = {rule.source for rule in LIFECYCLE if rule.needs_timer}
    assert timed == {OperationState.EXECUTING, OperationState.DISABLED}
