"""The runs of all cases, packed for the browser: it opens only the block with the case that is looked at.

What is packed is a dict that `json` can write:

- `per_block`: how many cases a block has.
- `cases`: how many there are.
- `shared`: compressed, `{texts, kinds, variables}`. `texts` are all names, values and sentences; wherever a number
  stands for a text below, it is an index into them. `kinds` are the kinds of records; `variables` has for each variable
  its name, its nominal value, both texts, and the group that it is shown in.
- `blocks`: compressed, each `{steps, cases}`. A step is what a record says but for its time and the number of its
  request, as `[kind, subject, detail, other, sentence, variable, value, variable, value, …]`; kind and variable are
  indexes into `kinds` and `variables`. Most steps happen in many cases.

A case is `null`, or has for each record its step (`steps`), the nanoseconds since the record before it (`after_ns`),
and how much the number of its request is larger than that of the last record that had one (`numbers`). `ended_ns` is
the end of its run, `violations` are `[requirement, begins, record, at_ns, reason]`, `unused` sentences.

*Compressed* is JSON, deflated with the header of zlib, in base64.
"""

from __future__ import annotations

from base64 import b64encode
from itertools import islice, pairwise
from json import dumps
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, assert_never, get_args
from zlib import compress

from scbm.cases.trace import (
    AutomaticTaken,
    BecameCurrent,
    InjectionApplied,
    MeasurementReceived,
    MeasurementRefused,
    MessageDisturbed,
    OperationStepped,
    PlanAsked,
    PlanDropped,
    PlanReceived,
    PutBack,
    Record,
    ReplyDropped,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    ResourceChanged,
    RunEnded,
    RunStarted,
    differing,
    sentence_of,
)
from scbm.model import format_value
from scbm.model.variables import Role

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases.trace import Sentence
    from scbm.model import BehaviorModel
    from scbm.testing import Execution
    from scbm.testing.requirement_monitors import Violation

_PER_BLOCK = 64

_LEVEL = 9
"""Of compression. Reports are written once and sent around often."""

_KINDS = tuple(record.kind for record in get_args(Record))

_GROUPS = {Role.DECLARED: "variables", Role.RESOURCE: "resources", Role.OPERATION_STATE: "operations"}


_Step: TypeAlias = tuple[int, ...]

_Thing = TypeVar("_Thing")


def pack_timelines(model: BehaviorModel, executions: Iterable[Execution | None]) -> dict[str, Any]:
    """Packs the runs of cases, in order; `None` for a case that cannot be run again.

    The executions are taken one by one, and none is kept.
    """
    packer = _Packer(model)
    packed = list(packer.blocks(executions))
    return {
        "per_block": _PER_BLOCK,
        "cases": sum(count for count, _ in packed),
        "shared": packer.shared(),
        "blocks": [block for _, block in packed],
    }


class _Packer:
    """Gives the parts of runs their numbers."""

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        self._texts: dict[str, int] = {}
        self._positions = {name: position for position, name in enumerate(model.running_space.names)}
        self._nominal = {variable.name: variable.initial for variable in model.running_space}
        self._variables = [
            (self._text(v.name), self._text(format_value(v.initial)), _GROUPS.get(v.role, "runner"))
            for v in model.running_space
        ]

    def shared(self) -> str:
        """What all blocks share, compressed. Complete when all blocks are packed."""
        return _compressed({"texts": list(self._texts), "kinds": list(_KINDS), "variables": self._variables})

    def blocks(self, executions: Iterable[Execution | None]) -> Iterator[tuple[int, str]]:
        """The blocks: how many cases each has, and the cases, compressed."""
        rest = iter(executions)
        while True:
            steps: dict[_Step, int] = {}
            # case by case: the executions of a whole block may be large
            cases = [self._case(execution, steps) for execution in islice(rest, _PER_BLOCK)]
            if not cases:
                return
            yield len(cases), _compressed({"steps": list(steps), "cases": cases})

    def _case(self, execution: Execution | None, steps: dict[_Step, int]) -> dict[str, Any] | None:
        if execution is None:
            return None
        records = execution.trace.records
        times = [record.at_ns for record in records]
        sentences = [sentence_of(record, self._model.nominal_state) for record in records]
        packed = [self._step(record, sentence) for record, sentence in zip(records, sentences, strict=True)]
        return {
            "steps": [_number(steps, step) for step in packed],
            "after_ns": _differences(times),
            "numbers": _differences(list(_numbers(sentences))),
            "ended_ns": execution.ended_ns,
            "violations": [self._violation(violation) for violation in execution.violations],
            "unused": [self._text(sentence) for sentence in execution.unused],
        }

    def _violation(self, violation: Violation) -> tuple[int, ...]:
        reason = self._text(violation.reason)
        return (self._text(violation.requirement), violation.begins, violation.record, violation.at_ns, reason)

    def _step(self, record: Record, sentence: Sentence) -> _Step:
        told = (*_lane(record), sentence.text)
        changes = (part for name, value in self._changes(record).items() for part in (name, value))
        return (_KINDS.index(record.kind), *map(self._text, told), *changes)

    def _changes(self, record: Record) -> dict[int, int]:
        """What a record changes; of the state with which a run starts, what is not nominal."""
        changes = dict(record.changes)
        if isinstance(record, RunStarted):
            changes = {**dict(differing(record, self._nominal)), **changes}
        return {self._positions[name]: self._text(format_value(value)) for name, value in changes.items()}

    def _text(self, text: str) -> int:
        return _number(self._texts, text)


def _lane(record: Record) -> tuple[str, str, str]:  # noqa: C901, PLR0911, PLR0912 - one case for each record
    """Where on the chart a record belongs: what it is about, what became of that, and what else took part."""
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
        case PlanAsked() | PlanDropped() | MeasurementReceived():
            return "", "", ""
        case _:
            assert_never(record)


def _numbers(sentences: Iterable[Sentence]) -> Iterator[int]:
    """Yield the number of each sentence; a sentence without one has that of the sentence before."""
    number = 0
    for sentence in sentences:
        number = number if sentence.number is None else sentence.number
        yield number


def _number(table: dict[_Thing, int], thing: _Thing) -> int:
    """The place of a thing in a table, where it is put if it is new."""
    return table.setdefault(thing, len(table))


def _differences(numbers: Sequence[int]) -> list[int]:
    """How much each is larger than the one before it: small, and often 0."""
    return [number - before for before, number in pairwise((0, *numbers))]


def _compressed(data: dict[str, Any]) -> str:
    written = dumps(data, ensure_ascii=False, separators=(",", ":")).encode()
    return b64encode(compress(written, _LEVEL)).decode()
