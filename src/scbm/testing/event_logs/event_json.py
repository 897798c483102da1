"""Events of a runner, notes and reactions as JSON: on the wire and in logs (docs/reference/event-logs.md).

Whatever is read may come from anybody: kinds, fields, sorts and names are checked, and what is wrong is a `ValueError`.
Values that a driver measured are kept as they came. The runner refuses those that do not fit, and says so.
"""

from __future__ import annotations

import re
from enum import Enum
from fractions import Fraction
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, TypeVar, assert_never

from msgspec import Meta

from scbm.cases import Condition, Injection, Reaction, condition_kind
from scbm.cases.trace import NETWORK, SENT, MessageDisturbed, ResourceChanged
from scbm.files import Scope, Where, parse_predicate
from scbm.model import InputError, Outcome
from scbm.model.json_reader import JsonError, convert_json
from scbm.running import GoalGiven, InjectionGiven, Measured, PlanAnswered, PlanStatus, ReplyArrived, TimePassed
from scbm.running.simulation import MessageKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    from scbm.cases import Delivery
    from scbm.cases.trace import Changes
    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.running import Event

Note: TypeAlias = MessageDisturbed | ResourceChanged
"""A record that no runner made: what the network did to a message, or a resource that was lost or came back."""

Count: TypeAlias = Annotated[int, Meta(ge=0)]
"""A whole number from 0 on."""

_T = TypeVar("_T")
_Words = TypeVar("_Words", bound=Enum)
_MESSAGES = tuple(message.value for message in MessageKind)
_MAX_CHARACTERS = 1_000
_FACTOR = re.compile(r"[1-9]\d{0,11}(/[1-9]\d{0,11})?", re.ASCII)


def event_json(event: Event | Note) -> dict[str, Any]:  # noqa: PLR0911 - one for each kind
    """Return an event or a note as data for `json`, without its time; raise `ValueError` if no JSON says it."""
    match event:
        case GoalGiven(name, predicate, when):
            waits = {} if when is None else {"when": str(when)}
            return {"kind": "goal", "name": name, "predicate": str(predicate), **waits}
        case ReplyArrived(request, succeeded, measured):
            return {"kind": "reply", "request": request, "succeeded": succeeded, "measured": _by_name(measured)}
        case Measured(values, by):
            return {"kind": "measured", "values": _by_name(values), **({"by": by} if by else {})}
        case InjectionGiven(injection):
            return {"kind": "injection", **_injection_json(injection)}
        case PlanAnswered(ask, status, plan):
            return {"kind": "plan", "ask": ask, "status": status.value, "plan": list(plan)}
        case TimePassed():
            return {"kind": "time"}
        case MessageDisturbed(_, request, resource, message, copies):
            return {"kind": "message", "request": request, "resource": resource, "message": message, "copies": copies}
        case ResourceChanged(_, injection, resource, condition):
            if injection != NETWORK:
                raise ValueError(f"the runner itself says what `{injection}` does to a resource")
            return {"kind": "resource", "resource": resource, "condition": condition}
        case _:
            assert_never(event)


def read_event(data: object, model: BehaviorModel, at_ns: int = 0) -> Event | Note:
    """Parse an event or a note from JSON.

    Args:
        data: the JSON of `event_json`, as a peer or a file gives it.
        model: the model whose names the event uses.
        at_ns: when it happened, in time of the run; notes are records, which have it in them.

    Raises:
        ValueError: the data is no event, with the reason.
    """
    kind = data.get("kind") if isinstance(data, dict) else None
    if not isinstance(kind, str) or kind not in _KEYS:
        raise ValueError("an event of an unknown kind")
    fields = _JsonFields(data, ("kind", *_KEYS[kind]), f"`{kind}`", model, _OPTIONAL.get(kind, ()))
    return _READERS[kind](fields, at_ns)


def read_note(data: object, model: BehaviorModel, at_ns: int) -> Note:
    """Parse a note; raise `ValueError` for any other event."""
    note = read_event(data, model, at_ns)
    if not isinstance(note, Note):
        raise ValueError("an event of the runner, where a note to the trace is expected")  # noqa: TRY004 - it is data
    return note


def reaction_json(reaction: Reaction) -> dict[str, Any]:
    """Return the reaction to a request as data that `json` can write."""
    measured = reaction.measured
    fields = {"resource": reaction.resource, "outcome": reaction.outcome.value, "latency_ns": reaction.latency_ns}
    travels = {"request": reaction.request, "reply": reaction.reply, "cancel": reaction.cancel}
    return {
        **fields,
        "measured": None if measured is None else _by_name(measured),
        **{message: None if delivery is None else list(delivery) for message, delivery in travels.items()},
    }


