"""`scbm report`: what a coverage store holds, for people, for browsers and for other tools."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer
from rich.text import Text

from scbm.cases.coverage import Cover, smallest_cover
from scbm.cli.options import threshold_option
from scbm.cli.options.report_files import FORMAT_OPTIONS, ReportFiles, write_formats
from scbm.cli.output.terminal import errors, report_columns, results, write_json
from scbm.files import FileWriter
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.reports import counted
from scbm.reports.ci.history_json import history_json, smallest_json
from scbm.reports.terminal.missing_report import told_missing
from scbm.reports.terminal.store_report import stored_report
from scbm.reports.terminal.visitors_report import contexts_report, smallest_report
from scbm.store import History, Replays, StoredCase, read_history
from scbm.testing import case_texts, find_case_files


def command(
    store: Annotated[Path, typer.Argument(help="The coverage store.", show_default=False)],
    *,
    missing: Annotated[bool, typer.Option("--missing", help="Show only the missed obligations, and why.")] = False,
    contexts: Annotated[
        bool, typer.Option("--contexts", help="Show which case visits what, and what only it visits.")
    ] = False,
    minimize: Annotated[bool, typer.Option("--minimize", help="Show the smallest suite that visits the same.")] = False,
    save: Annotated[
        Path | None, typer.Option("--save", metavar="DIRECTORY", help="Save the cases of that suite as files.")
    ] = None,
    files: Annotated[Mapping[str, Path | None], FORMAT_OPTIONS],
    fail_under: Annotated[
        list[str] | None, typer.Option(threshold_option.OPTION, metavar="PERCENT", help=threshold_option.HELP)
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Report what the cases of a coverage store visited, in any format."""
    wanted_figures = threshold_option.read_thresholds(fail_under or [])
    wanted = ReportFiles(files)
    if save is not None and not minimize:
        raise InputError(
            [Diagnostic(Slug.BAD_OPTION, "this saves the smallest suite", Place("--save"), "add --minimize")]
        )
    history = read_history(store)
    writer = wanted.writer(store, history)
    cover = _smallest(history) if minimize else None
    if json:
        write_json(history_json(history) | ({} if cover is None else {"smallest": smallest_json(history, cover)}))
    else:
        columns = report_columns()
        parts: list[Iterable[Text]] = []
        parts += [told_missing(history.model, history.coverage, history.source.path, columns)] if missing else []
        parts += [contexts_report(history)] if contexts else []
        parts += [smallest_report(history, cover)] if cover is not None else []
        results().lines(_apart(parts or [stored_report(history, str(store), columns)]))
    is_saved = save is None or cover is None or _save(history, cover.chosen, save, writer)
    written = write_formats(wanted, history, writer)
    if written:
        errors().line(f"Written: {', '.join(written)}")
    return 0 if threshold_option.meets(history.coverage, wanted_figures) and is_saved else 1


def _smallest(history: History) -> Cover:
    """The smallest suite that visits the same; of cases that visit the same, rather one that a file gives again."""
    order = sorted(range(len(history.cases)), key=lambda place: history.cases[place].is_over_nodes)
    cover = smallest_cover([history.cases[place].visited for place in order])
    return replace(cover, chosen=tuple(sorted(order[place] for place in cover.chosen)))


def _apart(parts: Iterable[Iterable[Text]]) -> Iterator[Text]:
    """Several reports with a line between them."""
    for number, part in enumerate(parts):
        if number:
            yield Text()
        yield from part


def _save(history: History, chosen: Iterable[int], directory: Path, writer: FileWriter) -> bool:
    """Writes cases as files that are run without chance; gives whether they visit the same, and says if they do not."""
    model = Path(history.source.path)
    if not model.is_file():
        message = f"there is no model file `{model}` here, which the saved cases would name"
        remedy = "save them from the directory in which the store was filled"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place("--save"), remedy)])
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
        errors().line(f"{directory} has {counted(others, 'other case file')} too, so it is not the smallest suite.")
    for label, why in kept_back.items():
        errors().line(f"{label} {why}, and is not saved.")
    return not others and not kept_back


def _unsaved(case: StoredCase, history: History) -> str:
    """Why no file gives the run of a case again; empty if one does."""
    if case.is_earlier:
        return "was run on an earlier version of the model"
    return f"ran {history.where(case)}, which no case file gives again" if case.is_over_nodes else ""
