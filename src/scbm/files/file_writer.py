"""Write files: all of the content or nothing, and never over a file that the command reads."""

from __future__ import annotations

import errno
import os
import stat
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from os import urandom
from os.path import lexists, realpath
from pathlib import Path
from types import MappingProxyType
from typing import IO, TYPE_CHECKING

from scbm.files.codec.model_files import files_used_by
from scbm.files.yaml.text_files import open_input
from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

_NEW_FILE_MODE = 0o666
"""The permissions of a new file before the umask of the process is applied, as for `open`."""

_SQLITE = b"SQLite format 3\0"
"""The first bytes of a database of SQLite."""


_COMMAND_INPUTS: ContextVar[Callable[[], Iterable[tuple[Path, str]]]] = ContextVar("command inputs", default=tuple)


@contextmanager
def protecting(inputs: Callable[[], Iterable[tuple[Path, str]]]) -> Iterator[None]:
    """Let no `FileWriter` overwrite the inputs of a command while it runs.

    Args:
        inputs: returns the files that the command line names, each with what it is in words. It is called only where
            an output exists already, since it may have to search directories.
    """
    before = _COMMAND_INPUTS.set(inputs)
    try:
        yield
    finally:
        _COMMAND_INPUTS.reset(before)


class FileWriter:
    """Writes the output files of one command, and refuses to overwrite the files that the command reads."""

    def __init__(
        self,
        inputs: Iterable[tuple[Path, str]] = (),
        model: Path | None = None,
        *,
        other_models: Sequence[Path] = (),
        edited: Path | None = None,
    ) -> None:
        """Take the files that the command reads, in addition to those that its command line names (`protecting`).

        Args:
            inputs: files, each with what it is in words, such as `the case`.
            model: the model file. The files that it uses count as read, too.
            other_models: further files that may be the model, with the files that they use.
            edited: a file of the command line that the command edits in place.
        """
        self._models = (*([] if model is None else [model]), *other_models)
        self._inputs = (*inputs, *((path, "the model") for path in self._models))
        self._edited = edited

    def refuse_clashes(self, outputs: Mapping[str, Path]) -> None:
        """Raise `InputError` if two outputs are one file, or an output would replace an input.

        Symbolic links, hard links and other spellings of a path count as the file that they lead to.

        Args:
            outputs: the files to write, by the options that ask for them.
        """
        if wrong := list(self._clashes(outputs)):
            raise InputError(wrong)

    def refuse_outputs(
        self,
        files: Mapping[str, Path | None],
        directories: Mapping[str, Sequence[Path]] = MappingProxyType({}),
        stores: Mapping[str, Path | None] = MappingProxyType({}),
    ) -> None:
        """Raise `InputError` with all outputs that clash or cannot be written: before the work whose results they are.

        Nothing is created. What goes wrong later, such as a full disk, is an error while writing.

        Args:
            files: the files to write, by their options; `None` for none.
            directories: the directories to write files into, by their options; missing ones are made later.
            stores: stores to add to, by their options. Opening one says why it cannot be used.
        """
        given = {option: path for option, path in files.items() if path is not None}
        opened = {option: path for option, path in stores.items() if path is not None}
        wrong = list(self._clashes(given | opened))
        clashing = [each.place.file for each in wrong]
        for option, path in given.items():
            wrong += _unwritable(option, path, _file_problems) if option not in clashing else ()
        for option, paths in directories.items():
            wrong += dict.fromkeys(each for path in paths for each in _unwritable(option, path, _directory_problems))
        if wrong:
            raise InputError(wrong)

    def _clashes(self, outputs: Mapping[str, Path]) -> Iterator[Diagnostic]:
        owners: dict[object, str] = {}
        for path, words in (*self._inputs, *self._further_inputs(outputs.values())):
            owners.setdefault(_identity(path), words)
        for option, path in outputs.items():
            owner = owners.setdefault(_identity(path), option)
            if owner != option and not path.is_char_device():
                both = f"`{option}` and `{owner}` name the same file, {path}"
                message = both if owner.startswith("--") else f"{path} is also {owner}"
                yield _bad_output(option, message, "write it to another file")

    def _further_inputs(self, outputs: Iterable[Path]) -> Iterator[tuple[Path, str]]:
        """Yield the inputs of the command line and the files that models use.

        There are none if all outputs are new, so that most commands do not look for them.
        """
        if not any(map(lexists, outputs)):
            return
        edited = None if self._edited is None else _identity(self._edited)
        yield from ((path, words) for path, words in _COMMAND_INPUTS.get()() if _identity(path) != edited)
        for model in self._models:
            yield from ((path, f"a file that {model} uses") for path in files_used_by(model))

    def reads(self, path: Path) -> bool:
        """Return whether the command reads this file."""
        return _identity(path) in [_identity(known) for known, _ in (*self._inputs, *self._further_inputs([path]))]

    def write(self, option: str, path: Path, content: bytes) -> None:
        """Write a file as `replace_file` does. Raise `InputError` if it cannot be written, or is an input.

        Args:
            option: the option that asks for the file.
            path: where to.
            content: all of it.
        """
        self.refuse_clashes({option: path})
        try:
            replace_file(path, content)
        except OSError as error:
            message = f"cannot write {path}: {_reason(error)}"
            raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(option))]) from None

    def write_all(self, files: Mapping[Path, str], *, overwrite: bool, own: str | None = None) -> None:
        """Write the files of an output directory, each as `replace_file` does; make the directories above them.

        A file that has its text already is left as it is.

        Args:
            files: the text of each file.
            overwrite: whether a file with another text is replaced.
            own: how the texts begin that the command itself writes; files that begin so are replaced in any case.

        Raises:
            InputError: a file is an input, or is there and not to be overwritten, and then nothing is written; or a
                file cannot be written.
        """
        encoded = {path: _encoded(path, text) for path, text in files.items()}
        changed = {path: encoded[path] for path, text in files.items() if not has_text(path, text)}
        self.refuse_clashes({str(path): path for path in changed})
        if not overwrite:
            _refuse_existing(path for path in changed if own is None or not _begins_with(path, own))
        for path, content in changed.items():
            try:
                path.parent.mkdir(parents=True, exist_ok=True)
                replace_file(path, content)
            except OSError as error:
                place = Place(str(error.filename or path))
                message = f"cannot write the output here: {_reason(error)}"
                raise InputError([Diagnostic(Slug.BAD_OPTION, message, place)]) from None


