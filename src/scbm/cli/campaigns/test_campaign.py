"""A campaign as a command line asks for it: which cases, where they run, what is told and kept of them."""

from __future__ import annotations

import re
import shlex
import sys
from contextlib import nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

from scbm.cli.options import threshold_option
from scbm.cli.options.arguments import complete, read_faults, read_requirements, read_time_limit
from scbm.cli.output.exit_codes import INTERRUPTED
from scbm.cli.output.progress import bar, with_lines
from scbm.cli.output.terminal import errors, in_one_line, results, write_json
from scbm.files import FileWriter, load_model
from scbm.model import Diagnostic, InputError, Place, Slug, format_duration
from scbm.reports import Setting, counted, coverage_report, missing_report
from scbm.testing import MAX_SHRUNK, Campaign, RandomCases, Tester, campaign_json, case_texts, find_causes, load_suite

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
    from contextlib import AbstractContextManager
    from pathlib import Path

    from scbm.cases import Case, Network
    from scbm.cases.coverage import Threshold
    from scbm.cli.campaigns.store_keeper import Keeper, Since
    from scbm.cli.options.node_options import NodeOptions
    from scbm.model import BehaviorModel, Requirement
    from scbm.testing import CaseResult, Execution, Finding, WrittenCase

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
        return Suite(
            loaded,
            self.model,
            load_suite(self.files, loaded),
            random,
            self.seed,
            self.network,
            read_faults(self.network, loaded),
            read_requirements(self.require, loaded),
            read_time_limit(self.time_limit),
        )


@dataclass(frozen=True, slots=True)
class CampaignOutput:
    """What is told and kept of a campaign.

    Attributes:
        thresholds: how much has to be visited.
        missing: whether only what is missing is shown.
        json: whether it is told to a machine.
        store: the store that cases are added to.
        save: where every random case is saved.
        failures: where small failing cases are saved.
        shrink: whether these are looked for.
    """

    thresholds: Sequence[Threshold]
    missing: bool
    json: bool
    store: Path | None
    save: Path | None
    failures: Path
    shrink: bool


def simulate(suite: Suite, telling: CampaignOutput) -> int:
    """Runs the cases in virtual time, and tells what came of them; the exit code."""
    suite.refuse_clashes(telling)
    tester = Tester(suite.model)
    done = _carry_out(suite, telling, lambda cases, _: map(tester.execute, cases), None)
    is_whole = done.ended is None  # who interrupts it does not wait for files and small cases
    is_saved = telling.save is None or not is_whole or suite.save_random(tester, telling.save)
    findings = find_causes(tester, done.campaign, MAX_SHRUNK if telling.shrink and is_whole else 0)
    saved = [suite.save_small(finding, telling.failures) for finding in findings]
    commands = tuple(suite.again(finding, path) for finding, path in zip(findings, saved, strict=True))
    code = _tell(done, suite.setting(findings, commands), telling)
    return code if is_saved else max(2, code)


def run_over_nodes(suite: Suite, telling: CampaignOutput, asked: NodeOptions, command: str) -> int:
    """Runs the cases over nodes, and tells what came of them; the exit code.

    Args:
        suite: the cases.
        telling: what is told.
        asked: where they run.
        command: what runs them all again.
    """
    from scbm.cli.campaigns.node_setup import refuse_beyond_reach  # noqa: PLC0415 - the same
    from scbm.cli.campaigns.over_nodes import over_nodes  # noqa: PLC0415 - sockets and processes, which few runs need

    suite.refuse_clashes(telling)
    refuse_beyond_reach(suite, asked.real, "--real")
    tester = Tester(suite.model)
    with over_nodes(asked, tester) as nodes:
        if not asked.starts:  # what is real, its controller says
            refuse_beyond_reach(suite, nodes.real, "--network")
        done = _carry_out(suite, telling, nodes.executions, asked.words)
    findings = find_causes(tester, done.campaign, 0)  # what fails over nodes need not fail in simulation
    logs = (nodes.logs.files.get(finding.results[0].case.name) for finding in findings)
    commands = tuple(command if log is None else f"scbm replay {shlex.quote(str(log))}" for log in logs)
    setting = replace(suite.setting(findings, commands), where=asked.words, answers=nodes.answers)
    code = _tell(done, setting, telling)
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
    """Runs the cases, keeps them in the store, and shows how far that is; what came until something ended it.

    Args:
        suite: the cases.
        telling: what is told and kept.
        run: gives what comes of cases, and calls with the name of the one that runs.
        where: the nodes that they run over, in words; `None` for simulation.

    Raises:
        InputError: it was ended before the first case was done.
        KeyboardInterrupt: the same, by somebody.
    """
    is_over_nodes = where is not None
    progress = _progress(suite.count, is_bar=is_over_nodes or suite.count >= _SLOW, is_told=is_over_nodes)
    came: list[CaseResult] = []
    keeper: Keeper | None = None
    ended: InputError | KeyboardInterrupt | None = None
    try:
        with _store(telling.store, suite, where) as keeper, progress as (said, done):
            executions = run(suite.cases(), said)
            results = (execution.result for execution in executions)
            for result in done(results if keeper is None else keeper.kept(executions, suite.by_name, suite.network)):
                came.append(result)  # noqa: PERF402 - what came before an interruption is kept
    except (InputError, KeyboardInterrupt) as error:
        if not came:
            raise
        ended = error
    return _Done(Campaign.of(suite.model, came), suite.count, keeper, ended)


