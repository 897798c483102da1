"""The runs of all cases, packed for the script of the page, which unpacks only the block of the case that is shown.

The packed runs are a dict that `json` can write:

- `per_block`: the number of cases in a block.
- `cases`: the number of all cases.
- `shared`: compressed, `{texts, kinds, variables}`. `texts` has all names, values and sentences; the texts below are
  indices into it. `kinds` has the kinds of records. `variables` has for each variable its name and its nominal value,
  both as texts, and its group on the page.
- `blocks`: compressed, each `{steps, cases}`. A step is a record without its time and the number of its request:
  `[kind, subject, detail, other, sentence, variable, value, variable, value, …]`; kind and variable are indices into
  `kinds` and `variables`. Most steps occur in many cases.

A case is `null` if it cannot be run again. Otherwise it has:

- `steps`: the step of each record.
- `after_ns`: for each record the nanoseconds since the record before it.
- `numbers`: for each record the difference between the number of its request and the last such number before it.
- `operations`, `requests`, `plans`: the spans of the run (`scbm.cases.trace.spans`), flat, three numbers for each span:
  the index of its first record, the number of records up to its last one, and its outcome, which is a text.
- `ended_ns`: the end of the run.
- `violations`: each `[requirement, begins, record, at_ns, reason]`.
- `failures`: each `[message, record]`: why the case failed, and the record that shows it, which is often the last one.
- `unused`: the clauses of the case without effect, as sentences.
- `notes`: what else a reader should know of the run, as sentences.

*Compressed* means JSON, deflated with a zlib header, in base64.
"""

from __future__ import annotations

from base64 import b64encode
from itertools import islice, pairwise
from json import dumps
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias, TypeVar, assert_never, get_args
from zlib import compress

from msgspec.structs import astuple

from scbm.cases.trace import (
    AutomaticTaken,
    BecameCurrent,
    InjectionApplied,
    LivelockedAtRest,
    MeasurementReceived,
    MeasurementRefused,
    MessageDisturbed,
    OperationSpan,
    OperationStepped,
    PlanAsked,
    PlanDropped,
    PlanningSpan,
    PlanReceived,
    PlanSpan,
    PutBack,
    Record,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    RequestSpan,
    ResourceChanged,
    RunEnded,
    RunnerStarted,
    RunStarted,
    differing,
)
from scbm.model import format_moment, format_value
from scbm.model.variables import Role
from scbm.model.visible_text import escaped
from scbm.testing.verdicts import violation_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.testing import Execution, Failure
    from scbm.testing.requirement_monitors import Violation

_PER_BLOCK = 64

_LEVEL, _QUICK_LEVEL = 9, 1
"""The levels of compression: the highest for reports, which are sent around; the lowest for a page of one run."""

_MOST_KNOWN = 100_000
"""Maximum number of memoized records."""

_KINDS = tuple(record.kind for record in get_args(Record))

_GROUPS = {Role.DECLARED: "variables", Role.RESOURCE: "resources", Role.OPERATION_STATE: "operations"}


_Step: TypeAlias = tuple[int, ...]

_Thing = TypeVar("_Thing")


KnownRecords: TypeAlias = dict[tuple[Any, ...], "_RecordParts"]
"""What is packed of records, by all of their fields but the time."""


def pack_timelines(
    model: BehaviorModel, executions: Iterable[Execution | None], known: KnownRecords | None = None
) -> dict[str, Any]:
    """Return the packed runs of cases, in order; `None` stands for a case that cannot be run again.

    The executions are consumed one by one, and none is kept in memory.

    Args:
        model: the model.
        executions: the runs.
        known: a memo for simulated runs that are packed one after the other, each soon after it is wanted.
    """
    packer = _Packer(model, known)
    packed = list(packer.blocks(executions))
    return {
        "per_block": _PER_BLOCK,
        "cases": sum(count for count, _ in packed),
        "shared": packer.shared(),
        "blocks": [block for _, block in packed],
    }


