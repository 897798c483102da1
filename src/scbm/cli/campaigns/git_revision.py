"""`--since`: the entries of a model that changed since a revision in git."""

from __future__ import annotations

import subprocess
from typing import TYPE_CHECKING

from scbm.cli.options.option_errors import option_error
from scbm.files import read_model
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.testing.mutants import SubjectKind

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from scbm.model import BehaviorModel

_OPTION = "--since"


def changed_since(revision: str, model: BehaviorModel, path: Path) -> tuple[tuple[SubjectKind, str], ...]:
    """Return the kind and the name of each entry of a model that is new or changed since a revision.

    Args:
        revision: anything that names a commit, such as `main` or `HEAD~3`.
        model: the model as it is now.
        path: its file, inside a work tree of git.

    Raises:
        InputError: git is not there, or knows no such revision; or the file was no model then.
    """
    before = read_model(_text_at(revision, path), f"{revision}:{path.name}")
    return tuple(_changed(before, model))


def _changed(before: BehaviorModel, after: BehaviorModel) -> Iterator[tuple[SubjectKind, str]]:
    sections = (
        (SubjectKind.VARIABLE, before.variables, after.variables),
        (SubjectKind.RESOURCE, before.resources, after.resources),
        (SubjectKind.OPERATION, before.operations, after.operations),
        (SubjectKind.AUTOMATIC, before.automatic_transitions, after.automatic_transitions),
        (SubjectKind.ENVIRONMENT, before.environment, after.environment),
    )
    for kind, old, new in sections:
        known = {entry.name: entry for entry in old}
        yield from ((kind, entry.name) for entry in new if known.get(entry.name) != entry)


def _text_at(revision: str, path: Path) -> str:
    """Return the text of a file in a revision. Raise `InputError`."""
    commit = _git(path, "rev-parse", "--verify", "--quiet", "--end-of-options", f"{revision}^{{commit}}")
    if commit is None:
        message = f"git knows no revision `{revision}` where the model is"
        remedy = "name a branch, a tag or a commit, such as `main` or `HEAD~1`"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(_OPTION, 1, 1, len(revision)), remedy, revision)])
    text = _git(path, "show", f"{commit.strip()}:./{path.name}")
    if text is None:
        message = f"`{revision}` has no file {path}"
        raise option_error(_OPTION, message, f"leave out `{_OPTION}`: all of it is new")
    return text


def _git(path: Path, *arguments: str) -> str | None:
    """Return what a command of git prints in the directory of a file; `None` if git refuses it.

    No shell reads the arguments, and git takes none of them for an option.
    """
    directory = path.resolve().parent
    try:
        done = subprocess.run(  # noqa: S603 - no shell, and a fixed program
            ["git", "-C", str(directory), *arguments],  # noqa: S607 - the git of the user
            capture_output=True,
            check=False,
            encoding="utf-8",
            errors="replace",
            stdin=subprocess.DEVNULL,
        )
    except OSError:
        remedy = f"install git, or leave out `{_OPTION}`"
        raise option_error(_OPTION, "git cannot be run", remedy) from None
    return done.stdout if done.returncode == 0 else None
