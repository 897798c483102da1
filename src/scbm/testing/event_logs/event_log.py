"""Event logs of real runs: the events of a runner, from which its trace is replayed and judged.

A runner reads no clock and draws no random numbers, so the same events at the same times give the same records.
A log is JSON Lines (docs/reference/event-logs.md): a header, a line for each step, a line for the reaction to each
request.
"""

from __future__ import annotations

from contextlib import contextmanager
from fractions import Fraction
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeVar

from msgspec import UNSET, Struct, UnsetType
from msgspec.json import Encoder

from scbm.cases.trace import End, ends_of
from scbm.files import open_input, read_case, write_case
from scbm.model import FIRST_PLANNER, Diagnostic, InputError, Place, PlannerIdentity, Slug, refuse_other_version
from scbm.model.json_reader import (
    Count,
    Digest,
    JsonRecord,
    LongText,
    Names,
    Text,
    matching,
    one_of,
    read_json_object,
    read_record,
)
from scbm.running import records_of
from scbm.running.simulation import Simulated
from scbm.running.simulation.case_runner import CaseRunner
from scbm.testing.event_logs.event_records import (
    EventRecord,
    Note,
    NoteRecord,
    OptionsRecord,
    ReactionRecord,
    event_of,
    event_record,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.cases import Case, Reaction
    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel
    from scbm.running import Event, Program, RunnerOptions

FORMAT = "scbm-events"
FORMAT_VERSION = 5
"""Incremented with every change of the format, which `docs/reference/event-logs.md` describes."""

MAX_BYTES = 256 * 1024 * 1024
"""Maximum size of a log: some millions of steps."""

_T = TypeVar("_T")

_MAX_OF_THE_HEADER = 16 * 1024 * 1024
_MAX_OF_A_LINE = 1024 * 1024
_MAX_REPORTED = 20
"""Maximum number of wrong lines that an error lists; a file with more is hardly a log."""


class LogStep(Struct, frozen=True):
    """One step of a run: an event, or a note.

    Attributes:
        at_ns: its time in the run, in nanoseconds.
        event: the event that the runner handled; or a record from elsewhere, with the same time.
        after: of a note, how many records of the event before it stand before it; `None` if all of them do.
    """

    at_ns: int
    event: Event | Note
    after: int | None = None


class EventLog(Struct, frozen=True):
    """One run.

    Attributes:
        model: the name of the model.
        digest: the digest of the model, which identifies its version.
        case: the case that was run.
        options: those of the runner, the limits of the case among them.
        time_scale: seconds of the run for each second of the wall clock.
        real: the resources that real drivers carried out.
        steps: the events and notes, in order.
        reactions: the reaction to each request, in the order of sending.
        end: how the run ended; `lost` if it was not finished: then the steps are those up to the loss.
        trace: the SHA-256 of its trace as text, in hexadecimal digits.
        model_file: the path of the model file from the directory of the log; `None` if it is not recorded.
        planner: the planner of the controller.
    """

    model: str
    digest: str
    case: Case
    options: RunnerOptions
    time_scale: Fraction
    real: tuple[str, ...]
    steps: tuple[LogStep, ...]
    reactions: tuple[Reaction, ...]
    end: End
    trace: str
    model_file: str | None = None
    planner: PlannerIdentity = FIRST_PLANNER

    @property
    def ended_ns(self) -> int:
        """The time of the last step."""
        return self.steps[-1].at_ns if self.steps else 0


def replay(log: EventLog, program: Program) -> tuple[Record, ...]:
    """Return the records of the run, computed from its events.

    Args:
        log: the run.
        program: the compiled model of the log.

    Raises:
        ValueError: a note stands behind more records than its event has.
    """
    return _replayed(log, CaseRunner(program, log.case, log.options))


def _replayed(log: EventLog, runner: CaseRunner) -> tuple[Record, ...]:
    """Return the records that a new runner makes of the events. Raises `ValueError` as `replay` does."""
    records: list[Record] = []
    begin = 0
    for step in log.steps:
        if isinstance(step.event, Note):
            place = len(records) if step.after is None else begin + step.after
            if place > len(records):
                raise ValueError(f"a note stands behind {step.after} records, and there are {len(records) - begin}")
            records.insert(place, step.event)
        else:
            begin = len(records)
            records += records_of(runner.handle(step.event, step.at_ns))
    return tuple(records)


def rerun(log: EventLog, program: Program) -> Simulated:
    """Replay the run, and return its records, its end and the time of its end, as a simulation does.

    A run that was lost as a change of its case never came has this change as `impossible`.

    Raises:
        ValueError: the events do not end the run; or as in `replay`.
    """
    runner = CaseRunner(program, log.case, log.options)
    records = _replayed(log, runner)
    if log.end is End.LOST:
        return Simulated(End.LOST, log.ended_ns, records, impossible=runner.waiting if runner.is_over else None)
    ends = ends_of(records)
    if len(ends) != len(log.case.goals):
        raise ValueError("the run does not end with these events")
    return Simulated(End(ends[-1].end), ends[-1].at_ns, records)


# the lines


class _HeaderRecord(JsonRecord, frozen=True):
    """The first line of a log."""

    format: Text
    version: Count
    model: Text
    model_digest: Digest
    model_file: LongText | None
    case: str
    time_scale: Annotated[str, matching("[1-9][0-9]{0,8}(/[1-9][0-9]{0,8})?", "a number such as `20` or `1/2`")]
    real: Names
    options: OptionsRecord
    end: Annotated[str, one_of(End)]
    trace: Digest
    planner: Text
    steps: Count
    reactions: Count


class _StepRecord(JsonRecord, frozen=True):
    """The line of a step."""

    at_ns: Count
    event: EventRecord
    after: Count | UnsetType = UNSET

    def __post_init__(self) -> None:
        if self.after is not UNSET and not isinstance(self.event, NoteRecord):
            raise ValueError("`after` belongs to a note")


class _ReactionLine(JsonRecord, frozen=True):
    """The line of a reaction."""

    reaction: ReactionRecord


# writing


def write_event_log(log: EventLog, model: BehaviorModel) -> str:
    """Return the log as JSON Lines. Raises `ValueError` for a run that no log can record."""
    header = _HeaderRecord(
        FORMAT,
        FORMAT_VERSION,
        log.model,
        log.digest,
        log.model_file,
        write_case(log.case, model, None),
        str(log.time_scale),
        log.real,
        OptionsRecord.of(log.options),
        log.end.value,
        log.trace,
        str(log.planner),
        len(log.steps),
        len(log.reactions),
    )
    reactions = (_ReactionLine(ReactionRecord.of(reaction)) for reaction in log.reactions)
    return Encoder().encode_lines(chain([header], map(_step_record, log.steps), reactions)).decode()


def _step_record(step: LogStep) -> _StepRecord:
    if isinstance(step.event, Note) and step.event.at_ns != step.at_ns:
        raise ValueError(f"a note of {step.event.at_ns} ns stands at {step.at_ns} ns")
    return _StepRecord(step.at_ns, event_record(step.event), UNSET if step.after is None else step.after)


# reading


def open_event_log(path: Path) -> LogDocument:
    """Read the lines and the header of a log file. Raises `InputError` if it is unreadable or its header is wrong."""
    try:
        with open_input(path) as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        message = f"cannot read the file: {reason}"
        raise InputError([Diagnostic(Slug.FILE_UNREADABLE, message, Place(str(path)))]) from None
    if len(data) > MAX_BYTES:
        message = f"the file is larger than {MAX_BYTES // 1024**2} MiB"
        raise InputError([Diagnostic(Slug.FILE_TOO_LARGE, message, Place(str(path)))])
    try:
        text = data.decode()
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        raise _bad(f"the byte 0x{data[error.start]:02x} is not UTF-8", Place(str(path), line)) from None
    return LogDocument(text, str(path))


def read_event_log(text: str, model: BehaviorModel, digest: str, file: str = "log") -> EventLog:
    """Parse a log.

    Args:
        text: JSON Lines.
        model: the model of the log.
        digest: the digest of the model, which identifies its version.
        file: the name of the text in errors.

    Raises:
        InputError: it is no log, is cut off, of another version, or of another model; or some lines are wrong.
    """
    return LogDocument(text, file).read(model, digest)


class LogDocument:
    """A log whose header is parsed; the other lines are parsed once the model is loaded."""

    def __init__(self, text: str, file: str) -> None:
        """Take the text of a log; raise `InputError` if it is no log, is cut off, or of another version."""
        self._file = file
        *lines, rest = text.split("\n")
        if not lines or rest:
            message = "the log is empty" if not text else f"the log is cut off in line {len(lines) + 1}"
            raise _bad(message, Place(file))
        self._header = header = _read_header(lines[0], Place(file, 1))
        self._lines = lines
        expected, found = header.steps + header.reactions, len(lines) - 1
        if expected != found:
            what = "is cut off" if found < expected else "is too long"
            message = f"the log {what}: its header announces {expected} lines, and {found} follow"
            raise _bad(message, Place(file))

    def model_path(self) -> Path:
        """Return the path of the model file, relative to the log. Raises `InputError` if the log does not name one."""
        named = self._header.model_file
        if named is None:
            message = "the log names no model file"
            raise InputError([Diagnostic(Slug.MODEL_MISSING, message, Place(self._file), "add `--model FILE`")])
        return Path(self._file).parent / named

    def read(self, model: BehaviorModel, digest: str) -> EventLog:
        """Parse the log with its model, whose version `digest` identifies. Raises `InputError`."""
        header = self._header
        self._refuse_another_model(model, digest)
        case = read_case(header.case, model, f"{self._file} (case)")
        self._refuse_others(header.real, model)
        wrong: list[Diagnostic] = []
        behind = 1 + header.steps
        steps = tuple(self._read_lines(range(1, behind), _StepReader(model), wrong))
        reactions = tuple(self._read_lines(range(behind, len(self._lines)), partial(_reaction, model), wrong))
        if wrong:
            raise InputError(wrong[:_MAX_REPORTED])
        return EventLog(
            model.name,
            digest,
            case,
            header.options.options(),
            Fraction(header.time_scale),
            header.real,
            steps,
            reactions,
            End(header.end),
            header.trace,
            header.model_file,
            PlannerIdentity.parse(header.planner),
        )

    def _refuse_another_model(self, model: BehaviorModel, digest: str) -> None:
        name, known = self._header.model, self._header.model_digest
        if name == model.name and known == digest:
            return
        what = f"`{name}`, not `{model.name}`" if name != model.name else "another version of it"
        message = f"this log is of another model than this one: {what}"
        remedy = "name the model file with which the log was recorded"
        raise InputError([Diagnostic(Slug.LOG_OTHER_MODEL, message, Place(self._file, 1), remedy)])

    def _refuse_others(self, real: tuple[str, ...], model: BehaviorModel) -> None:
        names = [resource.name for resource in model.resources]
        if list(real) != [name for name in names if name in real]:
            raise _bad("`real` is not a list of resources of the model, in its order", Place(self._file, 1))

    def _read_lines(self, indices: range, read: Callable[[object], _T], wrong: list[Diagnostic]) -> Iterator[_T]:
        """Yield what the lines with these indices say; add an error for each that is wrong."""
        for index in indices:
            try:
                yield read(read_json_object(self._lines[index], _MAX_OF_A_LINE))
            except ValueError as error:
                wrong += _bad(str(error), Place(self._file, index + 1)).diagnostics


class _StepReader(Struct):
    """Parses the steps of a log one after the other; each call raises `ValueError` if the step is wrong."""

    model: BehaviorModel
    now_ns: int = 0

    def __call__(self, data: object) -> LogStep:
        record: _StepRecord = read_record(data, _StepRecord, "the step")
        if record.at_ns < self.now_ns:
            raise ValueError(f"time runs backwards, from {self.now_ns} ns to {record.at_ns} ns")
        event = event_of(record.event, self.model, record.at_ns)
        self.now_ns = record.at_ns
        return LogStep(record.at_ns, event, None if record.after is UNSET else record.after)


def _reaction(model: BehaviorModel, data: object) -> Reaction:
    record: _ReactionLine = read_record(data, _ReactionLine, "the line")
    return record.reaction.reaction(model)


def _read_header(line: str, place: Place) -> _HeaderRecord:
    """Return the header of a log. Raises `InputError`."""
    with _at(place):
        data = read_json_object(line, _MAX_OF_THE_HEADER)
    if data.get("format") != FORMAT:
        is_trace = data.get("format") == "scbm-trace"
        raise _bad(f"this is {'the trace of a run, which does not have its events' if is_trace else 'no log'}", place)
    remedy = "record its run again: `scbm test MODEL CASES --logs DIRECTORY`"
    refuse_other_version("log", data.get("version"), FORMAT_VERSION, place, remedy)
    with _at(place):
        header: _HeaderRecord = read_record(data, _HeaderRecord, "the header")
        PlannerIdentity.parse(header.planner)
    return header


@contextmanager
def _at(place: Place) -> Iterator[None]:
    """Turn a `ValueError` into the `InputError` of a log."""
    try:
        yield
    except ValueError as error:
        raise _bad(str(error), place) from None


def _bad(message: str, place: Place) -> InputError:
    return InputError([Diagnostic(Slug.BAD_LOG, message, place)])
