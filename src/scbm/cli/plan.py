"""`scbm plan`: the canonical plan to a goal, or why there is none."""

from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.arguments import read_goal, read_state
from scbm.cli.output import Output, counted, results, write_json
from scbm.model import And, BehaviorModel, Predicate, State, format_value
from scbm.model.actions import apply
from scbm.notation import load_model
from scbm.planning import Answer, LimitReached, PlanLimits, Planner, Solved, find_flaw

FORMAT_VERSION = 1


def command(
    model: Annotated[Path, typer.Argument(help="The model file.", show_default=False)],
    *,
    goal: Annotated[str, typer.Option("--goal", help="A goal's name, or a predicate.", show_default=False)],
    state: Annotated[
        list[str] | None, typer.Option("--state", metavar="VAR=VALUE", help="Differs from the nominal state.")
    ] = None,
    max_length: Annotated[int, typer.Option("--max-length", min=0, help="The longest plan to look for.")] = 1_000,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Find the canonical plan: the shortest, and of the shortest the first in the order of the file."""
    loaded = load_model(model)
    name, predicate = read_goal(goal, loaded)
    start = read_state(state or [], loaded)
    planner = Planner(loaded)
    answer = planner.plan(start, predicate, PlanLimits(length=max_length))
    if isinstance(answer, Solved):
        flaw = find_flaw(loaded, start, predicate, answer.plan)
        if flaw is not None:
            raise AssertionError(f"the planner made a plan that does not work: {flaw}")
    if json:
        write_json(
            {
                "format_version": FORMAT_VERSION,
                "model": loaded.name,
                "goal": str(predicate),
                "status": answer.status,
                "plan": list(answer.plan) if isinstance(answer, Solved) else None,
                "expanded": answer.expanded,
                "limit": answer.limit.value if isinstance(answer, LimitReached) else None,
            }
        )
    else:
        _draw(answer, name, predicate, start, planner, results())
    return 0 if isinstance(answer, Solved) else 1


def _draw(answer: Answer, name: str, goal: Predicate, start: State, planner: Planner, out: Output) -> None:
    shown = name if name == str(goal) else f"{name}: {goal}"
    expanded = f"{counted(answer.expanded, 'state')} expanded"
    if isinstance(answer, Solved) and not answer.plan:
        out.line(f"Nothing to do: the goal holds already: {shown}")
    elif isinstance(answer, Solved):
        out.line(f"{counted(len(answer.plan), 'operation')} to {shown}   ({expanded})")
        _draw_steps(answer.plan, goal, start, planner, out)
    elif isinstance(answer, LimitReached):
        out.line(f"No answer: the search for {shown} met its limit on {answer.limit.value}   ({expanded})")
    else:
        looked = f"all {answer.expanded} reachable states" if answer.expanded > 1 else "the only reachable state"
        out.line(f"No plan: nothing reaches {shown}   ({looked} looked at)")
        for line in _reasons(goal, start, planner):
            out.line(f"  {line}")


def _draw_steps(plan: tuple[str, ...], goal: Predicate, start: State, planner: Planner, out: Output) -> None:
    """The operations by number, each with what it does to the variables that planning can tell apart."""
    model, told = planner.model, planner.task(goal).packing.space
    width = max((len(name) for name in plan), default=0)
    now = State(model.running_space, {v.name: start.get(v.name, v.initial) for v in model.running_space})
    for number, name in enumerate(plan, start=1):
        after = _after(model, name, now)
        changes = [f"{key} <- {format_value(after[key])}" for key in after if after[key] != now[key] and key in told]
        out.line(f"  {number:>3}  {name:<{width}}   {', '.join(changes)}".rstrip())
        now = after


def _after(model: BehaviorModel, name: str, state: State) -> State:
    operation = model.operation(name)
    between = apply(operation.pre.a, state)
    after = None if between is None else apply(operation.post.a, between)
    if after is None:
        raise AssertionError(f"{name} leaves a domain, though its plan was validated")
    return after


def _reasons(goal: Predicate, start: State, planner: Planner) -> list[str]:
    """For each part of the goal, whether it can be reached alone."""
    parts = goal.operands if isinstance(goal, And) else (goal,)
    if len(parts) == 1:
        return [f"{goal} holds in none of them"]
    lines = []
    for part in parts:
        alone = planner.plan(start, part)
        reached = f"can be reached alone, with {counted(len(alone.plan), 'operation')}" if isinstance(
            alone, Solved
        ) else "cannot even be reached alone"  # fmt: skip
        lines.append(f"{part}: {reached}")
    return lines
