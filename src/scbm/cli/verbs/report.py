"""`scbm report`: reports the contents of a coverage store on the terminal and in files for other tools.

It has an option for each entry of `FORMATS`.
"""

import os
from collections.abc import Iterable, Iterator, Mapping
from itertools import count
from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec import Struct
from msgspec.structs import replace
from rich.text import Text
from typer.models import OptionInfo

from scbm.cases.case import BETWEEN_GOALS, CaseGoalNames
from scbm.cases.coverage import Cover, smallest_cover
from scbm.cli.options.campaign_options import meets_thresholds, read_thresholds
from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.registry_options import OptionPerEntry
from scbm.cli.options.status_options import Certificates, WaiversFile, stored_evidence
from scbm.cli.options.verb_options import FailUnder, Json, Missing, ShowAll
from scbm.cli.output.terminal import activity_display, errors, report_columns, results, write_json
from scbm.files import FileWriter, without_detours
from scbm.model import Diagnostic, InputError
from scbm.model.visible_text import counted
from scbm.reports.ci.history_json import history_json, smallest_json
from scbm.reports.cover_advice import CampaignKind
from scbm.reports.formats import FORMATS, ReportFormat
from scbm.reports.run_changes import run_in_words
from scbm.reports.terminal.coverage_report import missing_lines
from scbm.reports.terminal.store_report import stored_report
from scbm.reports.terminal.visitors_report import contexts_report, smallest_report
from scbm.store import History, Replays, StoredCase, StoredRun, Written, compare_runs, earlier_runs, read_history
from scbm.testing import Execution, case_texts, find_case_files

_LAST_RUN = "last"

_MAX_RUNS = 10
"""Maximum number of runs that an error lists."""

_SLOW = 200
"""Minimum number of cases for a display of progress while they are run again."""


def _format_options() -> dict[str, tuple[Any, OptionInfo]]:
    return {
        name: (
            Path | None,
            HelpSection.FILES.option(f"--{name}", metavar="FILE", help=form.help),
        )
        for name, form in FORMATS.items()
    }


FORMAT_OPTIONS = OptionPerEntry(_format_options)
"""Marks the parameter of a verb that gets the files by the names of their formats."""


class ReportFiles(Struct, frozen=True):
    """The files to write, by the names of their formats."""

    files: Mapping[str, Path | None]

    @property
    def given(self) -> dict[str, Path]:
        """The files of the formats that were given."""
        return {option: path for option, path in self.files.items() if path is not None}

    def writer(self, store: Path, history: History, save: Path | None) -> FileWriter:
        """Return a writer for these files that refuses to replace the models and case files of a store, too.

        Raises:
            InputError: two formats are one file, one of them is such an input, or it or `save` cannot be written.
        """
        models, cases = _stored_paths(history)
        files = [(path, "a case file") for each in cases for path in _places(each, store)]
        writer = FileWriter(files, other_models=[path for each in models for path in _places(each, store)])
        files_by_option = {f"--{name}": path for name, path in self.files.items()}
        writer.refuse_outputs(files_by_option, {"--save": [] if save is None else [save]})
        return writer


def _places(path: str, store: Path) -> tuple[Path, ...]:
    """Return where a path of a store may lead to: from the present directory, and from the directory of the store.

    A store has paths as its command lines named them, and does not say in which directory.
    """
    return tuple(dict.fromkeys([Path(path), store.parent / path]))


def _found(path: str, store: Path) -> str:
    """Return the path to the file that a path of a store leads to; the path itself if there is no such file."""
    there = next((each for each in _places(path, store) if os.path.isfile(each)), None)  # noqa: PTH113 - a path too long is none
    return path if there is None or there == Path(path) else str(without_detours(there))


def _with_found_files(history: History, store: Path) -> History:
    """Return the history with the paths that lead to its model and its case files from here."""
    models, files = _stored_paths(history)
    found = {path: _found(path, store) for path in (*models, *files)}
    if all(path == there for path, there in found.items()):
        return history
    runs = (replace(run, source=replace(run.source, path=found[run.source.path])) for run in history.runs)
    return replace(history, runs=tuple(runs), cases=tuple(_with_paths(case, found) for case in history.cases))


