"""Writes the cases and certificates of closing into a directory.

Files that closing did not write, or that it wrote for another model, are never overwritten or removed.
"""

from __future__ import annotations

import os
from pathlib import Path
from textwrap import wrap
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.closing.certificate_files import SUFFIX, is_certificate_text, model_path_in
from scbm.closing.proof_reasons import REASONS_SUFFIX, is_reasons_text, reasons_text
from scbm.closing.summaries import in_few_words
from scbm.files import FileWriter, open_input, real_path, without_detours
from scbm.model import Diagnostic, InputError, Place, PlannerChoice, Slug
from scbm.planning import planner_of_random_runs

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from scbm.cases import Case
    from scbm.closing.decisions import Closing, ClosingCase
    from scbm.model import BehaviorModel

_CASES = "cases"
_OTHER_PLANS = "other_plans"
"""Cases with other plans than those of the planner violate what holds under these, so no suite should have them."""

_CERTIFICATES = "certificates"
_OWN = "# closed by scbm: "
"""The beginning of the first line of a case file that closing wrote."""

_COLUMNS = 110

_SNIFFED_BYTES = 4_096


class ClosingFiles(Struct, frozen=True):
    """The files that were written.

    Attributes:
        directory: the directory.
        cases: the files of the new cases, by name.
        certificates: the files of the certificates, by name.
        removed: files of an earlier closing that are outdated.
        other_plans: the files of the cases with other plans than those of the planner, by name.
    """

    directory: Path
    cases: Mapping[str, Path]
    certificates: Mapping[str, Path]
    removed: tuple[Path, ...] = ()
    other_plans: Mapping[str, Path] = {}

    @property
    def files(self) -> dict[str, str]:
        """The file of each written case, by its name."""
        return {name: str(path) for name, path in (*self.cases.items(), *self.other_plans.items())}

    @property
    def suite(self) -> Path:
        """The directory of all cases that the runs of the planner pass or fail."""
        return self.directory / _CASES if self.other_plans else self.directory


def refuse_output(model_file: Path, directory: Path | None, store: Path | None, *, edits_model: bool) -> None:
    """Raise `InputError` if closing cannot write into its directory, or cannot edit the model that it has to."""
    directories = [] if directory is None else [directory / name for name in (_CASES, _OTHER_PLANS, _CERTIFICATES)]
    edited = model_file if edits_model and model_file.is_file() else None
    FileWriter(edited=edited).refuse_outputs({"--write": edited}, {"--out": directories}, {"--store": store})


def write_output(closing: Closing, directory: Path, model_file: Path, suite: Collection[Path] = ()) -> ClosingFiles:
    """Write cases and certificates into their directories, and remove those of an earlier closing.

    Args:
        closing: the result of closing.
        directory: the output directory; created if missing.
        model_file: the model file, which cases and certificates name.
        suite: the files of the closed suite: they are kept, even if an earlier closing wrote them.

    Raises:
        InputError: a file cannot be written, or a file of the same name exists that closing did not write, or wrote for
            another model. In the last two cases nothing is written.
    """
    from scbm.proofcheck import certificate_text  # noqa: PLC0415 - the formats of files, which few closings write

    made_cases = (*closing.cases, *closing.counterexamples)
    cases = {made.case.name: directory / _CASES / f"{made.case.name}.yaml" for made in made_cases}
    others = closing.cases_with_other_plans
    other_plans = {made.case.name: directory / _OTHER_PLANS / f"{made.case.name}.yaml" for made in others}
    certificates = {name: directory / _CERTIFICATES / f"{name}{SUFFIX}" for name, _ in closing.certificates}
    paths = cases | other_plans
    texts = {
        paths[made.case.name]: _case_text(made, closing.model, paths[made.case.name], model_file)
        for made in (*made_cases, *others)
    }
    reasons = {str(decided.obligation): decided.reason for decided in closing.decided}
    for name, certificate in closing.certificates:
        shown = _seen_from(certificates[name].parent, model_file)
        texts[certificates[name]] = certificate_text(certificate, shown)
        texts[certificates[name].with_suffix(REASONS_SUFFIX)] = reasons_text(certificate, reasons)
    kept = {real_path(path) for path in suite}
    _refuse_to_lose(texts, kept, model_file)
    before = _written_before(directory, model_file)
    removed = tuple(path for path in before if path not in texts and real_path(path) not in kept)
    FileWriter([(path, "a case file") for path in suite], model_file).write_all(texts, overwrite=True)
    _remove(removed)
    return ClosingFiles(directory, cases, certificates, removed, other_plans)


def _case_text(made: ClosingCase, model: BehaviorModel, path: Path, model_file: Path) -> str:
    from scbm.files import write_case  # noqa: PLC0415 - as above

    shown = _seen_from(path.parent, model_file)
    return write_case(_recorded_case(made, model), model, shown, tuple(_comment(made, model)))


