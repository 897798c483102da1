"""Certificates from text. Everything that is wrong with the shape of one is told, with its place.

What a certificate says is not looked at: whether a variable, a value or a claim exists is asked by the check.

Where the values of a JSON text stand. Only asked when something is wrong with them.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.proofcheck.certificate import Certificate, Claim
from scbm.proofcheck.certificate_arguments import ARGUMENTS
from scbm.proofcheck.certificate_writer import FORMAT_VERSION

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from typing import TypeVar

    from scbm.model import Value

    Part = TypeVar("Part")

Path: TypeAlias = tuple[str | int, ...]
"""The keys and indices that lead to a value from the outside."""

_MARK = re.compile(r'"(?:[^"\\]|\\.)*"|[\[\]{}:,]|[^\s\[\]{}:,"]+')
_LINE_END = re.compile(r"\r\n|\r|\n")


def positions(text: str, wanted: Iterable[Path]) -> dict[Path, int]:
    """The position at which the value at each path begins; `text` is JSON, and has these values."""
    left = dict.fromkeys(wanted)
    found: dict[Path, int] = {}
    path: list[str | int | None] = []  # None where a key comes next
    for match in _MARK.finditer(text):
        mark = match[0]
        if mark in ("]", "}"):
            path.pop()
        elif mark == ",":
            path[-1] = path[-1] + 1 if isinstance(path[-1], int) else None
        elif path and path[-1] is None:
            path[-1] = json.loads(mark)
        elif mark != ":":
            here = tuple(part for part in path if part is not None)
            if here in left:
                found.setdefault(here, match.start())
                if len(found) == len(left):
                    break
            if mark in ("[", "{"):
                path.append(0 if mark == "[" else None)
    return found


def line_and_column(text: str, position: int) -> tuple[int, int, str]:
    """The line and the column of a position, both counted from 1, and the text of that line."""
    begin, number = 0, 1
    for match in _LINE_END.finditer(text):
        if match.end() > position:
            return number, position - begin + 1, text[begin : match.start()]
        begin, number = match.end(), number + 1
    return number, position - begin + 1, text[begin:]


MAX_CHARACTERS = 256 * 1024 * 1024
"""So large a text is read; it has some hundred thousand situations."""
MAX_WORD = 1_000
"""So long a name or a reason may be."""
MAX_FAULTS = 100
"""So many faults are told at once."""

_HEAD = ("scbm_certificate", "model", "digest", "claims", "argument")
_MAX_NUMBER = 2**63
_MAX_QUOTED = 60
_DIGEST = re.compile(r"[0-9a-f]{64}")


class _FaultError(Exception):
    """Something is wrong with the value at a path."""

    def __init__(self, path: Path, message: str) -> None:
        super().__init__(message)
        self.path = path
        self.message = message


class _RefusedError(Exception):
    """JSON that is none of a certificate, whatever stands around it."""

    def __init__(self, message: str, token: str) -> None:
        super().__init__(message)
        self.message = message
        self.token = token


def read_certificate(text: str, file: str = "certificate") -> Certificate:
    """The certificate that was written as `text`. Raises `InputError`, located in the text."""
    text = text.removeprefix("\N{BYTE ORDER MARK}")
    if len(text) > MAX_CHARACTERS:
        raise InputError([_diagnostic("this is too large for a certificate", text, file, 0)])
    document = _document(text, file)
    reading = CertificateParts()
    certificate = reading.read(document)
    if certificate is None:
        found = positions(text, (fault.path for fault in reading.faults))
        told = {_diagnostic(f.message, text, file, found.get(f.path, 0)): None for f in reading.faults}
        raise InputError(sorted(told, key=lambda diagnostic: diagnostic.order))
    return certificate


def _document(text: str, file: str) -> object:
    try:
        return json.loads(text, object_pairs_hook=_object, parse_float=_not_whole, parse_constant=_not_whole)
    except json.JSONDecodeError as error:
        message, position = f"this is not JSON: {error.msg[0].lower()}{error.msg[1:]}", error.pos
    except _RefusedError as error:
        message, position = error.message, max(0, text.rfind(error.token))
    except RecursionError:
        message, position = "this is nested too deeply for a certificate", 0
    except ValueError:  # a number with more digits than Python reads
        message, position = "there is a number that no variable can have", 0
    raise InputError([_diagnostic(message, text, file, position)])


def _object(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    result = dict(pairs)
    if len(result) < len(pairs):
        twice = next(key for key, times in Counter(key for key, _ in pairs).items() if times > 1)
        raise _RefusedError(f"the key {_quoted(twice)} stands twice in one object", json.dumps(twice))
    return result


def _not_whole(token: str) -> NoReturn:
    raise _RefusedError(f"{_quoted(token)} is no whole number", token)


def _diagnostic(message: str, text: str, file: str, position: int) -> Diagnostic:
    line, column, source = line_and_column(text, position)
    return Diagnostic(Slug.BAD_CERTIFICATE, message, Place(file, line, column), source_line=source)


def _quoted(word: str) -> str:
    """A word of the text in a message: on one line, and not all of it if it is long."""
    shown = word if len(word) <= _MAX_QUOTED else f"{word[:_MAX_QUOTED]}…"
    return f"`{''.join(c if c.isprintable() else '?' for c in shown)}`"


class CertificateParts:
    """Goes through a document and keeps all that is wrong with it."""

    def __init__(self) -> None:
        self.faults: list[_FaultError] = []
        self._words: dict[str, str] = {}

    def read(self, document: object) -> Certificate | None:
        """The certificate; `None` if there are faults."""
        try:
            certificate = self._certificate(document)
        except _FaultError as fault:
            self.faults.append(fault)
            return None
        return None if self.faults else certificate

    def _certificate(self, document: object) -> Certificate:
        if not isinstance(document, dict) or "scbm_certificate" not in document:
            raise _FaultError((), "this is not a certificate of scbm")
        version = document["scbm_certificate"]
        if type(version) is not int or version != FORMAT_VERSION:
            told = version if type(version) is int and abs(version) < _MAX_NUMBER else "?"
            message = f"version {told} of the format of certificates; this scbm reads version {FORMAT_VERSION}"
            raise _FaultError(("scbm_certificate",), message)
        kind = document.get("argument")
        if not isinstance(kind, str) or kind not in ARGUMENTS:
            path: Path = ("argument",) if "argument" in document else ()
            raise _FaultError(path, f"the key `argument` says which one it is: {', '.join(ARGUMENTS)}")
        self.keys(document, (*_HEAD, *ARGUMENTS[kind].keys), ())
        return Certificate(
            self.word(document["model"], ("model",)),
            self._digest(document["digest"], ("digest",)),
            self.each(document["claims"], ("claims",), self._claim),
            ARGUMENTS[kind].read(self, document),
        )

    # the parts

    def _digest(self, value: object, path: Path) -> str:
        if not isinstance(value, str) or not _DIGEST.fullmatch(value):
            raise _FaultError(path, "a digest has 64 digits, `0` to `9` and `a` to `f`")
        return value

    def _claim(self, value: object, path: Path) -> Claim:
        claim = self.keys(value, ("obligation", "reason"), path)
        obligation = self.word(claim["obligation"], (*path, "obligation"))
        return Claim(obligation, self.word(claim["reason"], (*path, "reason")))

    def value(self, value: object, path: Path) -> Value:
        """Return a value of a variable."""
        if isinstance(value, bool):
            return value
        if isinstance(value, int):
            if abs(value) > _MAX_NUMBER:
                raise _FaultError(path, "this is a number that no variable can have")
            return value
        return self.word(value, path)

    def word(self, value: object, path: Path) -> str:
        """A name, a symbol or a reason. The same words come back in every situation, and are kept once."""
        if isinstance(value, str) and value in self._words:
            return self._words[value]
        if not isinstance(value, str) or not value.isprintable() or not 0 < len(value) <= MAX_WORD:
            raise _FaultError(path, f"here is a text of one line with 1 to {MAX_WORD} characters")
        return self._words.setdefault(value, value)

    def each(self, value: object, path: Path, read: Callable[[Any, Path], Part]) -> tuple[Part, ...]:
        """All elements of a list; what is wrong with one of them is kept, and the others are read."""
        if not isinstance(value, list):
            raise _FaultError(path, "here is a list")
        parts: list[Part] = []
        for index, element in enumerate(value):
            try:
                parts.append(read(element, (*path, index)))
            except _FaultError as fault:
                self.faults.append(fault)
                if len(self.faults) >= MAX_FAULTS:
                    raise
        return tuple(parts)

    def keys(self, value: object, keys: tuple[str, ...], path: Path) -> dict[str, Any]:
        """Return an object that has exactly these keys."""
        if not isinstance(value, dict):
            raise _FaultError(path, f"here is an object with the keys {', '.join(keys)}")
        for key in keys:
            if key not in value:
                raise _FaultError(path, f"the key `{key}` is missing")
        for key in value:
            if key not in keys:
                raise _FaultError((*path, key), f"{_quoted(key)} is not a key here")
        return value

    def refuse(self, path: Path, message: str) -> NoReturn:
        """Refuse the value at a path."""
        raise _FaultError(path, message)
