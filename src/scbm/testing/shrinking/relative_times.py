"""Times of changes from outside that belong to events: "300 ms after the request was sent" (semantics 7.2).

Shrinking removes operations and requests from a case, which moves all later events. A change that belongs to an event
moves with it; one with a time of its own would come at another moment of the run.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases.trace import MeasurementReceived, ReplyReceived, RunnerStarted
from scbm.model import Constant, Equal, Reference, Role

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases import Case, EnvironmentChange
    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel, Predicate, Value

_ROLES = (Role.RESOURCE, Role.OPERATION_STATE, Role.DECLARED)
"""The roles of variables that tell a moment, the most telling first; others tell none."""

_EVENTS = (MeasurementReceived, ReplyReceived)
"""The kinds of records with which an event begins, where no time has passed since the event before."""


def with_relative_times(case: Case, records: Sequence[Record], model: BehaviorModel) -> Case:
    """Return a case in which changes have `when` and `after` instead of `at`, where a predicate tells their moment.

    Args:
        case: the case; each of its changes acts once.
        records: the trace of its run.
        model: the model.
    """
    acted = [index for index, record in enumerate(records) if isinstance(record, MeasurementReceived)]
    changes = case.environment or ()
    if not changes or len(acted) != len(changes) or any(change.at_ns is None for change in changes):
        return case
    since = [0, *acted]
    pairs = zip(changes, since, acted, strict=False)
    return replace(
        case, environment=tuple(_relative(each, records[: end + 1], begin, model) for each, begin, end in pairs)
    )


def _relative(
    change: EnvironmentChange, records: Sequence[Record], since: int, model: BehaviorModel
) -> EnvironmentChange:
    """Return a change with a predicate that first holds, since the record `since`, at the last event before it."""
    event = _last_event(records)
    if event <= since and since:
        event = since
    when = next(_predicates_of(records, since, event, model), None)
    if when is None or change.at_ns is None:
        return change
    return replace(change, at_ns=None, when=when, after_ns=change.at_ns - records[event].at_ns)


def _last_event(records: Sequence[Record]) -> int:
    """Return the index of the record with which the last event before the last record begins."""
    index = len(records) - 2
    while index > 0 and records[index].at_ns == records[index - 1].at_ns and not isinstance(records[index], _EVENTS):
        index -= 1
    return index


def _predicates_of(records: Sequence[Record], since: int, event: int, model: BehaviorModel) -> Iterator[Predicate]:
    """Yield predicates that hold after an event, and in no state between the record `since` and the event."""
    before: list[dict[str, Value]] = []
    state: dict[str, Value] = {}
    changed: dict[str, None] = {}
    for index, record in enumerate(records[:-1]):
        state.update(record.state if isinstance(record, RunnerStarted) else record.changes)
        if index >= event:
            changed |= dict.fromkeys(name for name, _ in record.changes)
        elif index >= since:
            before.append(dict(state))
    space = model.running_space
    names = [name for name in space.names if name in changed and space[name].role in _ROLES]
    triggers = [resource.trigger for resource in model.resources]
    for name in sorted(names, key=lambda name: (_ROLES.index(space[name].role), name in triggers)):
        if all(earlier[name] != state[name] for earlier in before):
            yield Equal(Reference(name), Constant(state[name]))
