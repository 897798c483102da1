"""Reads fields of messages in files: paths to them, and the values that are written for them."""

from __future__ import annotations

from math import isfinite
from typing import TYPE_CHECKING, Any

from scbm.files.codec.key_types import NAME_NODE, VALUE, NamesType, ScalarType, scalar_node
from scbm.files.codec.keys import Key, Keys, KeyType
from scbm.files.expansion.expanded_nodes import text_node
from scbm.files.spelling import nearest, suggestion
from scbm.model import Place, Slug
from scbm.model.predicates import Reference
from scbm.model.values import ValueKind, format_value
from scbm.nodes.bindings.ros_binding import MappedVariable
from scbm.nodes.types.definitions import ListShape, MessageDefinition, Primitive
from scbm.nodes.types.field_paths import FieldPath, read_path

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.files.codec.keys import Data, Definitions, ShapeCheck, Spot
    from scbm.files.codec.value_reader import Entry, ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model.resources import Resource
    from scbm.model.values import Domain, Value
    from scbm.model.variables import Variable
    from scbm.nodes.bindings.ros_binding import Content, RequestFields
    from scbm.nodes.types.definitions import FieldShape, Scalar

SCALAR_OF_MESSAGE: dict[str, Any] = {"type": ["boolean", "number", "string"]}
"""The JSON Schema of the value of a field."""

CONTENT = ScalarType("value", "a value", SCALAR_OF_MESSAGE, scalar_node)
"""The value of a field, which is read by the type of the field."""

_MAX_SHOWN = 8
"""The maximum number of values that one message lists."""


class ContentKeys(Keys):
    """A text that is the name of a variable, too, or what a field gets for each value of a variable."""

    text = Key(VALUE, "This text, though it is the name of a variable.")
    variable = Key(NAME_NODE, "The variable that the request carries.")
    values = Key(
        NamesType(CONTENT, "value → content of the field"), "What the field gets for each value of the variable."
    )


class ContentType(KeyType["YamlNode | None"], frozen=True):
    """What a field of a request gets."""

    words = "value, variable, list, `{text: …}` or `{variable: …, values: …}`"

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Check a mapping, and the elements of a list."""
        if isinstance(spot.node.plain, dict):
            ContentKeys.check(spot, check)
        elif isinstance(spot.node.plain, list):
            for element in spot.elements():
                self.check(element, check)
        elif not spot.is_scalar:
            check.wrong_shape(spot, "a value, a variable that the request carries, a list or a mapping")

    def read(self, node: YamlNode, reader: ValueReader) -> YamlNode:  # noqa: ARG002 - what it means depends on the field
        """Return the node."""
        return node

    def write(self, value: object) -> Data:
        """Return the data as it is: bindings keep what was written."""
        return value

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema."""
        return {"anyOf": [SCALAR_OF_MESSAGE, {"type": "array"}, definitions.reference(ContentKeys)]}

    def mappings(self) -> tuple[type[Keys], ...]:
        """Return the mapping."""
        return (ContentKeys,)


