"""The parts of certificates in JSON, such as values and lists of names: read with all that is wrong with them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NoReturn

from scbm.model.json_reader import quoted

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import TypeVar

    from scbm.model import Value
    from scbm.model.json_reader import JsonPath

    Part = TypeVar("Part")

MAX_WORD = 1_000
"""Maximum number of characters of a name or a reason."""
MAX_FAULTS = 100
"""Maximum number of faults that are reported for one certificate."""

_MAX_NUMBER = 2**63


class FaultError(Exception):
    """Something is wrong with the value at a path."""

    def __init__(self, path: JsonPath, message: str) -> None:
        super().__init__(message)
        self.path = path
        self.message = message


class CertificateParts:
    """Reads parts of a document and keeps all that is wrong with them."""

    def __init__(self) -> None:
        self.faults: list[FaultError] = []
        self._words: dict[str, str] = {}

    def value(self, value: object, path: JsonPath) -> Value:
        """Return a value of a variable."""
        if isinstance(value, bool):
            return value
        if isinstance(value, int):
            if abs(value) > _MAX_NUMBER:
                raise FaultError(path, "this is a number that no variable can have")
            return value
        if isinstance(value, float):
            raise FaultError(path, f"`{value}` is not a whole number")
        return self.word(value, path)

    def word(self, value: object, path: JsonPath) -> str:
        """Return a name, a symbol or a reason. The same words recur in every situation, and are kept once."""
        if isinstance(value, str) and value in self._words:
            return self._words[value]
        if not isinstance(value, str) or not value.isprintable() or not 0 < len(value) <= MAX_WORD:
            raise FaultError(path, f"expected a text of one line with 1 to {MAX_WORD} characters")
        return self._words.setdefault(value, value)

    def each(self, value: object, path: JsonPath, read: Callable[[Any, JsonPath], Part]) -> tuple[Part, ...]:
        """Return all elements of a list; what is wrong with one of them is kept, and the others are read."""
        if not isinstance(value, list):
            raise FaultError(path, "expected a list")
        parts: list[Part] = []
        for index, element in enumerate(value):
            try:
                parts.append(read(element, (*path, index)))
            except FaultError as fault:
                self.faults.append(fault)
                if len(self.faults) >= MAX_FAULTS:
                    raise
        return tuple(parts)

    def values(self, value: object, path: JsonPath) -> tuple[Value, ...]:
        """Return a list of values of variables: there may be millions of lists, of few words."""
        words = self._words
        if type(value) is not list:
            return self.each(value, path, self.value)
        try:
            return tuple([part if part is True or part is False else words[part] for part in value])
        except (KeyError, TypeError):  # a number, a new word, or no value at all
            return self.each(value, path, self.value)

    def words(self, value: object, path: JsonPath) -> tuple[str, ...]:
        """Return a list of words."""
        if type(value) is not list:
            return self.each(value, path, self.word)
        try:
            return tuple([self._words[part] for part in value])
        except (KeyError, TypeError):  # a new word, or no word at all
            return self.each(value, path, self.word)

    def keys(self, value: object, keys: tuple[str, ...], path: JsonPath) -> dict[str, Any]:
        """Return an object that has exactly these keys."""
        if not isinstance(value, dict):
            raise FaultError(path, f"expected an object with the keys {', '.join(keys)}")
        for key in keys:
            if key not in value:
                raise FaultError(path, f"the key `{key}` is missing")
        for key in value:
            if key not in keys:
                raise FaultError((*path, key), f"{quoted(key)} is not a key here")
        return value

    def refuse(self, path: JsonPath, message: str) -> NoReturn:
        """Refuse the value at a path."""
        raise FaultError(path, message)
