"""The table of the life of an operation is whole."""

from __future__ import annotations

from scbm.model import OperationState
from scbm.running.compiled_steps import OperationPart
from scbm.running.lifecycle import LIFECYCLE, PlanEffect, is_current_in, parts_by_end, states_trying, timer_moves


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


def test_a_precondition_is_tried_until_the_operation_executes() -> None:
    assert states_trying(OperationPart.PRE) == (OperationState.INITIAL, OperationState.DISABLED)


def test_an_operation_ends_with_a_part_that_has_a_key_in_the_model_file() -> None:
    ends = {state.value: part.key for state, part in parts_by_end().items()}
    assert ends == {"completed": "post", "failed": "failed", "timedout": "timedout"}


def test_a_timer_ends_executing_and_disabled() -> None:
    moves = [(before.value, after.value) for before, after in timer_moves()]
    assert moves == [("disabled", "initial"), ("executing", "timedout")]


def test_the_state_of_the_current_operation_as_a_predicate() -> None:
    waits = is_current_in("drill", states_trying(OperationPart.PRE))
    assert str(waits) == "current.name == drill && current.state in {initial, disabled}"
    executes = is_current_in("drill", (OperationState.EXECUTING,))
    assert str(executes) == "current.name == drill && current.state == executing"
