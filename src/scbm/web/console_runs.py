"""Runs the texts of a console: the work of its worker process, which has the model loaded.

A text always gives the same run, so the server keeps nothing of a session: each request has the whole text.
"""

from __future__ import annotations

import signal
import threading
import time
from contextlib import contextmanager
from copy import deepcopy
from functools import lru_cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from msgspec import Struct
from msgspec.structs import asdict, replace

from scbm.cases.coverage import Obligations, visited_by
from scbm.cases.trace import End
from scbm.cli.campaigns.rerun import with_planner_of
from scbm.cli.output.shown_run import run_json
from scbm.files import edited_case, load_model, parse_case
from scbm.files.record_editing import with_record
from scbm.model import InputError, format_value
from scbm.model.requirements import BUILT_IN_NAMES
from scbm.model.variables import Role
from scbm.planning import PlanCache, Planner, PlanRefusedError, SearchCancelledError
from scbm.reports.html.timelines import KnownRecords, pack_timelines
from scbm.running.simulation import Simulated, UnfinishedRunError
from scbm.testing import Tester
from scbm.web.case_edits import CASE_EDITS, EditedMoment, EditError, edit_data
from scbm.web.run_moments import moment_json

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.files import CaseDocument
    from scbm.model import BehaviorModel, Diagnostic, Predicate, Value
    from scbm.planning import Answer, PlanLimits
    from scbm.testing import Execution
    from scbm.web.case_edits import CaseEdit

MAX_RECORDS = 20_000
"""Maximum number of records of a run: more than anybody reads, and few enough that the page stays quick."""

MAX_SECONDS = 5
"""Maximum time of a run in seconds: longer than that, a click is no click any more."""

_PATIENCE_S = 1
"""How long a planner has beyond the limit of a run to ask whether it may go on, in seconds."""

_PICTURES = "scbm.drawing.marked_picture"
"""The module that draws, named as text: packages beside the core do not import each other."""

LIMIT = f"ended by the limit of the console: {MAX_RECORDS} records or {MAX_SECONDS} s"


class ConsoleRequest(Struct, frozen=True):
    """What the page asks for; which fields count depends on the request.

    Attributes:
        text: the text of the case.
        record: the index of the selected record.
        edit: the name of an edit.
        target: what is clicked; or an operation, a variable to draw, the path of the model.
        values: the values of the fields of an edit.
        name: the name of the case to save; the value to mark in a picture.
        records: whether the result of the run is saved, too.
        known: the digest of the file that the page has saved under the name.
        obligation: the obligation to show.
        page: the page that asks; a newer text or search of the same page ends an older one.
    """

    text: str = ""
    record: int = 0
    edit: str = ""
    target: str = ""
    values: dict[str, str] = {}
    name: str = ""
    records: bool = False
    known: str = ""
    obligation: str = ""
    page: str = ""


class ConsoleRun(NamedTuple):
    """The run of a text, and why it was ended early, if it was."""

    document: CaseDocument
    tester: Tester
    execution: Execution
    limit: str = ""


class LimitedPlans(PlanCache):
    """Answers of a planner, until the time of a run is up."""

    def __init__(self, planner: Planner) -> None:
        super().__init__(planner)
        self.ends_s = 0.0

    def plan(self, state: Mapping[str, Value], goal: Predicate, limits: PlanLimits, *_: object) -> Answer:  # type: ignore[override]
        """Return the answer of the planner. Raise `PlanRefusedError` once the time is up."""
        try:
            if self._has_time():
                with _interrupted(self.ends_s + _PATIENCE_S - time.monotonic()):
                    return super().plan(state, goal, limits, self._has_time)
        except SearchCancelledError:
            pass
        raise PlanRefusedError

    def _has_time(self) -> bool:
        return time.monotonic() < self.ends_s


@contextmanager
def _interrupted(seconds: float) -> Iterator[None]:
    """Raise `SearchCancelledError` after some time, within what reads no clock, such as the planner of another program.

    On Windows, and in threads, nothing is interrupted.
    """
    if not hasattr(signal, "setitimer") or threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGALRM, _cancel)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def _cancel(*_: object) -> None:
    raise SearchCancelledError


class _LimitedTester(NamedTuple):
    """A tester, and its plans."""

    tester: Tester
    plans: LimitedPlans

    @staticmethod
    def of(model: BehaviorModel) -> _LimitedTester:
        """Return the tester of a model."""
        plans = LimitedPlans(Planner.of(model))
        return _LimitedTester(Tester(model, plans=plans), plans)


