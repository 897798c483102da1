"""Compares a run with the expectations of its case."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases.trace import End, OperationStepped, PlanReceived, state_after
from scbm.model import OperationState, format_moment, format_value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.cases import Expectations
    from scbm.cases.trace import Record
    from scbm.model import Predicate, Value

_ARROW = " → "


def find_unmet(
    expect: Expectations, end: End, records: Sequence[Record], visited: Sequence[str]
) -> Iterator[tuple[str, str]]:
    """Yield the key of each expectation that is not met, with the difference between expectation and run."""
    if expect.verdict not in (None, end):
        yield "verdict", f"expected the run to end {_words(expect.verdict)}, and it ended {_words(end)}"
    if expect.plan is not None:
        yield from (("plan", message) for message in _plan(expect.plan, records))
    if expect.order:
        yield from (("order", message) for message in _order(expect.order, records))
    if expect.final:
        state = state_after(records)
        yield from (("final", _final(predicate, state)) for predicate in expect.final if not predicate.holds(state))
    for obligation in expect.visits:
        if str(obligation) not in visited:
            near = [name for name in visited if name.startswith(f"{obligation.subject}/")]
            told = f"; of {obligation.subject} it visited {', '.join(near)}" if near else ""
            yield "visits", f"expected a visit to {obligation}, and the run made none{told}"


def _words(end: End | None) -> str:
    return f"`{end}`"


def _plan(expected: tuple[str, ...], records: Sequence[Record]) -> Iterator[str]:
    plans = (record for record in records if isinstance(record, PlanReceived))
    first = next(plans, None)
    if first is None or first.status != "solved":
        found = "none was asked for" if first is None else f"the planner answered `{first.status}`"
        yield f"expected the plan {_listed(expected)}, and {found}"
    elif first.plan != expected:
        yield f"expected the plan {_listed(expected)}, and the first plan is {_listed(first.plan)}: " + _difference(
            expected, first.plan
        )


def _listed(operations: tuple[str, ...]) -> str:
    return _ARROW.join(operations) or "with no operations"


def _difference(expected: tuple[str, ...], found: tuple[str, ...]) -> str:
    """Return the first index at which two lists differ."""
    number = next(
        (n for n, (a, b) in enumerate(zip(expected, found, strict=False)) if a != b), min(len(expected), len(found))
    )
    parts = [plan[number] if number < len(plan) else "nothing" for plan in (expected, found)]
    return f"operation {number + 1} should be {parts[0]} and is {parts[1]}"


def _order(expected: tuple[str, ...], records: Sequence[Record]) -> Iterator[str]:
    """Return the first operation that does not complete behind its predecessors, as a sentence."""
    completed = [r for r in records if isinstance(r, OperationStepped) and r.target is OperationState.COMPLETED]
    position = 0
    for number, name in enumerate(expected):
        found = next((i for i in range(position, len(completed)) if completed[i].operation == name), None)
        if found is None:
            behind = f" behind {expected[number - 1]}" if number else ""
            happened = _ARROW.join(f"{r.operation} at {format_moment(r.at_ns)}" for r in completed) or "none"
            yield (
                f"expected {_ARROW.join(expected)} to complete in this order, and {name} does not complete{behind}; "
                f"completed: {happened}"
            )
            return
        position = found + 1


def _final(predicate: Predicate, state: dict[str, Value]) -> str:
    values = ", ".join(f"{name} == {format_value(state[name])}" for name in predicate.reads())
    return f"expected {predicate} at the end, and it ends with {values or 'something else'}"
