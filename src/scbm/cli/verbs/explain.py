"""`scbm explain`: explains in sentences how an obligation is covered, or why it is not."""

import re
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any

import typer
from msgspec.structs import replace
from rich.text import Text

from scbm.cases.coverage import Obligation, Obligations, instances_of, lifted_names
from scbm.cli.exit_codes import INTERRUPTED
from scbm.cli.options.closing_options import ClosingLimits, limit_text
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.planner_options import RunPlanner
from scbm.cli.options.status_options import WaiversFile, read_waivers_of
from scbm.cli.options.verb_options import Json, Model, SuiteFiles
from scbm.cli.output.terminal import activity_display, report_columns, results, write_json
from scbm.closing import Closer, Closing, Decision
from scbm.closing.closing_json import decided_json, decided_requirement_json, suggestion_json
from scbm.closing.decisions import DecidedRequirement, RequirementDecisions, RequirementStatus
from scbm.closing.explanations import Explanation, Visit, explain
from scbm.closing.interruption import Interruption
from scbm.closing.proved_statuses import with_waivers
from scbm.files import load_model, nearest, suggestion, write_case
from scbm.model import BehaviorModel, Slug
from scbm.model.requirements import BUILT_IN_NAMES
from scbm.model.visible_text import shown_path
from scbm.reports.terminal.explanation_report import (
    ExplainedRequirement,
    case_lines,
    explanation_lines,
    requirement_explanation,
    violation_picture,
)
from scbm.testing import Execution, Tester
from scbm.testing.suite import Suite

if TYPE_CHECKING:
    from scbm.closing.requirements.requirement_closer import RequirementCloser

FORMAT_VERSION = 2


def command(
    model: Model,
    obligation: Annotated[
        str,
        typer.Argument(help="`scan/failed`, `automatic/give_up`, a name alone, or a requirement.", show_default=False),
    ],
    *,
    suite: SuiteFiles = None,
    waivers: WaiversFile = None,
    limits: ClosingLimits,
    planner: RunPlanner,
    json: Json = False,
) -> int:
    """Show how a case visits an obligation, such as `scan/failed`, or why no case does."""
    loaded = planner.applied(load_model(model))
    requirements = _requirements(obligation, loaded)
    asked = () if requirements else _read_obligation(obligation, loaded)
    review = read_waivers_of(loaded, waivers)
    given = Suite(loaded, model, tuple(suite or ()), planner_option=planner.text).loaded()
    interruption = Interruption()
    with interruption.handled():
        with activity_display(given.activity) as show:
            with interruption.stage():
                interruption.check()
                campaign = given.run(show)
            show(f"exploring {loaded.name}")
            with given.locating():
                wanted = None if requirements else asked  # cases for obligations may violate requirements
                closing = Closer(loaded, limits, show, interruption=interruption).close(campaign, wanted)
            closer = None
            if requirements:
                from scbm.closing.requirements.requirement_closer import RequirementCloser  # noqa: PLC0415 - few do

                closer = RequirementCloser(loaded, limits, show, interruption)
                closing = replace(closing, requirements=closer.decide(campaign, closing))
        if closer is not None:
            return _explain_requirements(requirements, closer, closing, given, json=json)
        explanations = explain(with_waivers(closing, review), asked, _executions(closing, given))
        if json:
            write_json(_json(explanations, given))
        else:
            close = f"scbm close {shown_path(str(model))}{given.close_options}{limit_text(limits)}"
            out = results()
            out.lines(explanation_lines(explanations, loaded, given.files, close, closing.ended, report_columns()))
            for name, text in _texts(explanations, given).items():
                replay = f"scbm replay {shown_path(f'{name}.yaml')}{planner.text}"
                path = given.files.get(name)
                known = given.again(name)
                first = None if known else f"Save this here as {name}.yaml, then run:"
                out.lines(case_lines(text, known or replay, path, first))
    if closing.is_interrupted:
        return INTERRUPTED
    return 1 if any(each.decided.decision is Decision.UNDECIDED for each in explanations) else 0


def _requirements(text: str, model: BehaviorModel) -> tuple[ExplainedRequirement, ...]:
    """Return the requirements of a name: of the model, all of an entry with parameters, or built-in ones.

    A requirement of the model and a built-in one may be called alike. There are none for obligations.
    """
    if any(text in (str(obligation), obligation.subject) for obligation in Obligations.of(model)):
        return ()
    name = ".".join(re.split(r"\s*[\[,]\s*", text.removesuffix("]"))) if text.endswith("]") else text
    names = ((each, model.lifted_name("requirements", each.name)) for each in model.requirements)
    own = [each for each, lifted in names if name in (each.name, lifted)]
    found = [ExplainedRequirement(each.name, each) for each in own]
    found += [ExplainedRequirement(text, None)] if text in (*BUILT_IN_NAMES, *model.requirements_on) else []
    return tuple(found)