class ConsoleRuns:
    """All that one model answers."""

    def __init__(self, file: Path) -> None:
        """Load the model. Raise `InputError` with its errors."""
        self.model = load_model(file)
        self._own = _LimitedTester.of(self.model)
        self._known: KnownRecords = {}
        self._recent: dict[str, ConsoleRun] = {}
        self._picture = lru_cache(200)(self._drawn)

    def answer(self, name: str, request: ConsoleRequest) -> dict[str, Any]:
        """Return the answer to a request, as data for JSON. Errors of the text are part of it."""
        try:
            return self._answer(name, request)
        except EditError as error:
            return {"refused": str(error)}
        except InputError as error:
            return {"text": request.text, "errors": errors_json(error.diagnostics)}

    def _answer(self, name: str, request: ConsoleRequest) -> dict[str, Any]:
        match name:
            case "facts":
                return facts_json(self.model)
            case "picture":
                return {"svg": self._picture(request.target, request.name)}
            case "save":
                return self._saved(request)
            case "edit":
                run = self._run(self._edited(request))
            case _:
                run = self._run_of(request.text)
        match name:
            case "trace":
                return run_json(self.model, run.execution)
            case "moment":
                chosen, execution = request.target, run.execution
                record = min(max(request.record, 0), len(execution.trace.records) - 1)
                return moment_json(self.model, run.tester.program, execution, record, chosen)
            case _:
                return {"text": run.document.source.text, "run": self._shown(run)}

    # runs

    def _run_of(self, text: str) -> ConsoleRun:
        """Return the run of a text: that of the last two texts without running them again."""
        run = self._recent.pop(text, None) or self._run(parse_case(text))
        self._recent[text] = run
        return run

    def _run(self, document: CaseDocument) -> ConsoleRun:
        case, (tester, plans) = document.read(self.model), self._own
        if case.recorded is not None and not case.plans and case.recorded.planner != tester.planner.identity:
            model = with_planner_of(case.recorded.planner, self.model, Path(document.source.file))
            tester, plans = _LimitedTester.of(model)
        plans.ends_s, limit = time.monotonic() + MAX_SECONDS, ""
        try:
            execution = tester.execute(case, most_records=MAX_RECORDS)
        except UnfinishedRunError as error:
            self._own = _LimitedTester.of(self.model)  # a planner that was interrupted plans no more
            limit, ended_ns = LIMIT, error.records[-1].at_ns if error.records else 0
            unfinished = tester.lost(case, LIMIT, Simulated(End.LOST, ended_ns, error.records))
            visited = visited_by(error.records, tester.obligations)
            execution = replace(unfinished, reactions=error.reactions, visited=visited)
        run = ConsoleRun(document, tester, execution, limit)
        self._recent = {**dict(list(self._recent.items())[-1:]), document.source.text: run}
        return run

    def _shown(self, run: ConsoleRun) -> dict[str, Any]:
        execution = run.execution
        off = [name for name, _ in self.model.requirements_off]
        own = [each.name for each in (*self.model.requirements, *execution.case.requirements)]
        return {
            "end": execution.verdict.end_in_words,
            "passed": execution.verdict.passed,
            "limit": run.limit,
            "visited": run.tester.obligations.names(execution.visited),
            "requirements": [*own, *(name for name in BUILT_IN_NAMES if name not in off)],
            "timeline": pack_timelines(self.model, [execution], self._known),
        }

    # texts

    def _edited(self, request: ConsoleRequest) -> CaseDocument:
        """Return the case after a click."""
        run = self._run_of(request.text)
        data = deepcopy(run.document.tree.plain)
        assert isinstance(data, dict)  # noqa: S101 - it is a case
        moment = EditedMoment(self.model, run.execution, request.record, request.target, request.values)
        edit_data(request.edit, data, moment)
        return edited_case(run.document, data)

    def _saved(self, request: ConsoleRequest) -> dict[str, Any]:
        """Return the text to save: with its name, the path of the model, and the result if that is wanted."""
        document = self._run_of(request.text).document
        assert isinstance(document.tree.plain, dict)  # noqa: S101 - it is a case
        data = {**document.tree.plain, "case": request.name, "model": request.target}
        if request.records:
            data.pop("recorded", None)
        saved = self._run(edited_case(document, data))
        text, execution = saved.document.source.text, saved.execution
        if not request.records or not execution.verdict.passed:
            return {"text": text, "recorded": False}
        recorded = replace(execution.recorded, trace=None)  # as `scbm test --record` does
        return {"text": with_record(text, f"{request.name}.yaml", recorded, self.model), "recorded": True}

    def _drawn(self, variable: str, value: str) -> str:
        """Return the automaton of a variable with its value marked, as SVG; empty if it has none."""
        svg: str = import_module(_PICTURES).marked_automaton(self.model, variable, value)
        return svg


def errors_json(diagnostics: Sequence[Diagnostic]) -> list[dict[str, Any]]:
    """Return errors of a text as data for JSON."""
    keys = ("file", "line", "column")
    places = [{key: getattr(each.place, key) for key in keys} for each in diagnostics]
    return [p | {"message": e.message, "remedy": e.remedy or ""} for p, e in zip(places, diagnostics, strict=True)]


def facts_json(model: BehaviorModel) -> dict[str, Any]:
    """Return what the page has to know of a model: names, values, and what can be clicked."""
    variables = [
        {"name": each.name, "values": [*map(format_value, each.assignable)], "is_initial": each.role is Role.DECLARED}
        for each in model.running_space
        if each.assignable
    ]
    return {
        "model": model.name,
        "edits": [{"name": name, **_edit_json(edit)} for name, edit in CASE_EDITS.items()],
        "variables": variables,
        "resources": [each.name for each in model.resources],
        "goals": [name for name, _ in model.goals],
        "operations": [each.name for each in model.operations],
        "obligations": [str(each) for each in Obligations.of(model)],
    }


def _edit_json(edit: CaseEdit) -> dict[str, Any]:
    return {"label": edit.label, "target": edit.target.value, "fields": [asdict(field) for field in edit.fields]}
