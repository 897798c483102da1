"""Which cases say what nobody can bring about, as some resources are real."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases import Network

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases import Case
    from scbm.model import BehaviorModel


def beyond_reach(case: Case, model: BehaviorModel, real: Sequence[str]) -> str | None:
    """What of a case nobody can bring about: `says …`, `has …`; `None` if all of it can be.

    Nobody directs a real resource, nor delays what it is sent: simulated ones carry out the faults of a network.
    """
    told = _told_of(case, model)
    name = next((name for name in real if name in told), None)
    if name is not None:
        return f"says what becomes of `{name}`, which is real"
    is_alone = all(resource.name in real for resource in model.resources)
    if real and is_alone and case.network != Network():
        return "has faults of the network, and no resource is simulated that could carry them out"
    return None


def _told_of(case: Case, model: BehaviorModel) -> list[str | None]:
    """The resources of which the case says something: themselves, or by the name of an operation.

    `None`, all of them, is said of the simulated ones.
    """
    network = case.network
    subjects = [rule.subject for rule in case.outcomes]
    sent = [action.target for o in model.operations if o.name in subjects for action in o.pre.running_actions]
    return [
        *subjects,
        *[resource.name for resource in model.resources if resource.trigger in sent],
        *[injection.resource for injection in case.injections],
        *[cut.resource for cut in network.partitions],
        *[restart.resource for restart in network.restarts],
    ]
