"""From a file to a behavior model. Every error of the file comes at once, each with its place."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.notation.builder import Builder
from scbm.notation.document import Node, read_document
from scbm.notation.nearest import nearest
from scbm.notation.report import Report
from scbm.notation.shape import check_shape
from scbm.notation.source import Source

if TYPE_CHECKING:
    from scbm.model.behavior import BehaviorModel

MOST_BYTES = 4 * 1024 * 1024
"""A model file may be so large; the largest that people write are a hundredth of it."""


class Places:
    """Where each part of a model stands in its file."""

    def __init__(self, document: Node, source: Source) -> None:
        self._document = document
        self._source = source

    def find(self, path: tuple[str, ...]) -> tuple[Place, str]:
        """The key at the end of a path, or the last one on the way that is there, and the line that it stands in."""
        place = Place(self._source.file)
        for length in range(len(path)):
            owner = self._document.at(path[:length])
            if path[length] not in owner.key_places:
                break
            place = owner.key_places[path[length]]
        return place, self._source.lines[place.line - 1] if place.line else ""


def load_model(path: str | Path) -> BehaviorModel:
    """The model in a file. Raises `InputError` with everything that is wrong with it."""
    return load_located(path)[0]


def load_located(path: str | Path) -> tuple[BehaviorModel, Places]:
    """The model in a file, and where its parts stand there. Raises `InputError`."""
    return _read(_read_text(Path(path)), str(path))


def read_model(text: str, file: str = "model") -> BehaviorModel:
    """The model that a text says. Raises `InputError` with everything that is wrong with it.

    Args:
        text: YAML.
        file: what errors call the text.
    """
    return _read(text, file)[0]


def _read(text: str, file: str) -> tuple[BehaviorModel, Places]:
    source = Source(text.removeprefix(_MARK), file)
    report = Report(source.lines)
    document = read_document(source, report)
    if document is None or (document.plain is None and not document.condemned):
        message = "there is no model in the file" if source.text.strip() else "the file is empty"
        raise InputError([Diagnostic(Slug.FILE_EMPTY, message, Place(file), _START)])
    if not isinstance(document.plain, dict):
        if not document.condemned:
            report.add(Slug.WRONG_SHAPE, "a model file is a mapping of keys", document.place, _START)
        raise report.error()
    check_shape(document, report)
    builder = Builder(document, report)
    model = builder.model()
    report.raise_any()
    if not builder.is_whole:
        raise AssertionError(f"{file}: something was not resolved, and nothing was complained of")
    return model, Places(document, source)


_MARK = "\N{BYTE ORDER MARK}"
_START = "a model begins with `behavior_model: <name>`"


def _read_text(path: Path) -> str:
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
        remedy = _neighbour(path)
    return InputError([Diagnostic(slug, message, Place(str(path)), remedy)])


def _neighbour(path: Path) -> str | None:
    """The file beside a missing one that was probably meant."""
    try:
        names = sorted(entry.name for entry in path.parent.iterdir())
    except OSError:
        return None
    near = nearest(path.name, names)
    return f"did you mean `{path.parent / near}`?" if near else None
