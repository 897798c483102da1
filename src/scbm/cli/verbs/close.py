"""`scbm close`: decides every obligation, writes cases and certificates, and checks certificates."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any

import typer
from msgspec import Struct, field
from msgspec.structs import replace

from scbm.cases.coverage import engine_words
from scbm.cli.exit_codes import INTERRUPTED
from scbm.cli.options.campaign_options import read_executor
from scbm.cli.options.closing_options import ClosingLimits, limit_text
from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.option_errors import OptionReader, option_error
from scbm.cli.options.option_values import read_requirements
from scbm.cli.options.planner_options import PlannerOptions, RunPlanner
from scbm.cli.options.status_options import WaiversFile, read_waivers_of
from scbm.cli.options.verb_options import Jobs, Json, Seed, SuiteFiles
from scbm.cli.output.terminal import activity_display, errors, report_columns, results, write_json
from scbm.closing import CloseLimits, Closer, Closing, Decision
from scbm.closing.certificate_files import SUFFIX, CheckedCertificate, check_file, find_certificates, open_certificates
from scbm.closing.closing_files import refuse_output, write_output
from scbm.closing.closing_result import ClosingResult
from scbm.closing.interruption import Interruption
from scbm.closing.proved_statuses import with_waivers
from scbm.files import load_model, suggestion
from scbm.model import Diagnostic, InputError, Place, Requirement, Slug
from scbm.model.visible_text import counted, shell_word
from scbm.reports.terminal.closing_report import closing_report
from scbm.testing.suite import Suite

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
        bool, HelpSection.CASES.option("--requirements", help="Decide the requirements in all runs, built-in ones too.")
    ] = False,
    require: Annotated[
        list[str] | None,
        HelpSection.CASES.option(
            "--require", metavar="SENTENCE", help="Decide this requirement in all runs, too, as with --requirements."
        ),
    ] = None,
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
    store: Annotated[
        Path | None,
        HelpSection.OUTPUT.option(
            "--store", metavar="FILE", help="Keep the answers of --requirements in this coverage store."
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
    decides = requirements or bool(require)
    given = tuple(suite or ())
    asked = _CloseRequest(
        model, given, cases, seed, limits, planner, jobs, waivers, one_case_each, decides, require or (), store
    )
    if store is not None and not decides:
        message, remedy = "a store keeps the answers about requirements", "add `--requirements`"
        raise option_error("--store", message, remedy)
    refuse_output(model, out, store, edits_model=bool(write))
    with asked.interruption.handled():
        return _carry_out(asked, out, store, write or (), json=json)


def _carry_out(
    asked: "_CloseRequest", out: Path | None, store: Path | None, write: Sequence[str], *, json: bool
) -> int:
    """Close the model, write files, print the report, and return the exit code."""
    result = asked.close()
    goals = _SuggestedGoals.chosen(result.closing, () if result.closing.is_interrupted else write)
    if goals.new:
        from scbm.files import add_goals  # noqa: PLC0415 - the round trip of YAML, which most commands do not need

        add_goals(asked.file, [(name, goal, None) for name, goal in goals.new.items()])
        result = asked.close()
    closing = result.closing
    output = refused = None
    if out is not None:
        try:
            output = write_output(closing, out, asked.file, [case.path for case in result.suite.written])
        except InputError as error:  # the report comes first: what took minutes is not lost
            refused = error
    if store is not None and closing.requirements is not None and not closing.is_interrupted:
        from scbm.store import keep_decisions  # noqa: PLC0415 - a database, which few closings need

        files = result.suite.files | ({} if output is None else output.files)
        keep_decisions(store, closing.model, closing.requirements.known(files))
    result = replace(result, output=output, written=goals.new, already=goals.already)
    if json:
        from scbm.closing.closing_json import closing_json  # noqa: PLC0415 - only what is asked for is loaded

        write_json(closing_json(result))
    else:
        results().lines(closing_report(result, report_columns()))
    if refused is not None:
        raise refused
    if closing.is_interrupted:
        return INTERRUPTED
    is_open = any(decided.decision is Decision.UNDECIDED for decided in closing.decided)
    judged = closing.requirements
    return 1 if result.failed or is_open or (judged is not None and judged.is_open) else 0


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
    require: Sequence[str] = ()
    store: Path | None = None
    interruption: Interruption = field(default_factory=Interruption)

    def close(self) -> ClosingResult:
        """Read model and suite again, run the suite, and decide the remaining obligations."""
        written, read = load_model(self.file), OptionReader()
        model = read.read(lambda: self.planner.applied(written), written)
        if self.store is not None:
            from scbm.store import refuse_store  # noqa: PLC0415 - a database, which few closings need

            refuse_store(self.store, model)  # before anything is computed or written
        asked: tuple[Requirement, ...] = read.read(lambda: read_requirements(self.require, model), ())
        waivers = read.last(lambda: read_waivers_of(model, self.waivers))
        suite = Suite(model, self.file, self.paths, random=self.cases, seed=self.seed, planner_option=self.planner.text)
        suite = replace(suite, requirements=asked).loaded()
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

                closer_of_runs = RequirementCloser(model, self.limits, show, self.interruption, asked)
                decisions = closer_of_runs.decide(campaign, closing)
                certificates = (*closing.certificates, *decisions.certificates)
                closing = replace(closing, requirements=decisions, certificates=certificates)
        closing = with_waivers(closing, waivers)
        return ClosingResult(closing, suite, campaign, self._options, self.waivers)

    @property
    def _options(self) -> str:
        each = " --one-case-each" * self.one_case_each + " --requirements" * self.requirements
        require = "".join(f" --require {shell_word(sentence)}" for sentence in self.require)
        return f"{each}{require}{limit_text(self.limits)}"


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


def _unknown(name: str, goals: list[str]) -> Diagnostic:
    message = f"no suggested goal has the name `{name}`" if goals else "no goal is suggested"
    remedy = suggestion(name, [*goals, _ALL], "the suggested goals are") if goals else None
    return Diagnostic(Slug.UNKNOWN_GOAL, message, Place("--write", 1, 1, max(1, len(name))), remedy, name)


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
    certificate = checked.file.certificate
    if certificate.is_about_requirements:
        sizes = [counted(len(certificate.claims), "requirement")]
    else:
        words = engine_words(certificate.argument.kind)
        sizes = [f"{counted(len(certificate.claims), 'obligation')} by {words}"]
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
        "requirements": list(checked.requirements),
        "situations": checked.situations,
        "assumptions": list(checked.assumptions),
        "flaws": [str(flaw) for flaw in checked.flaws],
    }
