"""What a click does to a case: one class and one entry of `CASE_EDITS` for each; the page makes its buttons of them.

An edit changes the data of the case: the dictionaries, lists and scalars of its file. The text keeps all else.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from enum import StrEnum
from typing import TYPE_CHECKING, Any

from msgspec import Struct

from scbm.cases import AT_ONCE
from scbm.cases.injections import CONDITIONS
from scbm.files import parse_duration
from scbm.model import Outcome, format_duration, format_value
from scbm.model.variables import NO_OPERATION
from scbm.web.outcome_rules import changed_rules

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from scbm.cases import Reaction
    from scbm.model import BehaviorModel, Value
    from scbm.testing import Execution


class EditTarget(StrEnum):
    """What is clicked."""

    REQUEST = "request"
    VARIABLE = "variable"
    RESOURCE = "resource"
    CHANGE = "change"
    INITIAL = "initial"
    GOAL = "goal"


class EditField(Struct, frozen=True):
    """A value that an edit needs, such as a duration.

    Attributes:
        name: its name in a request to the server.
        label: its name on the page.
        value: the value that the page begins with.
        choices: all values, if there are few.
    """

    name: str
    label: str
    value: str = ""
    choices: tuple[str, ...] = ()


class EditError(Exception):
    """A click cannot be carried out; its text says why, in one sentence."""


class EditedMoment(Struct, frozen=True):
    """Where in a run something is clicked.

    Attributes:
        model: the model.
        execution: the run.
        record: the index of the selected record.
        target: the name of what is clicked; the id of a request.
        values: the values of the fields.
    """

    model: BehaviorModel
    execution: Execution
    record: int
    target: str
    values: Mapping[str, str]

    @property
    def at(self) -> str:
        """The time of the selected record."""
        return format_duration(self.execution.trace.records[self.record].at_ns)

    def duration_ns(self, name: str) -> int:
        """Return a duration. Raise `EditError` for another text."""
        text = self.values.get(name, "")
        duration_ns = parse_duration(text)
        if duration_ns is None:
            raise EditError(f"`{text}` is no duration; write for example `2 s`")
        return duration_ns

    def number(self, name: str) -> float:
        """Return a number, whole where it is. Raise `EditError` for another text."""
        try:
            number = float(self.values.get(name, ""))
        except ValueError:
            raise EditError(f"`{self.values.get(name, '')}` is no number") from None
        return int(number) if number.is_integer() else number

    def value(self, name: str = "value") -> Value:
        """Return the value of a variable with the target's name. Raise `EditError` for another text."""
        return value_of(self.model, self.target, self.values.get(name, ""))


def value_of(model: BehaviorModel, variable: str, text: str) -> Value:
    """Return the value of a variable that is written so. Raise `EditError` if there is none."""
    found = next((each for each in model.running_space if each.name == variable), None)
    value = None if found is None else next((v for v in found.domain.values if format_value(v) == text), None)
    if value is None:
        raise EditError(f"there is no variable `{variable}` with the value `{text}`")
    return value


class CaseEdit(ABC):
    """What a button does to a case.

    Attributes:
        label: the text of the button.
        target: what it is about.
        fields: the values that it needs.
    """

    label: str
    target: EditTarget
    fields: tuple[EditField, ...] = ()

    @abstractmethod
    def apply(self, data: dict[str, Any], moment: EditedMoment) -> None:
        """Change the data of a case in place. Raise `EditError` if that cannot be done."""


# requests


class RequestEdit(CaseEdit):
    """Decides about one request: changes the rule that the case has for it."""

    target = EditTarget.REQUEST

    def apply(self, data: dict[str, Any], moment: EditedMoment) -> None:
        """Change the rule of the request, which is that of its operation, or of its resource if the case has such."""
        spans = {str(each.request): each for each in moment.execution.spans.requests}
        if moment.target not in spans:
            raise EditError(f"this run has no request {moment.target}")
        span, outcomes = spans[moment.target], data.setdefault("outcomes", {})
        by_resource = span.operation == NO_OPERATION or (span.resource in outcomes and span.operation not in outcomes)
        subject = span.resource if by_resource else span.operation
        alike = (
            each.resource if by_resource else each.operation for each in spans.values() if each.request <= span.request
        )
        reaction = moment.execution.reactions[span.request - 1]
        outcomes[subject] = changed_rules(
            outcomes.get(subject), list(alike).count(subject), lambda rule: self.decide(rule, reaction, moment)
        )

    @abstractmethod
    def decide(self, rule: dict[str, Any], reaction: Reaction, moment: EditedMoment) -> None:
        """Change the rule of the request in place.

        Args:
            rule: the keys of the rule, with `outcome`.
            reaction: what happened to the request.
            moment: where it was clicked.
        """