@dataclass(frozen=True, slots=True)
class _Done:
    """What came of a campaign.

    Attributes:
        campaign: the cases that were run.
        count: how many cases there were to run.
        keeper: what added them to a store, if there is one.
        ended: what ended the campaign early, if something did.
    """

    campaign: Campaign
    count: int
    keeper: Keeper | None
    ended: InputError | KeyboardInterrupt | None

    @property
    def since(self) -> Since | None:
        """What the store says then; nothing if there is none, or the campaign was ended early."""
        if self.keeper is None or self.ended is not None:
            return None
        return self.keeper.since(self.campaign.coverage)

    @property
    def words(self) -> str:
        """How far it came, if it was ended; for the report."""
        if self.ended is None:
            return ""
        how = "Interrupted" if isinstance(self.ended, KeyboardInterrupt) else "Ended by an error"
        return f"{how} after {len(self.campaign.results)} of {counted(self.count, 'case')}"

    def drawn(self, random: int) -> int:
        """How many of so many random cases were run; they come last."""
        return max(0, random - (self.count - len(self.campaign.results)))


def _tell(done: _Done, setting: Setting, telling: CampaignOutput) -> int:
    campaign, since = done.campaign, done.since
    if telling.json:
        stored = {} if since is None else {"store": since.as_json}
        early = {"ended_early": done.words} if done.words else {}
        report = campaign_json(campaign, setting.seed, setting.findings, setting.commands, setting.answers)
        write_json(report | stored | early)
    else:
        shown = replace(setting, random=done.drawn(setting.random), ended_early=done.words)
        results().lines((missing_report if telling.missing else coverage_report)(campaign, shown))
        results().lines([] if since is None else since.lines)
    if done.words:
        return _tell_early(done, telling)
    if since is not None and not since.is_whole:
        return 2
    return 0 if threshold_option.meets(campaign.coverage, telling.thresholds) and not campaign.failed else 1


def _tell_early(done: _Done, telling: CampaignOutput) -> int:
    """Tells what ended a campaign; the exit code."""
    is_unfinished = done.keeper is not None and done.keeper.is_unfinished
    stored = f"; their run in {telling.store} is not finished" if is_unfinished else ""
    errors().line(f"scbm: {done.words[0].lower()}{done.words[1:]}{stored}")
    if telling.save is not None:
        errors().line(f"scbm: nothing is saved in {telling.save}: that comes behind the last case")
    if isinstance(done.ended, InputError):
        errors().diagnostics(done.ended.diagnostics)
        return 2
    return INTERRUPTED


def _tell_progress(words: str) -> None:
    errors().line(f"scbm: {in_one_line(words)}")


def _store(path: Path | None, suite: Suite, where: str | None) -> AbstractContextManager[Keeper | None]:
    """The store that results are added to, if one is asked for."""
    if path is None:
        return nullcontext()
    from scbm.cli.campaigns.store_keeper import keeping  # noqa: PLC0415 - a database, which few runs need

    return keeping(path, suite.model, suite.file, where)


def _progress(
    count: int, *, is_bar: bool, is_told: bool
) -> AbstractContextManager[tuple[Callable[[str], None], Callable[[Iterator[CaseResult]], Iterator[CaseResult]]]]:
    """What to call with the case that runs, and what lets results through and counts them."""
    if is_bar and sys.stderr.isatty():
        return bar(count)
    if is_told:
        return nullcontext((lambda _: None, lambda results: with_lines(results, count, _tell_progress)))
    return nullcontext((lambda _: None, lambda results: results))


def refuse_without_random_cases(count: int, options: Mapping[str, object]) -> None:
    """Raises `InputError` for options that say something of random cases where there are none."""
    useless = [option for option, value in options.items() if value is not None and not count]
    message = "this is for random cases, and none are drawn"
    if useless:
        remedy = "add for example `--cases 20`"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy) for option in useless])


