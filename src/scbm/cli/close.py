"""`scbm close`: decides every obligation, writes what comes of it, and checks certificates."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from scbm.cli.campaigns.certificate_verdicts import check_certificates
from scbm.cli.campaigns.suite import Suite
from scbm.cli.output.progress import activity_display
from scbm.cli.output.terminal import results, write_json
from scbm.closing import CloseLimits, Closer, Closing, Decision
from scbm.closing.closing_files import ClosingFiles, write_output
from scbm.closing.closing_json import closing_json
from scbm.closing.failing_cases import FailedCase, FoundFault, failed_cases, found_faults
from scbm.files import add_goals, load_model, suggestion
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.reports.figure_table import shown_path
from scbm.reports.terminal.closing_report import ClosingSetting, closing_report
from scbm.testing import Campaign, Tester, find_causes

_ALL = "all"
_DEFAULT = CloseLimits().situations


def command(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="MODEL", help="The model file; with --check, certificates.", show_default=False),
    ] = None,
    *,
    suite: Annotated[
        list[Path] | None, typer.Option("--suite", metavar="CASES", help="Case files to begin with, or a directory.")
    ] = None,
    cases: Annotated[
        int, typer.Option("--cases", min=0, max=10_000_000, help="How many random cases to begin with.")
    ] = 0,
    seed: Annotated[int, typer.Option("--seed", help="Seed of the random cases.")] = 0,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIRECTORY", help="Where cases and certificates are written.")
    ] = None,
    write: Annotated[
        list[str] | None,
        typer.Option("--write", metavar="NAME", help="Write this suggested goal into the model; `all` of them."),
    ] = None,
    max_states: Annotated[
        int, typer.Option("--max-states", min=1, help="Maximum number of explored situations of runs.")
    ] = _DEFAULT,
    check: Annotated[bool, typer.Option("--check", help="Check certificates instead.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Decide every obligation: covered by a case, proved uncoverable, or undecided. With --check, check such proofs."""
    if check:
        return check_certificates(files or [], json=json)
    asked = _CloseRequest(_only_model(files or []), tuple(suite or ()), cases, seed, max_states)
    result = asked.close()
    goals = _SuggestedGoals.chosen(result.closing, write or ())
    if goals.new:
        add_goals(asked.file, [(name, goal, None) for name, goal in goals.new.items()])
        result = asked.close()
    output = None
    if out is not None:
        paths = [case.path for case in result.suite.written]
        output = write_output(result.closing, out, asked.file, paths)
    failed, found = result.failed(output), result.found(output)
    if json:
        write_json(closing_json(result.closing, output) | _json(output, failed, found, goals))
    else:
        setting = replace(result.setting(output), found=found, written=goals.told(goals.new))
        setting = replace(setting, already=goals.told(goals.already))
        results().lines(closing_report(result.closing, setting))
    is_open = any(decided.decision is Decision.UNDECIDED for decided in result.closing.decided)
    return 1 if failed or is_open else 0


def _only_model(files: Sequence[Path]) -> Path:
    """The one file to close. Raises `InputError` if there is none, or are several."""
    if len(files) == 1:
        return files[0]
    message = f"`scbm close` takes one model, and here are {len(files)}" if files else "which model is to be closed?"
    remedy = "cases go behind `--suite`, certificates behind `--check`" if files else "write `scbm close MODEL`"
    raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place("MODEL"), remedy)])


@dataclass(frozen=True)
class _CloseRequest:
    """What the command line asks to be closed."""

    file: Path
    paths: tuple[Path, ...]
    cases: int
    seed: int
    most: int

    def close(self) -> "_CloseResult":
        """Reads model and suite as they are now, runs the suite, and decides the rest."""
        model = load_model(self.file)
        suite = Suite.load(model, self.file, self.paths, self.cases, self.seed)
        with activity_display(suite.activity) as told:
            campaign = suite.run()
            told(f"exploring {model.name}")
            closing = Closer(model, CloseLimits(situations=self.most), told).close(campaign)
        return _CloseResult(self, suite, campaign, closing)

    @property
    def options(self) -> str:
        """The options that closing again needs beside those of the suite."""
        return f" --max-states {self.most}" if self.most != _DEFAULT else ""


