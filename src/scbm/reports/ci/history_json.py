"""A store as JSON, for machines. `docs/reference/report-formats.md` describes it field by field."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scbm.cases.coverage import bits_of, only_by, visitors_of_each
from scbm.reports.run_changes import change_groups
from scbm.reports.stored_cases import again
from scbm.store import Written
from scbm.testing.campaign_results_json import (
    asserted_json,
    coverage_json,
    hazard_json,
    lifted_json,
    requirement_json,
    statuses_json,
)

if TYPE_CHECKING:
    from scbm.cases.coverage.set_cover import Cover
    from scbm.store import History, Recipe, RunComparison, StoredCase, StoredRun

FORMAT_VERSION = 4


def history_json(history: History) -> dict[str, Any]:
    """Return the contents of a store as data for `json`, in time linear in its size."""
    names = tuple(map(str, history.obligations))
    exclusive = only_by(history.coverage)
    return {
        "format_version": FORMAT_VERSION,
        "model": history.model.name,
        "model_file": history.source.path,
        "model_text": history.source.text,
        "passed": not history.failed,
        "coverage": coverage_json(history.coverage),
        "statuses": statuses_json(history.statuses),
        "asserted": asserted_json(history.evidence),
        **lifted_json(history.lifted),
        "simulated_seconds": history.ended_ns / 1e9,
        "over_nodes_seconds": history.over_nodes_ns / 1e9,
        "outdated": history.outdated,
        "short_of_goal": history.short_count,
        "requirements": [requirement_json(each) for each in history.requirements],
        "requirements_off": dict(history.model.requirements_off),
        "requirements_on": list(history.model.requirements_on),
        "hazards": len(history.hazards),
        **({} if history.since is None else {"since": _since(history.since, history)}),
        "runs": [_run(run, names) for run in history.runs],
        "cases": [
            _case(label, case, history)
            | {"visited": _names(case.visited, names), "only_it_visits": _names(only, names)}
            for label, case, only in zip(history.labels, history.cases, exclusive, strict=True)
        ],
        "visited_by": {
            name: [history.labels[place] for place in places]
            for name, places in zip(names, visitors_of_each(history.coverage), strict=True)
        },
    }


def smallest_json(history: History, cover: Cover) -> dict[str, Any]:
    """Return the smallest suite with the same visits.

    Args:
        history: the history that has its cases.
        cover: the suite, as indices into `history.cases`.
    """
    return {
        "cases": [history.labels[place] for place in cover.chosen],
        "at_least": cover.at_least,
        "is_smallest": cover.is_smallest,
        "requests": sum(history.cases[place].requests for place in cover.chosen),
        "simulated_seconds": sum(history.cases[place].ended_ns for place in cover.chosen) / 1e9,
    }


def _names(visited: int, names: tuple[str, ...]) -> list[str]:
    return [names[position] for position in bits_of(visited)]


def _run(run: StoredRun, names: tuple[str, ...]) -> dict[str, Any]:
    return {
        "id": run.id,
        "started": run.started,
        "command": run.command,
        "model_file": run.source.path,
        "cases": run.cases,
        "failed": run.failed,
        "visited": _names(run.visited, names),
        "nodes": run.nodes,
    }


def _since(since: RunComparison, history: History) -> dict[str, Any]:
    """Return the comparison with an earlier run; nothing but a null if there is none."""
    if since.then is None:
        return {"then": None}
    return {
        "then": since.then.id,
        "now": since.now.id,
        "percent_then": history.obligations.figure(since.then.visited).percent,
        "percent_now": history.obligations.figure(since.now.visited).percent,
        "changes": [
            {"change": row.change, "subject": str(row.subject), "then": list(row.then), "now": list(row.now)}
            for _, rows in change_groups(since)
            for row in rows
        ],
    }


def _case(label: str, case: StoredCase, history: History) -> dict[str, Any]:
    return {
        "label": label,
        "name": case.name,
        "key": case.key.hex(),
        "recipe": _recipe(case.recipe),
        "again": again(case, history.source.path, history.runs) or None,
        "nodes": _nodes(case, history),
        "goal": case.goal,
        "run": history.runs[case.run].id,
        "position": case.position,
        "is_earlier": case.is_earlier,
        "verdict": case.verdict.end.value,
        "passed": case.verdict.passed,
        "excused": [excuse.value for excuse in case.verdict.excuses],
        "failures": [
            {"kind": failure.kind.value, "subject": failure.subject, "message": failure.message}
            for failure in case.verdict.failures
        ],
        "hazards": list(map(hazard_json, case.hazards)),
        "simulated_seconds": case.ended_ns / 1e9,
        "requests": case.requests,
    }


def _nodes(case: StoredCase, history: History) -> dict[str, Any] | None:
    """Return the nodes that ran a case; `None` for simulation."""
    real = case.recipe.real
    if real is None:
        return None
    return {"where": history.where(case), "real": list(real), "excluded_values": case.excluded}


def _recipe(recipe: Recipe) -> dict[str, Any]:
    if isinstance(recipe, Written):
        how: dict[str, Any] = {"kind": "written", "path": recipe.path, "text": recipe.text}
    else:
        how = {"kind": "drawn", "seed": recipe.seed, "number": recipe.number, "network": recipe.network}
        how |= {"goals": recipe.goals}
    limit_ns = recipe.time_limit_ns
    return how | {
        "requirements": dict(recipe.requirements),
        "time_limit_seconds": None if limit_ns is None else limit_ns / 1e9,
    }
