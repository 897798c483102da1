"""Files that a command writes: none of them is one that it read, or another one that it writes, and none is cut off."""

from __future__ import annotations

from os.path import lexists, realpath
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


def refuse_clashes(outputs: Mapping[str, Path], inputs: Iterable[tuple[Path, str]]) -> None:
    """Raises `InputError` if two outputs would be one file, or one of them would replace an input.

    Args:
        outputs: the files to write, by their options.
        inputs: the files that are read, and what they are in words.
    """
    taken: dict[object, str] = {}
    for path, words in inputs:
        taken.setdefault(_identity(path), words)
    wrong = []
    for option, path in outputs.items():
        other = taken.setdefault(_identity(path), option)
        if other != option and not path.is_char_device():
            told = f"{path} is also {'that of ' if other.startswith('--') else ''}{other}"
            wrong.append(Diagnostic(Slug.BAD_OPTION, told, Place(option), "write it to another file"))
    if wrong:
        raise InputError(wrong)


def _identity(path: Path) -> object:
    """What tells files apart, by whichever name: links lead to the same."""
    try:
        status = path.stat()
    except OSError:
        return realpath(path)
    return status.st_dev, status.st_ino


def write_whole(option: str, path: Path, content: bytes) -> None:
    """All of it or nothing, where that is a file; a pipe or a terminal takes what it gets. Raises `InputError`."""
    try:
        _write(Path(realpath(path)), content)
    except OSError as error:
        message = f"cannot write {path}: {(error.strerror or str(error)).lower()}"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(option))]) from None


def _write(path: Path, content: bytes) -> None:
    if lexists(path) and not path.is_file():
        path.write_bytes(content)
        return
    part = path.with_name(f"{path.name}.part")
    try:
        part.write_bytes(content)
        part.replace(path)
    except OSError:
        part.unlink(missing_ok=True)
        raise
