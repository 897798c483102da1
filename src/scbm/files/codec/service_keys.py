"""The keys of a service: how requests become calls of it, and its responses replies."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.files.codec.key_types import NamesType, ScalarType, scalar_node
from scbm.files.codec.keys import Key, Keys
from scbm.files.codec.reading_keys import FIELD_READING, SCALAR_OF_MESSAGE, ResponseField, literal_data
from scbm.files.codec.ros_names import ROS_NAME, SERVICE_TYPE, SharedNames
from scbm.files.spelling import nearest, suggestion
from scbm.model import Slug
from scbm.model.bindings import FieldType, ServiceCall
from scbm.model.predicates import Reference
from scbm.model.values import ValueKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model import Place
    from scbm.model.bindings import Reading, Scalar, ServiceType
    from scbm.model.resources import Resource
    from scbm.model.values import Domain


class _ServiceFields(Struct, frozen=True):
    """The fields of a request or of a response, and what messages call these."""

    words: str
    types: Mapping[str, FieldType]


def _argument_data(argument: Scalar | Reference) -> Scalar:
    return argument.name if isinstance(argument, Reference) else literal_data(argument)


_ARGUMENT = ScalarType(
    "value or variable",
    "a value, or a variable that the request carries",
    SCALAR_OF_MESSAGE,
    scalar_node,
    _argument_data,
)
_FIELD_VALUE = ScalarType("value", "a value", SCALAR_OF_MESSAGE, scalar_node, literal_data)
_SUCCESS = ("success", FieldType.BOOL)


def _declared_success(call: ServiceCall) -> object:
    """Return the fields of a successful response; `None` for the default."""
    is_default = call.succeeded == (("success", True),) and _SUCCESS in call.type.response
    return None if is_default else call.succeeded


class ServiceKeys(Keys):
    """A service, and how requests become calls of it."""

    name = Key(ROS_NAME, "The name of the service, from the root: `/scanner/scan`.", required=True)
    type = Key(
        SERVICE_TYPE,
        "The type of the service. A type other than these two is described by its `name`, `request` and `response`.",
        required=True,
    )
    request = Key(
        NamesType(_ARGUMENT, "field → value or variable"),
        "What each field of a request gets: a value, or a variable that the request carries.",
    )
    succeeded = Key(
        NamesType(_FIELD_VALUE, "field → value"),
        "The field values of a response that reports success; `{}` if every response does. Required if "
        "responses have no field `success` of type `bool`.",
        absent="`{success: true}`",
        source=_declared_success,
        always_written=True,
    )
    measured = Key(
        NamesType(FIELD_READING, "variable → field or reading"),
        "For variables under `measures`: the field of the response that measures each.",
        source=lambda call: {reading.variable: ResponseField(field, reading) for field, reading in call.measured},
    )

    def call(self, resource: Resource, shared: SharedNames) -> ServiceCall | None:
        """Return the service for requests to a resource; valid only if no error is noted."""
        if not isinstance(self.node.plain, dict):
            return None
        name = self.name
        kind = self.type.service_type(shared) if self.type is not None else None
        if kind is None:
            return None
        place = self.node.items["type"].place
        if name is not None:
            shared.note_service(name, kind, place)
        return ServiceCall(
            name or "",
            kind,
            tuple(self._request(resource, kind, place)),
            tuple(self._succeeded(kind, place)),
            tuple(self._measured(resource, kind)),
        )

    # what a call says

    def _request(self, resource: Resource, kind: ServiceType, place: Place) -> Iterator[tuple[str, Scalar | Reference]]:
        node = self.node.get("request")
        if node is not None and (not isinstance(node.plain, dict) or node.incomplete):
            return
        entries = {entry.name: entry for entry in self.request or ()}
        fields = _ServiceFields(f"a request of `{kind.name}`", dict(kind.request))
        unknown = [name for name, entry in entries.items() if not self._is_field(name, fields, entry.place)]
        for name, type_ in fields.types.items():
            argument = self._argument(entries[name].node, type_, resource) if name in entries else None
            if argument is not None:
                yield name, argument
            elif name not in entries and all(nearest(other, fields.types) != name for other in unknown):
                message = f"the field `{name}` of {fields.words} gets no value"
                at, remedy = (place, f"request: {{{name}: …}}") if node is None else (node.place, f"{name}: …")
                self.reader.add(Slug.MISSING_FIELD, message, at, f"add `{remedy}`")

    def _argument(self, node: YamlNode, kind: FieldType, resource: Resource) -> Scalar | Reference | None:
        """Return a value, or a variable: a text that is the name of one is that variable."""
        name = node.text or ""
        variables = self.reader.scope.variables
        if name not in variables and name not in resource.request:
            return self._literal(node, kind, resource.request)
        variable = variables.get(name)
        if not is_carried(self.reader, name, resource, node.place) or variable is None:
            return None
        if not _fits(variable.domain, kind):
            message = f"`{name}` has values that a field of type {kind} cannot have"
            self.reader.add(Slug.WRONG_TYPE, message, node.place, f"its domain is {variable.domain}")
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
        self.reader.add(Slug.WRONG_TYPE, message, node.place, remedy)
        return None

    # what a response says

    def _succeeded(self, kind: ServiceType, place: Place) -> Iterator[tuple[str, Scalar]]:
        if not self.has("succeeded"):
            if _SUCCESS in kind.response:
                yield "success", True
            elif nearest("succeeded", self.node.items) is None:
                message = f"`succeeded` is missing: a response of `{kind.name}` has no `success` of type bool"
                remedy = "add `succeeded: {<field>: <value>}`, or `succeeded: {}` if every response says so"
                self.reader.add(Slug.MISSING_KEY, message, place, remedy)
            return
        fields = _ServiceFields(f"a response of `{kind.name}`", dict(kind.response))
        for entry in self.succeeded or ():
            if not self._is_field(entry.name, fields, entry.place):
                continue
            type_ = fields.types[entry.name]
            if type_.is_float:
                message = f"`{entry.name}` is of type {type_}; such numbers cannot be compared for equality"
                self.reader.add(Slug.WRONG_TYPE, message, entry.place, "compare another field")
                continue
            literal = self._literal(entry.node, type_)
            if literal is not None:
                yield entry.name, literal

    def _measured(self, resource: Resource, kind: ServiceType) -> Iterator[tuple[str, Reading]]:
        fields = _ServiceFields(f"a response of `{kind.name}`", dict(kind.response))
        for entry in self.measured or ():
            field = entry.value.field_node
            if field is not None and field.text is not None and self._is_field(field.text, fields, field.place):
                reading = entry.value.reading(entry.name, resource, fields.types[field.text], entry.place)
                yield field.text, reading

    def _is_field(self, name: str, fields: _ServiceFields, place: Place) -> bool:
        if name in fields.types:
            return True
        remedy = suggestion(name, fields.types, "its fields are") or "it has no fields"
        self.reader.add(Slug.UNKNOWN_FIELD, f"{fields.words} has no field `{name}`", place, remedy)
        return False


def is_carried(reader: ValueReader, name: str, resource: Resource, place: Place) -> bool:
    """Return whether requests to the resource carry a variable; note an error if not."""
    if name in resource.request:
        return True
    remedy = suggestion(name, resource.request, "they carry") or f"add `request: [{name}]` to the resource"
    message = f"requests to `{resource.name}` do not carry `{name}`"
    reader.add(Slug.UNKNOWN_VARIABLE, message, place, remedy)
    return False


def _fits(domain: Domain, kind: FieldType) -> bool:
    """Return whether a field can have all values of a domain."""
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
