"""Output of one run: as a timeline, as JSON, and its trace as a file."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgspec.structs import asdict

from scbm.cases.trace import records_json, write_trace
from scbm.cli.output.terminal import report_columns, results, write_json
from scbm.reports import timeline
from scbm.testing.campaign_results_json import hazard_json

if TYPE_CHECKING:
    from pathlib import Path

    from scbm.files import FileWriter
    from scbm.model import BehaviorModel
    from scbm.testing import Execution, Violation

FORMAT_VERSION = 3


def show_run(
    model: BehaviorModel,
    execution: Execution,
    *,
    trace: Path | None,
    writer: FileWriter,
    json: bool,
    every: bool,
    more: dict[str, Any] | None = None,
) -> None:
    """Print a run, and write its trace if that is required.

    Args:
        model: the model of the run.
        execution: the run.
        trace: the file for the trace; `None` writes no trace.
        writer: writes the trace.
        json: whether to print JSON instead of the timeline.
        every: whether the timeline includes the variables of resources and runner.
        more: further fields of the JSON.
    """
    if trace is not None:
        writer.write("--trace", trace, write_trace(execution.trace).encode())
    if json:
        write_json(run_json(model, execution) | (more or {}))
    else:
        results().lines(timeline(model, execution, every=every, columns=report_columns()))


def run_json(model: BehaviorModel, execution: Execution) -> dict[str, Any]:
    """Return a run as the data of `scbm run --json`."""
    return {
        "format_version": FORMAT_VERSION,
        "model": execution.trace.model,
        "case": execution.case.name,
        "goal": execution.case.goal_names,
        "predicate": execution.case.predicates,
        "initial": {variable.name: execution.case.initial[variable.name] for variable in model.variables},
        "verdict": execution.verdict.end.value,
        "passed": execution.verdict.passed,
        "excused": [excuse.value for excuse in execution.verdict.excuses],
        "failures": [str(failure) for failure in execution.verdict.failures],
        "unused": list(execution.unused),
        "notes": list(execution.notes),
        "hazards": list(map(hazard_json, execution.hazards)),
        "violations": [_violation(violation) for violation in execution.violations],
        "simulated_seconds": execution.ended_ns / 1e9,
        "trace": records_json(execution.trace),
        **({} if execution.log is None else {"excluded_values": list(map(asdict, execution.excluded))}),
    }


def _violation(violation: Violation) -> dict[str, Any]:
    return {
        "requirement": violation.requirement,
        "built_in": violation.is_built_in,
        "at_ns": violation.at_ns,
        "record": violation.record,
        "begins": violation.begins,
        "reason": violation.reason,
        "operation": violation.operation,
        "values": dict(violation.values),
    }
