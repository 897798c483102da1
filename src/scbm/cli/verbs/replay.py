"""`scbm replay`: repeats one run exactly, from its case or from the log of its events."""

from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.campaigns.rerun import AskedRun, rerun
from scbm.cli.options.command_inputs import Reads
from scbm.cli.options.planner_options import RunPlanner
from scbm.cli.options.verb_options import AllChanges, Json, ModelOfFile, Require, RerunTimeLimit, TraceFile
from scbm.cli.output.shown_run import show_run
from scbm.cli.output.terminal import errors
from scbm.model import Diagnostic, Place, Slug


def command(
    file: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="The case file, or the log of a real run.", show_default=False),
        Reads("the case or log"),
    ],
    *,
    model: ModelOfFile = None,
    require: Require = None,
    time_limit: RerunTimeLimit = None,
    planner: RunPlanner,
    every: AllChanges = False,
    trace: TraceFile = None,
    json: Json = False,
) -> int:
    """Run a case file or the log of a real run again, and compare the run with the recorded one."""
    outputs = {} if trace is None else {"--trace": trace}
    replayed = rerun(AskedRun(file, model, require or [], time_limit, outputs, planner))
    execution = replayed.execution
    is_same = None if replayed.recorded is None else replayed.recorded == execution.digest
    show_run(
        replayed.model,
        execution,
        trace=trace,
        writer=replayed.writer,
        json=json,
        every=every,
        more={"is_recorded_run": is_same},
    )
    if is_same is False:
        message = f"this is not the run that the {replayed.saved} was saved from"
        errors().diagnostics([Diagnostic(Slug.REPLAY_DIFFERS, message, Place(str(file)), replayed.remedy)])
    return 0 if execution.verdict.passed and is_same is not False else 1