class _RecordParts(NamedTuple):
    """What is packed of a record beside its time: texts, changes by position, and the number of its request."""

    texts: tuple[str, ...]
    changes: tuple[tuple[int, str], ...]
    number: int | None


class _Packer:
    """Assigns indices to the texts, steps and variables of runs."""

    def __init__(self, model: BehaviorModel, known: KnownRecords | None) -> None:
        self._known, self._level = known, _LEVEL if known is None else _QUICK_LEVEL
        self._nominal_state = model.nominal_state
        self._texts: dict[str, int] = {}
        self._positions = {name: position for position, name in enumerate(model.running_space.names)}
        self._nominal = {variable.name: variable.initial for variable in model.running_space}
        self._variables = [
            (self._text(v.name), self._text(format_value(v.initial)), _GROUPS.get(v.role, "runner"))
            for v in model.running_space
        ]

    def shared(self) -> str:
        """Return the data that all blocks share, compressed; it is complete once all blocks are packed."""
        return _compressed(
            {"texts": [escaped(text) for text in self._texts], "kinds": list(_KINDS), "variables": self._variables},
            self._level,
        )

    def blocks(self, executions: Iterable[Execution | None]) -> Iterator[tuple[int, str]]:
        """Yield for each block the number of its cases, and the compressed block."""
        rest = iter(executions)
        while True:
            steps: dict[_Step, int] = {}
            # one execution at a time: those of a whole block may be large
            cases = [self._case(execution, steps) for execution in islice(rest, _PER_BLOCK)]
            if not cases:
                return
            yield len(cases), _compressed({"steps": list(steps), "cases": cases}, self._level)

    def _case(self, execution: Execution | None, steps: dict[_Step, int]) -> dict[str, Any] | None:
        if execution is None:
            return None
        records, spans = execution.trace.records, execution.spans
        times = [record.at_ns for record in records]
        parts = [self._parts(record, execution) for record in records]
        packed = [self._step(record.kind, part) for record, part in zip(records, parts, strict=True)]
        return {
            "steps": [_number(steps, step) for step in packed],
            "after_ns": _differences(times),
            "numbers": _differences(list(_numbers(parts))),
            "operations": self._spans(spans.operations),
            "requests": self._spans(spans.requests),
            "plans": self._spans(spans.plans),
            "ended_ns": execution.ended_ns,
            "violations": [self._violation(violation) for violation in execution.violations],
            "failures": [[self._text(str(each)), _record(each, execution)] for each in execution.verdict.failures],
            "unused": [self._text(sentence) for sentence in execution.unused],
            "notes": [
                self._text(sentence)
                for sentence in (*map(str, execution.hazards), *execution.notes, *_repeats(execution))
            ],
        }

    def _spans(self, spans: Iterable[OperationSpan | RequestSpan | PlanningSpan | PlanSpan]) -> list[int]:
        """Return for each span its first record, the number of records up to its last, and its outcome as a text."""
        return [
            part
            for span in spans
            for part in (span.begin_record, span.end_record - span.begin_record, self._text(_outcome(span)))
        ]

    def _violation(self, violation: Violation) -> tuple[int, ...]:
        reason = self._text(violation.reason)
        return (self._text(violation.requirement), violation.begins, violation.record, violation.at_ns, reason)

    def _step(self, kind: str, parts: _RecordParts) -> _Step:
        changes = (part for position, value in parts.changes for part in (position, self._text(value)))
        return (_KINDS.index(kind), *map(self._text, parts.texts), *changes)

    def _parts(self, record: Record, execution: Execution) -> _RecordParts:
        """Return what is packed of a record; memoized where runs are packed one after the other."""
        if self._known is None:
            return self._new_parts(record, execution)
        key = (record.kind, *astuple(record)[1:])
        found = self._known.get(key)
        if found is None:
            found = self._new_parts(record, execution)
            if len(self._known) < _MOST_KNOWN:
                self._known[key] = found
        return found

    def _new_parts(self, record: Record, execution: Execution) -> _RecordParts:
        """Return the parts; the changes of the start of the runner are the values that are not nominal."""
        sentence = execution.sentence(record, self._nominal_state)
        changes = dict(differing(record, self._nominal) if isinstance(record, RunnerStarted) else record.changes)
        by_position = tuple((self._positions[name], format_value(value)) for name, value in changes.items())
        return _RecordParts((*_lane(record), sentence.text), by_position, sentence.number)

    def _text(self, text: str) -> int:
        return self._texts.setdefault(text, len(self._texts))


