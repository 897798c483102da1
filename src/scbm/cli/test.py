"""`scbm test`: case files and random cases, verdicts, and the coverability report."""

import re
import shlex
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scbm.cases import Case, Network
from scbm.cli import thresholds
from scbm.cli.arguments import complete, read_faults, read_requirements, read_time_limit
from scbm.cli.output import errors, results, write_json
from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.model import BehaviorModel, Requirement, format_duration
from scbm.notation import load_model
from scbm.reports import Setting, coverage_report, missing_report
from scbm.testing import (
    MOST_SHRUNK,
    Campaign,
    CaseResult,
    Finding,
    RandomCases,
    Tester,
    WrittenCase,
    campaign_json,
    find_causes,
    load_suite,
    save_cases,
)

if TYPE_CHECKING:
    from scbm.cli.keeping import Keeper

_SLOW = 500
"""From so many cases on, progress is shown."""

_RANDOM = 20
"""So many random cases are drawn if neither a number nor files are given."""


def command(
    model: Annotated[Path, typer.Argument(help="The model file.", show_default=False)],
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="CASES", help="Case files, and directories of them.", show_default=False),
    ] = None,
    *,
    cases: Annotated[
        int | None,
        typer.Option("--cases", min=0, max=10_000_000, help="How many random cases. [20; 0 beside case files]"),
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Decides everything that is drawn.")] = 0,
    network: Annotated[
        str | None, typer.Option("--network", help="Faults in random cases: `loss: 2 %, jitter: 20 ms`, or `drawn`.")
    ] = None,
    require: Annotated[
        list[str] | None, typer.Option("--require", metavar="SENTENCE", help="A requirement beside the model's.")
    ] = None,
    save: Annotated[
        Path | None, typer.Option("--save", metavar="DIRECTORY", help="Save every random case as a file.")
    ] = None,
    shrink: Annotated[bool, typer.Option("--shrink/--no-shrink", help="Make failing cases small.")] = True,
    failures: Annotated[
        Path, typer.Option("--failures", metavar="DIRECTORY", help="Where small failing cases are saved.")
    ] = Path("scbm-failures"),
    store: Annotated[
        Path | None, typer.Option("--store", metavar="FILE", help="Add the cases to this coverage store.")
    ] = None,
    missing: Annotated[bool, typer.Option("--missing", help="Show only what is missing, and why.")] = False,
    fail_under: Annotated[
        list[str] | None, typer.Option(thresholds.OPTION, metavar="PERCENT", help=thresholds.HELP)
    ] = None,
    time_limit: Annotated[
        str | None, typer.Option("--time-limit", metavar="DURATION", help="Simulated time for each case. [1 h]")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Run case files and random cases, judge them, and report how much of the model they visited."""
    loaded = load_model(model)
    wanted = (0 if files else _RANDOM) if cases is None else cases
    _refuse_without_random_cases(wanted, {"--network": network, "--save": save})
    suite = _Suite(
        loaded,
        model,
        load_suite(files or [], loaded),
        wanted,
        seed,
        network,
        read_faults(network, loaded),
        read_requirements(require or [], loaded),
        read_time_limit(time_limit),
    )
    wanted_figures = thresholds.read_thresholds(fail_under or [])
    suite.refuse_equal_names()
    tester = Tester(loaded)
    with _store(store, loaded, model) as keeper:
        done = tester.results(suite.cases())
        kept = done if keeper is None else keeper.kept(done, suite.by_name, suite.network)
        campaign = Campaign.of(loaded, _with_progress(kept, suite.count))
        since = None if keeper is None else keeper.since(campaign.coverage)
    is_saved = save is None or suite.save_random(tester, save)
    findings = find_causes(tester, campaign, MOST_SHRUNK if shrink else 0)
    saved = [suite.save_small(finding, failures) for finding in findings]
    commands = tuple(suite.again(finding, path) for finding, path in zip(findings, saved, strict=True))
    if json:
        stored = {} if since is None else {"store": since.as_json}
        write_json(campaign_json(campaign, seed, findings, commands) | stored)
    else:
        setting = Setting(
            str(model), seed, wanted, suite.drawing, findings, commands, loses_messages=suite.loses_messages
        )
        results().lines((missing_report if missing else coverage_report)(campaign, setting))
        results().lines([] if since is None else since.lines)
    if not is_saved or (since is not None and not since.is_whole):
        return 2
    return 0 if thresholds.meets(campaign.coverage, wanted_figures) and not campaign.failed else 1


def _store(path: Path | None, model: BehaviorModel, model_file: Path) -> "AbstractContextManager[Keeper | None]":
    """The store that results are added to, if one is asked for."""
    if path is None:
        return nullcontext()
    from scbm.cli.keeping import keeping  # noqa: PLC0415 - a database, which few runs need

    return keeping(path, model, model_file)


def _refuse_without_random_cases(count: int, options: Mapping[str, object]) -> None:
    """Raises `InputError` for options that say something of random cases where there are none."""
    useless = [option for option, value in options.items() if value is not None and not count]
    message = "this is for random cases, and none are drawn"
    if useless:
        remedy = "add for example `--cases 20`"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy) for option in useless])


@dataclass(frozen=True)
class _Suite:
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
        return len(self.written) + self.random

    def cases(self) -> Iterator[Case]:
        """All cases, with what the command line adds to them."""
        for written in self.written:
            yield self._completed(written.case)
        for case in self._drawn():
            yield self._completed(case)

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

    def _drawn(self) -> Iterable[Case]:
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
        recorded = (tester.execute(self._completed(case)).recorded_case for case in self._drawn())
        labelled = [(case, [f"case {number} of seed {self.seed}"]) for number, case in enumerate(recorded, start=1)]
        try:
            save_cases(labelled, directory, self.model, self.file, overwrite=False)
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
        try:
            return save_cases([(small, comments)], directory, self.model, self.file, overwrite=True)[0]
        except InputError as error:
            errors().diagnostics(error.diagnostics)
            return None

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

    @property
    def _judging(self) -> str:
        """The options that cases are run and judged with."""
        options = []
        if self.time_limit_ns is not None:
            options.append(f"--time-limit {shlex.quote(format_duration(self.time_limit_ns))}")
        options += [f"--require {shlex.quote(str(requirement.sentence))}" for requirement in self.requirements]
        return "".join(f" {option}" for option in options)


def _with_progress(done: Iterable[CaseResult], count: int) -> Iterator[CaseResult]:
    """The results as they come, with a bar on a terminal if there are many."""
    if count < _SLOW or not sys.stderr.isatty():
        yield from done
        return
    from rich.console import Console  # noqa: PLC0415 - only where there is something to show
    from rich.progress import track  # noqa: PLC0415

    yield from track(done, "cases", count, console=Console(file=sys.stderr), transient=True)
