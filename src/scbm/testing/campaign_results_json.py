"""The JSON of campaigns; `docs/reference/formats.md` describes it field by field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgspec import to_builtins
from msgspec.structs import asdict

from scbm.cases.coverage import (
    STATE_ASPECTS,
    Aspect,
    Assertion,
    Coverage,
    LiftedStatuses,
    Statuses,
)
from scbm.testing.real_drivers import GoalFate

if TYPE_CHECKING:
    from scbm.cases.coverage import AssertionEvidence, Figure
    from scbm.model import Waiver
    from scbm.running.simulation.device_hazards import Hazard
    from scbm.testing.campaign import Campaign, CaseResult
    from scbm.testing.campaign_result import CampaignResult, Finding
    from scbm.testing.decided_requirements import CheckedRequirement
    from scbm.testing.real_drivers import Answers
    from scbm.testing.shrinking.shrinker import Shrunk
    from scbm.testing.tester import Execution


FORMAT_VERSION = 5
"""The version of the format of `campaign_json`."""


def requirement_json(checked: CheckedRequirement) -> dict[str, Any]:
    """Return what is known of a requirement."""
    decision = checked.decision
    return {
        "name": checked.name,
        "built_in": checked.is_built_in,
        "asked": checked.is_asked,
        "cases": checked.cases,
        "unjudged": {why.value: count for why, count in checked.unjudged.items()},
        "off": checked.off or None,
        "decision": None if decision is None else to_builtins(decision) | {"words": decision.words},
    }


def campaign_json(result: CampaignResult) -> dict[str, Any]:
    """Return the result of a campaign as data that `json` can write; equal campaigns of one seed give equal bytes."""
    campaign, is_over_nodes = result.campaign, bool(result.answers or result.excluded)
    return {
        "format_version": FORMAT_VERSION,
        "model": campaign.model.name,
        "seed": result.suite.seed,
        "passed": not campaign.failed_count,
        "coverage": coverage_json(campaign.coverage),
        "statuses": statuses_json(result.statuses),
        **lifted_json(result.lifted),
        "simulated_seconds": campaign.simulated_ns / 1e9,
        "findings": [_finding(*pair) for pair in zip(result.findings, result.commands, strict=True)],
        **({"real_resources": [_answers(of_one) for of_one in result.answers]} if result.answers else {}),
        "forecast": None if campaign.forecast is None else asdict(campaign.forecast),
        "case_count": campaign.count,
        "excused": {excuse.value: count for excuse, count in campaign.summary.excuses},
        "short_of_goal": campaign.summary.short_count,
        "requirements": [requirement_json(each) for each in result.requirements],
        "requirements_off": dict(campaign.model.requirements_off),
        "requirements_on": list(campaign.model.requirements_on),
        "hazards": campaign.summary.hazard_count,
        "cases": [_case(each, campaign) for each in campaign.results],
        **({"excluded_values": to_builtins(result.excluded)} if is_over_nodes else {}),
        "random_cases": {"count": campaign.drawn, "reached": result.random_reached},
        **({} if result.evidence is None else {"asserted": asserted_json(result.evidence)}),
        **({} if result.dry is None else {"dry": {"cases": result.dry, "reached": result.is_dry}}),
        **({"ended_early": result.ended_early} if result.ended_early else {}),
    }


def _answers(answers: Answers) -> dict[str, Any]:
    counts = asdict(answers) | {"given_up": answers.given_up, "silent": answers.is_silent}
    goals = counts.pop("goals")
    return counts | ({"goals": {fate.value: goals.get(fate, 0) for fate in GoalFate}} if goals else {})


def _finding(finding: Finding, command: str) -> dict[str, Any]:
    small = finding.shrunk
    return {
        "kind": finding.failure.kind.value,
        "subject": finding.failure.subject,
        "failures": [str(failure) for failure in finding.failures],
        "count": finding.count,
        "cases": list(finding.names),
        "again": command,
        "smallest": None if small is None else _small(small),
    }


def _small(small: Shrunk) -> dict[str, Any]:
    return {
        "case": small.execution.case.name,
        "failure": str(small.failure),
        "goal": small.execution.case.goal_names,
        "size": asdict(small.after),
        "size_before": asdict(small.before),
        "runs": small.runs,
        "repeats": repetition_json(small.execution),
        "matters": [{"choice": choice.text, "otherwise": choice.otherwise} for choice in small.matters],
    }


def repetition_json(execution: Execution) -> dict[str, Any] | None:
    """Return the turn that repeats until the end of a run as data for `json`; `None` if none does."""
    found = execution.repetition
    if found is None:
        return None
    begins_ns = execution.trace.records[found.begin].at_ns
    return {
        "begins_seconds": begins_ns / 1e9,
        "until_seconds": found.until_ns / 1e9,
        "turns": found.turns,
        "first_record": found.begin,
        "records": found.length,
    }


def coverage_json(coverage: Coverage) -> dict[str, Any]:
    """Return the figures of a coverage, the missed obligations, and the case that visited each one first."""
    figure = coverage.figure
    visited = {str(obligation): coverage.first_visitor(obligation) for obligation in coverage.obligations}
    return {
        "visited": figure.visited,
        "obligations": figure.of,
        "percent": figure.percent,
        "by_state": {aspect.value: _figure(coverage.figure_of(aspect)) for aspect in STATE_ASPECTS},
        "automatic": _figure(coverage.figure_of(Aspect.TAKEN)),
        "queued": _figure(coverage.figure_of(Aspect.QUEUED)),
        "missed": [str(obligation) for obligation in coverage.missed()],
        "missed_queued": [str(obligation) for obligation in coverage.missed(Aspect.QUEUED)],
        "first_visited_by": {name: case for name, case in visited.items() if case is not None},
    }


def waiver_json(waiver: Waiver) -> dict[str, Any]:
    """Return a waiver as data for `json`."""
    return {
        "obligation": waiver.obligation,
        "reason": waiver.reason,
        "author": waiver.author,
        "date": waiver.date,
        "expires": waiver.expires,
    }


def lifted_json(lifted: LiftedStatuses | None) -> dict[str, Any]:
    """Return the key `lifted` with the statuses of lifted obligations; nothing for `None`."""
    if lifted is None:
        return {}
    figure, coverable = lifted.figure, lifted.coverable
    return {
        "lifted": {
            **_figure(figure),
            "percent": figure.percent,
            "coverable": _figure(coverable) | {"percent": coverable.percent},
            "counts": {status.value: count for status, count in lifted.counts.items()},
            "obligations": [
                {
                    "name": str(entry.obligation),
                    "status": entry.decision.value,
                    "instances": len(entry.decisions),
                    "missed": entry.missed,
                    "visited_elsewhere": bool(entry.elsewhere),
                }
                for entry in lifted.entries
                if entry.is_lifted
            ],
            "alone": _figure(lifted.alone.figure) | {"percent": lifted.alone.figure.percent},
            "united_with": [
                {"objects": {name: list(objects) for name, objects in each.objects.types}, "cases": each.cases}
                for each in lifted.others
            ],
        }
    }


def statuses_json(statuses: Statuses) -> dict[str, Any]:
    """Return the statuses of obligations.

    `obligations` has those that are neither covered nor undecided, and those that only forced states visit.
    """
    special = [entry for entry in statuses.entries if not entry.is_plain]
    figure = statuses.coverable
    return {
        "coverable": _figure(figure) | {"percent": figure.percent},
        "forced": statuses.forced,
        "counts": {status.value: count for status, count in statuses.counts.items()},
        "engines": statuses.engines,
        "obligations": [
            {
                "name": str(entry.obligation),
                "status": entry.decision.value,
                "reason": entry.reason,
                "is_forced": entry.is_forced,
                "certificate": entry.certificate,
                "engine": entry.engine,
            }
            for entry in special
        ],
        "visited_waivers": [waiver_json(waiver) for waiver in statuses.visited_waivers],
        "expired_waivers": [waiver_json(waiver) for waiver in statuses.expired_waivers],
        "ignored_certificates": list(statuses.ignored),
        "assumptions": list(statuses.assumptions),
        "outside_proofs": list(statuses.outside),
        "contradicted": [
            {"obligation": name, "certificate": proof.certificate, "reason": proof.reason}
            for name, proof in statuses.contradicted
        ],
    }


def _figure(figure: Figure) -> dict[str, int]:
    return {"visited": figure.visited, "of": figure.of}


def _case(result: CaseResult, campaign: Campaign) -> dict[str, Any]:
    case = result.case
    return {
        "name": case.name,
        "verdict": result.verdict.end.value,
        "passed": result.verdict.passed,
        "excused": [excuse.value for excuse in result.verdict.excuses],
        "failures": [str(failure) for failure in result.verdict.failures],
        "unused": list(result.unused),
        "hazards": list(map(hazard_json, result.hazards)),
        "goal": case.goal_names,
        "initial": {variable.name: case.initial[variable.name] for variable in campaign.model.variables},
        "simulated_seconds": result.ended_ns / 1e9,
        "requests": result.requests,
        "visited": list(campaign.coverage.obligations.names(result.visited)),
    }


def hazard_json(hazard: Hazard) -> dict[str, Any]:
    """Return a hazard at a device as data for `json`."""
    return {
        "kind": hazard.kind.value,
        "resource": hazard.resource,
        "request": hazard.request,
        "other": hazard.other,
        "begin_seconds": hazard.begin_ns / 1e9,
        "end_seconds": None if hazard.end_ns is None else hazard.end_ns / 1e9,
        "text": str(hazard),
    }


def asserted_json(evidence: AssertionEvidence) -> dict[str, Any]:
    """Return what a store says about asserted obligations as data for `json`."""
    found, figure = evidence.found, evidence.figure
    entries = () if found is None else found.entries
    return {
        "percent": figure.percent,
        "asserted": figure.visited,
        "of": figure.of,
        "counts": {answer.value: 0 if found is None else len(found.with_answer(answer)) for answer in Assertion},
        "why_none": evidence.why_none or None,
        "obligations": [
            {
                "name": str(entry.obligation),
                "answer": entry.answer.value,
                "mutants": entry.mutants,
                "noticed": entry.noticed,
                "unnoticed": entry.unnoticed,
                "equivalent": entry.equivalent,
                "undecided": entry.undecided,
            }
            for entry in entries
        ],
    }