@dataclass(frozen=True)
class Suite:
    """The cases that a command line asks for: those in files, then random ones."""

    model: BehaviorModel
    file: Path
    written: Sequence[WrittenCase]
    random: int
    seed: int
    network_text: str | None
    network: Network | None
    requirements: tuple[Requirement, ...]
    time_limit_ns: int | None

    @property
    def count(self) -> int:
        """How many they are."""
        return len(self.written) + self.random

    def cases(self) -> Iterator[Case]:
        """All cases, with what the command line adds to them."""
        for written in self.written:
            yield self._completed(written.case)
        for case in self.drawn():
            yield self._completed(case)

    @cached_property
    def writer(self) -> FileWriter:
        """What writes the files of the campaign, and refuses to replace the model and the case files."""
        return FileWriter([(self.file, "the model"), *((written.path, "a case file") for written in self.written)])

    def refuse_clashes(self, telling: CampaignOutput) -> None:
        """Raise `InputError` if the store of the command line is a file that the command reads."""
        self.writer.refuse_clashes({} if telling.store is None else {"--store": telling.store})

    @cached_property
    def by_name(self) -> dict[str, WrittenCase]:
        """The written cases by their names."""
        return {written.case.name: written for written in self.written}

    def refuse_equal_names(self) -> None:
        """Raises `InputError` if a written case has the name of a random one."""
        drawn = re.compile(rf"seed-{self.seed}-case-([1-9]\d*)", re.ASCII)
        for written in self.written:
            match = drawn.fullmatch(written.case.name)
            if match is not None and int(match[1]) <= self.random:
                message = f"`{written.case.name}` is drawn, and also in {written.path}"
                remedy = "choose another seed, or leave out one of them"
                raise InputError([Diagnostic(Slug.DUPLICATE_NAME, message, Place("--cases"), remedy)])

    def drawn(self) -> Iterable[Case]:
        """The random ones, without what the command line adds."""
        if not self.random:
            return ()
        return RandomCases(self.model, str(self.file), self.network).first(self.random, self.seed)

    @property
    def loses_messages(self) -> bool:
        """Whether the network of random cases may lose messages."""
        network = self.network
        return network is None or bool(network.loss or network.partitions or network.restarts)

    def _completed(self, case: Case) -> Case:
        return complete(case, self.requirements, self.time_limit_ns, self.model)

    def save_random(self, tester: Tester, directory: Path) -> bool:
        """Saves every random case with all that was drawn in it; if it cannot, that is told and the report goes on."""
        recorded = (tester.execute(self._completed(case)).recorded_case for case in self.drawn())
        labelled = [(case, [f"case {number} of seed {self.seed}"]) for number, case in enumerate(recorded, start=1)]
        try:
            self.writer.write_all(case_texts(labelled, directory, self.model, self.file), overwrite=False)
        except InputError as error:
            errors().diagnostics(error.diagnostics)
            return False
        return True

    def save_small(self, finding: Finding, directory: Path) -> Path | None:
        """Saves the small case of a finding, if there is one; where it cannot, that is told and the report goes on."""
        if finding.shrunk is None:
            return None
        failed = finding.results[0].case.name
        comments = [f"the smallest case found that fails as {failed} did:", str(finding.failure)]
        execution = finding.shrunk.execution
        small = replace(execution.case, recorded=execution.recorded)
        texts = case_texts([(small, comments)], directory, self.model, self.file)
        (path,) = texts
        if self.writer.reads(path):
            return None  # the suite has the small case of an earlier campaign, which shows the failure as well
        try:
            self.writer.write_all(texts, overwrite=True)
        except InputError as error:
            errors().diagnostics(error.diagnostics)
            return None
        return path

    def again(self, finding: Finding, saved: Path | None) -> str:
        """The command that shows a finding again: its small case if that is saved, else its first case."""
        case = finding.results[0].case
        if saved is not None:
            return f"scbm replay {shlex.quote(str(saved))}"
        for written in self.written:
            if written.case.name == case.name:
                return f"scbm replay {shlex.quote(str(written.path))}{self._model_of(written)}{self._judging}"
        assert case.origin is not None  # noqa: S101 - it is not written, so it is drawn
        drawn = f"--seed {case.origin.seed} --case {case.origin.number}"
        return f"scbm run {shlex.quote(str(self.file))} {drawn}{self.drawing}{self._judging}"

    def _model_of(self, written: WrittenCase) -> str:
        """The option that says the model, if the case does not name this one itself."""
        named = written.model_path
        is_this = named is not None and named.resolve() == self.file.resolve()
        return "" if is_this else f" --model {shlex.quote(str(self.file))}"

    @property
    def drawing(self) -> str:
        """The options that random cases are drawn with, beside the seed."""
        return f" --network {shlex.quote(self.network_text)}" if self.network_text else ""

    def setting(self, findings: Sequence[Finding], commands: Sequence[str]) -> Setting:
        """What the report tells beside the results."""
        return Setting(
            str(self.file),
            self.seed,
            self.random,
            self.drawing,
            tuple(findings),
            tuple(commands),
            loses_messages=self.loses_messages,
        )

    @property
    def options(self) -> str:
        """The cases, as options and arguments behind the model."""
        files = "".join(f" {shlex.quote(str(path))}" for path in dict.fromkeys(w.path for w in self.written))
        random = f" --cases {self.random} --seed {self.seed}" if self.random else ""
        return f"{files}{random}{self.drawing}{self._judging}"

    @property
    def _judging(self) -> str:
        """The options that cases are run and judged with."""
        options = []
        if self.time_limit_ns is not None:
            options.append(f"--time-limit {shlex.quote(format_duration(self.time_limit_ns))}")
        options += [f"--require {shlex.quote(str(requirement.sentence))}" for requirement in self.requirements]
        return "".join(f" {option}" for option in options)
