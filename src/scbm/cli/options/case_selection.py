"""Which cases of a suite run: `-k EXPRESSION` selects by name, `--lf` those that failed last time."""

from __future__ import annotations

import json
import os
import re
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from msgspec import to_builtins

from scbm.cli.options.option_errors import option_error
from scbm.files import open_input
from scbm.model import Diagnostic, InputError, Place, Slug, refuse_other_version
from scbm.model.json_reader import JsonError, JsonRecord, line_and_column, read_json_object, read_located

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from scbm.files import FileWriter

_TOKEN = re.compile(r'\s*(?:(?P<sign>[()])|"(?P<quoted>[^"]*)"|(?P<word>[^\s()"]+))')
_RECORD = "last-failed.json"
FORMAT_VERSION = 1

_MAX_CHARACTERS = 64 * 1024 * 1024
"""Maximum length of the record; it has some million names of cases."""


def name_filter(expression: str) -> Callable[[str], bool]:
    """Return whether a name of a case satisfies an expression such as `scan and not (fast or "two words")`.

    A word holds for the names that it is a part of, in capitals or not. Raises `InputError`.
    """
    parser = _NameExpression(expression)
    test = parser.any_of()
    parser.end()
    return lambda name: test(name.casefold())


class _NameExpression:
    """Parses an expression by recursive descent: `or` binds least, then `and`, then `not`."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._position = 0

    def any_of(self) -> Callable[[str], bool]:
        parts = [self._all_of()]
        while self._take("or"):
            parts.append(self._all_of())
        return lambda name: any(part(name) for part in parts)

    def end(self) -> None:
        """Raise `InputError` if tokens are left."""
        if self._text[self._position :].strip():
            raise self._wrong("`and` or `or` is missing here")

    def _all_of(self) -> Callable[[str], bool]:
        parts = [self._single()]
        while self._take("and"):
            parts.append(self._single())
        return lambda name: all(part(name) for part in parts)

    def _single(self) -> Callable[[str], bool]:
        if self._take("not"):
            negated = self._single()
            return lambda name: not negated(name)
        if self._take("("):
            inner = self.any_of()
            if not self._take(")"):
                raise self._wrong("`)` is missing here")
            return inner
        token = _TOKEN.match(self._text, self._position)
        if token is None or token["sign"] or token["word"] in ("and", "or"):
            raise self._wrong("a part of a name is missing here")
        self._position = token.end()
        part = (token["word"] or token["quoted"]).casefold()
        return lambda name: part in name

    def _take(self, word: str) -> bool:
        """Skip the next token if it is `word`; return whether it was."""
        token = _TOKEN.match(self._text, self._position)
        if token is None or word not in (token["word"], token["sign"]):
            return False
        self._position = token.end()
        return True

    def _wrong(self, message: str) -> InputError:
        rest = self._text[self._position :]
        column = self._position + len(rest) - len(rest.lstrip()) + 1
        remedy = "write parts of names with `and`, `or`, `not` and parentheses: `scan and not fast`"
        return InputError([Diagnostic(Slug.BAD_OPTION, message, Place("-k", 1, column, 1), remedy, self._text)])


class LastFailed(JsonRecord, frozen=True):
    """The cases of a model that failed when they ran last, and the options that they ran with.

    The file `last-failed.json` in the directory of `--failures` has them for each model.

    Attributes:
        options: the arguments and options of `scbm test MODEL` that ran them.
        failed: the names of the cases.
    """

    options: str = ""
    failed: tuple[str, ...] = ()

    @staticmethod
    def read(directory: Path, model_file: Path) -> LastFailed:
        """Return the record of a model in the directory. Raise `InputError` if the file is damaged."""
        return _entries(directory).get(_key(directory, model_file), LastFailed())

    def after(self, passed: Iterable[str], failed: Iterable[str], options: str) -> LastFailed:
        """Return the record after some cases ran again."""
        known = dict.fromkeys(self.failed)
        over = {name: None for name in passed if name in known}  # of many cases, few were recorded
        names = tuple(dict.fromkeys([*(name for name in self.failed if name not in over), *failed]))
        return LastFailed(options if names else "", names)

    def write(self, directory: Path, model_file: Path, writer: FileWriter) -> None:
        """Write the record; write no file if there is no failure and no file yet. Raise `InputError`."""
        entries = _entries(directory)
        key = _key(directory, model_file)
        if not self.failed and key not in entries:
            return
        if self.failed:
            entries[key] = self
        else:
            del entries[key]
        data = to_builtins(_LastFailedFile(FORMAT_VERSION, entries))
        text = json.dumps(data, indent=2, ensure_ascii=False)
        writer.write_all({directory / _RECORD: f"{text}\n"}, overwrite=True)


class _LastFailedFile(JsonRecord, frozen=True):
    format_version: int
    models: dict[str, LastFailed]


def select_last_failed(last: LastFailed, names: Sequence[str]) -> Callable[[str], bool]:
    """Return whether a case failed last time. Raise `InputError` if none of the failed cases is among `names`."""
    failed = dict.fromkeys(last.failed)
    if not any(name in failed for name in names):
        message = f"none of these cases failed last time; `{last.failed[0]}` did"
        remedy = f"repeat the options that it ran with: `{last.options.strip()}`"
        raise option_error("--lf", message, remedy)
    return lambda name: name in failed


def _entries(directory: Path) -> dict[str, LastFailed]:
    """Return the records of all models in the directory; none without a file."""
    try:
        with open_input(directory / _RECORD) as stream:
            text = stream.read().decode("utf-8")
    except OSError:
        return {}
    except UnicodeDecodeError:
        raise _damaged(directory) from None
    try:
        data = read_json_object(text, _MAX_CHARACTERS)
        place = Place(str(directory / _RECORD))
        refuse_other_version("record of failed cases", data.get("format_version"), FORMAT_VERSION, place, _REMEDY)
        read: _LastFailedFile = read_located(data, _LastFailedFile, text)
    except JsonError as error:
        raise _damaged(directory, error.message, line_and_column(text, error.position)) from None
    return read.models


def _key(directory: Path, model_file: Path) -> str:
    return Path(os.path.relpath(model_file, directory)).as_posix()


_TextPlace: TypeAlias = tuple[int, int, str | None]
_NO_RECORD = "this is no record of failed cases"
_REMEDY = "remove it, and run the cases again"


def _damaged(directory: Path, message: str = _NO_RECORD, where: _TextPlace = (0, 0, None)) -> InputError:
    """Return the error for the file; `where` has the line, the column and the text of the line."""
    line, column, source = where
    place = Place(str(directory / _RECORD), line, column)
    return InputError([Diagnostic(Slug.WRONG_SHAPE, message, place, _REMEDY, source_line=source)])
