"""The parts that files of any kind have in common: names, values, durations, predicates, requirements.

Reads them out of nodes of any shape: what is missing or of the wrong sort is passed over here, as `shape` tells of it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from scbm.files.language.quantities import parse_duration
from scbm.files.language.resolver import Resolver
from scbm.files.language.scope import Scope, Where
from scbm.files.language.spelling import suggestion
from scbm.model import Place, Slug
from scbm.model.predicates import FALSE, TRUE, Predicate, conjunction
from scbm.model.requirements import Requirement
from scbm.model.values import Domain, Value, ValueKind, format_value, kind_of
from scbm.model.variables import Role

if TYPE_CHECKING:
    from collections.abc import Container

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.source_text import Scalar
    from scbm.files.yaml.text_files import ErrorCollector

NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_]*(\.[A-Za-z_][A-Za-z0-9_]*)*", re.ASCII)
"""What variables, operations, goals and all the others are called."""

_NEARLY_NAME = re.compile(r"[\w .-]{1,60}", re.ASCII)


@dataclass(slots=True)
class Parts:
    """Reads parts of a document in one scope, noting every error in a report.

    Attributes:
        report: where errors go.
        scope: the names that expressions can use.
        is_whole: whether every text so far was resolved; if not, the report says why.
    """

    report: ErrorCollector
    scope: Scope
    is_whole: bool = field(default=True, init=False)

    def add(self, slug: Slug, message: str, place: Place, remedy: str | None = None) -> None:
        """Notes an error."""
        self.report.add(slug, message, place, remedy)

    # names

    def refuse_name(self, name: str, place: Place) -> None:
        """Complains of a name that is none."""
        message = f"`{name}` is not a name" if name else "a name is missing"
        self.add(Slug.BAD_NAME, message, place, _name_remedy(name))

    def refuse_unknown(self, name: str, place: Place) -> None:
        """Complains of a variable that nobody declares."""
        if not self.scope.incomplete:
            known = [n for n, v in self.scope.variables.items() if v is None or v.role is Role.DECLARED]
            remedy = suggestion(name, known, "the variables are")
            self.add(Slug.UNKNOWN_VARIABLE, f"there is no variable `{name}`", place, remedy)

    def declared_names(self, node: YamlNode | None) -> tuple[str, ...]:
        """The variables of the world that a list names."""
        names: list[str] = []
        for element in node.elements if node is not None else ():
            if element.text is None:
                continue
            variable = self.scope.variables.get(element.text)
            if element.text not in self.scope.variables:
                self.refuse_unknown(element.text, element.place)
            elif variable is not None and variable.role.is_runner:
                message = f"`{element.text}` belongs to the runner; resources speak of the world"
                self.add(Slug.RUNNER_VARIABLE, message, element.place)
            elif element.text in names:
                self.add(Slug.DUPLICATE_VALUE, f"`{element.text}` stands here twice", element.place)
            else:
                names.append(element.text)
        return tuple(names)

    def alias(self, target: str) -> str:
        """Assignments to the states of operations count as one: only the current operation can be meant."""
        variable = self.scope.variables.get(target)
        is_state = variable is not None and variable.role in (Role.OPERATION_STATE, Role.CURRENT_STATE)
        return "the state of the operation" if is_state else target

    # values and durations

    def value(self, node: YamlNode | None, domain: Domain, name: str, values: Container[Value]) -> Value | None:
        """The value of a domain that a scalar says; `values` are all of the domain's."""
        if node is None or node.text is None or node.plain is None:
            return None
        slug = Slug.DIFFERENT_KINDS
        if isinstance(node.plain, (bool, int, str)) and kind_of(node.plain) is domain.kind:
            if node.plain in values:
                return node.plain
            slug = Slug.VALUE_OUTSIDE_DOMAIN
        self.add(slug, f"`{node.text}` is not a value of `{name}`", node.place, _value_remedy(node, domain))
        return None

    def duration(self, node: YamlNode | None) -> int | None:
        """The duration that a scalar says, in nanoseconds."""
        if node is None or node.text is None or node.plain is None:
            return None
        duration_ns = parse_duration(node.text)
        if duration_ns is not None:
            return duration_ns
        if isinstance(node.plain, (int, float)) and not isinstance(node.plain, bool):
            message = f"`{node.text}` is a number without a unit"
            self.add(Slug.BARE_DURATION, message, node.place, f"write `{node.text} s` or `{node.text} ms`")
        else:
            remedy = "write a number and a unit: `10 s`, `500 ms`, `2 minutes`"
            self.add(Slug.BAD_DURATION, f"`{node.text}` is not a duration", node.place, remedy)
        return None

    # expressions

    def predicate(self, node: YamlNode | None, where: Where) -> Predicate:
        """The predicate that a scalar or a list says; `true` for none and for one that is wrong."""
        if node is None:
            return TRUE
        if node.elements:
            return conjunction(self.predicate(element, where) for element in node.elements)
        if isinstance(node.plain, bool):
            return TRUE if node.plain else FALSE
        if node.scalar is None or node.plain is None:
            return TRUE
        predicate = self.resolver(node.scalar, where).read_predicate(node.scalar.text)
        self.is_whole = self.is_whole and predicate is not None
        return predicate or TRUE

    def requirement(self, name: str, node: YamlNode) -> Requirement | None:
        """The requirement that a scalar says."""
        if node.scalar is None or node.plain is None:
            return None
        sentence = self.resolver(node.scalar, Where.REQUIREMENT).read_requirement(node.scalar.text)
        self.is_whole = self.is_whole and sentence is not None
        return None if sentence is None else Requirement(name, sentence)

    def resolver(self, scalar: Scalar, where: Where) -> Resolver:
        """What resolves the text of a scalar and complains at its places."""

        def complain(slug: Slug, message: str, begin: int, end: int, remedy: str | None = None) -> None:
            self.add(slug, message, scalar.stretch(begin, end), remedy)

        return Resolver(self.scope, where, complain)


def _name_remedy(name: str) -> str:
    fixed = re.sub(r"[^A-Za-z0-9_]+", "_", name).strip("_")
    if not fixed or fixed[0].isdigit() or not _NEARLY_NAME.fullmatch(name):
        return "names are letters from a to z, digits and `_`, and begin with a letter"
    return f"write `{fixed}`"


def _value_remedy(node: YamlNode, domain: Domain) -> str:
    written = node.text or ""
    if domain.kind is ValueKind.SYMBOL:
        return suggestion(written, map(format_value, domain.values), "its values are") or f"its domain is {domain}"
    if node.scalar is not None and node.scalar.style and written in map(format_value, domain.values):
        return "leave out the quotes"
    return "write `true` or `false`" if domain.kind is ValueKind.BOOLEAN else f"its domain is {domain}"
