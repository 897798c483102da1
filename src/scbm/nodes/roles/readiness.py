"""Reasons why a cell is not ready for a run, and cases that real resources cannot carry out."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases import Network
from scbm.model.sources import published_by
from scbm.nodes.bindings.ros_binding import binding_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases import Case
    from scbm.model import BehaviorModel


class Lack(StrEnum):
    """The sort of a problem of a cell, from which follows the remedy."""

    RIVAL = "another tester is at work"
    FOREIGN = "a node was not started for this tester"
    VERSION = "a node speaks another version"
    MODEL = "a node has another version of the model"
    TIME_SCALE = "a real resource cannot be made faster"
    CHILD = "a node that was started here cannot work"
    CONTROLLER = "no controller"
    RESOURCES = "no node simulates some resources"
    UNREADABLE = "a node whose messages cannot be parsed"
    DRIVER = "a real resource is not reached"
    GOAL = "a real resource is busy with a goal"
    BINDING = "a driver does not match its binding"
    VENDOR = "a real resource has services that plain DDS cannot call"
    SERVERS = "a real resource has several servers"


class Reason(Struct, frozen=True):
    """One problem of a cell.

    Attributes:
        lack: the sort of the problem.
        message: one sentence, lower case, without a full stop.
        resources: the resources that no node simulates, as far as that is known.
    """

    lack: Lack
    message: str
    resources: tuple[str, ...] = ()


class NotReadyError(Exception):
    """A cell is incomplete or wrong for a tester."""

    def __init__(self, reasons: Iterable[Reason]) -> None:
        self.reasons = tuple(reasons)
        super().__init__("; ".join(reason.message for reason in self.reasons))


def beyond_reach(case: Case, model: BehaviorModel, real: Sequence[str]) -> str | None:
    """Return what a case demands that real resources cannot do, as a clause; `None` if there is nothing.

    The tester decides nothing for a real resource: only simulated ones carry out the faults of a network.
    """
    subjects = _resources_with_rules(case, model)
    name = next((name for name in real if name in subjects), None)
    if name is not None:
        return f"a case cannot force the outcome of `{name}`: its requests go to a real driver"
    sent = dict(_sent_unasked(model, real))
    changed = next((name for name in _changed_by(case, model) if name in sent), None)
    if changed is not None:
        return f"a case cannot change `{changed}`: its values come from the real driver of `{sent[changed]}`"
    is_alone = all(resource.name in real for resource in model.resources)
    if real and is_alone and case.network != Network():
        return "a case with faults of the network needs a simulated resource to carry them out"
    return None


def _sent_unasked(model: BehaviorModel, real: Sequence[str]) -> Iterator[tuple[str, str]]:
    """Yield the variables whose values real drivers send without a request, each with its resource."""
    for resource in model.resources:
        if resource.name in real:
            bound = binding_of(resource).measured
            names = (*published_by(resource, model), *(measured.reading.variable for measured in bound))
            yield from ((name, resource.name) for name in names)


def _changed_by(case: Case, model: BehaviorModel) -> Iterator[str]:
    """Yield the variables that a case changes under `environment`."""
    actions = {each.name: each.actions for each in model.environment}
    for change in case.environment or ():
        made = [action.target for action in actions.get(change.by, ())]
        yield from made if change.assign is None else (name for name, _ in change.assign)


def _resources_with_rules(case: Case, model: BehaviorModel) -> list[str | None]:
    """Return the resources that the case has rules for, by their names or by the name of an operation.

    `None` stands for all simulated resources.
    """
    subjects = [rule.subject for rule in case.outcomes]
    sent = [action.target for o in model.operations if o.name in subjects for action in o.pre.running_actions]
    return [
        *subjects,
        *[resource.name for resource in model.resources if resource.trigger in sent],
        *[injection.resource for injection in case.injections],
        *[window.resource for _, _, window in case.network.windows()],
    ]
