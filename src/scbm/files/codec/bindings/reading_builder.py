"""From what is said of measured data to readings: which variable, and which data means which of its values."""

from __future__ import annotations

import re
from math import isfinite
from typing import TYPE_CHECKING

from scbm.files.language.spelling import suggestion
from scbm.model import Place, Slug
from scbm.model.bindings import FieldType, Interval, Reading
from scbm.model.values import ValueKind, format_value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.codec.common_parts import Parts
    from scbm.files.yaml.document import YamlNode
    from scbm.model.resources import Resource
    from scbm.model.values import Value
    from scbm.model.variables import Variable

_END = r"[-+]?\d{1,30}(?:\.\d{1,30})?(?:e[-+]?\d{1,3})?"
_RANGE = re.compile(rf"({_END})?\s*\.\.\s*({_END})?", re.ASCII | re.IGNORECASE)
_WHOLE = re.compile(r"[-+]?\d+", re.ASCII)


class ReadingBuilder:
    """Reads how data is read."""

    def __init__(self, parts: Parts) -> None:
        self._parts = parts

    def reading(self, name: str, resource: Resource, kind: FieldType, node: YamlNode, place: Place) -> Reading:
        """How data of a type becomes a value of a variable; only good if the report is empty afterwards.

        Args:
            name: of the variable.
            resource: what measures it.
            kind: the type of the data.
            node: what is said of it: `ranges`, `values`, or nothing.
            place: the key with the name.
        """
        variable = self._variable(name, resource, place)
        ranges, texts = node.get("ranges"), node.get("values")
        if ranges is None and texts is None and variable is not None:
            self._refuse_unlike(variable, kind, place)
        if ranges is not None and not kind.is_number:
            self._refuse_words("`ranges` are for numbers", kind, node.key_places["ranges"])
        if texts is not None and kind is not FieldType.STRING:
            self._refuse_words("`values` are for text", kind, node.key_places["values"])
        return Reading(name, tuple(self._ranges(variable, kind, ranges)), tuple(self._texts(variable, texts)))

    def value(self, text: str, variable: Variable | None, place: Place) -> Value | None:
        """The value of a variable that a key says."""
        if variable is None:
            return None
        values = {format_value(value): value for value in variable.domain.values}
        if text not in values:
            remedy = suggestion(text, values, "its values are") if variable.domain.kind is ValueKind.SYMBOL else None
            message = f"`{text}` is not a value of `{variable.name}`"
            remedy = remedy or f"its domain is {variable.domain}"
            self._parts.add(Slug.VALUE_OUTSIDE_DOMAIN, message, place, remedy)
        return values.get(text)

    def _variable(self, name: str, resource: Resource, place: Place) -> Variable | None:
        if name not in resource.measures:
            message = f"this resource does not measure `{name}`"
            remedy = suggestion(name, resource.measures, "it measures")
            remedy = remedy or f"add `measures: [{name}]` to the resource"
            self._parts.add(Slug.UNKNOWN_VARIABLE, message, place, remedy)
            return None
        return self._parts.scope.variables.get(name)

    def _refuse_unlike(self, variable: Variable, kind: FieldType, place: Place) -> None:
        """Complains of data that is no value of the variable by itself."""
        if kind.kind is variable.domain.kind:
            return
        message = f"`{variable.name}` has the domain {variable.domain}, and here comes {_words(kind)}"
        example = format_value(variable.domain.values[-1])
        if kind.is_number:
            remedy = f"say which numbers mean which value: `ranges: {{{example}: 5..}}`"
        elif kind is FieldType.STRING:
            remedy = f"say which text means which value: `values: {{<text>: {example}}}`"
        else:
            remedy = "measure a variable with the domain `bool`"
        self._parts.add(Slug.WRONG_TYPE, message, place, remedy)

    def _refuse_words(self, what: str, kind: FieldType, place: Place) -> None:
        self._parts.add(Slug.WRONG_TYPE, f"{what}, and here comes {_words(kind)}", place)

    # ranges

    def _ranges(
        self, variable: Variable | None, kind: FieldType, node: YamlNode | None
    ) -> Iterator[tuple[Value, Interval]]:
        self._refuse_none("ranges", node)
        before: list[tuple[str, Interval]] = []
        for text, written in node.items.items() if node is not None else ():
            assert node is not None  # noqa: S101 - its items are gone through
            value = self.value(text, variable, node.key_places[text])
            interval = self._interval(written, whole=not kind.is_float)
            if interval is None:
                continue
            other = next((other for other, earlier in before if earlier.overlaps(interval)), None)
            if other is not None:
                message = f"the ranges of `{other}` and `{text}` overlap"
                remedy = "the end of a range does not belong to it, so the next one may begin there"
                self._parts.add(Slug.BAD_RANGE, message, written.place, remedy)
            before.append((text, interval))
            if value is not None:
                yield value, interval

    def _interval(self, node: YamlNode, *, whole: bool) -> Interval | None:
        if node.text is None or node.plain is None:
            return None
        match = _RANGE.fullmatch(node.text)
        if match is None:
            remedy = "write `0.5..2`, `..0.5` or `2..`"
            self._parts.add(Slug.BAD_RANGE, f"`{node.text}` is not a range", node.place, remedy)
            return None
        ends = [end for end in match.groups() if end is not None]
        huge = next((end for end in ends if not isfinite(float(end))), None)
        if huge is not None:
            self._parts.add(Slug.BAD_RANGE, f"`{huge}` is larger than any number of a message", node.place)
            return None
        odd = next((end for end in ends if whole and not _WHOLE.fullmatch(end)), None)
        if odd is not None:
            message = f"`{odd}` is not a whole number, and those are measured here"
            self._parts.add(Slug.BAD_RANGE, message, node.place)
            return None
        low, high = (None if end is None else int(end) if whole else float(end) for end in match.groups())
        interval = Interval(low, high)
        if interval.is_empty:
            message = f"no number lies in {node.text}: it begins with {match[1]} and ends before {match[2]}"
            self._parts.add(Slug.BAD_RANGE, message, node.place)
            return None
        return interval

    # texts

    def _texts(self, variable: Variable | None, node: YamlNode | None) -> Iterator[tuple[str, Value]]:
        self._refuse_none("values", node)
        for text, written in node.items.items() if node is not None and variable is not None else ():
            assert variable is not None  # noqa: S101 - said above
            value = self._parts.value(written, variable.domain, variable.name, variable.domain.values)
            if value is not None:
                yield text, value

    def _refuse_none(self, key: str, node: YamlNode | None) -> None:
        if node is not None and node.plain == {} and not node.incomplete:
            self._parts.add(Slug.EMPTY_DOMAIN, f"`{key}` has no entries, so nothing would mean a value", node.place)


def _words(kind: FieldType) -> str:
    if kind.is_number:
        return f"a number ({kind})"
    return "text" if kind is FieldType.STRING else "a truth value"
