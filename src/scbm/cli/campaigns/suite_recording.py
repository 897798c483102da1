"""`scbm test --record` and `--update`: the results of the written cases of a suite, recorded in their files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgspec.structs import replace
from rich.text import Text

from scbm.cli.output.terminal import results
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import counted, shown_path
from scbm.reports.figure_table import command_text
from scbm.testing import Tester
from scbm.testing.recorded_results import is_of_record
from scbm.testing.written_cases import RecordingStatus, recordings_of, write_recordings

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.testing import CampaignResult
    from scbm.testing.suite import Suite
    from scbm.testing.written_cases import CaseRecording, RecordingMode

_MAX_LISTED = 10
"""Maximum number of files that get their first result, or none, and are listed."""


def refuse_without_files(mode: RecordingMode, suite: Suite, others: dict[str, object]) -> None:
    """Raise `InputError` for options about recording where no result can be recorded.

    Args:
        mode: the options about recording.
        suite: the suite.
        others: options on which a recorded result must not depend, with their values.
    """
    asked = [option for option, value in (("--record", mode.adds), ("--update", mode.updates)) if value]
    wrong = []
    if asked and not suite.paths:
        message = "results are recorded in case files, and none are given"
        remedy = f"name files or directories, as in `scbm test MODEL cases {asked[0]}`; `--save` saves random cases"
        wrong += [Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy) for option in asked]
    for option, value in others.items():
        if asked and value is not None:
            message = f"a result that `{asked[0]}` records depends on the file of the case alone"
            remedy = "leave it out, and write for example `limits: {time: 10 min}` in the case"
            wrong.append(Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy))
    if wrong:
        raise InputError(wrong)


def record_suite(suite: Suite, mode: RecordingMode, *, shows: bool) -> tuple[Suite, dict[str, Any]]:
    """Record results in the files of a suite; return the suite as it is in the files then, and the changes as JSON.

    The differences are shown before the files are written.

    Args:
        suite: the suite.
        mode: which files are changed.
        shows: whether the changes are shown as text.

    Raises:
        InputError: a file cannot be edited, and then none is written; or files cannot be written.
    """
    if not (mode.adds or mode.updates):
        return suite, {}
    completed = (suite.work.case(position) for position in range(1, len(suite.written) + 1))
    found = recordings_of(Tester(suite.model), zip(suite.written, completed, strict=True), mode)
    write_recordings(found)
    if shows:
        results().lines(_lines(found, mode))
    return replace(suite, written=tuple(each.written for each in found)), {"recording": _as_json(found)}


def update_hint(result: CampaignResult) -> Iterator[Text]:
    """Yield the command that records the new results of cases that differ from recorded ones, if there are any."""
    causes, suite = result.campaign.summary.causes, result.suite
    differing = sum(cause.count for cause in causes if any(map(is_of_record, cause.failures)))
    if differing:
        cases = counted(differing, "case differs from its recorded result", "cases differ from their recorded results")
        yield Text()
        yield Text(f"{cases}.")
        yield Text("If the differences are right, record the new results:")
        command = f"scbm test {shown_path(str(suite.file))}{suite.arguments}{suite.planner_option} --update"
        yield command_text("  ", command)


def _of(status: RecordingStatus, found: Sequence[CaseRecording]) -> list[CaseRecording]:
    return [each for each in found if each.status is status]


def _lines(found: Sequence[CaseRecording], mode: RecordingMode) -> Iterator[Text]:
    """Yield what changes in which file."""
    added, updated = (_of(status, found) for status in (RecordingStatus.ADDED, RecordingStatus.UPDATED))
    if mode.adds:
        known = len(_of(RecordingStatus.LEFT, found))
        more = f"; {known} {'has' if known == 1 else 'have'} a recorded result already" if known else ""
        yield Text(f"Recorded: {counted(len(added), 'case file')}{more}", style="bold")
        yield from _listed(added)
    if mode.updates:
        yield Text(f"Updated: {counted(len(updated), 'case file')}", style="bold")
        for each in updated:
            yield _file(each)
            yield from (Text(f"    {part}: {words}") for part, words in each.differences)
    failed = _of(RecordingStatus.FAILED, found)
    if failed:
        yield Text(f"Not recorded, as they fail: {counted(len(failed), 'case file')}", style="bold red")
        yield from _listed(failed)
    left = _of(RecordingStatus.LEFT, found)
    if left and not mode.adds:
        yield Text(f"Without a recorded result: {counted(len(left), 'case file')}; `--record` adds one")
    yield Text()


def _listed(found: Sequence[CaseRecording]) -> Iterator[Text]:
    yield from map(_file, found[:_MAX_LISTED])
    if len(found) > _MAX_LISTED:
        yield Text(f"  and {len(found) - _MAX_LISTED} more")


def _file(recording: CaseRecording) -> Text:
    return Text(f"  {shown_path(str(recording.written.path))}")


def _as_json(found: Sequence[CaseRecording]) -> list[dict[str, Any]]:
    return [
        {
            "name": each.written.case.name,
            "file": str(each.written.path),
            "status": each.status.value,
            "differences": [{"part": part, "message": words} for part, words in each.differences],
        }
        for each in found
    ]
