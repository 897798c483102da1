"""Reads the scalars and lists of a file in one scope: names, values, durations, numbers, predicates, requirements."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Generic, TypeVar

from msgspec import Struct

from scbm.files.language.quantities import parse_duration, parse_share
from scbm.files.language.resolver import Resolver
from scbm.files.language.scope import NAME, Scope, Where, name_fault
from scbm.files.spelling import nearest, suggestion
from scbm.model import Place, Slug
from scbm.model.predicates import FALSE, TRUE, Predicate, conjunction, flat_conjunction
from scbm.model.values import Domain, Value, ValueKind, format_value, kind_of
from scbm.model.variables import Role

if TYPE_CHECKING:
    from collections.abc import Container, Iterable, Iterator, Mapping
    from fractions import Fraction

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.files.yaml.source_text import Scalar
    from scbm.model.requirements import RequirementForm
    from scbm.model.resources import Resource
    from scbm.model.variables import Variable

T = TypeVar("T")

CASE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*", re.ASCII)
"""The syntax of the names of cases and injections."""

_LONG_DURATION = re.compile(r"\s*\d{16,}(?:\.\d+)?\s*[a-zµ]+\s*", re.ASCII)
"""A duration whose number has more digits than `parse_duration` reads."""


class Entry(Struct, Generic[T], frozen=True):
    """An entry of a mapping from names: its name, the place of that, the node behind it, and the value of the node."""

    name: str
    place: Place
    node: YamlNode
    value: T


class ValueReader:
    """Reads values in one scope, and notes every error in a report.

    Attributes:
        report: where errors go.
        scope: the names that expressions can use.
        is_whole: whether every text so far was resolved; if not, the report says why.
    """

    def __init__(self, report: ErrorCollector, scope: Scope) -> None:
        self.report = report
        self.scope = scope
        self.is_whole = True

    def add(self, slug: Slug, message: str, place: Place, remedy: str | None = None) -> None:
        """Note an error."""
        self.report.add(slug, message, place, remedy)

    # names and words

    def check_name(self, name: str, place: Place, section: str = "") -> None:
        """Note a text that is not a name, or a reserved word; `section` is that of an entry with this name."""
        fault = name_fault(name, section)
        if fault is not None:
            self.add(fault.slug, fault.message, place, fault.remedy)

    def refuse_unknown(self, name: str, place: Place) -> None:
        """Note that no variable has this name."""
        if not self.scope.may_miss(name):
            known = [n for n, v in self.scope.variables.items() if v is None or v.role is Role.DECLARED]
            remedy = self.report.suggestion(name, known, "the variables are", place)
            self.add(Slug.UNKNOWN_VARIABLE, f"there is no variable `{name}`", place, remedy)

    def model_name(self, node: YamlNode, text: str) -> str:
        """Return the name of a model or of a transition, even if it is not a name."""
        if not NAME.fullmatch(text):
            self.check_name(text, node.place)
        return text

    def case_name(self, node: YamlNode, text: str) -> str | None:
        """Return the name of a case or of an injection."""
        if CASE_NAME.fullmatch(text):
            return text
        fixed = re.sub(r"[^A-Za-z0-9_.-]+", "_", text).strip("_")
        remedy = "names are letters from a to z, digits, `_`, `-` and `.`, and begin with a letter"
        remedy = f"write `{fixed}`" if CASE_NAME.fullmatch(fixed) else remedy
        message = f"`{text}` is not a name" if text else "a name is missing"
        self.add(Slug.BAD_NAME, message, node.place, remedy)
        return None

    def variables(self, node: YamlNode) -> tuple[str, ...]:
        """Return the variables of the world that a list names."""
        names: list[str] = []
        for element in node.elements:
            if element.text is None or not self.is_of_world(element.text, element.place):
                continue
            if element.text in names:
                self.add(Slug.DUPLICATE_VALUE, f"`{element.text}` is listed twice", element.place)
            else:
                names.append(element.text)
        return tuple(names)

    def is_of_world(self, name: str, place: Place) -> bool:
        """Return whether a resource can use a variable of this name; note an error if it cannot."""
        variable = self.scope.variables.get(name)
        if name not in self.scope.variables:
            self.refuse_unknown(name, place)
            return False
        if variable is not None and variable.role.is_runner:
            message = f"`{name}` is a variable of the runner; resources can use none"
            self.add(Slug.RUNNER_VARIABLE, message, place)
            return False
        return True

    def operations(self, node: YamlNode) -> tuple[str, ...]:
        """Return the operations that a list names, in its order; one may stand there more than once."""
        names: list[str] = []
        for element in node.elements:
            if element.text is None or element.plain is None:
                continue
            if element.text in self.scope.operations:
                names.append(element.text)
            else:
                remedy = self.report.suggestion(
                    element.text, self.scope.operations, "the operations are", element.place
                )
                message = f"there is no operation `{element.text}`"
                self.add(Slug.UNKNOWN_OPERATION, message, element.place, remedy)
        return tuple(names)

    def resource(self, node: YamlNode, text: str) -> Resource | None:
        """Return the resource with this name."""
        known = self.scope.resources
        if text not in known:
            remedy = self.report.suggestion(text, known, "the resources are", node.place)
            self.add(Slug.UNKNOWN_RESOURCE, f"there is no resource `{text}`", node.place, remedy)
        return known.get(text)

    def word(
        self, node: YamlNode, text: str, words: Iterable[str], what: str, former: Mapping[str, str] | None = None
    ) -> str | None:
        """Return the text if it is one of some words, which are called `what`; `former` says what old words are now."""
        known = list(words)
        if text in known:
            return text
        remedy = suggestion((former or {}).get(text, text), known, "the allowed words are")
        self.add(Slug.UNKNOWN_WORD, f"`{text}` is not {what}", node.place, remedy)
        return None

    def alias(self, target: str) -> str:
        """Return the target of an assignment; one name for the states of all operations.

        Only the current operation can be meant, so two assignments to the states of operations contradict each other.
        """
        variable = self.scope.variables.get(target)
        is_state = variable is not None and variable.role in (Role.OPERATION_STATE, Role.CURRENT_STATE)
        return "the state of the operation" if is_state else target

    # values and numbers

    def value(self, node: YamlNode | None, domain: Domain, name: str, values: Container[Value]) -> Value | None:
        """Return the value of variable `name` that a scalar names; `values` are those of its domain."""
        if node is None or node.text is None or node.plain is None:
            return None
        slug = Slug.DIFFERENT_KINDS
        if isinstance(node.plain, (bool, int, str)) and kind_of(node.plain) is domain.kind:
            if node.plain in values:
                return node.plain
            slug = Slug.VALUE_OUTSIDE_DOMAIN
        self.add(slug, f"`{node.text}` is not a value of `{name}`", node.place, _value_remedy(node, domain))
        return None

    def assignments(self, entries: Iterable[Entry[T]] | None) -> Iterator[tuple[Variable, Value, Entry[T]]]:
        """Yield the variables of a mapping with their values and entries."""
        for entry in entries or ():
            variable = self.scope.variables.get(entry.name)
            if variable is None:
                self.refuse_unknown(entry.name, entry.place)
                continue
            value = self.value(entry.node, variable.domain, entry.name, variable.domain)
            if value is not None:
                yield variable, value, entry

    def duration(self, node: YamlNode, text: str) -> int | None:
        """Return a duration in nanoseconds."""
        duration_ns = parse_duration(text)
        if duration_ns is not None:
            return duration_ns
        if isinstance(node.plain, (int, float)) and not isinstance(node.plain, bool):
            message = f"`{text}` is a number without a unit"
            self.add(Slug.BARE_DURATION, message, node.place, f"write `{text} s` or `{text} ms`")
        else:
            remedy = "write a number and a unit: `10 s`, `500 ms`, `2 minutes`"
            message = f"`{text}` is not a duration"
            near = nearest(text, self.report.parameters_of_part(node.place))
            remedy = f"{remedy}, or the parameter `{near}`" if near is not None else remedy
            if _LONG_DURATION.fullmatch(text):
                message = f"`{text}` is too large: the number of a duration has at most 15 digits before its point"
            self.add(Slug.BAD_DURATION, message, node.place, remedy)
        return None

    def time(self, node: YamlNode, text: str) -> int | None:
        """Return a duration of a run in nanoseconds; a negative one has an error of its own."""
        shown = text.strip()
        if not shown.startswith("-") or parse_duration(shown[1:]) is None:
            return self.duration(node, text)
        remedy = f"write `{shown[1:].strip()}`" if parse_duration(shown[1:]) else "write `0 s`"
        self.add(Slug.NEGATIVE_TIME, f"`{shown}` is negative; a time is at least `0 s`", node.place, remedy)
        return None

    def whole_number(self, node: YamlNode, text: str, least: int | None = None, most: int | None = None) -> int | None:
        """Return a whole number from `least` to `most`."""
        number = node.plain
        if not isinstance(number, int) or isinstance(number, bool):
            quoted = isinstance(number, str) and node.scalar is not None and node.scalar.style and number.isdecimal()
            remedy = "leave out the quotes" if quoted else "write a whole number, such as `3`"
            self.add(Slug.BAD_NUMBER, f"`{text}` is not a whole number", node.place, remedy)
        elif least is not None and number < least:
            message = f"`{text}` is too small: the least is {least}"
            self.add(Slug.BAD_NUMBER, message, node.place, f"write a number from {least} on")
        elif most is not None and number > most:
            self.add(Slug.BAD_NUMBER, f"`{text}` is too large: the most is {most}", node.place)
        else:
            return number
        return None

    def count(self, node: YamlNode, text: str) -> int | None:
        """Return a whole number from 1 on."""
        return self.whole_number(node, text, least=1)

    def share(self, node: YamlNode, text: str) -> Fraction | None:
        """Return a share from 0 to 1."""
        share = parse_share(text)
        if share is None:
            message = f"`{text}` is not a share from 0 % to 100 %"
            self.add(Slug.NOT_A_SHARE, message, node.place, "write for example `2 %` or `0.02`")
        return share

    # expressions

    def predicate(self, node: YamlNode | None, where: Where) -> Predicate:
        """Return the predicate of a scalar or a list; `true` for none and for a wrong one."""
        if node is None:
            return TRUE
        if node.elements:
            operands = [self.predicate(element, where) for element in node.elements]
            return flat_conjunction(operands) if node.flattens else conjunction(operands)
        if isinstance(node.plain, bool):
            return TRUE if node.plain else FALSE
        if node.scalar is None or node.plain is None:
            return TRUE
        predicate = self.resolver(node.scalar, where).read_predicate(node.scalar.syntax or node.scalar.text)
        self.is_whole = self.is_whole and predicate is not None
        return predicate or TRUE

    def sentence(self, node: YamlNode, text: str) -> RequirementForm | None:
        """Return the sentence of a requirement."""
        if node.scalar is None:
            return None
        sentence = self.resolver(node.scalar, Where.REQUIREMENT).read_requirement(node.scalar.syntax or text)
        self.is_whole = self.is_whole and sentence is not None
        return sentence

    def resolver(self, scalar: Scalar, where: Where) -> Resolver:
        """Return a resolver of the text of a scalar, which notes errors at their places in the file."""

        def complain(slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
            self.add(slug, message, scalar.stretch(begin, end), remedy)

        def warn(slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
            self.report.warn(slug, message, scalar.stretch(begin, end), remedy)

        def suggest(name: str, known: Iterable[str], what: str, begin: int, end: int) -> str | None:
            return self.report.suggestion(name, known, what, scalar.stretch(begin, end))

        return Resolver(self.scope, where, complain, suggest, warn)


def _value_remedy(node: YamlNode, domain: Domain) -> str:
    written = node.text or ""
    if domain.kind is ValueKind.SYMBOL:
        return suggestion(written, map(format_value, domain.values), "its values are") or f"its domain is {domain}"
    if node.scalar is not None and node.scalar.style and written in map(format_value, domain.values):
        return "leave out the quotes"
    return "write `true` or `false`" if domain.kind is ValueKind.BOOLEAN else f"its domain is {domain}"
