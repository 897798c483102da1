"""The results of mutants as JSON. `docs/reference/formats.md` describes it field by field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scbm.cases.coverage import MutantStatus

if TYPE_CHECKING:
    from scbm.mutation.mutant_results import MutantCounts, MutantResult
    from scbm.mutation.report.mutation_summary import MutationSummary

FORMAT_VERSION = 1


def mutation_json(summary: MutationSummary) -> dict[str, Any]:
    """Return the results as data for `json`; equal results give equal bytes."""
    return {
        "format_version": FORMAT_VERSION,
        "model": summary.model.name,
        "file": summary.file,
        "cases": summary.cases,
        "failing": list(summary.failing),
        "runs": summary.runs,
        "skipped": summary.skipped,
        **({"ended_early": summary.ended_early} if summary.ended_early else {}),
        **_counts(summary.counts),
        "assumptions": list(summary.assumptions),
        "operators": {name: _counts(counts) for name, counts in summary.by_operator().items()},
        "entries": {name: _counts(counts) for name, counts in summary.by_entry().items()},
        "mutants": [_mutant(result, summary) for result in summary.results],
    }


def _counts(counts: MutantCounts) -> dict[str, Any]:
    by_status = {status.value: counts.of_status(status) for status in MutantStatus}
    return {"score": counts.score.percent, "all": counts.total, **by_status}


def _mutant(result: MutantResult, summary: MutationSummary) -> dict[str, Any]:
    mutant = result.mutant
    place, _ = summary.places.find(mutant.path)
    data: dict[str, Any] = {
        "name": mutant.name,
        "operator": mutant.operator,
        "kind": mutant.kind.value,
        "subject": mutant.subject,
        "parts": [part.value for part in mutant.parts],
        "line": place.line,
        "column": place.column,
        "before": mutant.before,
        "after": mutant.after,
        "change": mutant.change,
        "status": result.status.value,
        "runs": result.runs,
        "skipped": result.skipped,
    }
    if result.status is MutantStatus.KILLED:
        data["case"] = result.case
    if result.reason:
        data["reason"] = result.reason
    if result.status is MutantStatus.SURVIVED:
        witness = None if result.witness is None else result.witness.name
        data |= {"witness": witness, "benign": result.is_benign, "killable": result.is_killable}
    return data
