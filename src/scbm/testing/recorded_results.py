"""Recorded results: what the run for each goal of a case did, and how a later run differs from it (decision 49).

A case that was saved, or made by closing, has the result of its run. A later run that differs in its end, its time, its
visits, its order or its final values fails the case (semantics 7.6), with the difference in words.
"""

from __future__ import annotations

from itertools import zip_longest
from typing import TYPE_CHECKING, NamedTuple

from scbm.cases import RecordedGoal
from scbm.cases.coverage import visited_by
from scbm.cases.trace import OperationStepped, ends_of, ranges_of_goals, state_after
from scbm.model import OperationState, Role, format_duration, format_value
from scbm.testing.verdicts import Failure, FailureKind

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.cases import Case
    from scbm.cases.coverage import Obligations
    from scbm.cases.trace import Record, Trace
    from scbm.model import BehaviorModel, PlannerIdentity, Value

SUBJECT = "recorded"
"""The first word of the subjects of failures because of a recorded result: `recorded visits`."""

_ARROW = " → "
_MAX_LISTED = 12
"""Maximum number of names that a difference lists."""


class RecordedDifference(NamedTuple):
    """A part of a run that differs from the recorded one.

    Attributes:
        part: the part: `end`, `time`, `visits`, `order`, `final`, or `goals` if the number of goals differs.
        words: the difference, with the goal if the case has several.
    """

    part: str
    words: str


# what a run did


def goals_to_record(
    records: Sequence[Record], model: BehaviorModel, obligations: Obligations
) -> tuple[RecordedGoal, ...]:
    """Return what the run for each goal of a trace did.

    Args:
        records: the records of a complete run.
        model: its model.
        obligations: the obligations of the model.
    """
    goals = zip(ranges_of_goals(records), ends_of(records), strict=True)
    return tuple(
        RecordedGoal(
            ended.end,
            _visits(records[indices.start : indices.stop], obligations),
            tuple(_completed(records[indices.start : indices.stop])),
            tuple(_final(state_after(records[: indices.stop]), model)),
            ended.at_ns,
        )
        for indices, ended in goals
    )


def _visits(records: Sequence[Record], obligations: Obligations) -> tuple[str, ...]:
    """Return the names of the visited obligations in the order of the model, those of one subject together."""
    by_subject: dict[str, list[str]] = {}
    for name in obligations.names(visited_by(records, obligations)):
        by_subject.setdefault(name.partition("/")[0], []).append(name)
    return tuple(name for names in by_subject.values() for name in names)


def _completed(records: Iterable[Record]) -> Iterator[str]:
    for record in records:
        if isinstance(record, OperationStepped) and record.target is OperationState.COMPLETED:
            yield record.operation


def _final(state: Mapping[str, Value], model: BehaviorModel) -> Iterator[tuple[str, str]]:
    """Yield the values of declared variables: the end of a run clears all requests, and the runner owns the others."""
    for variable in model.space:
        if variable.role is Role.DECLARED:
            yield variable.name, format_value(state.get(variable.name, variable.initial))


# how a later run differs


class RecordCheck(NamedTuple):
    """The comparison of a run with the recorded run of its case.

    Attributes:
        failures: a failure for each part that differs.
        unused: a sentence if the runs cannot be compared.
    """

    failures: tuple[Failure, ...] = ()
    unused: tuple[str, ...] = ()


def check_record(case: Case, trace: Trace, model: BehaviorModel, obligations: Obligations) -> RecordCheck:
    """Compare a complete run in simulation with the recorded run of its case, if that has parts to compare.

    Args:
        case: the case.
        trace: the run.
        model: the model of the run.
        obligations: its obligations.
    """
    if case.recorded is None or not case.recorded.goals:
        return RecordCheck()
    recorded, planner = case.recorded.planner, trace.planner
    if not is_same_planner(recorded, planner):
        return RecordCheck(unused=(f"the recorded run had plans of `{recorded}`, and this one of `{planner}`",))
    found = goals_to_record(trace.records, model, obligations)
    return RecordCheck(tuple(_failures(case, found)))


def is_same_planner(left: PlannerIdentity, right: PlannerIdentity) -> bool:
    """Return whether plans of both can be compared: of one planner in one version, whatever its limits."""
    return (left.name, left.version) == (right.name, right.version)


