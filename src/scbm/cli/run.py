"""`scbm run`: one run against simulated resources, as a timeline."""

from pathlib import Path
from typing import Annotated, Any

import typer

from scbm.cli.arguments import allowed_state, read_goal, read_limits, read_state
from scbm.cli.output import results, write_json
from scbm.cli.timeline import draw_timeline
from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.model import BehaviorModel
from scbm.notation import load_model
from scbm.testing import Case, Execution, Origin, RandomCases, Tester, Violation
from scbm.trace import records_json, write_trace

FORMAT_VERSION = 1


def command(
    model: Annotated[Path, typer.Argument(help="The model file.", show_default=False)],
    *,
    goal: Annotated[str | None, typer.Option("--goal", help="A goal's name, or a predicate.")] = None,
    state: Annotated[
        list[str] | None, typer.Option("--state", metavar="VAR=VALUE", help="Differs from the nominal state.")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", help="Decides what resources do.")] = 0,
    case: Annotated[
        int | None, typer.Option("--case", min=1, help="Goal and initial state of this case of `scbm test --seed`.")
    ] = None,
    time_limit: Annotated[
        str | None, typer.Option("--time-limit", metavar="DURATION", help="Simulated time for the goal. [1 h]")
    ] = None,
    every: Annotated[bool, typer.Option("--all", help="Show changes of every variable.")] = False,
    trace: Annotated[Path | None, typer.Option("--trace", help="Write the trace to a file.")] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Run one goal against simulated resources, and draw what happens."""
    loaded = load_model(model)
    execution = Tester(loaded, read_limits(time_limit)).execute(_case(loaded, str(model), goal, state, seed, case))
    if trace is not None:
        _save(trace, execution)
    if json:
        write_json(_json(loaded, execution))
    else:
        draw_timeline(loaded, execution, results(), every=every)
    return 0 if execution.verdict.passed else 1


def _case(
    model: BehaviorModel, file: str, goal: str | None, state: list[str] | None, seed: int, number: int | None
) -> Case:
    """The case that the options name: drawn as `scbm test` draws it, or made of a goal and a state."""
    if number is not None:
        if goal is not None or state:
            raise _bad("`--case` draws goal and initial state, so `--goal` and `--state` do not go with it", "--case")
        return RandomCases(model, file).case(seed, number)
    if goal is None:
        names = ", ".join(name for name, _ in model.goals) or "none in this model"
        raise _bad("a run needs a goal", "--goal", f"goals: {names}; or write a predicate; or draw a case: `--case 1`")
    name, predicate = read_goal(goal, model)
    initial = allowed_state(read_state(state or [], model), model)
    return Case(f"seed-{seed}", name, predicate, initial, origin=Origin(seed, 1))


def _bad(message: str, option: str, remedy: str | None = None) -> InputError:
    return InputError([Diagnostic(Slug.BAD_OPTION, message, Place(option), remedy)])


def _save(path: Path, execution: Execution) -> None:
    try:
        path.write_text(write_trace(execution.trace), encoding="utf-8")
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise _bad(f"cannot write {path}: {reason}", "--trace") from None


def _json(model: BehaviorModel, execution: Execution) -> dict[str, Any]:
    return {
        "format_version": FORMAT_VERSION,
        "model": execution.trace.model,
        "case": execution.case.name,
        "goal": execution.case.goal,
        "predicate": str(execution.case.predicate),
        "initial": {variable.name: execution.case.initial[variable.name] for variable in model.variables},
        "verdict": execution.verdict.end.value,
        "passed": execution.verdict.passed,
        "failures": list(execution.verdict.failures),
        "violations": [_violation(violation) for violation in execution.violations],
        "simulated_seconds": execution.ended_ns / 1e9,
        "trace": records_json(execution.trace),
    }


def _violation(violation: Violation) -> dict[str, Any]:
    return {
        "requirement": violation.requirement,
        "at_ns": violation.at_ns,
        "record": violation.record,
        "reason": violation.reason,
        "operation": violation.operation,
        "values": dict(violation.values),
    }
