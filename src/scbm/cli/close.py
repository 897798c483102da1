"""`scbm close`: decides every obligation, writes what comes of it, and checks certificates."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import typer

from scbm.cli.certificates import check_certificates
from scbm.cli.output import results, write_json
from scbm.cli.suite import Suite, progress
from scbm.closing import CloseLimits, Closer, Closing, Decision, Suggestion
from scbm.closing.failed import FailedCase, failed_cases
from scbm.closing.json_report import closing_json
from scbm.closing.output import Output, write_output
from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.notation import add_goals, load_model, suggestion
from scbm.reports.closing import ClosingSetting, closing_report
from scbm.testing import Campaign

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
    seed: Annotated[int, typer.Option("--seed", help="Decides what random cases draw.")] = 0,
    out: Annotated[
        Path | None, typer.Option("--out", metavar="DIRECTORY", help="Where cases and certificates are written.")
    ] = None,
    write: Annotated[
        list[str] | None,
        typer.Option("--write", metavar="NAME", help="Write this suggested goal into the model; `all` of them."),
    ] = None,
    max_states: Annotated[
        int, typer.Option("--max-states", min=1, help="How many situations of runs to look at.")
    ] = _DEFAULT,
    check: Annotated[bool, typer.Option("--check", help="Check certificates instead.")] = False,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Decide every obligation: covered by a case, proved uncoverable, or undecided. Or check such proofs."""
    if check:
        return check_certificates(files or [], json=json)
    asked = _Asked(_only_model(files or []), tuple(suite or ()), cases, seed, max_states)
    result = asked.close()
    written: tuple[Suggestion, ...] = ()
    if write:
        written = _chosen(result.closing, write)
        add_goals(asked.file, [_goal(goal) for goal in written])
        result = asked.close()
    output = None
    if out is not None:
        paths = [case.path for case in result.suite.written]
        output = write_output(result.closing, out, asked.file, paths)
    failed = result.failed(output)
    if json:
        write_json(_json(result.closing, output, failed, written))
    else:
        results().lines(closing_report(result.closing, result.setting(output, failed, written)))
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
class _Asked:
    """What the command line asks to be closed."""

    file: Path
    paths: tuple[Path, ...]
    cases: int
    seed: int
    most: int

    def close(self) -> "_Result":
        """Reads model and suite as they are now, runs the suite, and decides the rest."""
        model = load_model(self.file)
        suite = Suite.load(model, self.file, self.paths, self.cases, self.seed)
        with progress("running the suite") as told:
            campaign = suite.run()
            closing = Closer(model, CloseLimits(situations=self.most), told).close(campaign)
        return _Result(self, suite, campaign, closing)

    @property
    def options(self) -> str:
        """The options that closing again needs beside those of the suite."""
        return f" --max-states {self.most}" if self.most != _DEFAULT else ""


@dataclass(frozen=True)
class _Result:
    """What closing came to, and what it began with."""

    asked: _Asked
    suite: Suite
    campaign: Campaign
    closing: Closing

    def failed(self, output: Output | None) -> tuple[FailedCase, ...]:
        """The cases that failed, each with the command that shows it."""
        return failed_cases(self.campaign, self.closing, lambda name: self.suite.again(name) or self._new(name, output))

    def _new(self, name: str, output: Output | None) -> str:
        if output is not None:
            return f"scbm replay {quote(str(output.cases[name]))}"
        closing = f"scbm close {quote(str(self.asked.file))}{self._options} --out closed"
        return f"{closing}; scbm replay closed/cases/{name}.yaml"

    @property
    def _options(self) -> str:
        return f"{self.suite.options}{self.asked.options}"

    def setting(
        self, output: Output | None, failed: tuple[FailedCase, ...], written: Sequence[Suggestion]
    ) -> ClosingSetting:
        """What the report tells beside the result."""
        return ClosingSetting(
            str(self.asked.file),
            self.suite.words,
            self.suite.arguments,
            self.suite.drawing,
            self._options,
            output,
            failed,
            tuple(f"{goal.name}: {goal.goal}" for goal in written),
        )


def _chosen(closing: Closing, names: Sequence[str]) -> tuple[Suggestion, ...]:
    """The suggested goals of these names. Raises `InputError` with all names that there are none of."""
    goals = {each.name: each for each in closing.suggestions if each.name is not None}
    unknown = [name for name in names if name not in goals and (name != _ALL or not goals)]
    if unknown:
        raise InputError([_unknown(name, list(goals)) for name in unknown])
    return tuple(goal for name, goal in goals.items() if _ALL in names or name in names)


def _unknown(name: str, goals: list[str]) -> Diagnostic:
    message = f"no goal `{name}` is suggested" if goals else "no goal is suggested"
    remedy = suggestion(name, [*goals, _ALL], "the suggested goals are") if goals else None
    return Diagnostic(Slug.UNKNOWN_GOAL, message, Place("--write", 1, 1, max(1, len(name))), remedy, name)


def _goal(goal: Suggestion) -> tuple[str, str, str]:
    """The goal as it is written into the model file."""
    assert goal.name is not None  # noqa: S101 - it was chosen by its name
    about = ", ".join(dict.fromkeys(obligation.subject for obligation in goal.obligations))
    return goal.name, str(goal.goal), f"needs {about}"


def _json(
    closing: Closing, output: Output | None, failed: Sequence[FailedCase], written: Sequence[Suggestion]
) -> dict[str, Any]:
    return closing_json(closing, output) | {
        "out": None if output is None else str(output.directory),
        "failed": [{"case": each.name, "failures": list(each.failures), "again": each.again} for each in failed],
        "written": [{"name": each.name, "goal": str(each.goal)} for each in written],
    }
