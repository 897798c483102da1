"""Campaigns of `scbm test` and `scbm node tester`: run the cases, save what failed, and print the report."""

from __future__ import annotations

from itertools import islice
from os.path import lexists
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cli.campaigns.campaign_loop import CampaignEnd, carry_out, finished_batches
from scbm.cli.campaigns.suite_recording import update_hint
from scbm.cli.exit_codes import INTERRUPTED
from scbm.cli.options.campaign_options import CampaignOutput, asks_for_asserted, meets_thresholds, read_inputs
from scbm.cli.options.case_selection import LastFailed, name_filter, select_last_failed
from scbm.cli.options.option_errors import OptionReader, refuse_given
from scbm.cli.options.option_values import read_faults, read_requirements, read_time_limit
from scbm.cli.options.planner_options import NO_PLANNER_OPTIONS, PlannerOptions
from scbm.cli.output.terminal import errors, report_columns, results, write_json
from scbm.files import load_model, write_case
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import counted, shown_path
from scbm.reports import coverage_report, missing_report
from scbm.testing import MAX_SHRUNK, CampaignResult, Tester, campaign_json, case_texts, find_causes
from scbm.testing.batches.campaign_runs import StopRule, run_steps
from scbm.testing.random_cases import most_goals
from scbm.testing.suite import Suite

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from scbm.cases import Case
    from scbm.model import Requirement
    from scbm.store import SmallestCase
    from scbm.testing import Campaign, Finding, Shrunk
    from scbm.testing.batches.campaign_runs import Executor

_RANDOM = 20
"""Number of random cases if neither a number nor case files are given."""

MAX_RANDOM = 10_000_000
"""Maximum number of random cases of one campaign."""

_ENOUGH = 10
"""So many random cases fail the campaign if none of them reaches its goal, whatever excuses them."""

_SAVED_AT_ONCE = 500
"""Maximum number of texts of cases in memory while random cases are saved."""


class CampaignOptions(Struct, frozen=True):
    """The options that determine the cases: see `scbm test --help`."""

    model: Path
    files: Sequence[Path]
    cases: int | None
    seed: int
    network: str | None
    require: Sequence[str]
    time_limit: str | None
    planner: PlannerOptions = NO_PLANNER_OPTIONS
    dry: int | None = None
    inputs: str | None = None
    goals: int | None = None

    def suite(self, options: Mapping[str, object]) -> Suite:
        """Return the suite. Raise `InputError`.

        Args:
            options: further options about random cases with their values, by their names.
        """
        model, read = load_model(self.model), OptionReader()
        loaded = read.read(lambda: self.planner.applied(model), model)
        default = 0 if self.files else _RANDOM
        random = (default if self.dry is None else MAX_RANDOM) if self.cases is None else self.cases
        given = {"--network": self.network, "--inputs": self.inputs, "--goals": self.goals, **options}
        read.read(lambda: refuse_without_random_cases(random, given), None)
        faults = read.read(lambda: read_faults(self.network, loaded), None)
        requirements: tuple[Requirement, ...] = read.read(lambda: read_requirements(self.require, loaded), ())
        time_limit_ns = read.read(lambda: read_time_limit(self.time_limit), None)
        moves_inputs = read.read(lambda: read_inputs(self.inputs), default=False)
        suite = Suite(
            loaded,
            self.model,
            self.files,
            random=random,
            seed=self.seed,
            network_text=self.network,
            network=faults,
            requirements=requirements,
            time_limit_ns=time_limit_ns,
            planner_option=self.planner.text,
            moves_inputs=moves_inputs,
            given_goals=None if self.goals == most_goals(loaded) else self.goals,
        )
        return read.last(suite.loaded)


def simulate(suite: Suite, output: CampaignOutput, executor: Executor) -> int:
    """Run the cases in virtual time, print the report, and return the exit code.

    Args:
        suite: the cases.
        output: the options for output and storage.
        executor: where the cases run.
    """
    rule = StopRule(output.stop, output.dry)
    steps = run_steps(suite.work, executor, rule, keeps_all=output.store is not None)
    with suite.locating():
        done = carry_out(suite, output, lambda _: finished_batches(suite, steps))
    if output.dry is not None:
        suite = suite.first_drawn(done.campaign.drawn)
    is_whole = done.ended is None or done.is_stopped  # after an interruption, users do not wait for small cases
    tester = Tester(suite.model)
    is_saved = output.save is None or done.ended is not None or _save_random(suite, tester, output.save)
    findings = find_causes(tester, done.campaign, MAX_SHRUNK if output.shrink and is_whole else 0)
    saved, is_kept = _save_all_small(suite, findings, output.failures)
    is_kept = is_kept and remember_failed(suite, done.campaign, output.failures)
    if done.keeper is not None:
        done.keeper.keep_smallest(_smallest_by_name(suite, findings, saved))
    commands = tuple(_again(suite, finding, path) for finding, path in zip(findings, saved, strict=True))
    code = report_campaign(done, result_of(done, suite, output, findings, commands), output)
    return code if is_saved and is_kept else max(2, code)


