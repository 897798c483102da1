"""Repeat one run from a file: a case, or the log of a run over nodes."""

from __future__ import annotations

import os
import re
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.trace import End
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.option_values import read_requirements, read_time_limit
from scbm.cli.options.planner_options import NO_PLANNER_OPTIONS, PlannerOptions
from scbm.files import FileWriter, digest_of, load_model, open_case, open_input
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.planning import DRAWN_PLANS, PLANNERS, model_planned_by
from scbm.testing import Execution, Tester
from scbm.testing.batches.campaign_work import complete

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from scbm.model import BehaviorModel, PlannerIdentity
    from scbm.testing.event_logs.event_log import LogDocument

_LOG = re.compile(rb'\s*\{\s*"format"\s*:')
"""The beginning of logs and traces; no case begins so."""

_LONGEST_BEGINNING = 100


class AskedRun(Struct, frozen=True):
    """One run, as the options of a command line describe it.

    Attributes:
        file: a case or a log.
        model: the model file of the command line; `None` without one.
        require: the sentences of additional requirements.
        time_limit: the time limit for a case without its own.
        outputs: the files to write, by their options.
        planner: the planner of the command line, if any; a log has the plans of its run.
    """

    file: Path
    model: Path | None
    require: Sequence[str]
    time_limit: str | None
    outputs: Mapping[str, Path]
    planner: PlannerOptions = NO_PLANNER_OPTIONS

    def load(self, model_file: Path, noun: str) -> tuple[BehaviorModel, FileWriter]:
        """Return the model, and a writer for the outputs. Raise `InputError`, also if an output cannot be written.

        Args:
            model_file: the model file.
            noun: the kind of `file` in words.
        """
        writer = FileWriter([(self.file, noun)], model_file)
        writer.refuse_outputs(self.outputs)
        return load_model(model_file), writer


class Rerun(Struct, frozen=True):
    """A run that was repeated.

    Attributes:
        model: the model of the run.
        execution: the repeated run.
        recorded: the digest of the recorded trace; `None` if none is recorded.
        saved: the kind of the file that was replayed, for messages.
        remedy: what to check if the traces differ.
        writer: writes the outputs of the command.
    """

    model: BehaviorModel
    execution: Execution
    recorded: str | None
    saved: str
    remedy: str
    writer: FileWriter


def rerun(asked: AskedRun) -> Rerun:
    """Run a case again in simulation, or replay a log. Raise `InputError`."""
    return _of_log(asked) if _is_log(asked.file) else _of_case(asked)


def _is_log(path: Path) -> bool:
    """Return whether a file begins like a log."""
    try:
        with open_input(path) as stream:
            return _LOG.match(stream.read(_LONGEST_BEGINNING)) is not None
    except (OSError, ValueError):
        return False  # reading it as a case reports the error


def _of_case(asked: AskedRun) -> Rerun:
    """Run a case again in simulation."""
    document = open_case(asked.file)
    model, writer = asked.load(asked.model or document.required_model_path(), "the case")
    read = document.read(model)
    if read.plans and asked.planner.words:
        message, remedy = "the case has the plans of its run", "leave it out, or remove `plans:` from the case"
        raise option_error(asked.planner.words[0], message, remedy)
    if asked.planner.name is None and read.recorded is not None and not read.plans:  # else no planner is asked
        model = with_planner_of(read.recorded.planner, model, asked.file)
    model = asked.planner.applied(model)
    requirements = read_requirements(asked.require, model)
    case = complete(read, requirements, read_time_limit(asked.time_limit), model)
    recorded = None if case.recorded is None else case.recorded.trace
    remedy = "the model, the case or scbm was changed since then; without `recorded:` nothing is compared"
    return Rerun(model, Tester(model).execute(case), recorded, "case", remedy, writer)


def with_planner_of(planner: PlannerIdentity, model: BehaviorModel, file: Path) -> BehaviorModel:
    """Return the model with the planner that a case was recorded with. Raise `InputError` if there is none such."""
    if planner.name not in (*PLANNERS, DRAWN_PLANS):
        message = f"the case was recorded with the planner `{planner.name}`, which this scbm does not have"
        remedy = "name another one: `--planner NAME`"
        raise InputError([Diagnostic(Slug.UNKNOWN_PLANNER, message, Place(str(file)), remedy)])
    return model_planned_by(planner, model)


def _of_log(asked: AskedRun) -> Rerun:
    """Replay a real run: feed its recorded events to a new runner."""
    from scbm.running import Program  # noqa: PLC0415 - the same
    from scbm.testing.event_logs import event_log  # noqa: PLC0415 - it takes long to load, and few runs need it

    if asked.time_limit is not None:
        message = "the run of a log had a time limit of its own"
        raise option_error("--time-limit", message, "leave it out")
    if asked.planner.words:
        message = "a log has the plans of its run"
        raise option_error(asked.planner.words[0], message, "leave it out")
    document = event_log.open_event_log(asked.file)
    model, writer = asked.load(asked.model or _model_of(document, asked.file), "the log")
    log = document.read(model, digest_of(model))
    case = complete(log.case, read_requirements(asked.require, model), None, model)
    try:
        run = event_log.rerun(log, Program(model))
    except ValueError as error:
        raise InputError([Diagnostic(Slug.BAD_LOG, str(error), Place(str(asked.file)))]) from None
    tester = Tester(model)
    why = "its log ends where it was lost" if run.impossible is None else run.impossible.never_came
    execution = (
        tester.lost(case, why, run, log) if log.end is End.LOST else tester.judged(case, run, log.reactions, log)
    )
    return Rerun(model, execution, log.trace, "log", "the log or scbm was changed since then", writer)


def _model_of(document: LogDocument, file: Path) -> Path:
    """Return the model file that a log names. Raise `InputError` if it does not exist: a file may have been moved."""
    path = document.model_path()
    if os.path.exists(path):  # noqa: PTH110 - a path too long is none, and no error
        return path
    message = f"the model of the log is not there: `{path}`"
    remedy = "name the model file with `--model FILE`"
    raise InputError([Diagnostic(Slug.FILE_MISSING, message, Place(str(file), 1), remedy)])