def _recorded_case(made: ClosingCase, model: BehaviorModel) -> Case:
    """Return a case with its run; with plans and trace too if `model` names a planner or limits.

    A replay under others is another run then. Else the trace is left out, since any change of the model changes it.
    """
    recorded = made.execution.recorded
    if made.case.plans:  # they need not be canonical
        recorded = replace(recorded, planner=planner_of_random_runs(model))
    if model.planner == PlannerChoice():
        return replace(made.case, recorded=replace(recorded, trace=None) if recorded.goals else None)
    return replace(made.case, recorded=recorded, plans=made.execution.plans_to_keep)


def _comment(made: ClosingCase, model: BehaviorModel) -> Iterator[str]:
    """Yield what a case adds to the cases before it."""
    adds = " that adds" if made.adds_freely else ""
    violates = f" that violates {made.violates}" if made.violates else ""
    violates += " with other plans than those of its planner" if made.has_other_plans else ""
    yield f"{_OWN.removeprefix('# ')}a case of {model.name}{adds}{violates}"
    for words in in_few_words(made.adds_freely):
        yield from wrap(words, _COLUMNS, initial_indent="  ", subsequent_indent="    ", break_long_words=False)
    if made.forcing is None:
        return
    yield from wrap(f"its state is {made.forcing}; there it adds", _COLUMNS, break_long_words=False)
    for words in in_few_words(made.adds_by_force):
        yield from wrap(words, _COLUMNS, initial_indent="  ", subsequent_indent="    ", break_long_words=False)


def _seen_from(directory: Path, file: Path) -> str:
    return Path(os.path.relpath(file, directory)).as_posix()


def _refuse_to_lose(texts: Mapping[Path, str], kept: Collection[Path], model_file: Path) -> None:
    lost = [found for path, text in texts.items() for found in _what_would_be_lost(path, text, kept, model_file)]
    if lost:
        raise InputError(lost)


def _what_would_be_lost(path: Path, text: str, kept: Collection[Path], model_file: Path) -> Iterator[Diagnostic]:
    if not os.path.lexists(path) or _text_of(path) == text:
        return
    message, remedy = "this file exists already, and closing did not write it", "or move this file away"
    if _is_own(path) and real_path(path) not in kept:
        other = _other_model(path, model_file)
        if other is None:
            return
        message, remedy = f"closing wrote this file for another model, {other}", "one for each model"
    yield Diagnostic(Slug.BAD_OPTION, message, Place(str(path)), f"write into another directory, {remedy}")


def _written_before(directory: Path, model_file: Path) -> Iterator[Path]:
    """Yield the files that an earlier closing of the model wrote."""
    cases = (path for name in (_CASES, _OTHER_PLANS) for path in _entries(directory / name, ".yaml"))
    for path in (*cases, *_entries(directory / _CERTIFICATES, SUFFIX)):
        if _is_own(path) and _other_model(path, model_file) is None:
            yield path
            reasons = path.with_suffix(REASONS_SUFFIX)
            if path.suffix == SUFFIX and _is_own(reasons):
                yield reasons


def _other_model(path: Path, model_file: Path) -> Path | None:
    """Return the model file of a file that closing wrote, if it is a different one."""
    try:
        named = _model_in(path)
        return None if named is None or real_path(named) == real_path(model_file) else named
    except (InputError, OSError, ValueError):
        return None  # damaged: it belongs to no model


def _model_in(path: Path) -> Path | None:
    """Return the model file that a case or a certificate names."""
    if path.suffix == REASONS_SUFFIX:
        path = path.with_suffix(SUFFIX)
    if path.suffix == SUFFIX:
        return model_path_in(_text_of(path, _SNIFFED_BYTES) or "", path)
    from scbm.files import open_case  # noqa: PLC0415 - as above

    named = open_case(path).model_path
    return None if named is None else without_detours(named)


def _entries(directory: Path, suffix: str) -> Sequence[Path]:
    try:
        return sorted(path for path in directory.iterdir() if path.suffix == suffix)
    except OSError:
        return ()  # writing will fail, too, with the reason


def _is_own(path: Path) -> bool:
    """Return whether closing wrote the file: a case with its comment, or a certificate or reasons by their format."""
    text = _text_of(path, _SNIFFED_BYTES)
    if text is None:
        return False
    if path.suffix == REASONS_SUFFIX:
        return is_reasons_text(text)
    return is_certificate_text(text) if path.suffix == SUFFIX else text.startswith(_OWN)


def _text_of(path: Path, most: int = -1) -> str | None:
    """Return the text of a file, or its beginning; `None` if it is no file, or cannot be read."""
    try:
        with open_input(path) as stream:
            return stream.read(most).decode("utf-8", errors="strict" if most < 0 else "replace")
    except (OSError, UnicodeDecodeError):
        return None


def _remove(paths: Iterable[Path]) -> None:
    """Remove files. Raise `InputError` if one cannot be removed."""
    for path in paths:
        try:
            path.unlink()
        except OSError as error:
            message = f"cannot remove this file: {(error.strerror or str(error)).lower()}"
            raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(str(path)))]) from None