def _failures(case: Case, found: Sequence[RecordedGoal]) -> Iterator[Failure]:
    for difference in differences_of_record(case, found):
        message = f"the run differs from the recorded one in {_NOUNS[difference.part]}: {difference.words}"
        yield Failure(FailureKind.EXPECTATION, f"{SUBJECT} {difference.part}", message)


def is_of_record(failure: Failure) -> bool:
    """Return whether a case failed because its run differs from the recorded one."""
    return failure.kind is FailureKind.EXPECTATION and failure.subject.startswith(f"{SUBJECT} ")


_NOUNS = {
    "goals": "its goals",
    "end": "its end",
    "time": "its time",
    "visits": "what it visits",
    "order": "which operations complete",
    "final": "its final values",
}


def differences_of_record(case: Case, found: Sequence[RecordedGoal]) -> Iterator[RecordedDifference]:
    """Yield the parts of a run that differ from the recorded run of its case, in words.

    Args:
        case: the case, with a recorded run.
        found: what the run for each goal did.
    """
    recorded = () if case.recorded is None else case.recorded.goals
    if len(recorded) != len(found):
        yield RecordedDifference("goals", f"{_number(len(recorded))} recorded, and the case has {len(found)}")
        return
    for number, (old, new) in enumerate(zip(recorded, found, strict=True), start=1):
        where = f"goal {number}, {case.goals[number - 1].name}: " if case.later else ""
        for part, words in _of_goal(old, new):
            yield RecordedDifference(part, f"{where}{words}")


def _number(goals: int) -> str:
    return "1 goal is" if goals == 1 else f"{goals} goals are"


def _of_goal(old: RecordedGoal, new: RecordedGoal) -> Iterator[tuple[str, str]]:
    if old.end != new.end:
        yield "end", f"it was `{old.end}` and is `{new.end}`"
    if old.ended_ns not in (None, new.ended_ns):
        yield "time", f"it ended after {_time(old.ended_ns)} and ends after {_time(new.ended_ns)}"
    if words := _changed_visits(old.visits, new.visits or ()):
        yield "visits", words
    if old.order is not None and old.order != new.order:
        yield "order", _changed_order(old.order, new.order or ())
    if words := _changed_values(old.final, dict(new.final or ())):
        yield "final", words


def _time(ended_ns: int | None) -> str:
    return format_duration(ended_ns or 0)


def _changed_visits(old: Sequence[str] | None, new: Sequence[str]) -> str:
    if old is None:
        return ""
    before, now = dict.fromkeys(old), dict.fromkeys(new)
    missing = [name for name in before if name not in now]
    added = [name for name in now if name not in before]
    found = [(missing, "missing"), (added, "new")]
    return "; ".join(f"{_listed(names)} {'is' if len(names) == 1 else 'are'} {word}" for names, word in found if names)


def _listed(names: Sequence[str], separator: str = ", ") -> str:
    more = len(names) - _MAX_LISTED
    return separator.join(names[:_MAX_LISTED]) + (f" and {more} more" if more > 0 else "")


def _changed_order(old: Sequence[str], new: Sequence[str]) -> str:
    """Return what stands between the operations with which both orders begin and those with which both end."""
    same = _equal_count(old, new)
    at_end = _equal_count(old[same:][::-1], new[same:][::-1])
    before, now = (names[same : len(names) - at_end] for names in (old, new))
    where = f"after {same} equal operation{'' if same == 1 else 's'}, " if same else ""
    if before and now:
        return f"{where}{_listed(before, _ARROW)} became {_listed(now, _ARROW)}"
    changed, word = (before, "missing") if before else (now, "new")
    return f"{where}{_listed(changed, _ARROW)} {'is' if len(changed) == 1 else 'are'} {word}"


def _equal_count(left: Sequence[str], right: Sequence[str]) -> int:
    """Return with how many equal names two lists begin."""
    pairs = zip_longest(left, right)
    return next((n for n, (a, b) in enumerate(pairs) if a != b), min(len(left), len(right)))


def _changed_values(old: Iterable[tuple[str, str]] | None, now: Mapping[str, str]) -> str:
    if old is None:
        return ""
    before = dict(old)
    names = (name for name in dict.fromkeys((*before, *now)) if before.get(name) != now.get(name))
    return _listed([_changed_value(name, before.get(name), now.get(name)) for name in names], "; ")


def _changed_value(name: str, was: str | None, is_: str | None) -> str:
    if was is None:
        return f"{name} is {is_} and was not recorded"
    return f"{name} was {was} and " + ("is no variable any more" if is_ is None else f"is {is_}")