class FieldReader:
    """Reads the fields of one message; every error is noted."""

    def __init__(self, reader: ValueReader, definition: MessageDefinition, words: str) -> None:
        """Made once for each message; errors call it `words`: `a response of …`."""
        self._reader = reader
        self._definition = definition
        self._words = words

    def path(self, text: str, place: Place) -> FieldPath | None:
        """Return the path to a field; `None` if the message has no such field."""
        found = read_path(self._definition, text, self._words)
        if isinstance(found, FieldPath):
            return found
        at = place
        if place.length == len(text) and "." in text:
            at = Place(place.file, place.line, place.column + found.begin, found.end - found.begin, place.user)
        self._reader.add(Slug.UNKNOWN_FIELD, found.message, at, found.remedy)
        return None

    def leaf(self, text: str, place: Place) -> FieldPath | None:
        """Return the path to a field that is a number, a truth value or a text; an error if it is not."""
        found = self.path(text, place)
        if found is None or isinstance(found.shape, Primitive):
            return found
        remedy = "name an element, such as `[0]`" if isinstance(found.shape, ListShape) else "name a field of it"
        message = f"`{text}` is {found.shape}, and not one value"
        self._reader.add(Slug.UNKNOWN_FIELD, message, place, remedy)
        return None

    def value(self, node: YamlNode, path: FieldPath, shape: FieldShape, known: tuple[str, ...] = ()) -> Scalar | None:
        """Return what a scalar means for a field; a text for a number is a constant. `known` are names for remedies."""
        written, text = node.plain, node.text
        if text is None or not isinstance(written, (bool, int, float, str)) or not isinstance(shape, Primitive):
            return None
        constants = dict(path.owner.constants) if shape.name != "string" else {}
        value: Scalar = constants.get(text, written) if isinstance(written, str) else written
        remedy = shape.fault(value)
        if isinstance(value, float) and not isfinite(value):
            remedy = "it is too large for the type"
        if remedy is None:
            return float(value) if shape.is_float else value
        near = nearest(text, (*known, *constants)) if isinstance(written, str) else None
        if shape.name == "string" and not isinstance(written, str):
            remedy = f"write `'{text}'`"
        message = f"`{text}` is not a value of a field of type {shape}"
        self._reader.add(Slug.WRONG_TYPE, message, node.place, f"did you mean `{near}`?" if near else remedy)
        return None

    # requests

    def request(
        self,
        entries: tuple[Entry[YamlNode | None], ...] | None,
        node: YamlNode | None,
        resource: Resource,
        place: Place,
    ) -> RequestFields:
        """Return the fields of a request with their contents; note numbers and texts of it that get none.

        Args:
            entries: the fields as they are written.
            node: the mapping of these; `None` if there is none.
            resource: the resource whose requests these are.
            place: where the type of the request is named.
        """
        fields, used = [], list[FieldPath]()
        for entry in entries or ():
            path = self.path(entry.name, entry.place)
            if path is not None:
                self._refuse_order(path, used, entry.place)
                used.append(path)
                content = self._content(entry.node, path, path.shape, resource)
                fields += [] if content is None else [(path, content)]
        if node is None or (isinstance(node.plain, dict) and not node.incomplete):
            written = [entry.name for entry in entries or ()]
            self._refuse_missing(written, node.place if node is not None else place, is_new=node is None)
        return tuple(fields)

    def _refuse_missing(self, written: list[str], place: Place, *, is_new: bool) -> None:
        """Note the numbers, truth values and texts of the request itself that get no value."""
        names = dict(self._definition.fields)
        unknown = [name for name in written if name not in names]
        for name, shape in names.items():
            is_missing = isinstance(shape, Primitive) and name not in written
            if is_missing and all(nearest(other, names) != name for other in unknown):
                message = f"the field `{name}` of {self._words} gets no value"
                remedy = f"request: {{{name}: …}}" if is_new else f"{name}: …"
                self._reader.add(Slug.MISSING_FIELD, message, place, f"add `{remedy}`")

    def _refuse_order(self, path: FieldPath, used: list[FieldPath], place: Place) -> None:
        """Note a list that is given twice, and an element that is not the next one of its list."""
        for earlier in used:
            shorter, longer = sorted((earlier.text, path.text), key=len)
            if longer.startswith((f"{shorter}[", f"{shorter}.")):
                self._reader.add(Slug.UNKNOWN_FIELD, f"`{path}` has a value by `{earlier}` already", place)
                return
        for number, step in enumerate(path.steps):
            if step.element is None or step.length:
                continue
            before = path.steps[:number]
            same = [other.steps[number].element for other in used if other.steps[:number] == before
                    and len(other.steps) > number and other.steps[number].field == step.field]  # fmt: skip
            following = 1 + max((each for each in same if isinstance(each, int)), default=-1)
            if not isinstance(step.element, int):
                message = f"`{path}`: a list of a request has no names yet"
            elif step.element > following:
                message = f"`{path}`: the next element of this list is {following}"
            else:
                continue
            self._reader.add(Slug.UNKNOWN_FIELD, message, place, "write the elements in order, from `[0]` on")
            return

    def _content(self, node: YamlNode, path: FieldPath, shape: FieldShape, resource: Resource) -> Content | None:
        """Return what a field gets; `None` after an error."""
        if isinstance(shape, MessageDefinition):
            message, remedy = f"`{path}` is {shape}, a message", f"give values to its fields: `{path}.{_first(shape)}`"
            self._reader.add(Slug.UNKNOWN_FIELD, message, node.place, remedy)
            return None
        if isinstance(shape, ListShape):
            return self._list(node, path, shape, resource)
        if isinstance(node.plain, dict):
            return self._mapped(ContentKeys(node, self._reader), path, shape, resource)
        if isinstance(node.plain, list):
            self._reader.add(Slug.WRONG_TYPE, f"`{path}` is {shape}, and this is a list", node.place)
            return None
        return self._argument(node, path, shape, resource)

    def _list(self, node: YamlNode, path: FieldPath, shape: ListShape, resource: Resource) -> Content | None:
        if not isinstance(node.plain, list):
            self._reader.add(Slug.WRONG_TYPE, f"`{path}` is the list {shape}", node.place, "write a list: `[…]`")
            return None
        count = len(node.elements)
        if count != shape.size if shape.is_array else 0 < shape.size < count:
            self._reader.add(Slug.WRONG_TYPE, f"`{path}` is {shape}, and this list has {count}", node.place)
        found = [self._content(element, path, shape.element, resource) for element in node.elements]
        return tuple(each for each in found if each is not None)

    def _argument(self, node: YamlNode, path: FieldPath, shape: Primitive, resource: Resource) -> Content | None:
        """Return a value, or a variable: a text that is the name of one is that variable."""
        name = node.text or ""
        variables = self._reader.scope.variables
        if name not in variables and name not in resource.request:
            return self.value(node, path, shape, resource.request)
        variable = variables.get(name)
        if not is_carried(self._reader, name, resource, node.place) or variable is None:
            return None
        if not _fits(variable.domain, shape):
            message = f"`{name}` has values that a field of type {shape} cannot have"
            remedy = f"its domain is {variable.domain}; `{{variable: {name}, values: {{…}}}}` says what each means"
            self._reader.add(Slug.WRONG_TYPE, message, node.place, remedy)
        return Reference(name)

    def _mapped(self, keys: ContentKeys, path: FieldPath, shape: Primitive, resource: Resource) -> Content | None:
        ways = [("text", keys.has("text")), ("variable", keys.has("variable"))]
        if sum(is_there for _, is_there in ways) != 1 or keys.has("variable") != keys.has("values"):
            remedy = "write `{text: …}`, or `{variable: …, values: {…}}`"
            self._reader.add(Slug.BAD_BINDING, "a field gets one of these", keys.node.place, remedy)
            return None
        if keys.has("text"):
            return None if keys.text is None else self.value(keys.text, path, shape)
        named = keys.variable
        if named is None or named.text is None:
            return None
        carried = is_carried(self._reader, named.text, resource, named.place)
        variable = self._reader.scope.variables.get(named.text) if carried else None
        values: list[tuple[Value, Scalar]] = []
        for entry in keys.values or ():
            value = read_variable_value(self._reader, entry.name, variable, entry.place)
            content = None if entry.value is None else self.value(entry.value, path, shape)
            values += [] if value is None or content is None else [(value, content)]
        section = keys.node.items["values"]
        if variable is not None and isinstance(section.plain, dict) and not section.incomplete:
            self._refuse_partial(variable, section)
        return MappedVariable(named.text, tuple(values))

    def _refuse_partial(self, variable: Variable, section: YamlNode) -> None:
        """Note values of a variable for which a field would get nothing."""
        missing = [text for text in map(format_value, variable.domain.values) if text not in section.items]
        if missing:
            message = f"`values` says nothing for {listed_values(missing)} of `{variable.name}`"
            self._reader.add(Slug.UNBOUND_REQUEST, message, section.place, f"add `{missing[0]}: …`")

    # responses

    def succeeded(self, entries: tuple[Entry[YamlNode | None], ...]) -> Iterator[tuple[FieldPath, Scalar]]:
        """Yield the fields that tell success, with the values that do."""
        for entry in entries:
            path = self.leaf(entry.name, entry.place)
            if path is None:
                continue
            if isinstance(path.shape, Primitive) and path.shape.is_float:
                message = f"`{path}` is of type {path.shape}; such numbers cannot be compared for equality"
                self._reader.add(Slug.WRONG_TYPE, message, entry.place, "compare another field")
                continue
            value = self.value(entry.node, path, path.shape)
            if value is not None:
                yield path, value


