"""The parts that only cases have: times of a run, counts, shares, words, and values for variables."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.files.codec.common_parts import Parts
from scbm.files.language.quantities import parse_duration, parse_share
from scbm.files.language.spelling import nearest, suggestion
from scbm.model import Slug
from scbm.model.values import format_value

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from fractions import Fraction

    from scbm.cases.trace import Changes
    from scbm.files.yaml.document import YamlNode
    from scbm.model.behavior import BehaviorModel
    from scbm.model.resources import Resource
    from scbm.model.values import Value
    from scbm.model.variables import Variable

CASE_NAME = re.compile(r"[A-Za-z_][A-Za-z0-9_.-]*", re.ASCII)
"""What cases and injections are called."""


@dataclass(slots=True)
class CaseParts(Parts):
    """Reads parts of a case for a model.

    Attributes:
        model: the model, which is right.
    """

    model: BehaviorModel

    # names and words

    def name(self, node: YamlNode | None) -> str | None:
        """The name of a case or of an injection."""
        if node is None or node.text is None or node.plain is None:
            return None
        if CASE_NAME.fullmatch(node.text):
            return node.text
        fixed = re.sub(r"[^A-Za-z0-9_.-]+", "_", node.text).strip("_")
        remedy = "names are letters from a to z, digits, `_`, `-` and `.`, and begin with a letter"
        remedy = f"write `{fixed}`" if CASE_NAME.fullmatch(fixed) else remedy
        message = f"`{node.text}` is not a name" if node.text else "a name is missing"
        self.add(Slug.BAD_NAME, message, node.place, remedy)
        return None

    def word(self, node: YamlNode | None, words: Iterable[str], what: str) -> str | None:
        """One of some words; `what` they are called."""
        if node is None or node.text is None or node.plain is None:
            return None
        known = list(words)
        if node.text in known:
            return node.text
        remedy = suggestion(node.text, known, "the words are")
        self.add(Slug.UNKNOWN_WORD, f"`{node.text}` is not {what}", node.place, remedy)
        return None

    def operation(self, node: YamlNode) -> str | None:
        """The name of an operation."""
        if node.text is None or node.plain is None:
            return None
        known = [operation.name for operation in self.model.operations]
        if node.text in known:
            return node.text
        remedy = suggestion(node.text, known, "the operations are")
        self.add(Slug.UNKNOWN_OPERATION, f"there is no operation `{node.text}`", node.place, remedy)
        return None

    def resource(self, node: YamlNode | None) -> Resource | None:
        """A resource by its name."""
        if node is None or node.text is None or node.plain is None:
            return None
        known = {resource.name: resource for resource in self.model.resources}
        if node.text not in known:
            remedy = suggestion(node.text, known, "the resources are")
            self.add(Slug.UNKNOWN_RESOURCE, f"there is no resource `{node.text}`", node.place, remedy)
        return known.get(node.text)

    # numbers

    def time(self, node: YamlNode | None) -> int | None:
        """A duration of a run, in nanoseconds."""
        text = (node.text or "").strip() if node is not None else ""
        if node is None or not text.startswith("-") or parse_duration(text[1:]) is None:
            return self.duration(node)
        remedy = f"write `{text[1:].strip()}`" if parse_duration(text[1:]) else "write `0 s`"
        self.add(Slug.NEGATIVE_TIME, f"`{text}` is negative, and no time is", node.place, remedy)
        return None

    def count(self, node: YamlNode | None, least: int | None = 1, most: int | None = None) -> int | None:
        """A whole number within bounds."""
        if node is None or node.text is None or node.plain is None:
            return None
        number = node.plain
        if not isinstance(number, int) or isinstance(number, bool):
            quoted = isinstance(number, str) and node.scalar is not None and node.scalar.style and number.isdecimal()
            remedy = "leave out the quotes" if quoted else "write a whole number, such as `3`"
            self.add(Slug.BAD_NUMBER, f"`{node.text}` is not a whole number", node.place, remedy)
        elif least is not None and number < least:
            message = f"`{node.text}` is too small: the least is {least}"
            self.add(Slug.BAD_NUMBER, message, node.place, f"write a number from {least} on")
        elif most is not None and number > most:
            message = f"`{node.text}` is too large: the most is {most}"
            self.add(Slug.BAD_NUMBER, message, node.place)
        else:
            return number
        return None

    def share(self, node: YamlNode | None) -> Fraction | None:
        """A share from 0 to 1."""
        if node is None or node.text is None or node.plain is None:
            return None
        share = parse_share(node.text)
        if share is None:
            message = f"`{node.text}` is not a share from 0 % to 100 %"
            self.add(Slug.NOT_A_SHARE, message, node.place, "write for example `2 %` or `0.02`")
        return share

    # values

    def assignments(self, node: YamlNode | None) -> Iterator[tuple[Variable, Value, YamlNode]]:
        """The variables of a mapping with their values; of those that are wrong, the errors."""
        for name, written in node.items.items() if node is not None else ():
            assert node is not None  # noqa: S101 - its items are gone through
            variable = self.scope.variables.get(name)
            if variable is None:
                self.refuse_unknown(name, node.key_places[name])
                continue
            value = self.value(written, variable.domain, name, variable.domain)
            if value is not None:
                yield variable, value, written

    def world(self, node: YamlNode | None) -> dict[str, Value]:
        """The values of a mapping whose variables belong to the world."""
        values: dict[str, Value] = {}
        for variable, value, _ in self.assignments(node):
            if variable.role.is_runner and node is not None:
                message = f"`{variable.name}` belongs to the runner; initial states speak of the world"
                self.add(Slug.RUNNER_VARIABLE, message, node.key_places[variable.name])
            else:
                values[variable.name] = value
        return values

    def measured(self, node: YamlNode | None, measures: Iterable[str], who: str) -> Changes:
        """The values of a mapping whose variables are measured; `who` does not measure others."""
        known = list(measures)
        values = []
        for variable, value, _ in self.assignments(node):
            if variable.name not in known and node is not None:
                message = f"{who} `{variable.name}`"
                near = nearest(variable.name, known)
                remedy = f"did you mean `{near}`?" if near else _measured_remedy(known)
                self.add(Slug.UNKNOWN_VARIABLE, message, node.key_places[variable.name], remedy)
            else:
                values.append((variable.name, value))
        return tuple(values)

    def assigned(self, node: YamlNode | None) -> Changes:
        """The values of a mapping whose variables an automatic transition may assign."""
        values: dict[str, tuple[str, Value]] = {}
        for variable, value, written in self.assignments(node):
            assert node is not None  # noqa: S101 - it has items
            place = node.key_places[variable.name]
            target = self.alias(variable.name)
            if not variable.assignable:
                message = f"`{variable.name}` is kept by the runner, and a case cannot assign it"
                self.add(Slug.NOT_ASSIGNABLE, message, place)
            elif variable.role.is_runner and value not in variable.assignable:
                allowed = " or ".join(f"`{format_value(allowed)}`" for allowed in variable.assignable)
                message = f"a case may assign only {allowed} to `{variable.name}`"
                self.add(Slug.NOT_ASSIGNABLE, message, written.place)
            elif target in values:
                message = f"`{variable.name}` is assigned twice; what an injection sets is set at once"
                self.add(Slug.ASSIGNED_TWICE, message, place, f"the other is `{values[target][0]}`")
            else:
                values[target] = (variable.name, value)
        return tuple(values.values())


def _measured_remedy(known: list[str]) -> str:
    return f"it measures: {', '.join(known)}" if known else "leave it out, or add `measures:` to the resource"
