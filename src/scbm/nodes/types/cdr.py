"""The bytes of messages in ROS 2: XCDR version 1, final, without keys. Version 2 and big-endian are read, too.

A codec is compiled once for each definition: nested functions, one for each field.
"""

from __future__ import annotations

import struct
from functools import cache
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, TypeAlias

from scbm.model.visible_text import counted
from scbm.nodes.types.definitions import CODES, ListShape, MessageDefinition, Primitive

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from scbm.nodes.types.definitions import FieldShape

FieldData: TypeAlias = Any
"""The value of a field, as it is given or received."""

Message: TypeAlias = Any
"""A received message: its fields are attributes. Lists of `uint8`, `byte` and `char` are bytes."""

_HEADER = b"\x00\x01\x00\x00"
"""XCDR version 1, little-endian, no options."""

_PADDED_TO = 4

_MAX_ELEMENTS = 100_000
"""Maximum number of texts or messages in a received list; numbers have no such limit."""


class BadPayloadError(ValueError):
    """A payload that is no message of the type, with the reason."""


class BadValueError(ValueError):
    """A value that a field cannot have, with the field."""


class LateMessage:
    """A message that is decoded when one of its fields is looked at first, which may raise `BadPayloadError`."""

    def __init__(self, decode: Callable[[], Message]) -> None:
        """Take what decodes it; the names of fields do not begin with `_`."""
        self._decode = decode

    def __getattr__(self, name: str) -> FieldData:
        if "_decode" not in vars(self):
            raise AttributeError(name)
        vars(self).update(vars(vars(self).pop("_decode")()))
        return getattr(self, name)


