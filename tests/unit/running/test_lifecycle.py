"""The table of the life of an operation is whole."""

from __future__ import annotations

from scbm.model import OperationState
from scbm.running.lifecycle import LIFECYCLE, RULES, Then, otherwise


def test_every_state_has_rules_and_every_state_is_reached() -> None:
    assert all(RULES[state] for state in OperationState)
    reached = {rule.target for rule in LIFECYCLE}
    assert reached == set(OperationState)


def test_only_the_last_rule_of_a_state_is_unconditional() -> None:
    for rules in RULES.values():
        assert all(rule.condition is not otherwise for rule in rules[:-1])


def test_an_operation_leaves_the_queue_exactly_when_it_becomes_initial() -> None:
    for rule in LIFECYCLE:
        assert (rule.target is OperationState.INITIAL) == (rule.then is not Then.STAY)


def test_only_completion_advances_the_queue() -> None:
    advancing = [rule.source for rule in LIFECYCLE if rule.then is Then.ADVANCE]
    assert advancing == [OperationState.COMPLETED]