def _bad_output(option: str, message: str, remedy: str) -> Diagnostic:
    return Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy)


def _unwritable(option: str, path: Path, problems: Callable[[Path], Iterator[tuple[str, str]]]) -> Iterator[Diagnostic]:
    """Yield why an output cannot be written, as far as that is known beforehand."""
    try:
        for message, remedy in problems(path):
            yield _bad_output(option, message, remedy)
    except OSError as error:  # such as a name that is too long
        yield _bad_output(option, f"cannot write {path}: {_reason(error)}", "name another")


def _file_problems(path: Path) -> Iterator[tuple[str, str]]:
    """Yield why `replace_file` cannot write a file, each with a remedy."""
    parent = Path(realpath(path)).parent  # of the file that a symbolic link leads to
    if path.is_dir():
        yield f"{path} is a directory", "name a file in it"
    elif not path.parent.is_dir():  # `missing/../file` is no file, whatever its resolved path is
        yield f"there is no directory `{path.parent}`", "name another, or make it"
    elif path.exists() and not os.access(path, os.W_OK):
        yield f"cannot write {path}: permission denied", "name another file"
    elif path.exists() and not path.is_file():
        return  # a pipe or a terminal
    elif path.exists() and _is_database(path):
        yield f"{path} is a database, such as a coverage store", "write to another file"
    elif not parent.is_dir():
        yield f"there is no directory `{parent}`", "name another, or make it"
    elif not os.access(parent, os.W_OK):
        yield f"cannot write into {path.parent}: permission denied", "name another directory"