def listed_values(values: Sequence[str]) -> str:
    """Return the first values, in words."""
    return ", ".join(f"`{text}`" for text in values[:_MAX_SHOWN]) + (", …" if values[_MAX_SHOWN:] else "")


def _first(definition: MessageDefinition) -> str:
    return next((name for name, _ in definition.fields), "…")


def key_node(entry: Entry[Any], shape: FieldShape) -> YamlNode:
    """Return the name of an entry as a scalar: a text for a field with texts, else perhaps a number."""
    node = text_node(entry.name, entry.place, entry.node.end)
    if shape == Primitive("string") or node.plain is None:
        node.plain = entry.name
    return node


def is_carried(reader: ValueReader, name: str, resource: Resource, place: Place) -> bool:
    """Return whether requests to the resource carry a variable; note an error if not."""
    if name in resource.request:
        return True
    remedy = suggestion(name, resource.request, "they carry") or f"add `request: [{name}]` to the resource"
    message = f"requests to `{resource.name}` do not carry `{name}`"
    reader.add(Slug.UNKNOWN_VARIABLE, message, place, remedy)
    return False


def read_variable_value(reader: ValueReader, text: str, variable: Variable | None, place: Place) -> Value | None:
    """Return the value of a variable that a key names."""
    if variable is None:
        return None
    values = {format_value(value): value for value in variable.domain.values}
    if text not in values:
        remedy = suggestion(text, values, "its values are") if variable.domain.kind is ValueKind.SYMBOL else None
        message = f"`{text}` is not a value of `{variable.name}`"
        reader.add(Slug.VALUE_OUTSIDE_DOMAIN, message, place, remedy or f"its domain is {variable.domain}")
    return values.get(text)


def kind_of_values(shape: Primitive) -> ValueKind | None:
    """Return the kind of variable whose values a field holds unchanged; `None` for numbers with fractions."""
    if shape.is_float:
        return None
    return {"bool": ValueKind.BOOLEAN, "string": ValueKind.SYMBOL}.get(shape.name, ValueKind.INTEGER)


def _fits(domain: Domain, shape: Primitive) -> bool:
    """Return whether a field can have all values of a domain."""
    if domain.kind is ValueKind.INTEGER:
        return shape.is_number and not any(map(shape.fault, (domain.values[0], domain.values[-1])))
    return kind_of_values(shape) is domain.kind and not any(map(shape.fault, domain.values))
