"""`scbm trace`: writes one run as a file for Perfetto or Foxglove."""

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Annotated, Any, BinaryIO

import typer
from msgspec import Struct

from scbm.cli.campaigns.rerun import AskedRun, rerun
from scbm.cli.options.campaign_options import read_inputs
from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.help_sections import HelpSection
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.option_values import read_faults, read_requirements, read_time_limit
from scbm.cli.options.planner_options import RunPlanner
from scbm.cli.options.verb_options import Inputs, ModelOfFile, MostGoals, Require, RerunTimeLimit
from scbm.cli.output.terminal import results, write_json
from scbm.files import FileWriter, load_model
from scbm.model import BehaviorModel, format_moment
from scbm.testing import Execution, RandomCases, Tester
from scbm.testing.batches.campaign_work import complete
from scbm.testing.random_cases import most_goals

FORMAT_VERSION = 1


class _TraceOutput(Struct, frozen=True):
    """An output file of an option.

    Attributes:
        option: the option.
        path: the path of the file.
        write: writes the file and returns the number of its entries.
        noun: what the entries are called.
        readers: the programs that open the file.
    """

    option: str
    path: Path
    write: Callable[[BehaviorModel, Execution, BinaryIO], int]
    noun: str
    readers: str


def command(
    file: Annotated[
        Path,
        typer.Argument(
            help="The case file, or the log of a real run; with `--case`, the model file.", show_default=False
        ),
        Reads("the case, log or model"),
    ],
    *,
    perfetto: Annotated[
        Path | None, HelpSection.FILES.option("--perfetto", metavar="FILE", help="Write JSON for ui.perfetto.dev.")
    ] = None,
    mcap: Annotated[
        Path | None, HelpSection.FILES.option("--mcap", metavar="FILE", help="Write MCAP for Foxglove.")
    ] = None,
    model: ModelOfFile = None,
    seed: Annotated[int | None, HelpSection.CASES.option("--seed", help="Seed of the random case. [0]")] = None,
    case: Annotated[
        int | None,
        HelpSection.CASES.option(
            "--case", metavar="N", min=1, help="This case of `scbm test --seed`, in place of a file."
        ),
    ] = None,
    network: Annotated[
        str | None, HelpSection.CASES.option("--network", help="With `--case`: `loss: 2 %, jitter: 20 ms`, or `drawn`.")
    ] = None,
    inputs: Inputs = None,
    goals: MostGoals = None,
    require: Require = None,
    time_limit: RerunTimeLimit = None,
    planner: RunPlanner,
    json: Annotated[bool, HelpSection.OUTPUT.option("--json", help="Print what was written as JSON.")] = False,
) -> int:
    """Run a case or the log of a real run again, and write what happens as a file that Perfetto or Foxglove opens."""
    outputs = _outputs(perfetto, mcap)
    files = {output.option: output.path for output in outputs}
    if case is None:
        _refuse(
            {"--seed": seed, "--network": network, "--inputs": inputs, "--goals": goals},
            "this is for random cases",
            "add for example `--case 1`",
        )
        done = rerun(AskedRun(file, model, require or [], time_limit, files, planner))
        loaded, execution, writer = done.model, done.execution, done.writer
    else:
        _refuse({"--model": model}, "`--case` draws from the model that comes first", None)
        writer = FileWriter(model=file)
        writer.refuse_outputs(files)
        loaded = planner.applied(load_model(file))
        faults, moves_inputs = read_faults(network, loaded), read_inputs(inputs)
        most = goals or most_goals(loaded)
        cases = RandomCases(loaded, str(file), faults, moves_inputs=moves_inputs, goals=most)
        drawn = cases.case(seed or 0, case)
        requirements = read_requirements(require or [], loaded)
        execution = Tester(loaded).execute(complete(drawn, requirements, read_time_limit(time_limit), loaded))
    counts = [_write(output, loaded, execution, writer) for output in outputs]
    _show(execution, outputs, counts, json=json)
    return 0


def _outputs(perfetto: Path | None, mcap: Path | None) -> list[_TraceOutput]:
    """Return the outputs that the options name. Raise `InputError` if there is none, or a package is missing."""
    outputs = []
    if perfetto is not None:
        from scbm.reports.run.perfetto import write_perfetto  # noqa: PLC0415 - only what is asked for is loaded

        readers = "ui.perfetto.dev"
        outputs.append(_TraceOutput("--perfetto", perfetto, write_perfetto, "events", readers))
    if mcap is not None:
        outputs.append(_TraceOutput("--mcap", mcap, _mcap_writer(), "messages", "Foxglove"))
    if not outputs:
        raise option_error("scbm trace", "no output file is given", "add `--perfetto FILE`, `--mcap FILE`, or both")
    return outputs


def _mcap_writer() -> Callable[[BehaviorModel, Execution, BinaryIO], int]:
    """Return the function that writes MCAP. Raise `InputError` if the package `mcap` is not installed."""
    try:
        from scbm.reports.run.mcap_trace import write_mcap  # noqa: PLC0415 - it needs a package that not everyone has
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "mcap":
            raise
        raise option_error("--mcap", "mcap is not installed: pip install 'scbm[trace]'") from None
    return write_mcap


def _refuse(options: dict[str, object], message: str, remedy: str | None) -> None:
    """Raise `InputError` for options that have no effect here."""
    for option, value in options.items():
        if value is not None:
            raise option_error(option, message, remedy)


def _write(output: _TraceOutput, model: BehaviorModel, execution: Execution, writer: FileWriter) -> int:
    """Write a file and return the number of entries in it. Raise `InputError` if it cannot be written."""
    stream = BytesIO()
    count = output.write(model, execution, stream)
    writer.write(output.option, output.path, stream.getvalue())
    return count


def _show(execution: Execution, outputs: list[_TraceOutput], counts: list[int], *, json: bool) -> None:
    if json:
        write_json(_json(execution, outputs, counts))
        return
    verdict = execution.verdict
    failed = "" if verdict.passed else ", failed"
    real = "" if execution.log is None else ", over nodes"
    ended = f"{verdict.end.replace('_', ' ')} after {format_moment(execution.ended_ns)}{real}{failed}"
    out = results()
    out.line(f"{execution.case.name}: {ended}")
    for output, count in zip(outputs, counts, strict=True):
        out.line(f"  {output.path}  {count} {output.noun}, for {output.readers}")


def _json(execution: Execution, outputs: list[_TraceOutput], counts: list[int]) -> dict[str, Any]:
    return {
        "format_version": FORMAT_VERSION,
        "model": execution.trace.model,
        "case": execution.case.name,
        "verdict": execution.verdict.end.value,
        "passed": execution.verdict.passed,
        "is_real_run": execution.log is not None,
        "simulated_seconds": execution.ended_ns / 1e9,
        "written": [
            {"format": output.option.removeprefix("--"), "file": str(output.path), output.noun: count}
            for output, count in zip(outputs, counts, strict=True)
        ],
    }
