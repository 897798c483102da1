"""The one reader of JSON that a file or a peer hands in: text to plain data, and plain data to typed values.

The input is not trusted. `read_json` bounds its size, and refuses what JSON libraries let pass: repeated keys, `NaN`,
half of a surrogate pair, and nesting beyond the stack. `convert_json` checks types with msgspec in strict mode: `1.0`
and `true` are no integers. Positions are computed only for inputs that are wrong.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterable

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
    import msgspec  # noqa: PLC0415 - traces, logs and certificates need it; most commands read none

    try:
        return msgspec.convert(value, expected, strict=True)
    except msgspec.ValidationError as error:
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
