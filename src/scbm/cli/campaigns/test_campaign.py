"""Campaigns of `scbm test` and `scbm node tester`: run the cases, save what failed, and print the report."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import islice
from typing import TYPE_CHECKING

from scbm.cli.campaigns.suite import Suite
from scbm.cli.options import threshold_option
from scbm.cli.options.arguments import read_faults, read_requirements, read_time_limit
from scbm.cli.options.case_selection import LastFailed, name_filter, select_last_failed
from scbm.cli.output.exit_codes import INTERRUPTED
from scbm.cli.output.progress import bar, with_lines
from scbm.cli.output.terminal import errors, in_one_line, report_columns, results, write_json
from scbm.files import load_model
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.reports import Setting, counted, coverage_report, missing_report
from scbm.reports.figure_table import shown_path
from scbm.testing import MAX_SHRUNK, Campaign, Tester, campaign_json, case_texts, find_causes, load_suite

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from scbm.cases import Case
    from scbm.cases.coverage import Threshold
    from scbm.cli.campaigns.store_keeper import Keeper, Since
    from scbm.cli.options.node_options import NodeOptions
    from scbm.testing import CaseResult, Execution, Finding

_SLOW = 500
"""From so many simulated cases on, progress is shown on a terminal; over nodes it always is."""

_RANDOM = 20
"""So many random cases are drawn if neither a number nor files are given."""


@dataclass(frozen=True, slots=True)
class CampaignOptions:
    """The cases, as options say them: see `scbm test --help`."""

    model: Path
    files: Sequence[Path]
    cases: int | None
    seed: int
    network: str | None
    require: Sequence[str]
    time_limit: str | None

    def suite(self, options: Mapping[str, object]) -> Suite:
        """The cases. Raises `InputError`.

        Args:
            options: further ones that say something of random cases, by their names, with their values.
        """
        loaded = load_model(self.model)
        random = (0 if self.files else _RANDOM) if self.cases is None else self.cases
        refuse_without_random_cases(random, {"--network": self.network, **options})
        suite = Suite(
            loaded,
            self.model,
            self.files,
            load_suite(self.files, loaded),
            random,
            self.seed,
            self.network,
            read_faults(self.network, loaded),
            read_requirements(self.require, loaded),
            read_time_limit(self.time_limit),
            range(1, random + 1),
        )
        suite.refuse_equal_names()
        return suite


@dataclass(frozen=True, slots=True)
class CampaignOutput:
    """What a campaign prints and saves.

    Attributes:
        thresholds: how much has to be visited.
        missing: whether only what is missing is shown.
        json: whether it is told to a machine.
        store: the store that cases are added to.
        save: where every random case is saved.
        failures: where small failing cases are saved.
        shrink: whether these are looked for.
        stop: whether the first failure ends the campaign.
    """

    thresholds: Sequence[Threshold]
    missing: bool
    json: bool
    store: Path | None
    save: Path | None
    failures: Path
    shrink: bool
    stop: bool


def simulate(suite: Suite, telling: CampaignOutput) -> int:
    """Run the cases in virtual time, print the report, and return the exit code."""
    _refuse_store_that_is_read(suite, telling)
    tester = Tester(suite.model)
    done = _carry_out(suite, telling, lambda cases, _: map(tester.execute, cases), None)
    is_whole = done.ended is None or done.is_stopped  # after an interruption, users do not wait for small cases
    is_saved = telling.save is None or done.ended is not None or _save_random(suite, tester, telling.save)
    findings = find_causes(tester, done.campaign, MAX_SHRUNK if telling.shrink and is_whole else 0)
    saved = [_save_small(suite, finding, telling.failures) for finding in findings]
    _remember_failed(suite, done.campaign, telling.failures)
    commands = tuple(_again(suite, finding, path) for finding, path in zip(findings, saved, strict=True))
    code = _report(done, _setting(suite, findings, commands), telling)
    return code if is_saved else max(2, code)


def run_over_nodes(suite: Suite, telling: CampaignOutput, asked: NodeOptions, command: str) -> int:
    """Run the cases over nodes, print the report, and return the exit code.

    Args:
        suite: the cases.
        telling: what is told.
        asked: where they run.
        command: what runs them all again.
    """
    from scbm.cli.campaigns.node_setup import refuse_beyond_reach  # noqa: PLC0415 - the same
    from scbm.cli.campaigns.over_nodes import over_nodes  # noqa: PLC0415 - sockets and processes, which few runs need

    _refuse_store_that_is_read(suite, telling)
    refuse_beyond_reach(suite, asked.real, "--real")
    tester = Tester(suite.model)
    with over_nodes(asked, tester) as nodes:
        if not asked.starts:  # what is real, its controller says
            refuse_beyond_reach(suite, nodes.real, "--network")
        done = _carry_out(suite, telling, nodes.executions, asked.words)
    if nodes.logs.is_whole:
        _remember_failed(suite, done.campaign, telling.failures)
    findings = find_causes(tester, done.campaign, 0)  # what fails over nodes need not fail in simulation
    logs = (nodes.logs.files.get(finding.results[0].case.name) for finding in findings)
    commands = tuple(command if log is None else f"scbm replay {shown_path(str(log))}" for log in logs)
    setting = replace(_setting(suite, findings, commands), where=asked.words, answers=nodes.answers)
    code = _report(done, setting, telling)
    if nodes.logs.words is not None and not telling.json:
        errors().line(f"scbm: {nodes.logs.words}")
    for complaint in nodes.complaints:
        errors().line(f"scbm: {complaint}")
    if any(answers.is_silent for answers in nodes.answers):
        code = max(code, 1)
    return code if nodes.logs.is_whole else max(2, code)


def _carry_out(
    suite: Suite,
    telling: CampaignOutput,
    run: Callable[[Iterable[Case], Callable[[str], None]], Iterator[Execution]],
    where: str | None,
) -> _Done:
    """Run the cases, add them to the store, and show the progress; return the results up to an interruption.

    Args:
        suite: the cases.
        telling: the options for output and storage.
        run: executes the cases, and calls its second argument with the name of the current one.
        where: a description of the nodes that run the cases; `None` for simulation.

    Raises:
        InputError: an error ended the campaign before its first case was complete.
        KeyboardInterrupt: the user interrupted it before its first case was complete.
    """
    is_over_nodes = where is not None
    progress = _progress(suite.count, is_bar=is_over_nodes or suite.count >= _SLOW, is_told=is_over_nodes)
    came: list[CaseResult] = []
    keeper: Keeper | None = None
    ended: InputError | KeyboardInterrupt | _FirstFailure | None = None
    try:
        with _store(telling.store, suite, where) as keeper, progress as (said, done):
            executions = run(suite.cases(), said)
            results = (execution.result for execution in executions)
            for result in done(results if keeper is None else keeper.kept(executions, suite.by_name, suite.network)):
                came.append(result)
                if telling.stop and not result.verdict.passed and len(came) < suite.count:
                    raise _FirstFailure  # noqa: TRY301 - the store must learn that its run is not finished
    except (InputError, KeyboardInterrupt, _FirstFailure) as error:
        if not came:
            raise
        ended = error
    return _Done(Campaign.of(suite.model, came), suite.count, keeper, ended)


class _FirstFailure(Exception):  # noqa: N818 - it is no error, but what `-x` asks for
    """A case failed, and the campaign is to end then."""


@dataclass(frozen=True, slots=True)
class _Done:
    """The results of a campaign.

    Attributes:
        campaign: the cases that were run.
        count: the number of selected cases.
        keeper: added the results to a store; `None` without a store.
        ended: the reason why the campaign ended early; `None` if it is complete.
    """

    campaign: Campaign
    count: int
    keeper: Keeper | None
    ended: InputError | KeyboardInterrupt | _FirstFailure | None

    @property
    def since(self) -> Since | None:
        """Return the changes since the previous run in the store; `None` without one, or after an early end."""
        if self.keeper is None or self.ended is not None:
            return None
        return self.keeper.since(self.campaign.coverage)

    @property
    def words(self) -> str:
        """Return how many cases ran before an early end; empty after a complete campaign."""
        if self.ended is None:
            return ""
        how = "Interrupted" if isinstance(self.ended, KeyboardInterrupt) else "Ended by an error"
        how = "Stopped at the first failure" if self.is_stopped else how
        return f"{how} after {len(self.campaign.results)} of {counted(self.count, 'case')}"

    @property
    def is_stopped(self) -> bool:
        """Whether `-x` ended the campaign."""
        return isinstance(self.ended, _FirstFailure)

    def drawn(self, random: int) -> int:
        """Return how many of so many random cases were run; they come last."""
        return max(0, random - (self.count - len(self.campaign.results)))


def _report(done: _Done, setting: Setting, telling: CampaignOutput) -> int:
    campaign, since = done.campaign, done.since
    if telling.json:
        stored = {} if since is None else {"store": since.as_json}
        early = {"ended_early": done.words} if done.words else {}
        report = campaign_json(campaign, setting.seed, setting.findings, setting.commands, setting.answers)
        write_json(report | stored | early)
    else:
        shown = replace(setting, random=done.drawn(setting.random), ended_early=done.words, columns=report_columns())
        results().lines((missing_report if telling.missing else coverage_report)(campaign, shown))
        results().lines([] if since is None else since.lines)
    if done.words:
        return _report_early_end(done, telling)
    if since is not None and not since.is_whole:
        return 2
    return 0 if threshold_option.meets(campaign.coverage, telling.thresholds) and not campaign.failed else 1


def _report_early_end(done: _Done, telling: CampaignOutput) -> int:
    """Report why the campaign ended early; return the exit code."""
    is_unfinished = done.keeper is not None and done.keeper.is_unfinished
    stored = f"; their run in {telling.store} is not finished" if is_unfinished else ""
    if not done.is_stopped or is_unfinished:
        errors().line(f"scbm: {done.words[0].lower()}{done.words[1:]}{stored}")
    if telling.save is not None:
        errors().line(f"scbm: nothing is saved in {telling.save}: that comes behind the last case")
    if done.is_stopped:
        return 1
    if isinstance(done.ended, InputError):
        errors().diagnostics(done.ended.diagnostics)
        return 2
    return INTERRUPTED


def _print_progress(words: str) -> None:
    errors().line(f"scbm: {in_one_line(words)}")


def _store(path: Path | None, suite: Suite, where: str | None) -> AbstractContextManager[Keeper | None]:
    """Return the store of the command line, if it names one."""
    if path is None:
        return nullcontext()
    from scbm.cli.campaigns.store_keeper import keeping  # noqa: PLC0415 - a database, which few runs need

    return keeping(path, suite.model, suite.file, where)


def _progress(
    count: int, *, is_bar: bool, is_told: bool
) -> AbstractContextManager[tuple[Callable[[str], None], Callable[[Iterator[CaseResult]], Iterator[CaseResult]]]]:
    """Return two callbacks: one for the name of the current case, one that counts results and yields them."""
    if is_bar and sys.stderr.isatty():
        return bar(count)
    if is_told:
        return nullcontext((lambda _: None, lambda results: with_lines(results, count, _print_progress)))
    return nullcontext((lambda _: None, lambda results: results))


def select_cases(suite: Suite, expression: str | None, failures: Path | None) -> Suite:
    """Return the suite with the selected cases alone. Raise `InputError` if none is selected.

    Args:
        suite: all cases of the command line.
        expression: what the names of the cases must satisfy, if that is asked for.
        failures: the directory that has the cases which failed last time, if only these are to run.
    """
    if expression is not None:
        chosen = suite.selected(name_filter(expression))
        if not chosen.count:
            remedy = f"the first cases are {', '.join(islice(suite.names, 3))}"
            message = f"none of {counted(suite.count, 'case')} has such a name"
            raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place("-k"), remedy, expression)])
        suite = chosen
    if failures is None:
        return suite
    last = LastFailed.read(failures, suite.file)
    if not last.names:
        errors().line("scbm: no case failed last time, so all of them run")
        return suite
    return suite.selected(select_last_failed(last, list(suite.names)))


def refuse_without_random_cases(count: int, options: Mapping[str, object]) -> None:
    """Raises `InputError` for options that say something of random cases where there are none."""
    useless = [option for option, value in options.items() if value is not None and not count]
    message = "this is for random cases, and none are drawn"
    if useless:
        remedy = "add for example `--cases 20`"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy) for option in useless])


def _refuse_store_that_is_read(suite: Suite, telling: CampaignOutput) -> None:
    """Raise `InputError` if the store of the command line is a file that the command reads."""
    suite.writer.refuse_clashes({} if telling.store is None else {"--store": telling.store})


def _save_random(suite: Suite, tester: Tester, directory: Path) -> bool:
    """Save every random case with all that was drawn in it. Show an error, and return whether there was none."""
    recorded = (tester.execute(case).recorded_case for case in suite.completed_drawn())
    labelled = [
        (case, [f"case {number} of seed {suite.seed}"]) for number, case in zip(suite.numbers, recorded, strict=True)
    ]
    return _is_written(suite, case_texts(labelled, directory, suite.model, suite.file), overwrite=False)


def _save_small(suite: Suite, finding: Finding, directory: Path) -> Path | None:
    """Save the small case of a finding and return its path; `None` if there is none or it cannot be saved."""
    if finding.shrunk is None:
        return None
    failed = finding.results[0].case.name
    comments = [f"the smallest case found that fails as {failed} did:", str(finding.failure)]
    execution = finding.shrunk.execution
    small = replace(execution.case, recorded=execution.recorded)
    texts = case_texts([(small, comments)], directory, suite.model, suite.file)
    (path,) = texts
    if suite.writer.reads(path):
        return None  # the suite has the small case of an earlier campaign, which shows the failure as well
    return path if _is_written(suite, texts, overwrite=True) else None


def _is_written(suite: Suite, texts: Mapping[Path, str], *, overwrite: bool) -> bool:
    """Write files; show an error instead of raising it, as the report is still to come."""
    try:
        suite.writer.write_all(texts, overwrite=overwrite)
    except InputError as error:
        errors().diagnostics(error.diagnostics)
        return False
    return True


def _again(suite: Suite, finding: Finding, saved: Path | None) -> str:
    """Return the command that shows a finding again: its small case if that is saved, else its first case."""
    if saved is not None:
        return f"scbm replay {shown_path(str(saved))}"
    return suite.again(finding.results[0].case.name) or ""


def _setting(suite: Suite, findings: Sequence[Finding], commands: Sequence[str]) -> Setting:
    """Return what the report shows beside the results."""
    return Setting(
        str(suite.file),
        suite.seed,
        len(suite.numbers),
        suite.network_option,
        tuple(findings),
        tuple(commands),
        loses_messages=suite.loses_messages,
    )


def _remember_failed(suite: Suite, campaign: Campaign, directory: Path) -> None:
    """Record for `--lf` which cases failed; show an error instead of raising it."""
    failed = dict.fromkeys(result.case.name for result in campaign.failed)
    passed = [result.case.name for result in campaign.results if result.case.name not in failed]
    try:
        last = LastFailed.read(directory, suite.file).after(passed, failed, suite.test_options)
        last.write(directory, suite.file, suite.writer)
    except InputError as error:
        errors().diagnostics(error.diagnostics)