def _record(failure: Failure, execution: Execution) -> int:
    """Return the index of the record that shows a failure: that of the violation, else the end of the run."""
    violation = violation_of(failure, execution.violations)
    return len(execution.trace.records) - 1 if violation is None else violation.record


def _repeats(execution: Execution) -> Iterator[str]:
    """Yield a sentence about the turn that repeats until the end of a run, if one does."""
    found = execution.repetition
    if found is not None:
        begins_ns = execution.trace.records[found.begin].at_ns
        yield f"from {format_moment(begins_ns)} to {format_moment(found.until_ns)} one turn {found.words}"


def _outcome(span: OperationSpan | RequestSpan | PlanningSpan | PlanSpan) -> str:
    """Return the outcome of a span as text; empty if the run ended first."""
    match span:
        case OperationSpan() | RequestSpan():
            return "" if span.outcome is None else span.outcome.value
        case PlanningSpan() | PlanSpan():
            return span.status or ""
        case _:
            assert_never(span)


def _lane(record: Record) -> tuple[str, str, str]:  # noqa: C901, PLR0911, PLR0912 - one case for each record
    """Return the subject of a record, its outcome, and a second subject: they decide its place on the chart."""
    match record:
        case RunStarted():
            return record.goal, "", ""
        case PlanReceived():
            return "", record.status, str(len(record.plan))
        case BecameCurrent():
            return record.operation, "", ""
        case OperationStepped():
            return record.operation, record.target.value, record.transition or ""
        case AutomaticTaken():
            return record.transition, "", record.failed or ""
        case RequestSent():
            return record.resource, ", ".join(format_value(value) for _, value in record.payload), ""
        case RequestCancelled():
            return record.resource, "", ""
        case ReplyReceived():
            return record.resource, "succeeded" if record.succeeded else "failed", ""
        case ReplyDropped():
            return "", record.why, ""
        case MeasurementRefused():
            return record.variable, format_value(record.value), ""
        case InjectionApplied():
            return record.injection, "", record.failed or ""
        case PutBack():
            return record.injection, "", ""
        case ResourceChanged():
            return record.injection, record.condition, record.resource
        case MessageDisturbed():
            return record.resource, record.message, str(record.copies)
        case RunEnded():
            return record.goal, record.end, ""
        case RunnerStarted() | PlanAsked() | PlanDropped() | MeasurementReceived() | LivelockedAtRest():
            return "", "", ""
        case _:
            assert_never(record)


def _numbers(parts: Iterable[_RecordParts]) -> Iterator[int]:
    """Yield the number of each record; a record without one has that of the record before."""
    number = 0
    for each in parts:
        number = number if each.number is None else each.number
        yield number


def _number(table: dict[_Thing, int], thing: _Thing) -> int:
    """Return the index of `thing` in `table`; add it if it is new."""
    return table.setdefault(thing, len(table))


def _differences(numbers: Sequence[int]) -> list[int]:
    """Return the difference of each number to the one before it; differences compress well."""
    return [number - before for before, number in pairwise((0, *numbers))]


def _compressed(data: dict[str, Any], level: int) -> str:
    written = dumps(data, ensure_ascii=False, separators=(",", ":")).encode()
    return b64encode(compress(written, level)).decode()
