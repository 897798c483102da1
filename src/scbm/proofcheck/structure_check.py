"""Checks facts of a model file (`StructureArgument`)."""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from scbm.model import Not
from scbm.model.variables import CURRENT_STATE, operation_state_name
from scbm.proofcheck.certificate import CertificateFlaw, ClaimedAspect, Fact
from scbm.proofcheck.guarded_parts import may_leave
from scbm.proofcheck.valuations import TooManyStepsError, is_satisfiable

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel, Operation
    from scbm.proofcheck.certificate import ClaimedObligation, StructureArgument

_RULES_OUT = {
    Fact.NO_DEADLINE: (ClaimedAspect.TIMEDOUT, "the operation has no deadline"),
    Fact.CANNOT_FAIL: (
        ClaimedAspect.FAILED,
        "nothing fails the operation: it has no `failed` transition, and no automatic one assigns its state",
    ),
    Fact.ALWAYS_ENABLED: (
        ClaimedAspect.DISABLED,
        "whatever the state, `g && gr` of its precondition holds and its actions fit",
    ),
}
"""The state that an operation with this fact never visits, and the fact in words."""


def check_structure(
    claimed: Sequence[ClaimedObligation], argument: StructureArgument, model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the facts, one fact for each claim in order."""
    if len(argument.facts) != len(claimed):
        yield CertificateFlaw("the argument", f"there are {len(claimed)} claims, and {len(argument.facts)} facts")
        return
    for obligation, fact in zip(claimed, argument.facts, strict=True):
        reason = _check(obligation, fact, model)
        if reason is not None:
            yield CertificateFlaw(f"claim {obligation}", reason)


def _check(obligation: ClaimedObligation, fact: Fact, model: BehaviorModel) -> str | None:
    aspect, words = _RULES_OUT[fact]
    if aspect is not obligation.aspect:
        return f"it does not follow from this fact: {words}"
    operation = model.operation(obligation.subject)
    match fact:
        case Fact.NO_DEADLINE:
            return None if operation.deadline_ns is None else "the operation has a deadline"
        case Fact.CANNOT_FAIL:
            return _what_fails(operation, model)
        case Fact.ALWAYS_ENABLED:
            return _what_disables(operation, model)
        case _:
            assert_never(fact)


def _what_fails(operation: Operation, model: BehaviorModel) -> str | None:
    if operation.failed is not None:
        return "the operation has a `failed` transition"
    for transition in model.automatic_transitions:
        for action in transition.running_actions:
            if action.target in (CURRENT_STATE, operation_state_name(operation.name)):
                return f"the automatic transition {transition.name} can fail it: {action}"
    return None


def _what_disables(operation: Operation, model: BehaviorModel) -> str | None:
    space = model.running_space
    for action in operation.pre.running_actions:
        if may_leave(action, space):
            return f"an action of the precondition can leave its domain: {action}"
    guard = operation.pre.running_guard
    choices = {name: space[name].domain.values for name in guard.reads()}
    try:
        if is_satisfiable(Not(guard), choices):
            return f"the precondition does not always hold: {guard}"
    except TooManyStepsError:
        return f"the precondition is too large to check: {guard}"
    return None