class _Buffer:
    """A payload that is read from its beginning to its end."""

    def __init__(self, payload: bytes, skipped: int) -> None:
        """Skip bytes behind the header. Raises `BadPayloadError`."""
        self.order = _order_of(payload)
        self.data = memoryview(payload)[len(_HEADER) :]
        self.at = skipped
        self.widest = 4 if payload[1] > 1 else 8

    def take(self, size: int, aligned_to: int = 1) -> memoryview:
        """Return the next bytes. Raises `BadPayloadError` if there are too few."""
        aligned_to = min(aligned_to, self.widest)
        begin = -(-self.at // aligned_to) * aligned_to
        self.at = begin + size
        if self.at > len(self.data):
            raise BadPayloadError(f"{len(self.data)} bytes are too few")
        return self.data[begin : self.at]

    def length(self, least: int, most: int) -> int:
        """Return the length of a list with elements of at least so many bytes."""
        (number,) = struct.unpack(self.order + "I", self.take(4, 4))
        if number * least > len(self.data) - self.at:
            raise BadPayloadError(f"a list of {number} does not fit into {len(self.data)} bytes")
        if 0 < most < number:
            raise BadPayloadError(f"a list has {number} elements, and the most are {most}")
        return int(number)


class MessageCodec:
    """Encodes and decodes the messages of one definition."""

    def __init__(self, definition: MessageDefinition) -> None:
        self.definition = definition
        self._write = _writer(definition)
        self._read = _reader(definition)

    def encode(self, values: Mapping[str, object], prefix: bytes = b"") -> bytes:
        """Return the payload of a message; what is left out is zero, empty or false.

        Args:
            values: the fields by name: numbers and texts, lists, and mappings for messages.
            prefix: bytes before the fields, such as the header of a call; 8 or a multiple of it.

        Raises:
            BadValueError: a field cannot have its value, or there is no such field.
        """
        out = bytearray(prefix)
        try:
            self._write(out, values)
        except BadValueError as error:
            raise BadValueError(f"{self.definition.name} cannot carry this: {str(error).lstrip('.')}") from None
        return _HEADER + out + bytes(-len(out) % _PADDED_TO)

    def decode(self, payload: bytes, skipped: int = 0) -> Message:
        """Return the message of a payload, without so many bytes before the fields. Raises `BadPayloadError`."""
        buffer = _Buffer(payload, skipped)
        try:
            message = self._read(buffer)
        except UnicodeDecodeError as error:
            raise BadPayloadError("a text is not UTF-8") from error
        left = len(buffer.data) - buffer.at
        if left >= _PADDED_TO:
            raise BadPayloadError(f"the payload has {left} bytes after its last field")
        return message

    def complete(self, values: Mapping[str, object]) -> Message:
        """Return a message with these values as its receiver gets it. Raises `BadValueError`."""
        return self.decode(self.encode(values))


def header_of(payload: bytes, codes: str) -> tuple[int, ...]:
    """Return the numbers, by their codes in `struct`, at the beginning of a payload. Raises `BadPayloadError`."""
    try:
        return struct.unpack_from(_order_of(payload) + codes, payload, len(_HEADER))
    except struct.error:
        raise BadPayloadError(f"{len(payload) - len(_HEADER)} bytes are too few") from None


def _order_of(payload: bytes) -> str:
    """Return the order of bytes of a payload, as `struct` writes it. Raises `BadPayloadError`."""
    if len(payload) < len(_HEADER) or payload[0] or payload[1] not in (0, 1, 6, 7):
        raise BadPayloadError("it is not in the plain CDR encoding")
    return "<" if payload[1] % 2 else ">"


@cache
def codec_of(definition: MessageDefinition) -> MessageCodec:
    """Return the codec of a definition."""
    return MessageCodec(definition)


# encoding

_Writer: TypeAlias = "Callable[[bytearray, Any], None]"
_Reader: TypeAlias = "Callable[[_Buffer], Any]"


def _pad(out: bytearray, size: int) -> None:
    out += bytes(-len(out) % size)


def _writer(shape: FieldShape) -> _Writer:
    """Return what appends a value, or zeros for `None`."""
    if isinstance(shape, Primitive):
        return _text_writer(shape) if shape.name == "string" else _number_writer(shape)
    return _message_writer(shape) if isinstance(shape, MessageDefinition) else _list_writer(shape)


def _refuse(shape: Primitive, value: object) -> None:
    remedy = shape.fault(value)
    if remedy is not None:
        raise BadValueError(f" is {shape}, not {value!r:.50}: {remedy}")


def _number_writer(shape: Primitive) -> _Writer:
    packed, zero = struct.Struct("<" + CODES[shape.name]), bytes(shape.size)

    def write(out: bytearray, value: object) -> None:
        _pad(out, packed.size)
        if value is None:
            out += zero
        else:
            _refuse(shape, value)
            out += packed.pack(value)

    return write


def _text_writer(shape: Primitive) -> _Writer:
    def write(out: bytearray, value: object) -> None:
        text = "" if value is None else value
        _refuse(shape, text)
        data = str(text).encode()
        _pad(out, 4)
        out += struct.pack("<I", len(data) + 1)
        out += data
        out.append(0)

    return write


def _message_writer(shape: MessageDefinition) -> _Writer:
    fields = [(name, _writer(part)) for name, part in shape.on_wire]
    names = {name for name, _ in shape.fields}

    def write(out: bytearray, values: FieldData) -> None:
        given = {} if values is None else vars(values) if isinstance(values, SimpleNamespace) else values
        if not hasattr(given, "keys"):
            raise BadValueError(f" is {shape}, not {given!r:.50}")
        unknown = next((name for name in given if name not in names), None)
        if unknown is not None:
            raise BadValueError(f".{unknown}: {shape} has no such field")
        for name, write_field in fields:
            try:
                write_field(out, given.get(name))
            except BadValueError as error:
                raise BadValueError(f".{name}{error}") from None

    return write


def _list_writer(shape: ListShape) -> _Writer:
    element, write_element = shape.element, _writer(shape.element)
    numbers = CODES.get(element.name) if isinstance(element, Primitive) else None

    def write(out: bytearray, value: FieldData) -> None:
        values = ([None] * shape.size if shape.is_array else []) if value is None else value
        try:
            length = len(values)
        except TypeError:
            raise BadValueError(f" is {shape}, not {value!r:.50}") from None
        if isinstance(values, str) or (length != shape.size if shape.is_array else 0 < shape.size < length):
            raise BadValueError(f" is {shape}, and this has {counted(length, 'element')}")
        if not shape.is_array:
            _pad(out, 4)
            out += struct.pack("<I", length)
        if numbers == "B" and isinstance(values, bytes):
            out += values
            return
        for position, each in enumerate(values):
            try:
                write_element(out, each)
            except BadValueError as error:
                raise BadValueError(f"[{position}]{error}") from None

    return write


# decoding


def _reader(shape: FieldShape) -> _Reader:
    if isinstance(shape, Primitive):
        return _read_text if shape.name == "string" else _number_reader(shape)
    return _message_reader(shape) if isinstance(shape, MessageDefinition) else _list_reader(shape)


def _number_reader(shape: Primitive) -> _Reader:
    size, structs = shape.size, {order: struct.Struct(order + CODES[shape.name]) for order in "<>"}

    def read(buffer: _Buffer) -> FieldData:
        data = buffer.take(size, size)
        if shape.name == "bool" and data[0] > 1:
            raise BadPayloadError(f"{data[0]} is no bool")
        return structs[buffer.order].unpack(data)[0]

    return read


def _read_text(buffer: _Buffer) -> str:
    (length,) = struct.unpack(buffer.order + "I", buffer.take(4, 4))
    data = buffer.take(length)
    if not length or data[-1]:
        raise BadPayloadError("the end of a text does not match its length")
    return str(data[:-1], "utf-8")


def _message_reader(shape: MessageDefinition) -> _Reader:
    fields = [(name, _reader(part)) for name, part in shape.on_wire]
    if not shape.fields:
        return lambda buffer: SimpleNamespace() if fields[0][1](buffer) is not None else None

    def read(buffer: _Buffer) -> SimpleNamespace:
        made = SimpleNamespace()
        values = vars(made)
        for name, read_field in fields:
            values[name] = read_field(buffer)
        return made

    return read


def _list_reader(shape: ListShape) -> _Reader:
    element, size = shape.element, shape.size
    if isinstance(element, Primitive) and element.name in CODES:
        return _numbers_reader(element, size, is_array=shape.is_array)
    read_element = _reader(element)
    most = min(size or _MAX_ELEMENTS, _MAX_ELEMENTS)
    return lambda buffer: [read_element(buffer) for _ in range(size if shape.is_array else buffer.length(1, most))]


def _numbers_reader(element: Primitive, size: int, *, is_array: bool) -> _Reader:
    code, width = CODES[element.name], element.size

    def read(buffer: _Buffer) -> FieldData:
        length = size if is_array else buffer.length(width, size)
        data = buffer.take(length * width, width if length else 1)
        if code == "B":
            return bytes(data)
        if code == "?" and any(each > 1 for each in data):
            raise BadPayloadError(f"{max(data)} is no bool")
        return list(struct.unpack(f"{buffer.order}{length}{code}", data))

    return read