def read_reaction(data: object, model: BehaviorModel) -> Reaction:
    """Parse a reaction that `reaction_json` wrote. Raises `ValueError`."""
    fields = _JsonFields(data, ("resource", "outcome", "latency_ns", "measured", *_MESSAGES), "reaction", model)
    return Reaction(
        fields.resource("resource"),
        fields.word("outcome", Outcome),
        fields.count("latency_ns"),
        None if fields["measured"] is None else fields.values("measured"),
        *(fields.delivery(message) for message in _MESSAGES),
    )


# writing


def _by_name(values: Changes) -> dict[str, Value]:
    by_name = dict(values)
    if len(by_name) != len(values):
        raise ValueError("a variable has two values")
    return by_name


def _injection_json(injection: Injection) -> dict[str, Any]:
    condition = injection.condition
    after = {} if injection.after_ns is None else {"after_ns": injection.after_ns}
    return {
        "name": injection.name,
        "set": _by_name(injection.assign),
        "when": None if injection.when is None else str(injection.when),
        "at_ns": injection.at_ns,
        "hold_ns": injection.hold_ns,
        "resource": injection.resource,
        "becomes": None if condition is None else {"kind": condition.kind.value, "factor": str(condition.factor)},
        **after,
    }


# reading


class _JsonFields:
    """The fields of a JSON object that has these and no others; each is asked for by the sort that it must be of."""

    def __init__(
        self, data: object, keys: Iterable[str], what: str, model: BehaviorModel, optional: Iterable[str] = ()
    ) -> None:
        names = tuple(keys)
        required = data.keys() - dict.fromkeys(optional).keys() if isinstance(data, dict) else ()
        if not isinstance(data, dict) or required != dict.fromkeys(names).keys():
            raise ValueError(f"the fields of {what} are {', '.join(names)}")
        self.model = model
        self._data = data
        self._what = what

    def __getitem__(self, name: str) -> object:
        return self._data[name]

    def has(self, name: str) -> bool:
        """Return whether an optional field is there."""
        return name in self._data

    def _wrong(self, name: str, expected: str) -> ValueError:
        return ValueError(f"`{name}` of {self._what} is not {expected}")

    def typed(self, name: str, type_: type[_T], expected: str) -> _T:
        """Return a field as a value of a type. Raises `ValueError`, which says what is `expected`."""
        try:
            return convert_json(self._data[name], type_)
        except JsonError as error:
            raise ValueError(f"`{name}` of {self._what} is not {expected}: {error.message}") from None

    def text(self, name: str, most: int | None = _MAX_CHARACTERS) -> str:
        """Return a text that UTF-8 can encode."""
        value = self.typed(name, str, "a text")
        if (most is not None and len(value) > most) or not _is_encodable(value):
            raise self._wrong(name, "a text" if most is None else f"a text of at most {most} characters")
        return value

    def count(self, name: str) -> int:
        """Return a whole number from 0 on."""
        return self.typed(name, Count, "a number from 0 on")

    def count_or_none(self, name: str) -> int | None:
        """Return a whole number from 0 on, or `None` for `null`."""
        return None if self._data.get(name) is None else self.count(name)

    def truth(self, name: str) -> bool:
        """Return true or false."""
        return self.typed(name, bool, "true or false")

    def word(self, name: str, words: type[_Words]) -> _Words:
        """Return a member of an enumeration by its value."""
        return self.typed(name, words, f"one of {', '.join(str(word.value) for word in words)}")

    def resource(self, name: str) -> str:
        """Return the name of a resource of the model."""
        value = self._data[name]
        for resource in self.model.resources:
            if resource.name == value:
                return resource.name
        raise self._wrong(name, "a resource of the model")

    def values(self, name: str) -> Changes:
        """Return names and values; the model need not know them."""
        written = self.typed(name, dict[str, bool | int | str], "an object of names and values")
        if not all(map(_is_encodable, (text for pair in written.items() for text in pair if isinstance(text, str)))):
            raise self._wrong(name, "an object of names and values that UTF-8 can encode")
        return tuple(written.items())

    def assigned(self, name: str) -> Changes:
        """Return variables with values that a case may set."""
        values = self.values(name)
        space = self.model.running_space
        for variable, value in values:
            if variable not in space or value not in space[variable].domain or value not in space[variable].assignable:
                raise self._wrong(name, f"an object of values that a case may set: see `{variable}`")
        return values

    def delivery(self, name: str) -> Delivery | None:
        """Return the delays of the copies of a message that arrive, in nanoseconds; `None` for `null`."""
        return None if self._data[name] is None else self.typed(name, tuple[Count, ...], "a list of times")

    def predicate(self, name: str, where: Where) -> Predicate:
        """Return a predicate over the variables of the model."""
        try:
            return parse_predicate(self.text(name, most=None), Scope.of(self.model), where)
        except InputError as error:
            raise self._wrong(name, f"a predicate: {error.diagnostics[0].message}") from None


