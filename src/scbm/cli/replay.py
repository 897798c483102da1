"""`scbm replay`: one case again, exactly."""

from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.arguments import complete, read_requirements, read_time_limit
from scbm.cli.output import errors
from scbm.cli.showing import show_run
from scbm.errors import Diagnostic, Place, Slug
from scbm.notation import load_model, open_case
from scbm.testing import Execution, Tester


def command(
    case: Annotated[Path, typer.Argument(help="The case file.", show_default=False)],
    *,
    model: Annotated[
        Path | None, typer.Option("--model", help="The model file; the one that the case names, if missing.")
    ] = None,
    require: Annotated[
        list[str] | None, typer.Option("--require", metavar="SENTENCE", help="A requirement beside the others.")
    ] = None,
    time_limit: Annotated[
        str | None, typer.Option("--time-limit", metavar="DURATION", help="Simulated time, if the case says none.")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Show changes of every variable.")] = False,
    trace: Annotated[Path | None, typer.Option("--trace", help="Write the trace to a file.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Run a case file again, draw what happens, and say whether it is the run that was recorded."""
    document = open_case(case)
    loaded = load_model(model or document.required_model_path())
    requirements = read_requirements(require or [], loaded)
    asked = complete(document.read(loaded), requirements, read_time_limit(time_limit), loaded)
    execution = Tester(loaded).execute(asked)
    is_same = _is_recorded_run(execution)
    show_run(loaded, execution, trace=trace, json=json, every=every, more={"is_recorded_run": is_same})
    if is_same is False:
        message = "this is not the run that the case was saved from"
        remedy = "the model, the case or scbm was changed since then; without `recorded:` nothing is compared"
        errors().diagnostics([Diagnostic(Slug.REPLAY_DIFFERS, message, Place(str(case)), remedy)])
    return 0 if execution.verdict.passed and is_same is not False else 1


def _is_recorded_run(execution: Execution) -> bool | None:
    """Whether the trace is the recorded one, byte for byte; `None` if none is recorded."""
    recorded = execution.case.recorded
    return None if recorded is None else recorded.trace == execution.digest
