"""Sets of values that nothing in a run leaves, and obligations that nothing within them visits (`ValuesArgument`)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.certifying.flaws import Flaw
from scbm.certifying.relaxation import after_the_end, while_running
from scbm.model import format_value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.certifying.certificate import ValuesArgument
    from scbm.certifying.relaxation import Sets
    from scbm.coverage import Obligation
    from scbm.model import BehaviorModel, Value, Variable


def check_values(claimed: Sequence[Obligation], argument: ValuesArgument, model: BehaviorModel) -> Iterator[Flaw]:
    """What is wrong with the sets of values, or else with the claims."""
    sets = dict(argument.values)
    yield from _check_shape(argument, model) or _check_closed(sets, model) or _check_claims(claimed, sets, model)


def _check_shape(argument: ValuesArgument, model: BehaviorModel) -> list[Flaw]:
    if tuple(name for name, _ in argument.values) != model.running_space.names:
        return [Flaw("the argument", "it does not name every variable once, in the order of the model")]
    return [
        Flaw(name, "the values are not some of its domain, each once and in order")
        for name, values in argument.values
        if not _is_part(values, model.running_space[name])
    ]


def _is_part(values: tuple[Value, ...], variable: Variable) -> bool:
    domain = variable.domain
    if not all(value in domain for value in values):
        return False
    positions = [domain.index(value) for value in values]
    return positions == sorted(dict.fromkeys(positions))


def _check_closed(sets: Sets, model: BehaviorModel) -> list[Flaw]:
    """Every value that something gives and that the sets do not have."""
    flaws = (
        Flaw(name, f"{format_value(value)} is not among its values, but it gets it by {possible.what}")
        for possible in while_running(sets, model)
        for name, value in possible.gives
        if value not in sets[name]
    )
    return list(dict.fromkeys(flaws))


def _check_claims(claimed: Sequence[Obligation], sets: Sets, model: BehaviorModel) -> list[Flaw]:
    visited_by: dict[Obligation, str] = {}
    for possible in (*while_running(sets, model), *after_the_end(sets, model)):
        for obligation in possible.visits:
            visited_by.setdefault(obligation, possible.what)
    return [
        Flaw(f"claim {obligation}", f"these values allow it to be visited by {visited_by[obligation]}")
        for obligation in claimed
        if obligation in visited_by
    ]
