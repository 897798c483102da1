"""Events of a runner, notes and reactions as records: on the wire and in logs (docs/reference/event-logs.md).

Records may come from anybody. Their types have fields and limits; `ModelNames` looks up names of the model, values
and predicates. Values that a driver measured are kept as they came. The runner refuses those that do not fit, and
says so.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, TypeAlias

from msgspec import Meta, Struct, structs
from msgspec.structs import asdict

from scbm.cases import Condition, Injection, Reaction, condition_kind
from scbm.cases.trace import NETWORK, SENT, MessageDisturbed, ResourceChanged
from scbm.files import Scope, Where, parse_predicate
from scbm.model import InputError, Outcome
from scbm.model.json_reader import Count, JsonRecord, LongText, Names, Text, Values, matching, one_of
from scbm.running import (
    GoalGiven,
    InjectionGiven,
    Measured,
    PlanAnswered,
    PlanStatus,
    ReplyArrived,
    RunnerOptions,
    TimePassed,
)
from scbm.running.simulation import MessageKind

if TYPE_CHECKING:
    from scbm.cases.trace import Changes
    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.running import Event

Note: TypeAlias = MessageDisturbed | ResourceChanged
"""A record that no runner made: what the network did to a message, or a resource that was lost or came back."""

Factor: TypeAlias = Annotated[str, matching("[1-9][0-9]{0,17}(/[1-9][0-9]{0,17})?", "a fraction greater than 0")]

OutcomeWord: TypeAlias = Annotated[str, one_of(Outcome)]

Travel: TypeAlias = Annotated[tuple[Count, ...], Meta(max_length=1_000)]
"""The delays of the copies of a message that arrive, in nanoseconds."""

_AtOnce: TypeAlias = Annotated[int, Meta(ge=0, le=1_000_000)]
"""A bound that detects a livelock: the records of all steps up to the bound stay in memory."""


class ModelNames(Struct, frozen=True):
    """Looks up what a record says of a model; each method raises `ValueError`, which names the field.

    Attributes:
        model: the model.
        record: the name of the record in errors.
    """

    model: BehaviorModel
    record: str

    def _wrong(self, field: str, expected: str) -> ValueError:
        return ValueError(f"`{field}` of {self.record} is not {expected}")

    def resource(self, name: str) -> str:
        """Return the name of a resource."""
        if all(resource.name != name for resource in self.model.resources):
            raise self._wrong("resource", "a resource of the model")
        return name

    def operations(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """Return the names of operations: a plan."""
        known = frozenset(operation.name for operation in self.model.operations)
        if not known.issuperset(names):
            raise self._wrong("plan", "a list of operations of the model")
        return names

    def transition(self, name: str) -> str:
        """Return the name of an environment transition."""
        if all(transition.name != name for transition in self.model.environment):
            raise self._wrong("by", "an environment transition of the model")
        return name

    def assigned(self, values: dict[str, Value]) -> Changes:
        """Return variables with values that a case may set."""
        space = self.model.running_space
        for name, value in values.items():
            if name not in space or value not in space[name].domain or value not in space[name].assignable:
                raise self._wrong("set", f"an object of values that a case may set: see `{name}`")
        return tuple(values.items())

    def predicate(self, field: str, text: str, where: Where) -> Predicate:
        """Return a predicate over the variables of the model."""
        try:
            return parse_predicate(text, Scope.of(self.model), where)
        except InputError as error:
            raise self._wrong(field, f"a predicate: {error.diagnostics[0].message}") from None

    def guard(self, field: str, text: str | None) -> Predicate | None:
        """Return a predicate over all variables of a run, if there is one."""
        return None if text is None else self.predicate(field, text, Where.GUARD)


class _EventRecord(JsonRecord, tag_field="kind", frozen=True):
    """An event or a note, without its time."""


class GoalRecord(_EventRecord, tag="goal", frozen=True):
    """A goal was given."""

    name: LongText
    predicate: LongText
    when: LongText | None = None


class ReplyRecord(_EventRecord, tag="reply", frozen=True):
    """A resource answered."""

    request: Count
    succeeded: bool
    measured: Values


class MeasuredRecord(_EventRecord, tag="measured", frozen=True):
    """A resource published values, or a change of the case came, `by` an environment transition."""

    values: Values
    by: Annotated[Text, Meta(min_length=1)] = ""


class ConditionRecord(JsonRecord, frozen=True):
    """The new condition of a resource."""

    kind: Text
    factor: Factor

    def __post_init__(self) -> None:
        if Fraction(self.factor) < 1:
            raise ValueError("`factor` is not a fraction from 1 on")


class InjectionRecord(_EventRecord, tag="injection", frozen=True):
    """The case injects something, or the controller gives up the run."""

    name: Annotated[Text, matching(f"(?!({NETWORK}|{SENT})$).+", f"a name other than `{NETWORK}` and `{SENT}`")]
    set: Values
    when: LongText | None
    at_ns: Count | None
    hold_ns: Count | None
    resource: Text | None
    becomes: ConditionRecord | None
    after_ns: Count | None = None

    def __post_init__(self) -> None:
        if (self.resource is None) != (self.becomes is None):
            raise ValueError("an injection has both `resource` and `becomes`, or neither")
        if self.after_ns is not None and self.when is None:
            raise ValueError("`after_ns` of an injection needs `when`")


class PlanRecord(_EventRecord, tag="plan", frozen=True):
    """The planner answered."""

    ask: Count
    status: Annotated[str, one_of(PlanStatus)]
    plan: Names

    def __post_init__(self) -> None:
        if self.plan and self.status != PlanStatus.SOLVED:
            raise ValueError("there is a plan only where the problem is solved")


class TimeRecord(_EventRecord, tag="time", frozen=True):
    """A deadline passed."""


class MessageRecord(_EventRecord, tag="message", frozen=True):
    """The network lost a message, or delivered it several times."""

    request: Count
    resource: Text
    message: Annotated[str, one_of(MessageKind)]
    copies: Count


class ResourceRecord(_EventRecord, tag="resource", frozen=True):
    """A resource was lost or came back."""

    resource: Text
    condition: Text


NoteRecord: TypeAlias = MessageRecord | ResourceRecord
EventRecord: TypeAlias = (
    GoalRecord
    | ReplyRecord
    | MeasuredRecord
    | InjectionRecord
    | PlanRecord
    | TimeRecord
    | MessageRecord
    | ResourceRecord
)


def event_record(event: Event | Note) -> EventRecord:  # noqa: PLR0911 - one for each kind
    """Return an event or a note as a record, without its time; raise `ValueError` if no record says it."""
    match event:
        case GoalGiven(name, predicate, when):
            return GoalRecord(name, str(predicate), None if when is None else str(when))
        case ReplyArrived(request, succeeded, measured):
            return ReplyRecord(request, succeeded, values_by_name(measured))
        case Measured(values, by):
            return MeasuredRecord(values_by_name(values), by)
        case InjectionGiven(injection):
            return _injection_record(injection)
        case PlanAnswered(ask, status, plan):
            return PlanRecord(ask, status.value, plan)
        case TimePassed():
            return TimeRecord()
        case _:
            return note_record(event)


def note_record(note: Note) -> NoteRecord:
    """Return a note as a record, without its time; raise `ValueError` for a change that the runner records itself."""
    if isinstance(note, MessageDisturbed):
        return MessageRecord(note.request, note.resource, note.message, note.copies)
    if note.injection != NETWORK:
        raise ValueError(f"the runner itself says what `{note.injection}` does to a resource")
    return ResourceRecord(note.resource, note.condition)


def _injection_record(injection: Injection) -> InjectionRecord:
    condition = injection.condition
    return InjectionRecord(
        injection.name,
        values_by_name(injection.assign),
        None if injection.when is None else str(injection.when),
        injection.at_ns,
        injection.hold_ns,
        injection.resource,
        None if condition is None else ConditionRecord(condition.kind.value, str(condition.factor)),
        injection.after_ns,
    )


def event_of(record: EventRecord, model: BehaviorModel, at_ns: int = 0) -> Event | Note:  # noqa: PLR0911 - the same
    """Return the event or the note of a record.

    Args:
        record: the record.
        model: the model whose names it uses.
        at_ns: when it happened, in time of the run; notes are records of the trace, which have it in them.

    Raises:
        ValueError: the model does not have a name or a value of the record.
    """
    names = ModelNames(model, f"`{record.__struct_config__.tag}`")
    match record:
        case GoalRecord(name, predicate, when):
            return GoalGiven(name, names.predicate("predicate", predicate, Where.WORLD), names.guard("when", when))
        case ReplyRecord(request, succeeded, measured):
            return ReplyArrived(request, succeeded, tuple(measured.items()))
        case MeasuredRecord(values, by):
            return Measured(tuple(values.items()), names.transition(by) if by else "")
        case InjectionRecord():
            return InjectionGiven(_injection_of(record, names))
        case PlanRecord(ask, status, plan):
            return PlanAnswered(ask, PlanStatus(status), names.operations(plan))
        case TimeRecord():
            return TimePassed()
        case MessageRecord(request, resource, message, copies):
            return MessageDisturbed(at_ns, request, names.resource(resource), message, copies)
        case ResourceRecord(resource, condition):
            return ResourceChanged(at_ns, NETWORK, names.resource(resource), condition)


def _injection_of(record: InjectionRecord, names: ModelNames) -> Injection:
    becomes = record.becomes
    return Injection(
        record.name,
        names.assigned(record.set),
        names.guard("when", record.when),
        record.at_ns,
        record.hold_ns,
        None if record.resource is None else names.resource(record.resource),
        None if becomes is None else Condition(condition_kind(becomes.kind), Fraction(becomes.factor)),
        record.after_ns,
    )


class ReactionRecord(JsonRecord, frozen=True):
    """The reaction to a request: see `cases.Reaction`."""

    resource: Text
    outcome: OutcomeWord
    latency_ns: Count
    measured: Values | None
    request: Travel | None
    reply: Travel | None
    cancel: Travel | None

    @staticmethod
    def of(reaction: Reaction) -> ReactionRecord:
        """Return a reaction as a record."""
        measured = None if reaction.measured is None else values_by_name(reaction.measured)
        travels = reaction.request, reaction.reply, reaction.cancel
        return ReactionRecord(reaction.resource, reaction.outcome.value, reaction.latency_ns, measured, *travels)

    def reaction(self, model: BehaviorModel) -> Reaction:
        """Return the reaction; raise `ValueError` if the model does not have the resource."""
        resource = ModelNames(model, "the reaction").resource(self.resource)
        measured = None if self.measured is None else tuple(self.measured.items())
        return Reaction(
            resource, Outcome(self.outcome), self.latency_ns, measured, self.request, self.reply, self.cancel
        )


class OptionsRecord(JsonRecord, frozen=True):
    """The options of a runner, all of them: see `running.RunnerOptions`."""

    time_limit_ns: Count
    plan_limit: Count
    livelock_bound: _AtOnce
    instant_bound: _AtOnce
    awaits_measurements: bool

    @staticmethod
    def of(options: RunnerOptions) -> OptionsRecord:
        """Return options as a record."""
        return OptionsRecord(**asdict(options))

    def options(self) -> RunnerOptions:
        """Return the options."""
        return RunnerOptions(**structs.asdict(self))


def values_by_name(values: Changes) -> dict[str, Value]:
    """Return values by the names of their variables; raise `ValueError` if a variable has two values."""
    found = dict(values)
    if len(found) != len(values):
        raise ValueError("a variable has two values")
    return found
