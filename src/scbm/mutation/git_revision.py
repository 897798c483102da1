"""`--since`: the entries of a model that changed since a revision in git."""

from __future__ import annotations

import subprocess
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cli.options.option_errors import option_error
from scbm.files import load_model, real_path
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.mutation.mutants import SubjectKind, entries_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import BehaviorModel

_OPTION = "--since"

_SUFFIXES = (".yaml", ".yml")
"""Files that parts may be in; the model itself may have any name."""

_FILE_MODES = ("100644", "100755")
"""The modes by which `git ls-tree` marks files; symbolic links and submodules have others."""


def changed_since(revision: str, model: BehaviorModel, path: Path) -> tuple[tuple[SubjectKind, str], ...]:
    """Return the kind and the name of each entry of a model that is new or changed since a revision.

    The files of parts below the folder of the model are those of the revision, too. An operation that stands behind
    another one than before counts as changed, as the order decides between plans of the same length.

    Args:
        revision: anything that names a commit, such as `main` or `HEAD~3`.
        model: the model as it is now.
        path: its file, inside a work tree of git.

    Raises:
        InputError: git is not there, or knows no such revision; or the file was no model then.
    """
    return tuple(_changed(_model_at(revision, path), model))


def _changed(before: BehaviorModel, after: BehaviorModel) -> Iterator[tuple[SubjectKind, str]]:
    for kind, new in entries_of(after).items():
        old = entries_of(before)[kind]
        known = {entry.name: entry for entry in old}
        moved = _moved([entry.name for entry in old], [entry.name for entry in new]) if kind in _ORDERED else ()
        yield from ((kind, entry.name) for entry in new if known.get(entry.name) != entry or entry.name in moved)


_ORDERED = (SubjectKind.OPERATION, SubjectKind.AUTOMATIC)
"""The entries whose order has a meaning."""


def _moved(before: Iterable[str], after: Iterable[str]) -> tuple[str, ...]:
    """Return the names that both lists have, and that follow another one of these names than before."""
    known = dict.fromkeys(after)
    old = [name for name in before if name in known]
    had = dict.fromkeys(old)
    new = [name for name in known if name in had]
    follows = dict(zip(old, ["", *old], strict=False))
    return tuple(name for name, previous in zip(new, ["", *new], strict=False) if follows[name] != previous)


def _model_at(revision: str, path: Path) -> BehaviorModel:
    """Return the model as it was in a revision. Raise `InputError`; its places name the revision."""
    commit = _text(_git(path, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")).strip()
    if not commit:
        message = f"git knows no revision `{revision}` where the model is"
        remedy = "name a branch, a tag or a commit, such as `main` or `HEAD~1`"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(_OPTION, 1, 1, len(revision)), remedy, revision)])
    with TemporaryDirectory() as directory:
        folder = Path(directory).resolve()
        _write_files(path, commit, folder)
        if not (folder / path.name).exists():
            message = f"`{revision}` has no file {path}"
            raise option_error(_OPTION, message, f"leave out `{_OPTION}`: all of it is new")
        try:
            return load_model(folder / path.name)
        except InputError as error:
            raise InputError([_at(revision, folder, found) for found in error.diagnostics]) from None


def _at(revision: str, folder: Path, found: Diagnostic) -> Diagnostic:
    """Return an error in a file of a folder as one in a revision."""
    place = replace(found.place, file=found.place.file.replace(f"{folder}/", f"{revision}:"))
    return replace(found, message=found.message.replace(f"{folder}/", f"{revision}:"), place=place)


def _write_files(path: Path, commit: str, folder: Path) -> None:
    """Write the model of a commit, and the files below its folder that can be parts, into another folder."""
    listed = _text(_git(path, "ls-tree", "-r", "-z", commit, "--", "."))
    names: dict[str, str] = {}
    for entry in filter(None, listed.split("\0")):
        facts, _, name = entry.partition("\t")
        mode, _, blob = facts.split()
        if mode in _FILE_MODES and ".." not in Path(name).parts and (name == path.name or name.endswith(_SUFFIXES)):
            names[name] = blob
    left = _git(path, "cat-file", "--batch", lines=names.values()) or b""
    for name in names:
        head, _, left = left.partition(b"\n")  # of each blob its name, its kind and its size, then its bytes
        size = int(head.split()[2])
        target = folder / name
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(left[:size])
        left = left[size + 1 :]


def _text(printed: bytes | None) -> str:
    return (printed or b"").decode("utf-8", "surrogateescape")


def _git(path: Path, *arguments: str, lines: Iterable[str] = ()) -> bytes | None:
    """Return what a command of git prints in the directory of a file; `None` if git refuses it.

    No shell reads the arguments, and git takes none of them for an option.

    Args:
        path: the file.
        arguments: the command.
        lines: what the command reads.
    """
    directory = real_path(path).parent
    try:
        done = subprocess.run(  # noqa: S603 - no shell, and a fixed program
            ["git", "-C", str(directory), *arguments],  # noqa: S607 - the git of the user
            capture_output=True,
            check=False,
            input="".join(f"{line}\n" for line in lines).encode(),
        )
    except OSError:
        remedy = f"install git, or leave out `{_OPTION}`"
        raise option_error(_OPTION, "git cannot be run", remedy) from None
    return done.stdout if done.returncode == 0 else None
