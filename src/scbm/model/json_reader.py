"""The one reader of JSON that a file or a peer hands in: text to plain data, and plain data to records.

The input is not trusted. `read_json` bounds its size, and refuses what JSON libraries let pass: repeated keys, `NaN`,
half of a surrogate pair, and nesting beyond the stack. Positions are computed only for inputs that are wrong.

What crosses a process, a file or a wire is a msgspec struct with known fields and limits. Its type says which JSON is
accepted, in strict mode: `1.0` and `true` are no integers. What it cannot say, such as names of a model, the code
checks that uses the record.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from enum import Enum
from itertools import chain
from types import NoneType
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, TypeAlias, TypeVar, get_args, get_origin

from msgspec import Meta, Struct, ValidationError, convert
from msgspec.structs import fields

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

_T = TypeVar("_T")

JsonPath: TypeAlias = tuple[str | int, ...]
"""The keys and indices that lead from the outermost value to an inner one."""

_MAX_QUOTED = 60
_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{}:,]|[^\s\[\]{}:,"]+')
_SURROGATES = re.compile(r"\\u[dD][89abAB]\w\w\\u[dD][c-fC-F]\w\w|(\\u[dD][89a-fA-F]\w\w)")
"""A pair of surrogates, or in group 1 half of one."""

_LINE_END = re.compile(r"\r\n|\r|\n")


class JsonError(ValueError):
    """A JSON text or value that is not acceptable.

    Attributes:
        message: what is wrong.
        position: the index of the character where it is wrong, if the text itself is.
    """

    def __init__(self, message: str, position: int = 0) -> None:
        super().__init__(message)
        self.message = message
        self.position = position


class _RefusedTokenError(Exception):
    """A token that JSON libraries accept and this reader refuses."""

    def __init__(self, message: str, token: str) -> None:
        super().__init__(message)
        self.message = message
        self.token = token


def read_json(text: str, max_characters: int) -> object:
    """Return the value of a JSON text as dictionaries, lists, strings, numbers, booleans and `None`.

    Raises:
        JsonError: the text is longer than `max_characters`, is not JSON, repeats a key within one object, holds `NaN`
            or an infinite number, holds half of a surrogate pair, or is nested too deeply.
    """
    if len(text) > max_characters:
        raise JsonError(f"the text has more than {max_characters} characters")
    try:
        text.encode()  # a peer in this process can hand over half of a surrogate pair
        value: object = json.loads(text, object_pairs_hook=_object, parse_constant=_refuse_constant)
        if "\\u" in text:  # only an escape can produce half of a surrogate pair
            json.dumps(value, ensure_ascii=False).encode()
    except json.JSONDecodeError as error:
        raise JsonError(f"this is not JSON: {error.msg[0].lower()}{error.msg[1:]}", error.pos) from None
    except _RefusedTokenError as error:
        raise JsonError(error.message, max(0, text.rfind(error.token))) from None
    except RecursionError:
        raise JsonError("this JSON is nested too deeply") from None
    except UnicodeEncodeError as error:
        position = next((match.start() for match in _SURROGATES.finditer(text) if match[1]), error.start)
        raise JsonError("a lone surrogate code unit is not a character", position) from None
    except ValueError:  # Python refuses to read integers of more than 4,300 digits
        raise JsonError("this JSON holds a number with too many digits") from None
    return value


def read_json_object(text: str, max_characters: int) -> dict[str, Any]:
    """Return the members of the JSON object in a text. Raises `JsonError` as `read_json`, or for another value."""
    value = read_json(text, max_characters)
    if not isinstance(value, dict):
        raise JsonError("this is not a JSON object")
    return value


def convert_json(value: object, expected: type[_T]) -> _T:
    """Return plain data as a value of a type: of a builtin or generic type, an enumeration, a dataclass or a struct.

    Args:
        value: what `read_json` returned, or a part of it.
        expected: the type; unions and `Annotated` types with limits are types in this sense.

    Raises:
        JsonError: the value is not of this type; the message names the inner place.
    """
    try:
        return convert(value, expected, strict=True)
    except ValidationError as error:
        reason = str(error)
        raise JsonError(reason[0].lower() + reason[1:]) from None


def value_positions(text: str, wanted: Iterable[JsonPath]) -> dict[JsonPath, int]:
    """Return the index of the character at which the value at each path begins; `text` is valid JSON."""
    remaining = dict.fromkeys(wanted)
    found: dict[JsonPath, int] = {}
    path: list[str | int | None] = []  # None where a key comes next
    for match in _TOKEN.finditer(text):
        mark = match[0]
        if mark in ("]", "}"):
            path.pop()
        elif mark == ",":
            path[-1] = path[-1] + 1 if isinstance(path[-1], int) else None
        elif path and path[-1] is None:
            path[-1] = json.loads(mark)
        elif mark != ":":
            here = tuple(part for part in path if part is not None)
            if here in remaining:
                found.setdefault(here, match.start())
                if len(found) == len(remaining):
                    break
            if mark in ("[", "{"):
                path.append(0 if mark == "[" else None)
    return found


def line_and_column(text: str, position: int) -> tuple[int, int, str]:
    """Return the line and the column of a character, both counted from 1, and the text of its line."""
    begin, number = 0, 1
    for match in _LINE_END.finditer(text):
        if match.end() > position:
            return number, position - begin + 1, text[begin : match.start()]
        begin, number = match.end(), number + 1
    return number, position - begin + 1, text[begin:]


def quoted(word: str) -> str:
    """Return a word of the input for a message: on one line, and cut if it is long."""
    shown = word if len(word) <= _MAX_QUOTED else f"{word[:_MAX_QUOTED]}…"
    return f"`{''.join(c if c.isprintable() else '?' for c in shown)}`"


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        repeated = next(key for key, times in Counter(key for key, _ in pairs).items() if times > 1)
        raise _RefusedTokenError(f"the key {quoted(repeated)} stands twice in one object", json.dumps(repeated))
    return result


def _refuse_constant(token: str) -> NoReturn:
    raise _RefusedTokenError(f"{quoted(token)} is not a JSON number", token)


# records


MAX_COUNT = 2**63 - 1
"""The largest number that a clock can hold, and a field of a message."""

Count: TypeAlias = Annotated[int, Meta(ge=0, le=MAX_COUNT)]
"""A whole number from 0 on that a clock can hold."""

Text: TypeAlias = Annotated[str, Meta(max_length=1_000)]
"""A name, or a few words."""

MAX_LONG_TEXT = 100_000
LongText: TypeAlias = Annotated[str, Meta(max_length=MAX_LONG_TEXT)]
"""A predicate, sentences, or a value that a driver sent."""

Names: TypeAlias = Annotated[tuple[Text, ...], Meta(max_length=100_000)]
"""A list of names, such as a plan."""

Values: TypeAlias = Annotated[
    dict[Text, bool | Annotated[int, Meta(ge=-MAX_COUNT - 1, le=MAX_COUNT)] | LongText], Meta(max_length=10_000)
]
"""Variables and their values; a model need not know them."""

_MAX_REASON = 100
"""Maximum number of characters of a reason that repeats words of the data."""

_PLACE = re.compile(r"(.*?)(?: - at (`key` in )?`\$\.?(.*)`)?", re.DOTALL)
_EXPECTED: dict[str, str] = {}
"""What a text that matches a pattern is, in words, by the pattern."""


class JsonRecord(Struct, frozen=True, forbid_unknown_fields=True, omit_defaults=True):
    """A JSON object with its fields and no others. A field with a default value is left out if it has this value."""


def matching(pattern: str, words: str) -> Meta:
    """Return the constraint of texts that match a regular expression as a whole; `words` say what such a text is."""
    whole = rf"^(?:{pattern})\Z"
    _EXPECTED[whole] = words
    return Meta(pattern=whole)


Digest: TypeAlias = Annotated[str, matching("[0-9a-f]{64}", "a SHA-256 of 64 hexadecimal digits")]
"""The digest of a model or of a trace."""


def one_of(words: Iterable[str]) -> Meta:
    """Return the constraint of texts that are one of some words."""
    known = tuple(words)
    return matching("|".join(map(re.escape, known)), f"one of {', '.join(known)}")


def read_record(data: object, kind: Any, what: str) -> Any:  # noqa: ANN401 - a record of this kind, or of a union
    """Return plain data, as `read_json` returns it, as a record.

    Args:
        data: the data.
        kind: the class of the record, or a union of classes with tags.
        what: the name of the data in errors.

    Raises:
        JsonError: the data is no such record; the message names the field.
    """
    try:
        return convert(data, kind, strict=True)
    except ValidationError as error:
        raise JsonError(_located(str(error), what)) from None


def read_located(data: object, kind: Any, text: str) -> Any:  # noqa: ANN401 - a record of this kind
    """Return the plain data of a text as a record. Raise `JsonError` with the position of the first fault."""
    for path, reason in record_faults(data, kind):
        raise JsonError(reason, value_positions(text, [path]).get(path, 0))
    return convert(data, kind, strict=True)


def record_faults(data: object, kind: Any, path: JsonPath = ()) -> Iterator[tuple[JsonPath, str]]:  # noqa: ANN401
    """Yield why plain data is no record of a kind: each reason with its path; nothing if it is one.

    `convert` stops at the first reason. So where it refuses the whole, its parts are converted one by one.
    """
    try:
        convert(data, kind, strict=True)
    except ValidationError as error:
        reason, _, _ = _split(str(error))
    else:
        return
    if isinstance(kind, type) and issubclass(kind, Enum):
        reason = f"expected one of {', '.join(kind)}"
    of_parts = (record_faults(part, of, (*path, key)) for key, part, of in _parts(data, kind))
    faults = chain(_faults_of_keys(data, kind, path), chain.from_iterable(of_parts))
    yield next(faults, (path, reason))
    yield from faults


def _faults_of_keys(data: object, kind: Any, path: JsonPath) -> Iterator[tuple[JsonPath, str]]:  # noqa: ANN401
    """Yield the keys that an object lacks, and those that are not known."""
    if isinstance(data, dict) and _is_object(kind):
        known = {field.encode_name: field.required for field in fields(kind)}
        missing = (name for name, is_required in known.items() if is_required and name not in data)
        yield from ((path, f"the key `{name}` is missing") for name in missing)
        yield from (((*path, key), f"{quoted(key)} is not a key here") for key in data if key not in known)


def _parts(data: object, kind: Any) -> Iterator[tuple[str | int, object, Any]]:  # noqa: ANN401
    """Yield the keys and the parts of data, each with its kind."""
    kinds = [each for each in get_args(kind) if each is not NoneType]
    match data:
        case dict() if _is_object(kind):
            yield from ((f.encode_name, data[f.encode_name], f.type) for f in fields(kind) if f.encode_name in data)
        case dict() if get_origin(kind) is dict:
            of_key, of_value = kinds
            yield from ((key, key, of_key) for key in data)
            yield from ((key, value, of_value) for key, value in data.items())
        case list() if _is_struct(kind):
            yield from zip(range(len(data)), data, (field.type for field in fields(kind)), strict=False)
        case list() if get_origin(kind) is tuple:
            yield from ((index, part, kinds[0]) for index, part in enumerate(data))
        case dict() | list() if kinds:  # of an annotated type, or of one that may be `None`, the type itself
            yield from _parts(data, kinds[0])
        case _:
            pass


def _is_struct(kind: object) -> bool:
    return isinstance(kind, type) and issubclass(kind, Struct)


def _is_object(kind: Any) -> bool:  # noqa: ANN401
    """Return whether records of a kind are objects, and no lists."""
    return _is_struct(kind) and not kind.__struct_config__.array_like


def _split(message: str) -> tuple[str, str, str]:
    """Return the reason in a message of msgspec, on one line and of bounded length, and its place in two parts."""
    match = _PLACE.fullmatch(message)
    assert match is not None  # noqa: S101 - all texts match
    reason, key, place = match.groups()
    for pattern, words in _EXPECTED.items():
        reason = reason.replace(f"`str` matching regex {pattern!r}", words)
    if len(reason) > _MAX_REASON and not reason.startswith("Expected"):
        reason = f"{reason[:_MAX_REASON]}…"
    words = f"{reason[0].lower()}{''.join(c if c.isprintable() else '?' for c in reason[1:])}"
    return words, "a key of " if key and place else "", f"`{place}` of " if place else ""


def _located(message: str, what: str) -> str:
    """Return a message of msgspec with its place in words."""
    reason, key, place = _split(message)
    return f"{key}{place}{what}: {reason}"
