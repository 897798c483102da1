"""Checks sets of values that no step leaves, with no visit to a claimed obligation (`ValuesArgument`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import format_value
from scbm.proofcheck.certificate import CertificateFlaw
from scbm.proofcheck.value_propagation import after_the_end, while_running

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel, Value, Variable
    from scbm.proofcheck.certificate import ValuesArgument
    from scbm.proofcheck.claimed_obligations import ClaimedObligation
    from scbm.proofcheck.value_propagation import Sets


def check_values(
    claimed: Sequence[ClaimedObligation], argument: ValuesArgument, model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the sets of values, or else of the claims."""
    sets = dict(argument.values)
    yield from _check_shape(argument, model) or _check_closed(sets, model) or _check_claims(claimed, sets, model)


def _check_shape(argument: ValuesArgument, model: BehaviorModel) -> list[CertificateFlaw]:
    if tuple(name for name, _ in argument.values) != model.running_space.names:
        return [CertificateFlaw("the argument", "it does not name every variable once, in the order of the model")]
    return [
        CertificateFlaw(name, "the values are not some of its domain, each once and in order")
        for name, values in argument.values
        if not _is_part(values, model.running_space[name])
    ]


def _is_part(values: tuple[Value, ...], variable: Variable) -> bool:
    domain = variable.domain
    if not all(value in domain for value in values):
        return False
    positions = [domain.index(value) for value in values]
    return positions == sorted(dict.fromkeys(positions))


def _check_closed(sets: Sets, model: BehaviorModel) -> list[CertificateFlaw]:
    """Return a flaw for each value that a possible step gives and that the sets do not have."""
    flaws = (
        CertificateFlaw(name, f"{format_value(value)} is not among its values, but it gets it by {possible.what}")
        for possible in while_running(sets, model)
        for name, value in possible.gives
        if value not in sets[name]
    )
    return list(dict.fromkeys(flaws))


def _check_claims(claimed: Sequence[ClaimedObligation], sets: Sets, model: BehaviorModel) -> list[CertificateFlaw]:
    visited_by: dict[ClaimedObligation, str] = {}
    for possible in (*while_running(sets, model), *after_the_end(sets, model)):
        for obligation in possible.visits:
            visited_by.setdefault(obligation, possible.what)
    return [
        CertificateFlaw(f"claim {obligation}", f"these values allow it to be visited by {visited_by[obligation]}")
        for obligation in claimed
        if obligation in visited_by
    ]
