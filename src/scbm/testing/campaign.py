"""Campaigns: many cases, run one by one, judged, and added up (paper, Section VI, steps 4 and 5); and their JSON.

`docs/reference/formats.md` describes the JSON field by field.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from scbm.cases.coverage import (
    STATE_ASPECTS,
    Aspect,
    Coverage,
    LiftedStatuses,
    Obligations,
    Statuses,
    Unnamed,
    bits_of,
)
from scbm.cases.trace import End
from scbm.testing.batches.batch_summary import BatchSummary, CaseOutcome, SummaryBuilder
from scbm.testing.batches.campaign_work import ListedCases
from scbm.testing.batches.forecast import Forecast, forecast

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.cases import Case
    from scbm.cases.coverage import Figure
    from scbm.model import BehaviorModel, Waiver
    from scbm.testing.batches.campaign_work import CaseSource
    from scbm.testing.findings import Finding
    from scbm.testing.real_drivers import Answers
    from scbm.testing.shrinking.shrinker import Shrunk
    from scbm.testing.tester import Execution
    from scbm.testing.verdicts import Verdict


@dataclass(frozen=True, slots=True)
class CaseResult:
    """The result of a case in a campaign: without trace and draws, which running the case again gives.

    Attributes:
        case: the case as it was given.
        requests: how many requests its run sent.
        verdict: how it ended.
        ended_ns: how long it took, in simulated time.
        visited: the obligations that it visited, as bits.
        unused: what the case says and nothing came of.
        forced: of the visited obligations those that it visited only after its state was forced, as bits.
        excluded: over nodes the number of values that drivers sent and the model excludes.
    """

    case: Case
    requests: int
    verdict: Verdict
    ended_ns: int
    visited: int
    unused: tuple[str, ...] = ()
    forced: int = 0
    excluded: int = 0

    def outcome(self, position: int) -> CaseOutcome:
        """Return the result without its case, which has this position in its campaign."""
        visits = (self.visited, self.unused, self.forced, self.excluded)
        return CaseOutcome(position, self.verdict, self.ended_ns, self.requests, *visits)


@dataclass(frozen=True)
class Campaign:
    """The results of many cases of one model.

    Attributes:
        model: what was tested.
        source: the cases by their positions.
        summary: what the cases did; it lists all of them, or of many random ones only the notable ones.
    """

    model: BehaviorModel
    source: CaseSource
    summary: BatchSummary

    @staticmethod
    def of(model: BehaviorModel, results: Iterable[CaseResult]) -> Campaign:
        """Return a campaign with the sum of results, which it lists all."""
        kept = tuple(results)
        builder = SummaryBuilder(len(Obligations.of(model).all), written=len(kept))
        for position, result in enumerate(kept, start=1):
            builder.add(result.outcome(position))
        return Campaign(model, ListedCases(tuple(result.case for result in kept)), builder.summary())

    @property
    def count(self) -> int:
        """The number of cases."""
        return self.summary.count

    @property
    def failed_count(self) -> int:
        """The number of cases that failed."""
        return self.summary.failed

    @property
    def simulated_ns(self) -> int:
        """The simulated time of all runs together."""
        return self.summary.ended_ns

    @cached_property
    def results(self) -> tuple[CaseResult, ...]:
        """The results of the listed cases."""
        return tuple(map(self.result, self.summary.outcomes))

    @property
    def failed(self) -> tuple[CaseResult, ...]:
        """The results of the listed cases that failed."""
        return tuple(self.result(o) for o in self.summary.outcomes if not o.verdict.passed)

    def reached_from(self, position: int) -> int:
        """Return how many cases from a position on reached their last goal; all cases before it are listed."""
        total = sum(count for words, count in self.summary.ends if words.startswith(End.REACHED.value))
        return total - sum(o.position < position and o.verdict.end is End.REACHED for o in self.summary.outcomes)

    def result(self, outcome: CaseOutcome) -> CaseResult:
        """Return an outcome with its case."""
        case = self.source.case(outcome.position)
        _, verdict, ended_ns, requests, visited, unused, forced, excluded = outcome
        return CaseResult(case, requests, verdict, ended_ns, visited, unused, forced, excluded)

    @cached_property
    def forced(self) -> int:
        """The obligations that listed cases visit only after their states were forced, as bits."""
        freely = 0
        for outcome in self.summary.outcomes:
            freely |= outcome.visited & ~outcome.forced
        return self.coverage.visited & ~freely

    @property
    def visited_freely(self) -> tuple[tuple[str, int], ...]:
        """The name of each listed case with what it visited before its state was forced, as bits."""
        return tuple((self.source.name(o.position), o.visited & ~o.forced) for o in self.summary.outcomes)

    @property
    def forecast(self) -> Forecast | None:
        """The forecast for ten times as many random cases; `None` where there is no estimate."""
        return forecast(self.summary, Obligations.of(self.model))

    @cached_property
    def coverage(self) -> Coverage:
        """The union of the visits of the cases; the listed cases have names there."""
        obligations = Obligations.of(self.model)
        named = tuple((self.source.name(o.position), o.visited) for o in self.summary.outcomes)
        rest = list(self.summary.visits or (0,) * len(obligations.all))
        for _, visited in named:
            for bit in bits_of(visited):
                rest[bit] -= 1
        unnamed = Unnamed(self.count - len(named), tuple(rest)) if len(named) < self.count else Unnamed()
        return Coverage(obligations, named, unnamed)


FORMAT_VERSION = 4
"""The version of the format of `campaign_json`."""


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
    decided = Statuses.of(campaign.coverage, forced=campaign.forced)
    real = {"real_resources": [_answers(of_one) for of_one in answers]} if answers else {}
    return {
        "format_version": FORMAT_VERSION,
        "model": campaign.model.name,
        "seed": seed,
        "passed": not campaign.failed_count,
        "coverage": coverage_json(campaign.coverage),
        "statuses": statuses_json(decided),
        **lifted_json(LiftedStatuses.of(campaign.model, decided)),
        "simulated_seconds": campaign.simulated_ns / 1e9,
        "findings": [_finding(*pair) for pair in zip(findings, commands, strict=True)],
        **real,
        "forecast": None if campaign.forecast is None else asdict(campaign.forecast),
        "case_count": campaign.count,
        "excused": {excuse.value: count for excuse, count in campaign.summary.excuses},
        "short_of_goal": campaign.summary.short_count,
        "requirements_off": dict(campaign.model.requirements_off),
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
        "obligations": [
            {
                "name": str(entry.obligation),
                "status": entry.decision.value,
                "reason": entry.reason,
                "is_forced": entry.is_forced,
                "certificate": entry.certificate,
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
        "goal": case.goal_names,
        "initial": {variable.name: case.initial[variable.name] for variable in campaign.model.variables},
        "simulated_seconds": result.ended_ns / 1e9,
        "requests": result.requests,
        "visited": list(campaign.coverage.obligations.names(result.visited)),
    }
