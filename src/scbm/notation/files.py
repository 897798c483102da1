"""Files as text, and as the tree of a mapping: what is the same for all kinds of files."""

from __future__ import annotations

import re
import shlex
from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.notation.document import Node, read_document
from scbm.notation.nearest import nearest
from scbm.notation.report import Report
from scbm.notation.source import Source

if TYPE_CHECKING:
    from pathlib import Path

    from scbm.notation.pieces import Shape

MOST_BYTES = 4 * 1024 * 1024
"""A file may be so large; the largest that people write are a hundredth of it."""

_MARK = "\N{BYTE ORDER MARK}"


def read_tree(text: str, file: str, shape: Shape, start: str) -> tuple[Node, Source, Report]:
    """The mapping that a text says, and what is noted of its YAML so far.

    Args:
        text: YAML.
        file: what errors call the text.
        shape: what kind of file it is; it is not compared with it here.
        start: how such a file begins, for people whose text is something else.

    Raises:
        InputError: the text is not YAML, or no mapping.
    """
    source = Source(text.removeprefix(_MARK), file)
    _refuse_runs(source, shape)
    report = Report(source.lines)
    document = read_document(source, report, shape.noun)
    if document is None or (document.plain is None and not document.condemned):
        message = f"there is no {shape.noun} in the file" if source.text.strip() else "the file is empty"
        raise InputError([Diagnostic(Slug.FILE_EMPTY, message, Place(file), start)])
    if isinstance(document.plain, dict):
        _refuse_other_kinds(document, shape, report)
    if not isinstance(document.plain, dict):
        if not document.condemned:
            report.add(Slug.WRONG_SHAPE, f"a {shape.noun} file is a mapping of keys", document.place, start)
        raise report.error()
    return document, source, report


_RUN = re.compile(r'\s*\{\s*"format"\s*:\s*"scbm-(events|trace)"')
"""How the log of a run over nodes begins, and a trace: JSON Lines, which YAML has much to say of."""


def _refuse_runs(source: Source, shape: Shape) -> None:
    """What came of a run is no file that a run is made of. Raises `InputError`."""
    match = _RUN.match(source.text)
    if match is None:
        return
    if match[1] == "events":
        message, remedy = "the log of a run over nodes", f"`scbm replay {shlex.quote(source.file)}` shows it"
    else:
        message, remedy = "the trace of a run", None
    told = f"this is {message}, and a {shape.noun} file is needed here"
    raise InputError([Diagnostic(Slug.WRONG_SHAPE, told, Place(source.file, 1), remedy)])


_MARKS = {"model": "behavior_model", "case": "case", "bindings": "bindings_of"}
"""The key that tells each kind of file."""


def _refuse_other_kinds(document: Node, shape: Shape, report: Report) -> None:
    """A file of another kind is one mistake, not as many as it has keys."""
    for noun, key in _MARKS.items():
        own = _MARKS.get(shape.noun)
        if noun != shape.noun and own is not None and key in document.items and own not in document.items:
            message = f"this is a {noun} file, and a {shape.noun} file is needed here"
            report.add(Slug.WRONG_SHAPE, message, document.key_places[key])
            raise report.error()


def read_file(path: Path) -> str:
    """The text of a file. Raises `InputError` if it cannot be read, or is no text in UTF-8."""
    try:
        with path.open("rb") as stream:
            data = stream.read(MOST_BYTES + 1)
    except FileNotFoundError:
        raise _unreadable(Slug.FILE_MISSING, "there is no such file", path) from None
    except IsADirectoryError:
        raise _unreadable(Slug.FILE_IS_DIRECTORY, "this is a directory, not a file", path) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise _unreadable(Slug.FILE_UNREADABLE, f"cannot read the file: {reason.lower()}", path) from None
    if len(data) > MOST_BYTES:
        raise _unreadable(Slug.FILE_TOO_LARGE, f"the file is larger than {MOST_BYTES // 1024**2} MiB", path)
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise InputError([_not_utf8(data, error.start, path)]) from None


def neighbour(path: Path) -> str | None:
    """The file beside a missing one that was probably meant, as a remedy."""
    try:
        names = {entry.stem: entry.name for entry in sorted(path.parent.iterdir(), reverse=True)}
    except (OSError, ValueError):
        return None
    near = nearest(path.stem, names)  # the ends of names are mostly alike, and say nothing
    return f"did you mean `{path.parent / names[near]}`?" if near else None


def _not_utf8(data: bytes, begin: int, path: Path) -> Diagnostic:
    """What to say of the first byte that does not belong into a file in UTF-8."""
    readable = data[:begin].decode("utf-8").removeprefix(_MARK)
    source = Source(readable + data[begin:].decode("utf-8", errors="replace"), str(path))
    place = source.place(len(readable))
    message = f"the byte 0x{data[begin]:02x} is not UTF-8"
    return Diagnostic(Slug.NOT_UTF8, message, place, "save the file as UTF-8", source.lines[place.line - 1])


def _unreadable(slug: Slug, message: str, path: Path) -> InputError:
    remedy = None
    if slug is Slug.FILE_MISSING:
        remedy = neighbour(path)
    return InputError([Diagnostic(slug, message, Place(str(path)), remedy)])
