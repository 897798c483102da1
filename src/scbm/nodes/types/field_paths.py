"""Paths to fields of messages: `pose.position.x`, `ranges[0]`, `position[name=gripper_joint]`."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec import Struct

from scbm.files.spelling import suggestion
from scbm.model.visible_text import counted
from scbm.nodes.types.definitions import ListShape, MessageDefinition, Primitive

if TYPE_CHECKING:
    from scbm.nodes.types.cdr import FieldData, Message
    from scbm.nodes.types.definitions import FieldShape, Scalar

_STEP = re.compile(r"([A-Za-z]\w*)(?:\[(?:(\d+)|([A-Za-z]\w*)=([^\]]*))\])?", re.ASCII)
_DOT = re.compile(r"\.(?![^\[]*\])")
MAX_INDEX = 999_999
"""Maximum index of an element; no list of texts or messages is read that is as long."""


class NamedElement(NamedTuple):
    """The element of a list that stands where another list of the same message has a text."""

    names: str
    text: str


class FieldStep(NamedTuple):
    """A field, the element of its list that is meant, if one is, and the length of its list if that is an array."""

    field: str
    element: int | NamedElement | None = None
    length: int = 0


class MissingElement(Exception):  # noqa: N818 - a message that lacks it is no error of the program
    """A message has no element that a path names; the text says which, and why."""


class FieldPath(Struct, frozen=True):
    """A path to a field of a message.

    Attributes:
        text: as it is written.
        steps: the fields on the way.
        shape: the type of the field at its end.
        owner: the message that has this field, and the constants for it.
    """

    text: str
    steps: tuple[FieldStep, ...]
    shape: FieldShape
    owner: MessageDefinition

    def get(self, message: Message) -> FieldData:
        """Return the value of the field; a message of any bus has its fields as attributes. Raises `MissingElement`."""
        value = message
        for field, element, _ in self.steps:
            holder, value = value, getattr(value, field)
            if element is not None:
                value = _element(holder, field, value, element)
        return _plain(self.shape, value) if isinstance(self.shape, Primitive) else value

    def put(self, values: dict[str, Any], value: object) -> None:
        """Set the field in a message that is being made: mappings, and lists with `None` for zero."""
        for step in self.steps[:-1]:
            values = _entry(values, step, {})
        _entry(values, self.steps[-1], value)

    def __str__(self) -> str:
        return self.text


def _entry(values: dict[str, FieldData], step: FieldStep, value: FieldData) -> FieldData:
    """Set a field or an element, unless it is there; return it."""
    if step.element is None:
        return values.setdefault(step.field, value)
    assert isinstance(step.element, int)  # noqa: S101 - lists of requests have no names
    elements = values.setdefault(step.field, [None] * step.length)
    elements += [None] * (step.element + 1 - len(elements))
    if elements[step.element] is None:
        elements[step.element] = value
    return elements[step.element]


def _element(holder: Message, field: str, elements: FieldData, element: int | NamedElement) -> FieldData:
    index = element
    if isinstance(element, NamedElement):
        names = list(getattr(holder, element.names))
        if element.text not in names:
            raise MissingElement(f"{field}[{element.names}={element.text}]: `{element.names}` lacks this text")
        index = names.index(element.text)
    if not isinstance(index, int) or index >= len(elements):
        raise MissingElement(f"{field}[{index}]: the list has {counted(len(elements), 'element')}")
    return elements[index]


def _plain(shape: Primitive, value: FieldData) -> Scalar:
    if shape.name == "string":
        return str(value)
    if shape.name == "bool":
        return bool(value)
    if shape.is_float:
        return float(value)
    return int.from_bytes(value, "big") if isinstance(value, bytes) else int(value)


class PathFault(NamedTuple):
    """What is wrong with a path: where in its text, a sentence, and a remedy if one is known."""

    begin: int
    end: int
    message: str
    remedy: str | None = None


def read_path(definition: MessageDefinition, text: str, words: str) -> FieldPath | PathFault:
    """Return a path to a field of a message, or what is wrong with it.

    Args:
        definition: of the message.
        text: as it is written.
        words: what messages call it: `a response of …`.
    """
    shape: FieldShape = definition
    owner, steps, at = definition, list[FieldStep](), 0
    for part in _DOT.split(text):
        match = _STEP.fullmatch(part)
        begin, at = at, at + len(part) + 1
        if match is None:
            remedy = "write a path such as `pose.position.x`, `ranges[0]` or `position[name=elbow]`"
            return PathFault(begin, at - 1, f"`{text[:60]}` is no path to a field", remedy)
        if not isinstance(shape, MessageDefinition):
            which = "is a list; name an element, such as `[0]`" if isinstance(shape, ListShape) else f"is {shape}"
            return PathFault(begin, at - 1, f"`{text[: begin - 1]}` has no fields: it {which}")
        owner, fields = shape, dict(shape.fields)
        name = match[1]
        if name not in fields:
            whose = words if owner is definition else f"`{owner.name}`"
            remedy = suggestion(name, fields, "its fields are") or "it has no fields"
            return PathFault(begin, begin + len(name), f"{whose} has no field `{name}`", remedy)
        shape = fields[name]
        if match.end(1) < len(part):
            step = _list_step(owner, name, shape, match)
            if isinstance(step, str):
                return PathFault(begin, at - 1, step)
            assert isinstance(shape, ListShape)  # noqa: S101 - checked
            steps.append(step)
            shape = shape.element
        else:
            steps.append(FieldStep(name))
    return FieldPath(text, tuple(steps), shape, owner)


def _list_step(owner: MessageDefinition, name: str, shape: FieldShape, match: re.Match[str]) -> FieldStep | str:
    """Return the step to an element of a list, or what is wrong with it."""
    if not isinstance(shape, ListShape):
        return f"`{name}` is no list: it is {shape}"
    if match[2] is None:
        names = dict(owner.fields).get(match[3])
        if not isinstance(names, ListShape) or names.element != Primitive("string"):
            lists = [each for each, kind in owner.fields if kind == ListShape(Primitive("string"))]
            known = f": there is `{lists[0]}`" if lists else ""
            return f"`{owner.name}` has no list of texts `{match[3]}`{known}"
        return FieldStep(name, NamedElement(match[3], match[4]))
    index = int(match[2]) if len(match[2]) < len(str(MAX_INDEX)) + 1 else MAX_INDEX + 1
    most = shape.size - 1 if shape.size else MAX_INDEX
    if index > most:
        return (
            f"`{name}` has no element {match[2][:30]}: {'its last one is' if shape.size else 'at most, it is'} {most}"
        )
    return FieldStep(name, index, shape.size if shape.is_array else 0)
