"""From what is said of a service to how requests become calls of it, and responses replies."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.files.language.spelling import nearest, suggestion
from scbm.model import Slug
from scbm.model.bindings import FieldType, ServiceCall
from scbm.model.predicates import Reference
from scbm.model.values import ValueKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.files.codec.bindings.reading_builder import ReadingBuilder
    from scbm.files.codec.bindings.ros_names import RosNames
    from scbm.files.codec.common_parts import Parts
    from scbm.files.yaml.document import YamlNode
    from scbm.model import Place
    from scbm.model.bindings import Reading, Scalar, ServiceType
    from scbm.model.resources import Resource
    from scbm.model.values import Domain


@dataclass(frozen=True, slots=True)
class _ServiceFields:
    """The fields of a request or of a response, and what these are called."""

    words: str
    types: Mapping[str, FieldType]


class ServiceBuilder:
    """Reads services of one resource after the other."""

    def __init__(self, parts: Parts, names: RosNames, readings: ReadingBuilder) -> None:
        self._parts = parts
        self._names = names
        self._readings = readings

    def call(self, resource: Resource, node: YamlNode | None) -> ServiceCall | None:
        """One service; only good if the report is empty afterwards."""
        if node is None or not isinstance(node.plain, dict):
            return None
        name, type_node = self._names.name(node.get("name")), node.get("type")
        kind = self._names.service_type(type_node)
        if kind is None or type_node is None:
            return None
        if name is not None:
            self._names.note_service(name, kind, type_node.place)
        return ServiceCall(
            name or "",
            kind,
            tuple(self._request(resource, kind, node.get("request"), type_node.place)),
            tuple(self._succeeded(kind, node, type_node.place)),
            tuple(self._measured(resource, kind, node.get("measured"))),
        )

    def is_carried(self, name: str, resource: Resource, place: Place) -> bool:
        """Whether requests to the resource carry a variable; complains if not."""
        if name in resource.request:
            return True
        remedy = suggestion(name, resource.request, "they carry") or f"add `request: [{name}]` to the resource"
        message = f"requests to `{resource.name}` do not carry `{name}`"
        self._parts.add(Slug.UNKNOWN_VARIABLE, message, place, remedy)
        return False

    # what a call says

    def _request(
        self, resource: Resource, kind: ServiceType, node: YamlNode | None, place: Place
    ) -> Iterator[tuple[str, Scalar | Reference]]:
        if node is not None and (not isinstance(node.plain, dict) or node.incomplete):
            return
        items = node.items if node is not None else {}
        fields = _ServiceFields(f"a request of `{kind.name}`", dict(kind.request))
        unknown = [name for name in items if node and not self._is_field(name, fields, node.key_places[name])]
        for name, type_ in fields.types.items():
            argument = self._argument(items[name], type_, resource) if name in items else None
            if argument is not None:
                yield name, argument
            elif name not in items and all(nearest(other, fields.types) != name for other in unknown):
                message = f"the field `{name}` of {fields.words} gets no value"
                at, remedy = (place, f"request: {{{name}: …}}") if node is None else (node.place, f"{name}: …")
                self._parts.add(Slug.MISSING_FIELD, message, at, f"add `{remedy}`")

    def _argument(self, node: YamlNode, kind: FieldType, resource: Resource) -> Scalar | Reference | None:
        """A value, or a variable: a text that is the name of one is that variable."""
        name = node.text or ""
        if name not in self._parts.scope.variables and name not in resource.request:
            return self._literal(node, kind, resource.request)
        variable = self._parts.scope.variables.get(name)
        if not self.is_carried(name, resource, node.place) or variable is None:
            return None
        if not _fits(variable.domain, kind):
            message = f"`{name}` has values that a field of type {kind} cannot have"
            self._parts.add(Slug.WRONG_TYPE, message, node.place, f"its domain is {variable.domain}")
        return Reference(name)

    def _literal(self, node: YamlNode, kind: FieldType, variables: tuple[str, ...] = ()) -> Scalar | None:
        written = node.plain
        if node.text is None or not isinstance(written, (bool, int, float, str)):
            return None
        if kind.holds(written):
            return float(written) if kind.is_float else written
        near = nearest(node.text, variables) if isinstance(written, str) else None
        remedy = f"did you mean `{near}`?" if near else _literal_remedy(node, kind)
        message = f"`{node.text}` is not a value of a field of type {kind}"
        self._parts.add(Slug.WRONG_TYPE, message, node.place, remedy)
        return None

    # what a response says

    def _succeeded(self, kind: ServiceType, node: YamlNode, place: Place) -> Iterator[tuple[str, Scalar]]:
        written = node.get("succeeded")
        if written is None:
            if ("success", FieldType.BOOL) in kind.response:
                yield "success", True
            elif nearest("succeeded", node.items) is None:
                message = f"`succeeded` is missing: a response of `{kind.name}` has no `success` of type bool"
                remedy = "add `succeeded: {<field>: <value>}`, or `succeeded: {}` if every response says so"
                self._parts.add(Slug.MISSING_KEY, message, place, remedy)
            return
        fields = _ServiceFields(f"a response of `{kind.name}`", dict(kind.response))
        for name, value in written.items.items():
            if not self._is_field(name, fields, written.key_places[name]):
                continue
            if fields.types[name].is_float:
                message = f"`{name}` is of type {fields.types[name]}; such numbers are seldom equal to a given one"
                self._parts.add(Slug.WRONG_TYPE, message, written.key_places[name], "look at another field")
                continue
            literal = self._literal(value, fields.types[name])
            if literal is not None:
                yield name, literal

    def _measured(self, resource: Resource, kind: ServiceType, node: YamlNode | None) -> Iterator[tuple[str, Reading]]:
        fields = _ServiceFields(f"a response of `{kind.name}`", dict(kind.response))
        for name, written in node.items.items() if node is not None else ():
            assert node is not None  # noqa: S101 - its items are gone through
            field = written.get("field") if isinstance(written.plain, dict) else written
            if field is None or field.text is None or field.plain is None:
                continue
            if self._is_field(field.text, fields, field.place):
                type_ = fields.types[field.text]
                yield field.text, self._readings.reading(name, resource, type_, written, node.key_places[name])

    def _is_field(self, name: str, fields: _ServiceFields, place: Place) -> bool:
        if name in fields.types:
            return True
        remedy = suggestion(name, fields.types, "its fields are") or "it has no fields"
        self._parts.add(Slug.UNKNOWN_FIELD, f"{fields.words} has no field `{name}`", place, remedy)
        return False


def _fits(domain: Domain, kind: FieldType) -> bool:
    """Whether a field can have all values of a domain."""
    if domain.kind is ValueKind.INTEGER:
        return kind.is_number and kind.holds(domain.values[0]) and kind.holds(domain.values[-1])
    return kind.kind is domain.kind


def _literal_remedy(node: YamlNode, kind: FieldType) -> str:
    if kind is FieldType.STRING:
        return "it has a NUL, where it would end" if isinstance(node.plain, str) else f"write `'{node.text}'`"
    if kind is FieldType.BOOL:
        return "write `true` or `false`"
    if kind.is_float:
        if isinstance(node.plain, bool) or not isinstance(node.plain, (int, float)):
            return "write a number"
        return f"it is too {'small' if abs(node.plain) < 1 else 'large'} for the type"
    return f"write a whole number from {kind.integers[0]} to {kind.integers[-1]}"