def _is_encodable(text: str) -> bool:
    """Return whether UTF-8 can encode a text; a peer in this process may hand over half of a surrogate pair."""
    try:
        text.encode()
    except UnicodeEncodeError:
        return False
    return True


def _goal(fields: _JsonFields, _: int) -> Event:
    when = fields.predicate("when", Where.GUARD) if fields.has("when") else None
    return GoalGiven(fields.text("name", most=None), fields.predicate("predicate", Where.WORLD), when)


def _reply(fields: _JsonFields, _: int) -> Event:
    return ReplyArrived(fields.count("request"), fields.truth("succeeded"), fields.values("measured"))


def _measured(fields: _JsonFields, _: int) -> Event:
    by = fields.text("by") if fields.has("by") else ""
    if fields.has("by") and all(each.name != by for each in fields.model.environment):
        raise ValueError("`by` of `measured` is not an environment transition of the model")
    return Measured(fields.values("values"), by)


def _injection(fields: _JsonFields, _: int) -> Event:
    name = fields.text("name")
    resource = None if fields["resource"] is None else fields.resource("resource")
    condition = None if fields["becomes"] is None else _condition(fields["becomes"], fields.model)
    if not name or name in (NETWORK, SENT):
        raise ValueError("the name of an injection must not be empty, `network` or `sent`")
    if (resource is None) != (condition is None):
        raise ValueError("an injection has both `resource` and `becomes`, or neither")
    return InjectionGiven(
        Injection(
            name,
            fields.assigned("set"),
            None if fields["when"] is None else fields.predicate("when", Where.GUARD),
            fields.count_or_none("at_ns"),
            fields.count_or_none("hold_ns"),
            resource,
            condition,
            _after_ns(fields),
        )
    )


def _after_ns(fields: _JsonFields) -> int | None:
    after_ns = fields.count_or_none("after_ns")
    if after_ns is not None and fields["when"] is None:
        raise ValueError("`after_ns` of an injection needs `when`")
    return after_ns


def _condition(data: object, model: BehaviorModel) -> Condition:
    fields = _JsonFields(data, ("kind", "factor"), "`becomes`", model)
    factor = fields.text("factor")
    if not _FACTOR.fullmatch(factor) or Fraction(factor) < 1:
        raise ValueError("`factor` of `becomes` is not a fraction from 1 on")
    return Condition(condition_kind(fields.text("kind")), Fraction(factor))


def _plan(fields: _JsonFields, _: int) -> Event:
    status = fields.word("status", PlanStatus)
    plan = fields.typed("plan", tuple[str, ...], "a list of operations of the model")
    known = frozenset(operation.name for operation in fields.model.operations)
    if not all(name in known for name in plan):
        raise ValueError("`plan` of `plan` is not a list of operations of the model")
    if plan and status is not PlanStatus.SOLVED:
        raise ValueError("there is a plan only where the problem is solved")
    return PlanAnswered(fields.count("ask"), status, plan)


def _time(_: _JsonFields, __: int) -> Event:
    return TimePassed()


def _message(fields: _JsonFields, at_ns: int) -> Note:
    message = fields.word("message", MessageKind).value
    request, resource = fields.count("request"), fields.resource("resource")
    return MessageDisturbed(at_ns, request, resource, message, fields.count("copies"))


def _resource(fields: _JsonFields, at_ns: int) -> Note:
    return ResourceChanged(at_ns, NETWORK, fields.resource("resource"), fields.text("condition"))


_READERS: Mapping[str, Callable[[_JsonFields, int], Event | Note]] = {
    "goal": _goal,
    "reply": _reply,
    "measured": _measured,
    "injection": _injection,
    "plan": _plan,
    "time": _time,
    "message": _message,
    "resource": _resource,
}

_KEYS: Mapping[str, tuple[str, ...]] = {
    "goal": ("name", "predicate"),
    "reply": ("request", "succeeded", "measured"),
    "measured": ("values",),
    "injection": ("name", "set", "when", "at_ns", "hold_ns", "resource", "becomes"),
    "plan": ("ask", "status", "plan"),
    "time": (),
    "message": ("request", "resource", "message", "copies"),
    "resource": ("resource", "condition"),
}

_OPTIONAL: Mapping[str, tuple[str, ...]] = {"goal": ("when",), "measured": ("by",), "injection": ("after_ns",)}
"""Fields that are left out where they have no value."""
