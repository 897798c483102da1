"""Cases in files: finding them, reading and saving them, and recording the results of their runs (decision 49)."""

from __future__ import annotations

import os
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct
from msgspec.structs import replace

from scbm.files import is_model_text, open_case, open_input, read_file, write_case
from scbm.files.file_writer import replace_file
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.testing.recorded_results import RecordedDifference, differences_of_record, is_same_planner

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases import Case, RecordedGoal, RecordedRun
    from scbm.model import BehaviorModel
    from scbm.testing.tester import Execution, Tester


SUFFIXES = (".yaml", ".yml")

_SNIFFED_BYTES = 65_536


class WrittenCase(Struct, frozen=True):
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


class RecordingMode(NamedTuple):
    """Which files are changed.

    Attributes:
        adds: whether files without a recorded result get one.
        updates: whether a recorded result is replaced that differs from that of the run.
    """

    adds: bool
    updates: bool


class RecordingStatus(StrEnum):
    """The action of recording on the file of a case."""

    ADDED = "added"
    UPDATED = "updated"
    EQUAL = "equal"
    """The run is the recorded one."""
    FAILED = "failed"
    """The case fails, so it records nothing."""
    LEFT = "left"
    """The mode leaves such files as they are."""


class CaseRecording(Struct, frozen=True):
    """The recording of one case: the action on its file, and the differences.

    Attributes:
        written: the case with its file; with the new result where the file gets one.
        status: what is done.
        differences: the parts in which the run differs from the recorded one.
        text: the new text of the file; `None` if it stays as it is.
    """

    written: WrittenCase
    status: RecordingStatus
    differences: tuple[RecordedDifference, ...] = ()
    text: str | None = None


def recordings_of(
    tester: Tester, cases: Iterable[tuple[WrittenCase, Case]], mode: RecordingMode
) -> tuple[CaseRecording, ...]:
    """Run cases and return what is to be done with their files. Nothing is written.

    Args:
        tester: runs the cases.
        cases: the cases as their files have them, each with what the command line adds to it.
        mode: which files are changed.

    Raises:
        InputError: the layout of some files does not allow the edit; with the errors of all files.
    """
    found: list[CaseRecording] = []
    wrong: list[Diagnostic] = []
    for written, completed in cases:
        try:
            found.append(_recording(tester, written, completed, mode))
        except InputError as error:
            wrong += error.diagnostics
    if wrong:
        raise InputError(wrong)
    return tuple(found)


def write_recordings(recordings: Iterable[CaseRecording]) -> None:
    """Write the files that change, each as `replace_file` does. Raise `InputError` for all that cannot be written."""
    wrong = []
    for each in recordings:
        if each.text is None:
            continue
        try:
            replace_file(each.written.path, each.text.encode())
        except OSError as error:
            message = f"cannot write the file: {(error.strerror or str(error)).lower()}"
            wrong.append(Diagnostic(Slug.BAD_OPTION, message, Place(str(each.written.path))))
    if wrong:
        raise InputError(wrong)


def _recording(tester: Tester, written: WrittenCase, completed: Case, mode: RecordingMode) -> CaseRecording:
    old = written.case.recorded
    is_new = old is None or not old.goals
    if not (mode.adds if is_new else mode.updates):
        return CaseRecording(written, RecordingStatus.LEFT)
    execution = tester.execute(_without_goals(completed))
    if not execution.verdict.passed:
        return CaseRecording(written, RecordingStatus.FAILED)
    differences = () if is_new else tuple(_differences(written.case, execution))
    if not is_new and not differences:
        return CaseRecording(written, RecordingStatus.EQUAL)
    case = replace(written.case, recorded=_record(execution, old))
    text = _edited(written.path, case.recorded, tester.model)
    status = RecordingStatus.ADDED if is_new else RecordingStatus.UPDATED
    return CaseRecording(replace(written, case=case), status, differences, text)


def _without_goals(case: Case) -> Case:
    """Return the case without a result to compare its run with; its plans still have their planner."""
    return case if case.recorded is None else replace(case, recorded=replace(case.recorded, goals=()))


def _differences(case: Case, execution: Execution) -> Iterable[RecordedDifference]:
    old, planner = case.recorded, execution.trace.planner
    if old is not None and not is_same_planner(old.planner, planner):
        yield RecordedDifference("planner", f"it was `{old.planner}` and is `{planner}`")
    yield from differences_of_record(case, execution.recorded_goals)


def _record(execution: Execution, old: RecordedRun | None) -> RecordedRun:
    """Return the result of a run, with those parts that the old one has: a person may have removed some."""
    found = execution.recorded
    kept = _kept(found.goals, () if old is None else old.goals)
    return replace(found, trace=None if old is None or old.trace is None else found.trace, goals=kept)


def _kept(found: Sequence[RecordedGoal], old: Sequence[RecordedGoal]) -> tuple[RecordedGoal, ...]:
    if len(found) != len(old):
        return tuple(found)
    return tuple(
        replace(
            new,
            visits=None if before.visits is None else new.visits,
            order=None if before.order is None else new.order,
            final=None if before.final is None else new.final,
            ended_ns=None if before.ended_ns is None else new.ended_ns,
        )
        for new, before in zip(found, old, strict=True)
    )


def _edited(path: Path, recorded: RecordedRun | None, model: BehaviorModel) -> str:
    if recorded is None:
        raise AssertionError("only a case with a result is recorded")
    from scbm.files.record_editing import with_record  # noqa: PLC0415 - few campaigns change case files

    return with_record(read_file(path), str(path), recorded, model)
