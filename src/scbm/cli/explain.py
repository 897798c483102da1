"""`scbm explain`: why an obligation ended as it did, in sentences."""

from pathlib import Path
from shlex import quote
from typing import Annotated, Any

import typer

from scbm.cases.coverage import Obligation, Obligations
from scbm.cli.campaigns.suite import Suite
from scbm.cli.output.progress import activity_display
from scbm.cli.output.terminal import results, write_json
from scbm.closing import CloseLimits, Closer, Closing, Decision
from scbm.closing.closing_json import decided_json, suggestion_json
from scbm.closing.explanations import Explanation, Visit, explain
from scbm.files import load_model, suggestion, write_case
from scbm.model import BehaviorModel, Diagnostic, InputError, Place, Slug
from scbm.reports.figure_table import shown_path
from scbm.reports.terminal.explanation_report import told_case, told_explanations
from scbm.testing import Execution, Tester

FORMAT_VERSION = 1

_DEFAULT = CloseLimits().situations


def command(
    model: Annotated[Path, typer.Argument(help="The model file.", show_default=False)],
    obligation: Annotated[
        str, typer.Argument(help="`scan/failed`, `automatic/give_up`, or a name alone.", show_default=False)
    ],
    *,
    suite: Annotated[
        list[Path] | None, typer.Option("--suite", metavar="CASES", help="Case files to begin with, or a directory.")
    ] = None,
    max_states: Annotated[
        int, typer.Option("--max-states", min=1, help="Maximum number of explored situations of runs.")
    ] = _DEFAULT,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Show which case covers an obligation and how, or why no case does."""
    loaded = load_model(model)
    asked = _read_obligation(obligation, loaded)
    given = Suite.load(loaded, model, tuple(suite or ()))
    with activity_display(given.activity) as told:
        campaign = given.run()
        told(f"exploring {loaded.name}")
        closing = Closer(loaded, CloseLimits(situations=max_states), told).close(campaign, asked)
    explanations = explain(closing, asked, _executions(closing, given))
    if json:
        write_json(_json(explanations, given))
    else:
        options = f" --max-states {max_states}" if max_states != _DEFAULT else ""
        close = f"scbm close {quote(str(model))}{given.close_options}{options}"
        out = results()
        out.lines(told_explanations(explanations, loaded, given.files, close))
        for name, text in _texts(explanations, given).items():
            again = (
                given.again(name) or f"save this here as {name}.yaml, then: scbm replay {shown_path(f'{name}.yaml')}"
            )
            out.lines(told_case(text, again, given.files.get(name)))
    return 1 if any(each.decided.decision is Decision.UNDECIDED for each in explanations) else 0


def _read_obligation(text: str, model: BehaviorModel) -> tuple[Obligation, ...]:
    """The obligations that a text names: one, or all of an operation or transition. Raises `InputError`."""
    known = Obligations.of(model)
    found = tuple(obligation for obligation in known if text in (str(obligation), obligation.subject))
    if found:
        return found
    names = [*map(str, known), *dict.fromkeys(obligation.subject for obligation in known)]
    message = f"the model has no obligation `{text}`"
    remedy = suggestion(text, names, "the obligations are")
    place = Place("OBLIGATION", 1, 1, max(1, len(text)))
    raise InputError([Diagnostic(Slug.UNKNOWN_OBLIGATION, message, place, remedy, text)])


def _executions(closing: Closing, suite: Suite) -> dict[str, Execution]:
    """The runs of all cases that cover something, by name."""
    covering = dict.fromkeys(decided.case for decided in closing.decided if decided.case is not None)
    tester = Tester(closing.model)
    runs = {
        written.case.name: tester.execute(written.case) for written in suite.written if written.case.name in covering
    }
    return runs | {made.case.name: made.execution for made in closing.cases}


def _texts(explanations: tuple[Explanation, ...], suite: Suite) -> dict[str, str]:
    """Return the cases of the explanations as YAML, by their names; those of the suite as their files have them."""
    cases = [each.visit.execution.case for each in explanations if each.visit is not None]
    return {case.name: suite.text(case.name) or write_case(case, suite.model, suite.file.as_posix()) for case in cases}


def _json(explanations: tuple[Explanation, ...], suite: Suite) -> dict[str, Any]:
    cases = _texts(explanations, suite)
    return {
        "format_version": FORMAT_VERSION,
        "model": suite.model.name,
        "obligations": [_explanation(explanation, suite.model) for explanation in explanations],
        "cases": [{"name": name, "file": suite.files.get(name), "text": text} for name, text in cases.items()],
    }


def _explanation(explanation: Explanation, model: BehaviorModel) -> dict[str, Any]:
    told = decided_json(explanation.decided)
    if explanation.visit is not None:
        told["visit"] = _visit(explanation.visit, model)
    if explanation.searched is not None:
        searched = explanation.searched
        told["looked_at"] = {
            "initial_states": searched.initial_states,
            "goals": searched.goals,
            "situations": searched.situations,
        }
    return told | {"suggestions": [suggestion_json(each) for each in explanation.suggestions]}


def _visit(visit: Visit, model: BehaviorModel) -> dict[str, Any]:
    case, execution = visit.execution.case, visit.execution
    nominal = model.nominal_state
    return {
        "goal": case.goal,
        "initial": {name: value for name, value in case.initial.items() if value != nominal[name]},
        "plan": list(visit.plan),
        "wrong": list(visit.wrong),
        "at_ns": visit.at_ns,
        "record": visit.record,
        "verdict": execution.verdict.end.value,
        "simulated_seconds": execution.ended_ns / 1e9,
    }
