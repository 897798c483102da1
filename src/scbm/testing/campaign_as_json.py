"""A campaign as JSON, for machines. `docs/reference/formats.md` describes it field by field."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from scbm.cases.coverage import STATE_ASPECTS, Aspect

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.cases.coverage import Coverage, Figure
    from scbm.testing.campaign import Campaign, CaseResult
    from scbm.testing.findings import Finding
    from scbm.testing.node_runs import Answers
    from scbm.testing.shrinking import Shrunk

FORMAT_VERSION = 1


def campaign_json(
    campaign: Campaign,
    seed: int,
    findings: Sequence[Finding],
    commands: Sequence[str],
    answers: Sequence[Answers] = (),
) -> dict[str, Any]:
    """Return the campaign as data that `json` can write; equal campaigns of one seed give equal bytes.

    Args:
        campaign: what was run.
        seed: what random cases were drawn from.
        findings: what failed.
        commands: for each finding the command that shows it again.
        answers: how real resources answered, if there are any.
    """
    real = {"real_resources": [_answers(of_one) for of_one in answers]} if answers else {}
    return {
        "format_version": FORMAT_VERSION,
        "model": campaign.model.name,
        "seed": seed,
        "passed": not campaign.failed,
        "coverage": coverage_json(campaign.coverage),
        "simulated_seconds": campaign.simulated_ns / 1e9,
        "findings": [_finding(*pair) for pair in zip(findings, commands, strict=True)],
        **real,
        "cases": [_case(result, campaign) for result in campaign.results],
    }


def _answers(answers: Answers) -> dict[str, Any]:
    return asdict(answers) | {"given_up": answers.given_up, "silent": answers.is_silent}


def _finding(finding: Finding, command: str) -> dict[str, Any]:
    small = finding.shrunk
    return {
        "kind": finding.failure.kind.value,
        "subject": finding.failure.subject,
        "failures": [str(failure) for failure in finding.failures],
        "cases": [result.case.name for result in finding.results],
        "again": command,
        "smallest": None if small is None else _small(small),
    }


def _small(small: Shrunk) -> dict[str, Any]:
    return {
        "case": small.execution.case.name,
        "failure": str(small.failure),
        "goal": small.execution.case.goal,
        "size": asdict(small.after),
        "size_before": asdict(small.before),
        "runs": small.runs,
        "matters": [{"choice": choice.text, "otherwise": choice.otherwise} for choice in small.matters],
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


def _figure(figure: Figure) -> dict[str, int]:
    return {"visited": figure.visited, "of": figure.of}


def _case(result: CaseResult, campaign: Campaign) -> dict[str, Any]:
    case = result.case
    return {
        "name": case.name,
        "verdict": result.verdict.end.value,
        "passed": result.verdict.passed,
        "failures": [str(failure) for failure in result.verdict.failures],
        "unused": list(result.unused),
        "goal": case.goal,
        "initial": {variable.name: case.initial[variable.name] for variable in campaign.model.variables},
        "simulated_seconds": result.ended_ns / 1e9,
        "requests": result.requests,
        "visited": list(campaign.coverage.obligations.names(result.visited)),
    }