def _leave_out(rule: dict[str, Any], *keys: str) -> None:
    for key in keys:
        rule.pop(key, None)


def _let_answer(rule: dict[str, Any], reaction: Reaction) -> None:
    """Let a request succeed that would get no reply."""
    if reaction.outcome is Outcome.TIMEOUT:
        rule["outcome"] = Outcome.SUCCEED.value


class DecideOutcome(RequestEdit):
    """The request succeeds, fails, or gets no reply."""

    def __init__(self, label: str, outcome: Outcome, *left_out: str) -> None:
        """Take the keys of a rule that mean nothing with this outcome."""
        self.label, self._outcome, self._left_out = label, outcome, left_out

    def decide(self, rule: dict[str, Any], reaction: Reaction, moment: EditedMoment) -> None:  # noqa: ARG002 - of others
        """Set the outcome."""
        rule["outcome"] = self._outcome.value
        _leave_out(rule, *self._left_out)


class DelayReply(RequestEdit):
    """The reply comes later."""

    label = "Late by"
    fields = (EditField("by", "time", "2 s"),)

    def decide(self, rule: dict[str, Any], reaction: Reaction, moment: EditedMoment) -> None:
        """Let the resource take longer."""
        rule["after"] = format_duration(reaction.latency_ns + moment.duration_ns("by"))
        _let_answer(rule, reaction)


_MESSAGE = EditField("message", "message", "reply", ("reply", "request"))


class DeliverMessage(RequestEdit):
    """One message of a request is lost, or travels in several copies."""

    fields = (_MESSAGE,)

    def __init__(self, label: str, delivery: Callable[[tuple[int, ...]], object]) -> None:
        """Take what makes of how long each copy travels now what the case says."""
        self.label, self._delivery = label, delivery

    def decide(self, rule: dict[str, Any], reaction: Reaction, moment: EditedMoment) -> None:
        """Change the delivery of the message."""
        message = moment.values.get("message", "")
        if message not in _MESSAGE.choices:
            raise EditError(f"`{message}` is no message: it is `reply` or `request`")
        rule[message] = self._delivery(getattr(reaction, message) or AT_ONCE)
        if message == "reply":
            _let_answer(rule, reaction)


# injections


def _inject(data: dict[str, Any], moment: EditedMoment, key: str, **injection: object) -> None:
    """Add an injection at the moment; one that does the same thing to the same target there is replaced."""
    injections, entry = data.setdefault("injections", []), {"at": moment.at, **injection}
    for index, other in enumerate(injections):
        same = other.get(key) == entry[key] or (key == "set" and other.get(key, {}).keys() == injection["set"].keys())  # type: ignore[attr-defined]
        if same and other.get("at") == moment.at and "when" not in other:
            named = {"name": other["name"]} if "name" in other else {}
            injections[index] = {**named, **entry}
            return
    injections.append(entry)


class SetHere(CaseEdit):
    """A variable has another value from here on."""

    label = "Set here"
    target = EditTarget.VARIABLE
    fields: tuple[EditField, ...] = (EditField("value", "value"),)

    def apply(self, data: dict[str, Any], moment: EditedMoment) -> None:
        """Add an injection."""
        _inject(data, moment, "set", set={moment.target: moment.value()})


class HoldFor(SetHere):
    """A variable has another value for some time."""

    label = "Hold for"
    fields = (*SetHere.fields, EditField("hold", "time", "5 s"))

    def apply(self, data: dict[str, Any], moment: EditedMoment) -> None:
        """Add an injection that restores the value."""
        hold = format_duration(moment.duration_ns("hold"))
        _inject(data, moment, "set", set={moment.target: moment.value()}, hold=hold)


