"""Values that drivers send though nothing in the model could send them (semantics 9.10).

The runner applies them. From there on the state is forced, so that proofs about the model say nothing about the cell.
"""

from __future__ import annotations

from itertools import zip_longest
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.trace import (
    SENT,
    InjectionApplied,
    LivelockedAtRest,
    MeasurementRefused,
    MessageDisturbed,
    ReplyReceived,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
)
from scbm.model import format_moment, format_value
from scbm.running.simulation.impossible_changes import values_in_words, why_impossible

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.cases.trace import Changes, Record
    from scbm.model import Value
    from scbm.running import Program

EXCLUDED = "the cell did what the model excludes; its proofs do not hold here"
"""What reports say about a run in which a driver sent such a value."""


class ExcludedValue(Struct, frozen=True):
    """One value that a driver sent though nothing in the model could send it then.

    Attributes:
        at_ns: the time of the run.
        variable: the variable that it measures.
        value: the value.
        reason: the guard or the list of values that excludes it, as a clause.
    """

    at_ns: int
    variable: str
    value: Value
    reason: str

    def __str__(self) -> str:
        return f"{self.variable} = {format_value(self.value)} at {format_moment(self.at_ns)}: {self.reason}"


def excluded_values(program: Program, records: Sequence[Record]) -> Iterator[ExcludedValue]:
    """Yield the values that drivers sent in a run and the model excludes, in order.

    Args:
        program: the compiled model.
        records: the records of the run, from its beginning.
    """
    state: dict[str, Value] = {}
    is_settled = True
    for record, following in zip_longest(records, records[1:]):
        if isinstance(record, RunnerStarted):
            state.update(record.state)
        if isinstance(record, InjectionApplied) and record.injection == SENT and record.forced:
            reply = following if isinstance(following, ReplyReceived) and following.at_ns == record.at_ns else None
            values = dict(record.changes)
            for name, reason in _reasons(program, state, record.changes, reply, is_settled=is_settled):
                yield ExcludedValue(record.at_ns, name, values[name], reason)
        if not isinstance(record, _WITHOUT_STEPS):
            is_settled = not isinstance(record, LivelockedAtRest)
        state.update(record.changes)


_WITHOUT_STEPS = (RunEnded, ResourceChanged, MessageDisturbed, MeasurementRefused)
"""What may stand between a livelock at rest and the next event, and leaves the runner as it is."""


def _reasons(
    program: Program, state: Mapping[str, Value], changes: Changes, reply: ReplyReceived | None, *, is_settled: bool
) -> Iterator[tuple[str, str]]:
    """Yield the variables of one message whose values the model excludes, each with the reason."""
    model = program.model
    if reply is not None:
        resource = next(each for each in model.resources if each.name == reply.resource)
        for name, _ in changes:
            sent = values_in_words(resource.sends(model.space[name]))
            yield name, f"{resource.name} measures {name} only {sent}"
        return
    packing = program.packing
    packed = packing.pack(state)
    found = False
    for name, value in changes:
        keep, bits = packing.assignment({name: value})
        if not is_settled or program.outside.maker_of(packed, packed & keep | bits, ()) is None:
            found = True
            yield name, why_impossible(model, state, ((name, value),), "", is_settled=is_settled)
    if not found:
        yield from ((name, "nothing sends it at one moment with the others of its message") for name, _ in changes)
