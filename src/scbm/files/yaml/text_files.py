"""Reads files as text and as the tree of a mapping, regular files only."""

from __future__ import annotations

import errno
import os
import re
import stat
from pathlib import Path
from typing import IO

from scbm.files.spelling import nearest
from scbm.files.yaml.document import YamlNode, read_document
from scbm.files.yaml.error_collector import ErrorCollector
from scbm.files.yaml.source_text import SourceText
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import shell_word

MAX_BYTES = 4 * 1024 * 1024
"""The maximum size of a file; the largest files that people write have a hundredth of it."""

_MARK = "\ufeff"


def read_tree(text: str, file: str, noun: str, start: str) -> tuple[YamlNode, SourceText, ErrorCollector]:
    """Return the mapping of a YAML text, with its source and the errors noted so far.

    Args:
        text: the YAML text.
        file: the name of the text in errors.
        noun: what messages call the text: `model`, `case`.
        start: how such a file begins, as a remedy for other texts.

    Raises:
        InputError: the text is not YAML, or no mapping.
    """
    source = SourceText(text.removeprefix(_MARK), file)
    _refuse_runs(source, noun)
    report = ErrorCollector(source.lines)
    document = read_document(source, report, noun)
    if document is None or (document.plain is None and not document.condemned):
        message = f"there is no {noun} in the file" if source.text.strip() else "the file is empty"
        raise InputError([Diagnostic(Slug.FILE_EMPTY, message, Place(file), start)])
    if isinstance(document.plain, dict):
        _refuse_other_kinds(document, noun, report)
    if not isinstance(document.plain, dict):
        if not document.condemned:
            report.add(Slug.WRONG_SHAPE, f"a {noun} file is a mapping of keys", document.place, start)
        raise report.error()
    return document, source, report


_RUN = re.compile(r'\s*\{\s*"format"\s*:\s*"scbm-(events|trace)"')
"""The beginning of an event log and of a trace. Both are JSON Lines, for which YAML would report many errors."""


def _refuse_runs(source: SourceText, noun: str) -> None:
    """Raise `InputError` if the text is an event log or a trace."""
    match = _RUN.match(source.text)
    if match is None:
        return
    if match[1] == "events":
        message, remedy = "the log of a run over nodes", f"`scbm replay {shell_word(source.file)}` shows it"
    else:
        message, remedy = "the trace of a run", None
    shown = f"expected a {noun} file, and this is {message}"
    raise InputError([Diagnostic(Slug.WRONG_SHAPE, shown, Place(source.file, 1), remedy)])


_MARKS = {"model": "behavior_model", "case": "case", "bindings": "bindings_of", "waivers": "waivers_of", "part": "part"}
"""The key that identifies each kind of file."""


def _refuse_other_kinds(document: YamlNode, noun: str, report: ErrorCollector) -> None:
    """Raise `InputError` for a file of another kind: one mistake, not as many as it has keys."""
    own = _MARKS.get(noun)
    for other, key in _MARKS.items():
        if other != noun and own is not None and key in document.items and own not in document.items:
            message = f"expected a {noun} file, and this is a {other} file"
            remedy = "check a model that uses it" if (other, noun) == ("part", "model") else None
            report.add(Slug.WRONG_SHAPE, message, document.key_places[key], remedy)
            raise report.error()


def read_file(path: Path, max_bytes: int = MAX_BYTES) -> str:
    """Return the text of a file.

    Args:
        path: the file.
        max_bytes: the maximum size of the file. Nothing is read of a larger one.

    Raises:
        InputError: the file cannot be read, is a pipe or a device, is too large, or is not UTF-8.
    """
    try:
        with open_input(path) as stream:
            is_too_large = os.fstat(stream.fileno()).st_size > max_bytes
            data = b"" if is_too_large else stream.read(max_bytes + 1)
    except FileNotFoundError:
        raise _unreadable(Slug.FILE_MISSING, "there is no such file", path) from None
    except IsADirectoryError:
        raise _unreadable(Slug.FILE_IS_DIRECTORY, "this is a directory, not a file", path) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        has_nul = "\0" in str(path)
        message = (
            "a file name cannot contain the NUL character" if has_nul else f"cannot read the file: {reason.lower()}"
        )
        raise _unreadable(Slug.FILE_UNREADABLE, message, path) from None
    if is_too_large or len(data) > max_bytes:
        raise _unreadable(Slug.FILE_TOO_LARGE, f"the file is larger than {max_bytes // 1024**2} MiB", path)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError([_not_utf8(data, error.start, path)]) from None


def real_path(path: Path) -> Path:
    """Return a path without symbolic links; the rest of a path that leads nowhere, such as in circles, stays."""
    try:
        return Path(os.path.realpath(path))
    except ValueError:  # such as a NUL
        return path


def without_detours(path: Path) -> Path:
    """Return a path without `..`; the same one if a symbolic link before `..` makes that a different file."""
    short = Path(os.path.normpath(path))
    return short if real_path(short) == real_path(path) else path


def similar_file_remedy(path: Path) -> str | None:
    """Return the remedy that names the most similar file beside a missing one."""
    try:
        names = {entry.stem: entry.name for entry in sorted(path.parent.iterdir(), reverse=True)}
    except (OSError, ValueError):
        return None
    near = nearest(path.stem, names)  # the ends of names are mostly alike, and say nothing
    return f"did you mean `{path.parent / names[near]}`?" if near else None


def _not_utf8(data: bytes, begin: int, path: Path) -> Diagnostic:
    """Return the diagnostic for the first byte that is not UTF-8."""
    readable = data[:begin].decode("utf-8").removeprefix(_MARK)
    source = SourceText(readable + data[begin:].decode("utf-8", errors="replace"), str(path))
    place = source.place(len(readable))
    message = f"the byte 0x{data[begin]:02x} is not UTF-8"
    return Diagnostic(Slug.NOT_UTF8, message, place, "save the file as UTF-8", source.lines[place.line - 1])


def _unreadable(slug: Slug, message: str, path: Path) -> InputError:
    remedy = None
    if slug is Slug.FILE_MISSING:
        remedy = similar_file_remedy(path)
    return InputError([Diagnostic(slug, message, Place(str(path)), remedy)])


_KINDS = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)


def open_input(path: Path) -> IO[bytes]:
    """Open a regular file, or a symbolic link to one, for reading.

    Raises:
        OSError: the file cannot be opened, or is no regular file. The kind of the file is known before it is opened, as
            opening a pipe waits for a writer.
    """
    mode = path.stat().st_mode
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if not stat.S_ISREG(mode):
        kind = next((noun for is_kind, noun in _KINDS if is_kind(mode)), "no file")
        raise OSError(errno.EINVAL, f"it is {kind}, and only regular files are read", str(path))
    return path.open("rb")
