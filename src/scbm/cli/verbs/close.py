"""`scbm close`: decides every obligation, writes cases and certificates, and checks certificates."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec import Struct, field
from msgspec.structs import replace

from scbm.cli.campaigns.suite import Suite
from scbm.cli.exit_codes import INTERRUPTED
from scbm.cli.options.campaign_options import read_executor
from scbm.cli.options.closing_options import ClosingLimits, limit_text
from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.planner_options import PlannerOptions, RunPlanner
from scbm.cli.options.status_options import WaiversFile, read_waivers_of
from scbm.cli.options.verb_options import Jobs, Json, Seed, SuiteFiles
from scbm.cli.output.terminal import activity_display, errors, report_columns, results, write_json
from scbm.closing import CloseLimits, Closer, Closing, Decision
from scbm.closing.certificate_files import SUFFIX, CheckedCertificate, check_file, find_certificates, open_certificates
from scbm.closing.closing_files import ClosingFiles, refuse_output, write_output
from scbm.closing.decisions import FailedCase, FoundFault, consequences_of_force, failed_cases, found_faults
from scbm.closing.interruption import Interruption
from scbm.closing.proved_statuses import with_waivers
from scbm.files import load_model, suggestion
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import shell_word
from scbm.reports import counted
from scbm.reports.figure_table import shown_path
from scbm.reports.terminal.closing_report import ClosingSetting, closing_report
from scbm.testing import Campaign, Tester, find_causes
from scbm.testing.batches.batch_summary import SummaryBuilder, merge
from scbm.testing.batches.campaign_work import FollowedBy

_ALL = "all"


def command(
    files: Annotated[
        list[Path] | None,
        typer.Argument(metavar="MODEL", help="The model file; with --check, certificates.", show_default=False),
        Reads("the model"),
    ] = None,
    *,
    suite: SuiteFiles = None,
    cases: Annotated[
        int,
        HelpSection.CASES.option(
            "--cases", metavar="N", min=0, max=10_000_000, help="Number of random cases to run first."
        ),
    ] = 0,
    seed: Seed = 0,
    one_case_each: Annotated[
        bool,
        HelpSection.CASES.option(
            "--one-case-each", help="Write the shortest case for each obligation, instead of few cases that visit much."
        ),
    ] = False,
    requirements: Annotated[
        bool, HelpSection.CASES.option("--requirements", help="Prove or refute the built-in requirements, too.")
    ] = False,
    jobs: Jobs = None,
    out: Annotated[
        Path | None,
        HelpSection.OUTPUT.option("--out", metavar="DIRECTORY", help="Directory for cases and certificates."),
    ] = None,
    write: Annotated[
        list[str] | None,
        HelpSection.OUTPUT.option(
            "--write", metavar="NAME", help="Write this suggested goal into the model; `all` writes all."
        ),
    ] = None,
    waivers: WaiversFile = None,
    limits: ClosingLimits,
    planner: RunPlanner,
    check: Annotated[bool, typer.Option("--check", help="Check certificates instead.")] = False,
    json: Json = False,
) -> int:
    """Generate cases for unvisited obligations, or prove that no run visits them; `--check` checks such proofs."""
    if check:
        return check_certificates(files or [], json=json)
    model = _only_model(files or [])
    asked = _CloseRequest(
        model, tuple(suite or ()), cases, seed, limits, planner, jobs, waivers, one_case_each, requirements
    )
    refuse_output(model, out, edits_model=bool(write))
    with asked.interruption.handled():
        return _carry_out(asked, out, write or (), json=json)


def _carry_out(asked: "_CloseRequest", out: Path | None, write: Sequence[str], *, json: bool) -> int:
    """Close the model, write files, print the report, and return the exit code."""
    result = asked.close()
    goals = _SuggestedGoals.chosen(result.closing, () if result.closing.is_interrupted else write)
    if goals.new:
        from scbm.files import add_goals  # noqa: PLC0415 - the round trip of YAML, which most commands do not need

        add_goals(asked.file, [(name, goal, None) for name, goal in goals.new.items()])
        result = asked.close()
    output = None
    if out is not None:
        paths = [case.path for case in result.suite.written]
        output = write_output(result.closing, out, asked.file, paths)
    failed, found = result.failed(output), result.found(output)
    if json:
        from scbm.closing.closing_json import closing_json  # noqa: PLC0415 - only what is asked for is loaded

        write_json(closing_json(result.closing, output) | _json(output, failed, found, goals))
    else:
        consequences = consequences_of_force(result.closing, lambda name: result.again(name, output))
        setting = replace(result.setting(output), found=found, consequences=consequences)
        setting = replace(setting, written=goals.sentences(goals.new))
        setting = replace(setting, already=goals.sentences(goals.already))
        results().lines(closing_report(result.closing, setting))
    if result.closing.is_interrupted:
        return INTERRUPTED
    is_open = any(decided.decision is Decision.UNDECIDED for decided in result.closing.decided)
    judged = result.closing.requirements
    return 1 if failed or is_open or (judged is not None and judged.is_open) else 0


def _only_model(files: Sequence[Path]) -> Path:
    """Return the model file. Raise `InputError` if there is none, or more than one."""
    if len(files) == 1:
        return files[0]
    message = f"`scbm close` takes one model, and {len(files)} are given" if files else "no model is given"
    remedy = "give cases with `--suite`, certificates with `--check`" if files else "write `scbm close MODEL`"
    raise option_error("MODEL", message, remedy)


class _CloseRequest(Struct, frozen=True):
    """The model and the suite of the command line, with the options for closing."""

    file: Path
    paths: tuple[Path, ...]
    cases: int
    seed: int
    limits: CloseLimits
    planner: PlannerOptions
    jobs: int | None = None
    waivers: Path | None = None
    one_case_each: bool = False
    requirements: bool = False
    interruption: Interruption = field(default_factory=Interruption)

    def close(self) -> "_CloseResult":
        """Read model and suite again, run the suite, and decide the remaining obligations."""
        model = self.planner.applied(load_model(self.file))
        waivers = read_waivers_of(model, self.waivers)
        suite = Suite.load(model, self.file, self.paths, self.cases, self.seed, self.planner.text)
        with activity_display(suite.activity) as show:
            executor = read_executor(self.jobs)
            with self.interruption.stage():
                self.interruption.check()
                campaign = suite.run(show, executor)
            show(f"exploring {model.name}")
            closer = Closer(model, self.limits, show, executor, self.interruption)
            with suite.locating():
                closing = closer.close(campaign, one_case_each=self.one_case_each)
            if self.requirements and not closing.is_interrupted:
                from scbm.closing.requirements.requirement_closer import RequirementCloser  # noqa: PLC0415 - few closings do

                decisions = RequirementCloser(model, self.limits, show, self.interruption).decide(campaign, closing)
                closing = replace(closing, requirements=decisions)
        return _CloseResult(self, suite, campaign, with_waivers(closing, waivers))

    @property
    def options(self) -> str:
        """The options that repeat this closing, in addition to those of the suite."""
        each = " --one-case-each" * self.one_case_each + " --requirements" * self.requirements
        return f"{each}{limit_text(self.limits)}{self.waivers_option}"

    @property
    def waivers_option(self) -> str:
        """The option for the waivers file, with a leading blank; empty without one."""
        return "" if self.waivers is None else f" --waivers {shell_word(str(self.waivers))}"


class _CloseResult(Struct, frozen=True):
    """The result of closing, with the campaign before it."""

    asked: _CloseRequest
    suite: Suite
    campaign: Campaign
    closing: Closing

    def failed(self, output: ClosingFiles | None) -> tuple[FailedCase, ...]:
        """Return the cases that failed, each with the command that reproduces it."""
        return failed_cases(self.campaign, self.closing, lambda name: self.again(name, output))

    def found(self, output: ClosingFiles | None) -> tuple[FoundFault, ...]:
        """Return the faults that new cases found, each with the command that reproduces it."""
        return found_faults(self.closing, lambda name: self._new(name, output))

    def again(self, name: str, output: ClosingFiles | None) -> str:
        """Return the command that reproduces the run of a case."""
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
        """Return what the report shows in addition to the result."""
        model = self.closing.model
        failed = self._with_new_cases()
        findings = find_causes(Tester(model), failed, 0)
        commands = [self.again(finding.names[0], output) for finding in findings]
        return ClosingSetting(
            str(self.asked.file),
            self.suite.words,
            self.suite.arguments,
            self.suite.drawing,
            self.suite.planner_option,
            self._options,
            output,
            failed,
            findings,
            tuple(commands),
            waivers=self.asked.waivers_option,
            columns=report_columns(),
        )

    def _with_new_cases(self) -> Campaign:
        """Return the campaign of the suite and of the new cases that follow it."""
        model, suite = self.closing.model, self.campaign
        made_cases = (*self.closing.cases, *self.closing.counterexamples)
        results = [replace(made.execution.result, verdict=made.verdict) for made in made_cases]
        new = Campaign.of(model, results)
        if not suite.count:
            return new
        shifted = SummaryBuilder(len(suite.coverage.obligations.all), suite.summary.written, suite.count + 1)
        for position, result in enumerate(new.results, start=suite.count + 1):
            shifted.add(result.outcome(position))
        source = FollowedBy(suite.source, suite.count, new.source)
        return Campaign(model, source, merge(suite.summary, shifted.summary()))


class _SuggestedGoals(Struct, frozen=True):
    """The goals to write into the model, each with its predicate as text.

    Attributes:
        new: the suggested goals.
        already: the goals that the model has already.
    """

    new: dict[str, str]
    already: dict[str, str]

    @staticmethod
    def chosen(closing: Closing, names: Sequence[str]) -> "_SuggestedGoals":
        """Return the goals with these names. Raise `InputError` with all unknown names."""
        goals = {each.name: str(each.goal) for each in closing.suggestions if each.name is not None}
        already = {name: str(goal) for name, goal in closing.model.goals if name in names}
        unknown = [name for name in names if name not in goals | already and (name != _ALL or not goals)]
        if unknown:
            raise InputError([_unknown(name, list(goals)) for name in unknown])
        return _SuggestedGoals({name: goals[name] for name in goals if _ALL in names or name in names}, already)

    @staticmethod
    def sentences(goals: dict[str, str]) -> tuple[str, ...]:
        """Return each goal as `name: predicate`."""
        return tuple(f"{name}: {goal}" for name, goal in goals.items())


def _unknown(name: str, goals: list[str]) -> Diagnostic:
    message = f"no suggested goal has the name `{name}`" if goals else "no goal is suggested"
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


_VERDICTS_VERSION = 1

_MAX_FLAWS = 5
"""Maximum number of flaws of a certificate that are shown; one is enough to refuse it."""


def check_certificates(files: Sequence[Path], *, json: bool) -> int:
    """Check certificates: each against the model that it names, or all against the model that precedes them.

    Raises:
        InputError: a file is not a certificate, or a model cannot be read.
    """
    model_path = files[0] if len(files) > 1 and files[0].suffix != SUFFIX and not files[0].is_dir() else None
    asked = files[1:] if model_path is not None else files
    if not asked:
        message = "no certificate is given"
        raise option_error("--check", message, "write `scbm close --check FILE`")
    opened = open_certificates(find_certificates(asked))
    paths = [model_path or file.required_model_path() for file in opened]
    models = {path: load_model(path) for path in dict.fromkeys(paths)}
    checked = []
    with activity_display("checking") as show:
        for file, path in zip(opened, paths, strict=True):
            show(f"checking {file.path}")
            checked.append(check_file(file, models[path]))
    if json:
        write_json({"format_version": _VERDICTS_VERSION, "certificates": [_verdict_json(each) for each in checked]})
    else:
        for each, path in zip(checked, paths, strict=True):
            _print_verdict(each, path)
    return 0 if all(each.is_sound for each in checked) else 1


def _print_verdict(checked: CheckedCertificate, model_path: Path) -> None:
    path = str(checked.file.path)
    if checked.is_sound:
        results().prose(f"{path}: sound: {', '.join(_sizes(checked))}")
        for sentence in checked.assumptions:
            results().prose(f"  {sentence}")
        return
    errors().diagnostics(checked.diagnostics(model_path)[:_MAX_FLAWS])
    if len(checked.flaws) > _MAX_FLAWS:
        errors().line(f"{path}: and {len(checked.flaws) - _MAX_FLAWS} more flaws")


def _sizes(checked: CheckedCertificate) -> list[str]:
    sizes = [counted(len(checked.obligations), "obligation")]
    situations = checked.situations
    return sizes if situations is None else [*sizes, f"{counted(situations, 'situation')} checked"]


def _verdict_json(checked: CheckedCertificate) -> dict[str, Any]:
    return {
        "file": str(checked.file.path),
        "model": checked.file.certificate.model,
        "kind": checked.file.certificate.argument.kind,
        "sound": checked.is_sound,
        "is_of_this_model": checked.is_of_this_model,
        "obligations": list(checked.obligations),
        "situations": checked.situations,
        "assumptions": list(checked.assumptions),
        "flaws": [str(flaw) for flaw in checked.flaws],
    }