def report_campaign(done: CampaignEnd, result: CampaignResult, output: CampaignOutput) -> int:
    """Print the report of a campaign, and return its exit code."""
    since = done.since
    if output.json:
        stored = {} if since is None else {"store": since.as_json}
        write_json(campaign_json(result) | stored | dict(output.recorded))
    else:
        report = missing_report if output.missing else coverage_report
        results().lines(report(result, report_columns(), shows_all=output.shows_all))
        results().lines(update_hint(result))
        results().lines([] if since is None else since.lines)
    if done.words:
        return _report_early_end(done, output)
    if since is not None and not since.is_whole:
        return 2
    apart_from = output.store if since is not None and since.is_united else None
    is_met = meets_thresholds(result, output.thresholds, apart_from)
    if asks_for_asserted(output.thresholds) and (result.evidence is None or result.evidence.found is None):
        errors().line(f"  {result.mutate_command}")
    has_missed = result.campaign.drawn >= _ENOUGH and not result.random_reached
    return 0 if is_met and not result.campaign.failed_count and not has_missed else 1


def _report_early_end(done: CampaignEnd, output: CampaignOutput) -> int:
    """Report why the campaign ended early; return the exit code."""
    is_unfinished = done.keeper is not None and done.keeper.is_unfinished
    stored = f"; the run in {output.store} is unfinished" if is_unfinished else ""
    if not done.is_stopped or is_unfinished:
        errors().prose(f"scbm: {done.words[0].lower()}{done.words[1:]}{stored}")
    if output.save is not None:
        errors().prose(f"scbm: nothing is saved in {output.save}: cases are saved only after the last one")
    if done.is_stopped:
        return 1
    if isinstance(done.ended, InputError):
        errors().diagnostics(done.ended.diagnostics)
        return 2
    return INTERRUPTED


def select_cases(suite: Suite, expression: str | None, failures: Path | None) -> Suite:
    """Return the suite with the selected cases alone. Raise `InputError` if none is selected.

    Args:
        suite: all cases of the command line.
        expression: the filter for the names of cases; `None` takes all.
        failures: the directory with the record of failed cases, to select only these; `None` takes all.
    """
    if expression is not None:
        chosen = suite.selected(name_filter(expression))
        if not chosen.count:
            remedy = f"the first cases are {', '.join(islice(suite.names, 3))}"
            message = f"none of {counted(suite.count, 'case')} has a name that matches"
            raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place("-k"), remedy, expression)])
        suite = chosen
    if failures is None:
        return suite
    last = LastFailed.read(failures, suite.file)
    if not last.failed:
        errors().prose("scbm: no case failed last time, so all of them run")
        return suite
    return suite.selected(select_last_failed(last, list(suite.names)))


def refuse_selection(dry: int | None, options: Mapping[str, object]) -> None:
    """Raise `InputError` for options that select cases where the number of cases is open."""
    if dry is not None:
        message = "`--until-dry` runs random cases in their order, until they visit nothing new"
        refuse_given(options, message, "leave one of the two out")


def refuse_without_random_cases(count: int, options: Mapping[str, object]) -> None:
    """Raise `InputError` for options about random cases if there are none."""
    if not count:
        refuse_given(options, "this is for random cases, and none are drawn", "add for example `--cases 20`")


def refuse_outputs(suite: Suite, output: CampaignOutput, logs: Path | None) -> None:
    """Raise `InputError` for outputs of the command line that replace what it reads, or cannot be written."""
    directories = {"--save": output.save, "--logs": logs}
    given = {option: [path] for option, path in directories.items() if path is not None}
    suite.writer.refuse_outputs({}, given, {"--store": output.store})


def _save_random(suite: Suite, tester: Tester, directory: Path) -> bool:
    """Save every random case with all that was drawn in it. Show an error, and return whether there was none.

    Nothing is saved if a file is there that says something else. The cases are run again for their files, a few at a
    time, so that memory does not grow with their number.
    """
    first = len(suite.written) + 1
    positions = range(first, suite.count + 1)
    there = [p for p in positions if lexists(directory / f"{suite.work.name(p)}.yaml")]
    return all(
        _is_written(suite, _saved_texts(suite, tester, directory, some[begin : begin + _SAVED_AT_ONCE]))
        for some in (there, positions)
        for begin in range(0, len(some), _SAVED_AT_ONCE)
    )


def _saved_texts(suite: Suite, tester: Tester, directory: Path, positions: Sequence[int]) -> dict[Path, str]:
    """Return the texts of random cases, each by the path of its file."""
    numbers = (suite.numbers[position - 1 - len(suite.written)] for position in positions)
    recorded = (tester.execute(suite.work.case(position)).recorded_case for position in positions)
    comments = ([suite.origin_words(number)] for number in numbers)
    labelled = list(zip(recorded, comments, strict=True))
    return case_texts(labelled, directory, suite.model, suite.file)


