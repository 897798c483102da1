"""The result of closing as JSON. `docs/reference/formats.md` describes it field by field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgspec import to_builtins

from scbm.closing.decisions import forcing_record
from scbm.planning import planner_of
from scbm.testing.campaign_results_json import waiver_json

if TYPE_CHECKING:
    from scbm.cases.coverage import Figure
    from scbm.closing.closing_files import ClosingFiles
    from scbm.closing.closing_result import ClosingResult
    from scbm.closing.decisions import Closing, ClosingCase, Decided, DecidedRequirement, Suggestion
    from scbm.proofcheck import Certificate

FORMAT_VERSION = 4


def closing_json(result: ClosingResult) -> dict[str, Any]:
    """Return the result of closing as data for `json`; equal results give equal bytes."""
    closing, output = result.closing, result.output
    planner = planner_of(closing.model)
    requirements = {} if closing.requirements is None else {"requirements": _requirements(closing, output)}
    counted = [decided for decided in closing.decided if decided.obligation.counts]
    queued = [decided for decided in closing.decided if not decided.obligation.counts]
    return {
        "format_version": FORMAT_VERSION,
        "model": closing.model.name,
        "planner": {"name": planner.name, "version": planner.version},
        "before": _figure(closing.before.figure),
        "after": _figure(closing.after.figure),
        "coverable": _figure(closing.coverable),
        "forced": closing.forced,
        "engines": closing.engines,
        "decisions": {decision.value: count for decision, count in closing.counts.items()},
        "obligations": [decided_json(decided, output) for decided in counted],
        "queued": [decided_json(decided, output) for decided in queued],
        "cases": [_case(case, output) for case in closing.cases],
        "certificates": [_certificate(name, certificate, output) for name, certificate in closing.certificates],
        "assumptions": list(closing.assumptions),
        "suggestions": [suggestion_json(suggestion) for suggestion in closing.suggestions],
        "waivers": {
            "visited": [waiver_json(waiver) for waiver in closing.visited_waivers],
            "expired": [waiver_json(waiver) for waiver in closing.expired_waivers],
        },
        "ended": [{"stage": end.stage.value, "why": end.why, "option": end.option} for end in closing.ended],
        **requirements,
        "out": None if output is None else str(output.directory),
        "failed": [to_builtins(each) for each in result.failed],
        "found": [to_builtins(each) for each in result.found],
        "written": [{"name": name, "goal": goal} for name, goal in result.written.items()],
        "already": [{"name": name, "goal": goal} for name, goal in result.already.items()],
    }


def decided_json(decided: Decided, output: ClosingFiles | None = None) -> dict[str, Any]:
    """Return one decision; it has the key `case` if a case visits it, `certificate` and `engine` if it is proved."""
    data: dict[str, Any] = {"name": str(decided.obligation), "decision": decided.decision.value}
    data["is_forced"] = decided.is_forced
    if decided.case is not None:
        data["case"] = decided.case
    if decided.certificate is not None:
        data["certificate"] = decided.certificate if output is None else str(output.certificates[decided.certificate])
    if decided.engine is not None:
        data["engine"] = decided.engine
    return data | {"reason": decided.reason}


def suggestion_json(suggestion: Suggestion) -> dict[str, Any]:
    """Return one suggestion; `obligation` is the first obligation that it is about."""
    names = [str(obligation) for obligation in suggestion.obligations]
    return {
        "obligation": names[0],
        "obligations": names,
        "obligations_by_force": [str(obligation) for obligation in suggestion.by_force],
        "kind": suggestion.kind.value,
        "text": suggestion.text,
        "goal": None if suggestion.goal is None else str(suggestion.goal),
        "name": suggestion.name,
        "blamed": list(suggestion.blamed),
    }


def _requirements(closing: Closing, output: ClosingFiles | None) -> dict[str, Any]:
    """Return the decisions about requirements, with the cases that violate some."""
    found = closing.requirements
    decided = () if found is None else found.decided
    return {
        "decided": [decided_requirement_json(each, output) for each in decided],
        "cases_only": 0 if found is None else found.left_to_cases,
        "situations": 0 if found is None else found.situations,
        "assumptions": [] if found is None else list(found.assumptions),
        "cases": [_case(made, output) for made in closing.counterexamples],
        "other_plans": [_case(made, output) for made in closing.cases_with_other_plans],
    }


def decided_requirement_json(decided: DecidedRequirement, output: ClosingFiles | None = None) -> dict[str, Any]:
    """Return the decision about a requirement; it has the key `case` if a case violates it."""
    certificate, others = decided.certificate, decided.other_plans
    if output is not None and certificate is not None:
        certificate = str(output.certificates[certificate])
    return {
        "name": decided.name,
        "sentence": decided.asked or None,
        "built_in": decided.is_built_in,
        "status": decided.status.value,
        "reason": decided.reason,
        "option": decided.option,
        "certificate": certificate,
        "undeclared": list(decided.undeclared),
        "other_plans": None if others is None else {"case": others.case or None, "reason": others.reason},
    } | ({} if decided.case is None else {"case": decided.case})


def _certificate(name: str, certificate: Certificate, output: ClosingFiles | None) -> dict[str, Any]:
    return {
        "name": name,
        "obligations": [] if certificate.is_about_requirements else list(certificate.claims),
        "requirements": list(certificate.claims) if certificate.is_about_requirements else [],
        "file": None if output is None else str(output.certificates[name]),
    }


def _figure(figure: Figure) -> dict[str, Any]:
    return {"visited": figure.visited, "of": figure.of, "percent": figure.percent}


def _case(made: ClosingCase, output: ClosingFiles | None) -> dict[str, Any]:
    verdict = made.verdict
    record = forcing_record(made.execution)
    return {
        "name": made.case.name,
        "goal": made.case.goal_names,
        "verdict": verdict.end.value,
        "passed": verdict.passed,
        "failures": [str(failure) for failure in verdict.failures],
        "adds": [str(obligation) for obligation in made.adds],
        "adds_by_force": [str(obligation) for obligation in made.adds_by_force],
        "forced_from_seconds": None if record is None else record.at_ns / 1e9,
        "forced_by": None if record is None else record.injection,
        "consequences": list(made.consequences),
        "notes": list(made.execution.notes),
        "simulated_seconds": made.execution.ended_ns / 1e9,
        "file": None if output is None else output.files[made.case.name],
    }