@dataclass(frozen=True)
class _CloseResult:
    """What closing came to, and what it began with."""

    asked: _CloseRequest
    suite: Suite
    campaign: Campaign
    closing: Closing

    def failed(self, output: ClosingFiles | None) -> tuple[FailedCase, ...]:
        """The cases that failed, each with the command that shows it."""
        return failed_cases(self.campaign, self.closing, lambda name: self._again(name, output))

    def found(self, output: ClosingFiles | None) -> tuple[FoundFault, ...]:
        """What new cases found on their way, each with the command that shows it."""
        return found_faults(self.closing, lambda name: self._new(name, output))

    def _again(self, name: str, output: ClosingFiles | None) -> str:
        return self.suite.again(name) or self._new(name, output)

    def _new(self, name: str, output: ClosingFiles | None) -> str:
        if output is not None:
            return f"scbm replay {shown_path(str(output.cases[name]))}"
        closing = f"scbm close {shown_path(str(self.asked.file))}{self._options} --out closed"
        return f"{closing}; scbm replay {shown_path(f'closed/cases/{name}.yaml')}"

    @property
    def _options(self) -> str:
        return f"{self.suite.close_options}{self.asked.options}"

    def setting(self, output: ClosingFiles | None) -> ClosingSetting:
        """Return what the report shows beside the result."""
        model = self.closing.model
        results = (*self.campaign.results, *(made.execution.result for made in self.closing.cases))
        failed = Campaign.of(model, [result for result in results if not result.verdict.passed])
        findings = find_causes(Tester(model), failed, 0)
        commands = [self._again(finding.results[0].case.name, output) for finding in findings]
        return ClosingSetting(
            str(self.asked.file),
            self.suite.words,
            self.suite.arguments,
            self.suite.drawing,
            self._options,
            output,
            failed,
            findings,
            tuple(commands),
        )


@dataclass(frozen=True)
class _SuggestedGoals:
    """The goals that were to be written, each with its predicate as text.

    Attributes:
        new: those that are suggested.
        already: those that the model has already.
    """

    new: dict[str, str]
    already: dict[str, str]

    @staticmethod
    def chosen(closing: Closing, names: Sequence[str]) -> "_SuggestedGoals":
        """The goals of these names. Raises `InputError` with all names that there are none of."""
        goals = {each.name: str(each.goal) for each in closing.suggestions if each.name is not None}
        already = {name: str(goal) for name, goal in closing.model.goals if name in names}
        unknown = [name for name in names if name not in goals | already and (name != _ALL or not goals)]
        if unknown:
            raise InputError([_unknown(name, list(goals)) for name in unknown])
        return _SuggestedGoals({name: goals[name] for name in goals if _ALL in names or name in names}, already)

    @staticmethod
    def told(goals: dict[str, str]) -> tuple[str, ...]:
        """The goals in words."""
        return tuple(f"{name}: {goal}" for name, goal in goals.items())


def _unknown(name: str, goals: list[str]) -> Diagnostic:
    message = f"no goal `{name}` is suggested" if goals else "no goal is suggested"
    remedy = suggestion(name, [*goals, _ALL], "the suggested goals are") if goals else None
    return Diagnostic(Slug.UNKNOWN_GOAL, message, Place("--write", 1, 1, max(1, len(name))), remedy, name)


def _json(
    output: ClosingFiles | None, failed: Sequence[FailedCase], found: Sequence[FoundFault], goals: _SuggestedGoals
) -> dict[str, Any]:
    return {
        "out": None if output is None else str(output.directory),
        "failed": [{"case": each.name, "failures": list(each.failures), "again": each.again} for each in failed],
        "found": [
            {"case": each.name, "end": each.end.value, "message": each.message, "again": each.again} for each in found
        ],
        "written": [{"name": name, "goal": goal} for name, goal in goals.new.items()],
        "already": [{"name": name, "goal": goal} for name, goal in goals.already.items()],
    }
