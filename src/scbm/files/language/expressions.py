"""Parses predicates, actions and requirements from a text of their own, such as an option of a command."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.files.language.resolver import Resolver
from scbm.files.language.scope import Scope, Where
from scbm.files.spelling import nearest, suggestion
from scbm.files.yaml.error_collector import ErrorCollector
from scbm.model import InputError, Place, Slug
from scbm.model.values import Domain, Value, format_value
from scbm.model.variables import State

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.operations import Action
    from scbm.model.predicates import Predicate
    from scbm.model.requirements import RequirementForm
    from scbm.model.variables import StateSpace


class _Text:
    """One text, its resolver, and its errors."""

    def __init__(self, text: str, scope: Scope, where: Where, file: str) -> None:
        self.text = text.replace("\n", " ").replace("\r", " ")
        self._file = file
        self._report = ErrorCollector([self.text])
        self.resolver = Resolver(scope, where, self._complain)

    def _complain(self, slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
        self._report.add(slug, message, Place(self._file, 1, begin + 1, max(1, end - begin)), remedy)

    def error(self) -> InputError:
        """Return the errors of a text that could not be resolved."""
        if not len(self._report):
            raise AssertionError(f"{self.text!r} was not resolved, and nothing was complained of")
        return self._report.error()


def parse_predicate(text: str, scope: Scope, where: Where = Where.WORLD, file: str = "predicate") -> Predicate:
    """Return the predicate of a text. Raises `InputError` with places in the text, which errors call `file`."""
    alone = _Text(text, scope, where, file)
    predicate = alone.resolver.read_predicate(alone.text)
    if predicate is None:
        raise alone.error()
    return predicate


def parse_action(text: str, scope: Scope, where: Where = Where.AUTOMATIC, file: str = "action") -> Action:
    """Return the action of a text. Raises `InputError`."""
    alone = _Text(text, scope, where, file)
    action = alone.resolver.read_action(alone.text)
    if action is None:
        raise alone.error()
    return action


def parse_requirement(text: str, scope: Scope, file: str = "requirement") -> RequirementForm:
    """Return the requirement of a text. Raises `InputError`."""
    alone = _Text(text, scope, Where.REQUIREMENT, file)
    requirement = alone.resolver.read_requirement(alone.text)
    if requirement is None:
        raise alone.error()
    return requirement


def parse_value(text: str, domain: Domain) -> Value | None:
    """Return the value of a domain that is written like this; `None` if there is none."""
    for value in domain.values:
        if format_value(value) == text:
            return value
    return None


def parse_state(text: str, space: StateSpace, file: str = "state") -> State:
    """Return the state of a text `v=x, w=y, …`; other variables are nominal. Raises `InputError`."""
    report = ErrorCollector([text])
    values: dict[str, Value] = {}
    for begin, assignment in _assignments(text):
        written_name, equals, written_value = assignment.partition("=")
        name, value = written_name.strip(), written_value.strip()
        place = Place(file, 1, begin + 1, max(1, len(name)))
        value_place = Place(file, 1, begin + 1 + assignment.rfind(value), max(1, len(value)))
        if not equals or not name:
            message = f"`{assignment.strip()}` is not `variable=value`"
            report.add(Slug.BAD_OPTION, message, place, "write for example `robot_at=home`")
        elif name not in space:
            remedy = suggestion(name, space.names, "the variables are")
            report.add(Slug.UNKNOWN_VARIABLE, f"there is no variable `{name}`", place, remedy)
        elif name in values:
            report.add(Slug.ASSIGNED_TWICE, f"`{name}` is given twice", place)
        else:
            domain = space[name].domain
            meant = parse_value(value, domain)
            if meant is None:
                near = nearest(value, map(format_value, domain.values))
                remedy = f"did you mean `{near}`?" if near else f"its domain is {domain}"
                report.add(Slug.VALUE_OUTSIDE_DOMAIN, f"`{value}` is not a value of `{name}`", value_place, remedy)
            else:
                values[name] = meant
    report.raise_any()
    return State.nominal(space).replace(values)


def _assignments(text: str) -> Iterator[tuple[int, str]]:
    """Yield the parts between commas, each with its position, without leading blanks."""
    index = 0
    for part in text.split(","):
        if part.strip():
            yield index + len(part) - len(part.lstrip()), part.strip()
        index += len(part) + 1