def _save_all_small(suite: Suite, findings: Sequence[Finding], directory: Path) -> tuple[list[Path | None], bool]:
    """Save the small cases; return their paths, and whether there was no error. After an error, none is saved."""
    saved: list[Path | None] = [None] * len(findings)
    names = [finding.shrunk and finding.shrunk.execution.case.name for finding in findings]
    for number, finding in enumerate(findings):
        try:
            first = names.index(names[number])  # one case may show several findings
            saved[number] = saved[first] if first < number else _save_small(suite, finding, directory)
        except InputError as error:
            errors().diagnostics(error.diagnostics)
            return saved, False
    return saved, True


def _save_small(suite: Suite, finding: Finding, directory: Path) -> Path | None:
    """Save the small case of a finding and return its path; `None` if there is none. Raise `InputError`."""
    if finding.shrunk is None:
        return None
    failed = finding.names[0]
    comments = [f"the smallest case found that fails as {failed} did:", str(finding.failure)]
    texts = case_texts([(_small_case(finding.shrunk), comments)], directory, suite.model, suite.file)
    (path,) = texts
    if suite.writer.reads(path):
        return None  # the suite has the small case of an earlier campaign, which shows the failure as well
    suite.writer.write_all(texts, overwrite=True)
    return path


def _small_case(shrunk: Shrunk) -> Case:
    """Return a small case with what its run showed, as its file has it."""
    execution = shrunk.execution
    return replace(execution.case, recorded=execution.recorded, plans=execution.plans_to_keep)


def _smallest_by_name(
    suite: Suite, findings: Sequence[Finding], saved: Sequence[Path | None]
) -> dict[str, list[SmallestCase]]:
    """Return the small cases as stores keep them, by the name of the first case of their findings."""
    from scbm.store import SmallestCase, sayable  # noqa: PLC0415 - a database, which few runs need

    found: dict[str, list[SmallestCase]] = {}
    for finding, path in zip(findings, saved, strict=True):
        shrunk = finding.shrunk
        if shrunk is not None:
            failure, after, before = shrunk.failure, shrunk.after, shrunk.before
            text = write_case(_small_case(shrunk), suite.model, None)
            sizes = (after.operations, after.choices, before.operations, before.choices)
            where = "" if path is None else sayable(str(path))
            small = SmallestCase(failure.kind, failure.subject, text, where, *sizes, tuple(map(str, shrunk.matters)))
            found.setdefault(finding.names[0], []).append(small)
    return found


def _is_written(suite: Suite, texts: Mapping[Path, str]) -> bool:
    """Write new files; print an error instead of raising it, as the report follows."""
    try:
        suite.writer.write_all(texts, overwrite=False)
    except InputError as error:
        errors().diagnostics(error.diagnostics)
        return False
    return True


def _again(suite: Suite, finding: Finding, saved: Path | None) -> str:
    """Return the command that reproduces a finding: its small case if that is saved, else its first case."""
    if saved is not None:
        return f"scbm replay {shown_path(str(saved))}"
    return suite.again(finding.names[0]) or ""


def result_of(
    done: CampaignEnd, suite: Suite, output: CampaignOutput, findings: Sequence[Finding], commands: Sequence[str]
) -> CampaignResult:
    """Return the result of a campaign in simulation.

    Args:
        done: how the campaign ended.
        suite: the cases.
        output: the options for output and storage.
        findings: the causes of failures.
        commands: for each finding the command that reproduces it.
    """
    campaign, decided = done.campaign, None
    if output.evidence is not None:
        goals = [written.case.goals_in(suite.model) for written in suite.written]
        decided = output.evidence.statuses(campaign.coverage, campaign.forced, goals)
    return CampaignResult(
        campaign,
        suite,
        tuple(findings),
        tuple(commands),
        decided,
        done.evidence,
        dry=output.dry,
        ended_early=done.words,
        store=output.store,
        decisions=done.decisions,
    )


def remember_failed(suite: Suite, campaign: Campaign, directory: Path) -> bool:
    """Record for `--lf` which cases failed; show an error instead of raising it, and return whether there was none."""
    listed = campaign.summary.failed_positions
    failed = dict.fromkeys(map(campaign.source.name, listed))
    is_whole = len(listed) == campaign.failed_count
    known = range(1, 1 + (campaign.count if is_whole else listed[-1]))
    passed = (name for name in map(campaign.source.name, known) if name not in failed)
    if not is_whole:
        errors().prose(f"scbm: {campaign.failed_count} cases failed, and `--lf` repeats the first {len(listed)}")
    try:
        last = LastFailed.read(directory, suite.file).after(passed, failed, suite.test_options)
        last.write(directory, suite.file, suite.writer)
    except InputError as error:
        errors().diagnostics(error.diagnostics)
        return False
    return True