def _with_paths(case: StoredCase, found: Mapping[str, str]) -> StoredCase:
    """Return a case with other paths of its file and of its smallest cases."""
    recipe = case.recipe
    if isinstance(recipe, Written):
        recipe = replace(recipe, path=found[recipe.path])
    return replace(case, recipe=recipe, smallest=tuple(replace(s, path=found.get(s.path, "")) for s in case.smallest))


def _stored_paths(history: History) -> tuple[dict[str, None], dict[str, None]]:
    """Return the paths of the models, and those of the case files, with those of smallest cases."""
    files = (case.recipe.path for case in history.cases if isinstance(case.recipe, Written))
    smallest = (each.path for case in history.cases for each in case.smallest if each.path)
    return dict.fromkeys(run.source.path for run in history.runs), dict.fromkeys((*files, *smallest))


def write_formats(wanted: ReportFiles, history: History, writer: FileWriter) -> list[str]:
    """Write the files, and return their names.

    Raises `InputError` with all files that cannot be written.
    """
    wrong: list[Diagnostic] = []
    for name, path in wanted.given.items():
        try:
            writer.write(f"--{name}", path, _text(FORMATS[name], history).encode())
        except InputError as error:
            wrong += error.diagnostics
    if wrong:
        raise InputError(wrong)
    return [str(path) for path in wanted.given.values()]


def _text(form: ReportFormat, history: History) -> str:
    """Return the report; show the progress while many cases are run again for it."""
    replays = Replays(history)
    if not form.runs_cases or len(history.cases) < _SLOW:
        return form.text(history, replays.execute)
    numbers = count(1)
    with activity_display("running the cases again") as show:

        def run_again(case: StoredCase) -> Execution | None:
            show(f"running the cases again: {next(numbers)} of {len(history.cases)}")
            return replays.execute(case)

        return form.text(history, run_again)


def command(
    store: Annotated[Path, typer.Argument(help="The coverage store.", show_default=False), Reads("the store")],
    *,
    missing: Missing = False,
    shows_all: ShowAll = False,
    contexts: Annotated[
        bool, HelpSection.OUTPUT.option("--contexts", help="Show the cases that visit each obligation.")
    ] = False,
    minimize: Annotated[
        bool, HelpSection.OUTPUT.option("--minimize", help="Show the smallest suite with the same coverage.")
    ] = False,
    save: Annotated[
        Path | None,
        HelpSection.OUTPUT.option("--save", metavar="DIRECTORY", help="Save the cases of that suite as files."),
    ] = None,
    since: Annotated[
        str | None,
        HelpSection.OUTPUT.option(
            "--since",
            metavar="RUN",
            help="Compare the last run with this earlier one: `last`, or the first digits of its id.",
        ),
    ] = None,
    files: Annotated[Mapping[str, Path | None], FORMAT_OPTIONS],
    fail_under: FailUnder = None,
    certificates: Certificates = None,
    waivers: WaiversFile = None,
    json: Json = False,
) -> int:
    """Report what the cases of a coverage store visited, in any format."""
    wanted_figures = read_thresholds(fail_under or [])
    wanted = ReportFiles(files)
    if save is not None and not minimize:
        raise option_error("--save", "only the smallest suite can be saved", "add --minimize")
    history = read_history(store)
    writer = wanted.writer(store, history, save)
    history = _with_found_files(history, store)
    evidence = stored_evidence(history, certificates, waivers, wanted_figures)
    if evidence is not None:
        goals = [
            CaseGoalNames(case.name, tuple(case.goal.split(BETWEEN_GOALS)))
            for case in history.cases
            if isinstance(case.recipe, Written)
        ]
        history = replace(history, decided=evidence.statuses(history.coverage, history.forced, goals))
    if since is not None:
        history = replace(history, since=compare_runs(store, history, _earlier_run(history, since)))
    cover = _smallest(history) if minimize else None
    if json:
        write_json(history_json(history) | ({} if cover is None else {"smallest": smallest_json(history, cover)}))
    else:
        columns = report_columns()
        parts: list[Iterable[Text]] = []
        if missing:
            kind = CampaignKind.of_store(history)
            parts.append(missing_lines(history, history.source.path, kind, columns, shows_all=shows_all))
        parts += [contexts_report(history)] if contexts else []
        parts += [smallest_report(history, cover)] if cover is not None else []
        results().lines(_apart(parts or [stored_report(history, str(store), columns, shows_all=shows_all)]))
        if save is None:  # else the error is about that
            _report_missing_file(history)
    is_saved = save is None or cover is None or _save(history, cover.chosen, save, writer)
    written = write_formats(wanted, history, writer)
    if written:
        errors().line(f"Written: {', '.join(written)}")
    return 0 if meets_thresholds(history, wanted_figures) and is_saved else 1