def _is_database(path: Path) -> bool:
    with open_input(path) as stream:
        return stream.read(len(_SQLITE)) == _SQLITE


def _directory_problems(path: Path) -> Iterator[tuple[str, str]]:
    """Yield why files cannot be written into a directory, or why it cannot be made, each with a remedy."""
    known = next((each for each in (path, *path.parents) if lexists(each)), path)
    if not known.is_dir():
        yield f"{known} is no directory", "name a directory"
    elif not os.access(known, os.W_OK):
        yield f"cannot write into {known}: permission denied", "name another directory"


def replace_file(path: Path, content: bytes) -> None:
    """Write a file so that it has all of the content, or stays as it was. Raise `OSError` if it cannot be written.

    The content goes to a temporary file beside it and reaches the disk there before it takes its place. An existing
    file keeps its permissions, a symbolic link stays one. A pipe or a terminal takes the content as it comes.
    """
    if not path.parent.is_dir():  # resolved, `missing/../file` would be another file
        raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
    target = Path(realpath(path))
    if lexists(target) and not target.is_file():
        target.write_bytes(content)
        return
    mode = _mode_of(target)
    try:
        temporary, stream = _open_temporary(target)
    except OSError as error:
        raise OSError(error.errno, error.strerror, str(path)) from None  # users did not name the temporary file
    try:
        with stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        if mode is not None:
            temporary.chmod(mode)
        temporary.replace(target)
    except BaseException as error:
        with suppress(OSError):
            temporary.unlink()
        if isinstance(error, OSError):
            raise OSError(error.errno, error.strerror, str(path)) from None
        raise


def _open_temporary(target: Path) -> tuple[Path, IO[bytes]]:
    """Create a temporary file beside `target`, with a name that no file has, and open it for writing."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
    while True:
        path = target.with_name(f".scbm-{urandom(8).hex()}.part")
        with suppress(FileExistsError):
            return path, os.fdopen(os.open(path, flags, _NEW_FILE_MODE), "wb")


def _mode_of(path: Path) -> int | None:
    """Return the permissions of a file; `None` if there is no file. Raise `PermissionError` if it is read-only."""
    if not path.exists():
        return None
    if not os.access(path, os.W_OK):
        raise PermissionError(errno.EACCES, "permission denied", str(path))
    return stat.S_IMODE(path.stat().st_mode)


def _refuse_existing(paths: Iterable[Path]) -> None:
    """Raise `InputError` for all files that are there."""
    message = "this file exists already, with other content"
    existing = [path for path in paths if lexists(path)]
    if existing:
        remedy = "save into another directory, or move this file away"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(str(path)), remedy) for path in existing])


def has_text(path: Path, text: str) -> bool:
    """Return whether the file has exactly this text."""
    try:
        with open_input(path) as stream:
            return stream.read() == text.encode()
    except (OSError, ValueError):
        return False


def _begins_with(path: Path, beginning: str) -> bool:
    """Return whether the text of the file begins so."""
    try:
        with open_input(path) as stream:
            return stream.read(len(beginning.encode())) == beginning.encode()
    except (OSError, ValueError):
        return False


def _reason(error: OSError) -> str:
    return (error.strerror or str(error)).lower()


def _identity(path: Path) -> object:
    """Return the identity of a file under all its names: device and inode, or the resolved path of a new file."""
    resolved = realpath(path)
    for spelling in (path, Path(resolved)):  # `missing/../file` is no path yet, and is one once a directory is made
        with suppress(OSError, ValueError):
            status = spelling.stat()
            return status.st_dev, status.st_ino
    return resolved


def _encoded(path: Path, text: str) -> bytes:
    """Return the text as UTF-8. Raise `InputError` if it has the name of a file that is not UTF-8."""
    try:
        return text.encode()
    except UnicodeEncodeError:
        message = "a file name in the text is not UTF-8, so the text cannot be written"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(str(path)), "rename that file")]) from None
