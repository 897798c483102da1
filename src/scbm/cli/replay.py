"""`scbm replay`: one run again, exactly, from its case or from the log of its events."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.arguments import complete, read_requirements, read_time_limit
from scbm.cli.files import refuse_clashes
from scbm.cli.output import errors
from scbm.cli.showing import show_run
from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.model import BehaviorModel
from scbm.notation import digest_of, load_model, open_case
from scbm.testing import Execution, Tester

_LOG = re.compile(rb'\s*\{\s*"format"\s*:')
"""How a log begins, and a trace, but no case."""

_LONGEST_BEGINNING = 100


@dataclass(frozen=True)
class _Asked:
    """What the command line says.

    Attributes:
        file: a case or a log.
        model: the model file, if it is said.
        require: sentences of requirements.
        time_limit: for a case that says none.
        trace: where the trace goes to, if anywhere.
    """

    file: Path
    model: Path | None
    require: list[str]
    time_limit: str | None
    trace: Path | None

    def load(self, model_file: Path) -> BehaviorModel:
        """The model. Raises `InputError`, also if the trace would replace a file that is read."""
        outputs = {} if self.trace is None else {"--trace": self.trace}
        refuse_clashes(outputs, [(self.file, "the run to show"), (model_file, "the model")])
        return load_model(model_file)


@dataclass(frozen=True)
class _Replayed:
    """A run that took place again.

    Attributes:
        recorded: the digest of the trace that it should have; `None` if nothing is recorded.
        saved: what the record was taken of.
        remedy: what to think of if the trace is another one.
    """

    model: BehaviorModel
    execution: Execution
    recorded: str | None
    saved: str
    remedy: str


def command(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="The case file, or the log of a real run.", show_default=False)
    ],
    *,
    model: Annotated[
        Path | None, typer.Option("--model", help="The model file; the one that the file names, if missing.")
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
    """Run a case file or the log of a real run again, draw what happens, and say whether it is the recorded run."""
    asked = _Asked(file, model, require or [], time_limit, trace)
    replayed = _of_log(asked) if _is_log(file) else _of_case(asked)
    execution = replayed.execution
    is_same = None if replayed.recorded is None else replayed.recorded == execution.digest
    show_run(replayed.model, execution, trace=trace, json=json, every=every, more={"is_recorded_run": is_same})
    if is_same is False:
        message = f"this is not the run that the {replayed.saved} was saved from"
        errors().diagnostics([Diagnostic(Slug.REPLAY_DIFFERS, message, Place(str(file)), replayed.remedy)])
    return 0 if execution.verdict.passed and is_same is not False else 1


def _is_log(path: Path) -> bool:
    """Whether a file begins like a log. What cannot be read twice, such as a pipe, is a case."""
    try:
        if not path.is_file():
            return False
        with path.open("rb") as stream:
            return _LOG.match(stream.read(_LONGEST_BEGINNING)) is not None
    except (OSError, ValueError):
        return False  # whoever reads it as a case says why it cannot


def _of_case(asked: _Asked) -> _Replayed:
    """A case, run again in simulation."""
    document = open_case(asked.file)
    model = asked.load(asked.model or document.required_model_path())
    requirements = read_requirements(asked.require, model)
    case = complete(document.read(model), requirements, read_time_limit(asked.time_limit), model)
    recorded = None if case.recorded is None else case.recorded.trace
    remedy = "the model, the case or scbm was changed since then; without `recorded:` nothing is compared"
    return _Replayed(model, Tester(model).execute(case), recorded, "case", remedy)


def _of_log(asked: _Asked) -> _Replayed:
    """A real run, by giving its events to a runner again."""
    from scbm.realtime.event_log import open_event_log, rerun  # noqa: PLC0415 - it takes long to load; few replays need it
    from scbm.running import Program  # noqa: PLC0415 - the same

    if asked.time_limit is not None:
        message = "a log is of one run, which had its time limit"
        raise InputError([Diagnostic(Slug.BAD_OPTION, message, Place("--time-limit"), "leave it out")])
    document = open_event_log(asked.file)
    model = asked.load(asked.model or document.model_path())
    log = document.read(model, digest_of(model))
    case = complete(log.case, read_requirements(asked.require, model), None, model)
    try:
        run = rerun(log, Program(model))
    except ValueError as error:
        raise InputError([Diagnostic(Slug.BAD_LOG, str(error), Place(str(asked.file)))]) from None
    execution = Tester(model).judged(case, run, log.reactions, log)
    return _Replayed(model, execution, log.trace, "log", "the log or scbm was changed since then")
