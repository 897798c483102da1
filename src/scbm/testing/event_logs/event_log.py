"""Event logs of real runs: the events of a runner, from which its trace is replayed and judged.

A runner reads no clock and draws no random numbers, so the same events at the same times give the same records.
A log is JSON Lines (docs/reference/event-logs.md): a header, a line for each step, a line for the reaction to each
request.
"""

from __future__ import annotations

import json
import re
from dataclasses import asdict, dataclass, fields
from fractions import Fraction
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from scbm.cases.trace import End, ends_of
from scbm.files import open_input, read_case, write_case
from scbm.model import FIRST_PLANNER, Diagnostic, InputError, Place, PlannerIdentity, Slug, refuse_other_version
from scbm.model.json_reader import JsonError, convert_json, read_json_object
from scbm.running import RunnerOptions, records_of
from scbm.running.simulation import Simulated
from scbm.running.simulation.case_runner import CaseRunner
from scbm.testing.event_logs.event_json import Count, Note, event_json, reaction_json, read_event, read_reaction

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases import Case, Reaction
    from scbm.cases.trace import Record
    from scbm.model import BehaviorModel
    from scbm.running import Event, Program

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

_MAX_NS = 2**63 - 1

_MAX_AT_ONCE = 1_000_000
"""Maximum of the bounds that detect a livelock: the records of all steps up to the bound stay in memory."""
_DIGEST = re.compile(r"[0-9a-f]{64}", re.ASCII)
_SCALE = re.compile(r"[1-9]\d{0,8}(/[1-9]\d{0,8})?", re.ASCII)


@dataclass(frozen=True, slots=True)
class LogStep:
    """One step of a run: an event, or a note.

    Attributes:
        at_ns: its time in the run, in nanoseconds.
        event: the event that the runner handled; or a record from elsewhere, with the same time.
        after: of a note, how many records of the event before it stand before it; `None` if all of them do.
    """

    at_ns: int
    event: Event | Note
    after: int | None = None


@dataclass(frozen=True, slots=True)
class EventLog:
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


# writing


def write_event_log(log: EventLog, model: BehaviorModel) -> str:
    """Return the log as JSON Lines. Raises `ValueError` for a run that no log can record."""
    header = {
        "format": FORMAT,
        "version": FORMAT_VERSION,
        "model": log.model,
        "model_digest": log.digest,
        "model_file": log.model_file,
        "case": write_case(log.case, model, None),
        "time_scale": str(log.time_scale),
        "real": log.real,
        "options": asdict(log.options),
        "end": log.end.value,
        "trace": log.trace,
        "planner": str(log.planner),
        "steps": len(log.steps),
        "reactions": len(log.reactions),
    }
    reactions = ({"reaction": reaction_json(reaction)} for reaction in log.reactions)
    return "".join(f"{_line(data)}\n" for data in chain([header], map(_step_json, log.steps), reactions))


def _line(data: dict[str, Any]) -> str:
    return json.dumps(data, ensure_ascii=False, separators=(",", ":"))


def _step_json(step: LogStep) -> dict[str, Any]:
    if isinstance(step.event, Note) and step.event.at_ns != step.at_ns:
        raise ValueError(f"a note of {step.event.at_ns} ns stands at {step.at_ns} ns")
    data = {"at_ns": step.at_ns, "event": event_json(step.event)}
    return data if step.after is None else data | {"after": step.after}


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
        self._header = _Header(_object(lines[0], Place(file, 1), _MAX_OF_THE_HEADER), Place(file, 1))
        self._steps, self._reactions = self._header.counts
        self._lines = lines[1:]
        expected, found = self._steps + self._reactions, len(self._lines)
        if expected != found:
            what = "is cut off" if found < expected else "is too long"
            raise _bad(
                f"the log {what}: its header announces {expected} lines, and {found} follow",
                Place(file),
            )

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
        steps = tuple(self._read_steps(model, wrong))
        reactions = tuple(self._read_reactions(model, wrong))
        if wrong:
            raise InputError(wrong[:_MAX_REPORTED])
        return EventLog(
            model.name, digest, case, header.options, header.time_scale, header.real, steps, reactions, header.end,
            header.trace, header.model_file, header.planner,
        )  # fmt: skip

    def _refuse_another_model(self, model: BehaviorModel, digest: str) -> None:
        name, known = self._header.model
        if name == model.name and known == digest:
            return
        what = f"`{name}`, not `{model.name}`" if name != model.name else "another version of it"
        message = f"this log is of another model than this one: {what}"
        remedy = "name the model file with which the log was recorded"
        raise InputError([Diagnostic(Slug.LOG_OTHER_MODEL, message, Place(self._file, 1), remedy)])

    def _refuse_others(self, real: tuple[str, ...], model: BehaviorModel) -> None:
        names = [resource.name for resource in model.resources]
        if list(real) != [name for name in names if name in real]:
            raise _bad(
                "`real` is not a list of resources of the model, in its order",
                Place(self._file, 1),
            )

    def _read_steps(self, model: BehaviorModel, wrong: list[Diagnostic]) -> Iterator[LogStep]:
        now_ns = 0
        for number, line in enumerate(self._lines[: self._steps], start=2):
            try:
                step = _step(_object(line, Place(self._file, number)), model, now_ns)
            except InputError as error:
                wrong += error.diagnostics
            except ValueError as error:
                wrong += _bad(str(error), Place(self._file, number)).diagnostics
            else:
                now_ns = step.at_ns
                yield step

    def _read_reactions(self, model: BehaviorModel, wrong: list[Diagnostic]) -> Iterator[Reaction]:
        for number, line in enumerate(self._lines[self._steps :], start=2 + self._steps):
            try:
                data = _object(line, Place(self._file, number))
                _refuse_other_keys(data, ("reaction",))
                yield read_reaction(data["reaction"], model)
            except InputError as error:
                wrong += error.diagnostics
            except ValueError as error:
                wrong += _bad(str(error), Place(self._file, number)).diagnostics


