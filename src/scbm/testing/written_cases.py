"""Cases in files: finding them, reading them all with all their errors at once, and saving them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.files import is_model_text, open_case, open_input, write_case
from scbm.model import Diagnostic, InputError, Place, Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases import Case
    from scbm.model import BehaviorModel

SUFFIXES = (".yaml", ".yml")

_SNIFFED_BYTES = 65_536


@dataclass(frozen=True, slots=True)
class WrittenCase:
    """A case and the file that it was read from.

    Attributes:
        model_path: the model file that it names, if it does.
    """

    case: Case
    path: Path
    model_path: Path | None


def find_case_files(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return the case files of paths: files as they are, and all YAML files below directories except models.

    Files below a directory come in the order of their paths; what begins with a dot is passed over.

    Raises:
        InputError: a directory has no case files below it.
    """
    found: dict[Path, None] = {}
    empty = []
    for path in paths:
        files = list(_below(path)) if os.path.isdir(path) else [path]  # noqa: PTH112 - a path too long is none, and no error
        if not files:
            remedy = "a case file ends in .yaml and begins with `case:`"
            empty.append(Diagnostic(Slug.NO_CASES, "there are no case files below", Place(str(path)), remedy))
        found |= dict.fromkeys(files)
    if empty:
        raise InputError(empty)
    return tuple(found)


def _below(directory: Path) -> Iterator[Path]:
    for path in sorted(directory.rglob("*")):
        inner = path.relative_to(directory)
        is_hidden = any(part.startswith(".") for part in inner.parts)
        if path.suffix in SUFFIXES and not is_hidden and path.is_file() and not _is_model(path):
            yield path


def _is_model(path: Path) -> bool:
    try:
        with open_input(path) as stream:
            return is_model_text(stream.read(_SNIFFED_BYTES).decode("utf-8", errors="replace"))
    except OSError:
        return False  # reading it will report the error


def load_suite(paths: Iterable[Path], model: BehaviorModel) -> tuple[WrittenCase, ...]:
    """Return the cases in files, for a model. Raises `InputError` with the errors of all files."""
    wrong: list[Diagnostic] = []
    cases: dict[str, WrittenCase] = {}
    for path in find_case_files(paths):
        try:
            document = open_case(path)
            case = document.read(model)
        except InputError as error:
            wrong += error.diagnostics
            continue
        if case.name in cases:
            message = f"the case `{case.name}` is also in {cases[case.name].path}"
            wrong.append(Diagnostic(Slug.DUPLICATE_NAME, message, Place(str(path)), "give it another name"))
        cases.setdefault(case.name, WrittenCase(case, path, document.model_path))
    if wrong:
        raise InputError(wrong)
    return tuple(cases.values())


def case_texts(
    cases: Iterable[tuple[Case, Sequence[str]]], directory: Path, model: BehaviorModel, model_file: Path
) -> dict[Path, str]:
    """Return the texts of case files, each by the path of its file in a directory.

    Args:
        cases: each case, with the lines of the comment at the top of its file.
        directory: of the files, which are named after the cases.
        model: the model of the cases.
        model_file: its file, which the case files name.
    """
    shown = Path(os.path.relpath(model_file, directory)).as_posix()
    return {directory / f"{case.name}.yaml": write_case(case, model, shown, comment) for case, comment in cases}