def _earlier_run(history: History, wanted: str) -> StoredRun | None:
    """Return the run that `--since` names; `None` for `last` if there is no earlier finished run.

    Raises:
        InputError: no earlier finished run has an id that begins so, or several have.
    """
    runs = earlier_runs(history)
    if wanted == _LAST_RUN:
        return runs[-1] if runs else None
    found = [run for run in runs if run.id.startswith(wanted)]
    if len(found) != 1:
        message = f"{counted(len(found), 'earlier finished run')} of this store with an id that begins with `{wanted}`"
        listed = [f"{run_in_words(run)}: `{run.command}`" for run in (found or runs)[-_MAX_RUNS:]]
        remedy = f"name one of these: {'; '.join(listed)}" if listed else "add a run with `scbm test --store`"
        raise option_error("--since", message, remedy, wanted)
    return found[0]


def _report_missing_file(history: History) -> None:
    """Say where the suggested commands work, if a file that they name is neither here nor beside the store."""
    for noun, paths in (("model file", [history.source.path]), ("case file", list(_stored_paths(history)[1]))):
        gone = [path for path in paths if not os.path.isfile(path)]  # noqa: PTH113 - as above
        if gone:
            more = f" nor {len(gone) - 1} more" if len(gone) > 1 else ""
            message = f"scbm: there is no {noun} {gone[0]}{more} here nor beside the store"
            errors().line(f"{message}: run the suggested commands in the directory in which the store was filled")
            return


def _smallest(history: History) -> Cover:
    """Return the smallest suite with the same visits; among equal cases it prefers those that a file can repeat."""
    order = sorted(range(len(history.cases)), key=lambda place: history.cases[place].is_over_nodes)
    cover = smallest_cover([history.cases[place].visited for place in order])
    return replace(cover, chosen=tuple(sorted(order[place] for place in cover.chosen)))


def _apart(parts: Iterable[Iterable[Text]]) -> Iterator[Text]:
    """Yield the lines of several reports with an empty line between them."""
    for number, part in enumerate(parts):
        if number:
            yield Text()
        yield from part


def _save(history: History, chosen: Iterable[int], directory: Path, writer: FileWriter) -> bool:
    """Write cases as files without random choices. Return whether they visit the same; print a warning if not."""
    model = Path(history.source.path)
    if not model.is_file():
        message = f"the saved cases need the model file `{model}`, which is not here"
        remedy = "save them from the directory in which the store was filled"
        raise option_error("--save", message, remedy)
    replays = Replays(history)
    comment = [f"one of the smallest suite that visits what all {len(history.cases)} cases of a store do"]
    kept_back = {history.labels[index]: why for index in chosen if (why := _unsaved(history.cases[index], history))}
    cases = [
        (replace(replays.recorded(history.cases[index]), name=history.labels[index]), comment)
        for index in chosen
        if history.labels[index] not in kept_back
    ]
    saved = case_texts(cases, directory, history.model, model)
    writer.write_all(saved, overwrite=False)
    others = len(find_case_files([directory])) - len(saved) if saved else 0
    if others:
        errors().prose(f"{directory} has {counted(others, 'other case file')} too, so it is not the smallest suite.")
    for label, why in kept_back.items():
        errors().prose(f"{label} {why}; it is not saved.")
    return not others and not kept_back


def _unsaved(case: StoredCase, history: History) -> str:
    """Return why no file can repeat the run of a case; empty if a file can."""
    if case.is_earlier:
        return "was run on an earlier version of the model"
    return f"ran {history.where(case)}, and no case file can repeat such a run" if case.is_over_nodes else ""