def _explain_requirements(
    asked: Sequence[ExplainedRequirement], closer: "RequirementCloser", closing: Closing, suite: Suite, *, json: bool
) -> int:
    """Print what closing says of requirements, and return the exit code."""
    found = closing.requirements
    assert found is not None  # noqa: S101 - it was asked for
    decided = [next(each for each in found.decided if one.is_about(each)) for one in asked]
    described = [_described(*each, closer, found, suite) for each in zip(asked, decided, strict=True)]
    if json:
        about = described[0] if len(described) == 1 else {"requirements": described}
        write_json({"format_version": FORMAT_VERSION, "model": suite.model.name} | about)
    else:
        out = results()
        for number, (one, answer, data) in enumerate(zip(asked, decided, described, strict=True)):
            out.lines([Text()] if number else [])
            lines = requirement_explanation(one, answer, data["nearest"], data["assumptions"], report_columns())
            out.lines(lines)
            shown = answer.execution or answer.other_execution
            if shown is not None:
                out.lines(violation_picture(answer, shown, suite.model))
                file = f"{shown.case.name}.yaml"
                first = f"Save this here as {file}, then run:"
                out.lines(case_lines(data["text"], f"scbm replay {shown_path(file)}", None, first))
    if found.is_interrupted:
        return INTERRUPTED
    open_ = (RequirementStatus.UNDECIDED, RequirementStatus.VIOLATED)
    return 1 if any(each.status in open_ for each in decided) else 0


def _described(
    asked: ExplainedRequirement,
    decided: DecidedRequirement,
    closer: "RequirementCloser",
    found: RequirementDecisions,
    suite: Suite,
) -> dict[str, Any]:
    """Return the answer about one requirement as JSON."""
    execution = decided.execution or decided.other_execution
    return {
        "requirement": decided_requirement_json(decided),
        "nearest": "" if asked.requirement is None else closer.nearest_miss(asked.requirement),
        "assumptions": [each for each in found.assumptions if decided.holds and asked.assumes(each)],
        "text": None if execution is None else write_case(execution.case, suite.model, suite.file.as_posix()),
    }


def _read_obligation(text: str, model: BehaviorModel) -> tuple[Obligation, ...]:
    """Return the obligations of a name: one, or all of an operation or transition, with all of its instances.

    Raises:
        InputError: there are none.
    """
    known = Obligations.of(model)
    found = tuple(obligation for obligation in known if text in (str(obligation), obligation.subject))
    found = found or tuple(instances_of(text, model, known))
    if found:
        return found
    names = [*lifted_names(model, known), *map(str, known), *dict.fromkeys(obligation.subject for obligation in known)]
    names += [*(requirement.name for requirement in model.requirements), *BUILT_IN_NAMES]
    message = f"the model has no obligation or requirement `{text}`"
    raise option_error("OBLIGATION", message, _remedy(text, names), text, Slug.UNKNOWN_OBLIGATION)


def _remedy(text: str, names: Sequence[str]) -> str | None:
    """Return the most similar name, else the names of the same operation, else all names."""
    aspects: dict[str, list[str]] = {}
    for name in names:
        subject, _, aspect = name.rpartition("/")
        aspects.setdefault(subject, []).append(aspect)
    subject, slash, aspect = text.rpartition("/")
    similar = subject if subject in aspects else nearest(subject, aspects)
    if slash and similar is not None:
        near = nearest(aspect, aspects[similar])
        if near is not None:
            return f"did you mean `{similar}/{near}`?"
        names = [f"{similar}/{each}" for each in aspects[similar]]
        return f"the obligations of {similar} are: {', '.join(names)}"
    return suggestion(text, names, "the obligations are")


def _executions(closing: Closing, suite: Suite) -> dict[str, Execution]:
    """Return the runs of all cases that cover an obligation, by the name of the case."""
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
    entry = decided_json(explanation.decided)
    if explanation.visit is not None:
        entry["visit"] = _visit(explanation.visit, model)
    if explanation.searched is not None:
        searched = explanation.searched
        entry["looked_at"] = {
            "initial_states": searched.initial_states,
            "goals": searched.goals,
            "situations": searched.situations,
        }
    return entry | {"suggestions": [suggestion_json(each) for each in explanation.suggestions]}


def _visit(visit: Visit, model: BehaviorModel) -> dict[str, Any]:
    case, execution = visit.execution.case, visit.execution
    nominal = model.nominal_state
    return {
        "goal": case.goal_names,
        "initial": {name: value for name, value in case.initial.items() if value != nominal[name]},
        "plan": list(visit.plan),
        "wrong": list(visit.wrong),
        "outside": list(visit.outside),
        "at_ns": visit.at_ns,
        "record": visit.record,
        "verdict": execution.verdict.end.value,
        "simulated_seconds": execution.ended_ns / 1e9,
    }