class ChangeCondition(CaseEdit):
    """A resource is in another condition from here on."""

    label = "Becomes"
    target = EditTarget.RESOURCE
    fields = (EditField("condition", "condition", "occupied", tuple(CONDITIONS)), EditField("factor", "factor", "3"))

    def apply(self, data: dict[str, Any], moment: EditedMoment) -> None:
        """Add an injection."""
        kind = CONDITIONS.get(moment.values.get("condition", ""))
        if kind is None:
            raise EditError(f"there is no condition `{moment.values.get('condition', '')}`")
        becomes: object = kind.value
        if kind.has_factor:
            becomes = {kind.value: moment.number("factor")}
        _inject(data, moment, "resource", resource=moment.target, becomes=becomes)


class RestartOne(CaseEdit):
    """A resource is down for some time, and forgets its requests."""

    label = "Restart for"
    target = EditTarget.RESOURCE
    fields = (EditField("for", "time", "2 s"),)

    def apply(self, data: dict[str, Any], moment: EditedMoment) -> None:
        """Add a restart."""
        restart = {"resource": moment.target, "at": moment.at, "for": format_duration(moment.duration_ns("for"))}
        data.setdefault("network", {}).setdefault("restarts", []).append(restart)


# outside


class LetHappen(CaseEdit):
    """Something happens that the environment can do here."""

    label = "Let it happen"
    target = EditTarget.CHANGE

    def apply(self, data: dict[str, Any], moment: EditedMoment) -> None:
        """Add a change of the environment in its order; changes that were drawn become written ones."""
        by, _, assigned = moment.target.partition(":")
        variable, _, text = assigned.partition("=")
        changes: list[Any] = data.setdefault("environment", self._made(moment))
        entry: dict[str, Any] = {"at": moment.at}
        entry |= {"set": {variable: value_of(moment.model, variable, text)}} if assigned else {"by": by}
        at_ns = moment.execution.trace.records[moment.record].at_ns
        later = (i for i, each in enumerate(changes) if (parse_duration(str(each.get("at", ""))) or 0) > at_ns)
        changes.insert(next(later, len(changes)), entry)

    def _made(self, moment: EditedMoment) -> list[Any]:
        """Return the changes that the run has made, as the case would leave them to chance."""
        by = [({"by": each.by} if each.by else {}, each) for each in moment.execution.moves or ()]
        return [{"at": format_duration(each.at_ns or 0), **maker, "set": dict(each.assign or ())} for maker, each in by]


# the case


class PursueGoal(CaseEdit):
    """The case has another goal."""

    label = "Pursue"
    target = EditTarget.GOAL

    def apply(self, data: dict[str, Any], moment: EditedMoment) -> None:
        """Set the goal, instead of all others."""
        _leave_out(data, "goals")
        data["goal"] = moment.target


class BeginWith(CaseEdit):
    """A variable has another initial value."""

    label = "Begin with"
    target = EditTarget.INITIAL
    fields = (EditField("value", "value"),)

    def apply(self, data: dict[str, Any], moment: EditedMoment) -> None:
        """Set the initial value; a nominal value needs no line."""
        value, initial = moment.value(), data.setdefault("initial", {})
        if moment.model.nominal_state.get(moment.target) == value:
            _leave_out(initial, moment.target)
        else:
            initial[moment.target] = value
        if not initial:
            _leave_out(data, "initial")


CASE_EDITS: dict[str, CaseEdit] = {
    "succeed": DecideOutcome("Succeed", Outcome.SUCCEED),
    "fail": DecideOutcome("Fail", Outcome.FAIL, "measured"),
    "time_out": DecideOutcome("Time out", Outcome.TIMEOUT, "after", "reply", "measured"),
    "late": DelayReply(),
    "lose": DeliverMessage("Lose the", lambda _: "lost"),
    "double": DeliverMessage("Double it", lambda present: [format_duration(present[0])] * 2),
    "set": SetHere(),
    "hold": HoldFor(),
    "become": ChangeCondition(),
    "restart": RestartOne(),
    "happen": LetHappen(),
    "goal": PursueGoal(),
    "begin": BeginWith(),
}
"""What can be clicked, by the names in requests to the server, in the order of the page."""


def edit_data(name: str, data: dict[str, Any], moment: EditedMoment) -> None:
    """Change the data of a case by a click. Raise `EditError` if that cannot be done.

    The result that the case was saved from is left out: it describes the run before.
    """
    if name not in CASE_EDITS:
        raise EditError(f"there is no edit `{name}`")
    if not 0 <= moment.record < len(moment.execution.trace.records):
        raise EditError(f"this run has no record {moment.record + 1}")
    CASE_EDITS[name].apply(data, moment)
    _leave_out(data, "recorded")