def _step(data: dict[str, Any], model: BehaviorModel, now_ns: int) -> LogStep:
    """Parse a step that is not before `now_ns`. Raises `ValueError`."""
    _refuse_other_keys(data, ("at_ns", "event"), ("after",))
    at_ns, after = data["at_ns"], data.get("after", 0)
    if not _is_count(at_ns) or at_ns > _MAX_NS:
        raise ValueError("`at_ns` is not a time in nanoseconds")
    if at_ns < now_ns:
        raise ValueError(f"time runs backwards, from {now_ns} ns to {at_ns} ns")
    event = read_event(data["event"], model, at_ns)
    if not _is_count(after) or ("after" in data and not isinstance(event, Note)):
        raise ValueError("`after` is a number of records, and belongs to a note")
    return LogStep(at_ns, event, data.get("after"))


class _Header:
    """The header: the first line of a log. Its first error is reported at once."""

    def __init__(self, data: dict[str, Any], place: Place) -> None:
        self._data = data
        self._place = place
        if data.get("format") != FORMAT:
            noun = (
                "the trace of a run, which does not have its events" if data.get("format") == "scbm-trace" else "no log"
            )
            raise _bad(f"this is {noun}", place)
        remedy = "record its run again: `scbm test MODEL CASES --logs DIRECTORY`"
        refuse_other_version("log", data.get("version"), FORMAT_VERSION, place, remedy)
        try:
            self._read()
        except ValueError as error:
            raise _bad(str(error), place) from None

    def _read(self) -> None:
        _refuse_other_keys(self._data, _HEADER)
        self.planner = PlannerIdentity.parse(self._text("planner"))
        self.model = (self._text("model"), self._matched("model_digest", _DIGEST))
        self.model_file = None if self._data["model_file"] is None else self._text("model_file")
        self.case = self._text("case")
        self.time_scale = Fraction(self._matched("time_scale", _SCALE))
        self.real = self._names("real")
        self.options = read_options(self._data["options"])
        self.end = self._end()
        self.trace = self._matched("trace", _DIGEST)
        self.counts = self._count("steps"), self._count("reactions")

    def _typed(self, name: str, type_: type[_T], what: str) -> _T:
        try:
            return convert_json(self._data[name], type_)
        except JsonError as error:
            raise ValueError(f"`{name}` is not {what}: {error.message}") from None

    def _text(self, name: str) -> str:
        return self._typed(name, str, "a text")

    def _names(self, name: str) -> tuple[str, ...]:
        return self._typed(name, tuple[str, ...], "a list of names")

    def _matched(self, name: str, pattern: re.Pattern[str]) -> str:
        value = self._text(name)
        if not pattern.fullmatch(value):
            raise ValueError(f"`{name}` is not {_WORDS[name]}")
        return value

    def _count(self, name: str) -> int:
        return self._typed(name, Count, "a number of lines")

    def _end(self) -> End:
        try:
            return End(self._data["end"])
        except ValueError:
            raise ValueError("`end` is not the end of a run") from None


_HEADER = (
    "format", "version", "model", "model_digest", "model_file", "case", "time_scale", "real", "options", "end",
    "trace", "planner", "steps", "reactions",
)  # fmt: skip

_WORDS = {
    "model_digest": "a SHA-256 of 64 hexadecimal digits",
    "trace": "a SHA-256 of 64 hexadecimal digits",
    "time_scale": "a number such as `20` or `1/2`",
}


def read_options(data: object) -> RunnerOptions:
    """Parse the options of a runner, all of which must be there. Raises `ValueError`."""
    types = {field.name: type(getattr(RunnerOptions(), field.name)) for field in fields(RunnerOptions)}
    if not isinstance(data, dict):
        raise ValueError("`options` are not an object")  # noqa: TRY004 - it is data
    _refuse_other_keys(data, tuple(types))
    for name, type_ in types.items():
        if type(data[name]) is not type_ or not 0 <= data[name] <= _MAX_NS:
            raise ValueError(
                f"`{name}` of `options` is not {'a number from 0 on' if type_ is int else 'true or false'}"
            )
    for name in ("livelock_bound", "instant_bound"):
        if data[name] > _MAX_AT_ONCE:
            raise ValueError(f"`{name}` of `options` is more than {_MAX_AT_ONCE}")
    return RunnerOptions(**data)


def _refuse_other_keys(data: dict[str, Any], required: Sequence[str], optional: Iterable[str] = ()) -> None:
    allowed = (*required, *optional)
    if any(name not in data for name in required) or any(name not in allowed for name in data):
        raise ValueError(f"the fields must be {', '.join(required)}")


def _is_count(value: object) -> bool:
    return type(value) is int and value >= 0


def _object(line: str, place: Place, most: int = _MAX_OF_A_LINE) -> dict[str, Any]:
    """Parse a line as a JSON object. Raises `InputError`."""
    try:
        return read_json_object(line, most)
    except JsonError as error:
        raise _bad(f"a line of a log is a JSON object: {error.message}", place) from None


def _bad(message: str, place: Place) -> InputError:
    return InputError([Diagnostic(Slug.BAD_LOG, message, place)])
