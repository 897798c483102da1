"""`scbm plan`: the canonical plan to a goal, or why there is none."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import typer

from scbm.cli.options.arguments import read_goal, read_state
from scbm.cli.options.registry_options import NameOf
from scbm.cli.output.terminal import TerminalOutput, results, write_json
from scbm.files import load_model
from scbm.model import And, BehaviorModel, Predicate, State, format_value
from scbm.model.operations import apply
from scbm.planning import DEFAULT_PLANNER, PLANNERS, Answer, Limit, LimitReached, PlanLimits, Planner, Solved, find_flaw
from scbm.reports import counted

FORMAT_VERSION = 1


def command(
    model: Annotated[Path, typer.Argument(help="The model file.", show_default=False)],
    *,
    goal: Annotated[str, typer.Option("--goal", help="A goal's name, or a predicate.", show_default=False)],
    state: Annotated[
        list[str] | None,
        typer.Option("--state", metavar="VAR=VALUE", help="A variable that differs from the nominal state."),
    ] = None,
    max_length: Annotated[
        int, typer.Option("--max-length", min=0, help="Maximum number of operations in the plan.")
    ] = 1_000,
    max_expanded: Annotated[
        int, typer.Option("--max-expanded", min=1, help="Maximum number of expanded states.")
    ] = 1_000_000,
    planner: Annotated[
        str | None, NameOf(lambda: PLANNERS, typer.Option("--planner", help=f"The search. [{DEFAULT_PLANNER}]"))
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Print JSON.")] = False,
) -> int:
    """Find the canonical plan: the shortest, and of the shortest the first in the order of the file."""
    loaded = load_model(model)
    name, predicate = read_goal(goal, loaded)
    start = read_state(state or [], loaded)
    plans = Planner(loaded, planner or DEFAULT_PLANNER)
    limits = PlanLimits(max_length, max_expanded)
    answer = plans.plan(start, predicate, limits)
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
        _Drawing(plans, start, name, predicate, limits, results()).draw(answer)
    return 0 if isinstance(answer, Solved) else 1


@dataclass(frozen=True)
class _Drawing:
    """A planning problem, and where its answer is drawn."""

    planner: Planner
    start: State
    name: str
    goal: Predicate
    limits: PlanLimits
    out: TerminalOutput

    def draw(self, answer: Answer) -> None:
        """The plan, step by step; or why there is none."""
        shown = self.name if self.name == str(self.goal) else f"{self.name}: {self.goal}"
        expanded = f"{counted(answer.expanded, 'state')} expanded"
        if isinstance(answer, Solved) and not answer.plan:
            self.out.line(f"Nothing to do: the goal holds already: {shown}")
        elif isinstance(answer, Solved):
            self.out.line(f"{counted(len(answer.plan), 'operation')} to {shown}   ({expanded})")
            self._draw_steps(answer.plan)
        elif isinstance(answer, LimitReached):
            self.out.line(f"No answer: the search for {shown} met its limit on {answer.limit.value}   ({expanded})")
            self.out.line(f"  {_RAISE[answer.limit]} sets another limit")
        else:
            looked = f"all {answer.expanded} reachable states" if answer.expanded > 1 else "the only reachable state"
            self.out.line(f"No plan: nothing reaches {shown}   ({looked} looked at)")
            for line in self._reasons():
                self.out.line(f"  {line}")

    def _draw_steps(self, plan: tuple[str, ...]) -> None:
        """Show the operations by number, each with its changes of the variables that guards read."""
        model, told = self.planner.model, self.planner.task(self.goal).packing.space
        width = max(len(name) for name in plan)
        now = State(model.running_space, {v.name: self.start.get(v.name, v.initial) for v in model.running_space})
        for number, name in enumerate(plan, start=1):
            after = _after(model, name, now)
            changes = [f"{key} <- {format_value(after[key])}" for key in told.names if after[key] != now[key]]
            self.out.line(f"  {number:>3}  {name:<{width}}   {', '.join(changes)}".rstrip())
            now = after

    def _reasons(self) -> list[str]:
        """For each part of the goal, whether it can be reached alone."""
        parts = self.goal.operands if isinstance(self.goal, And) else (self.goal,)
        if len(parts) == 1:
            return [f"{self.goal} holds in none of them"]
        return [f"{part}: {self._alone(part)}" for part in parts]

    def _alone(self, part: Predicate) -> str:
        answer = self.planner.plan(self.start, part, self.limits)
        if isinstance(answer, Solved):
            return f"can be reached alone, with {counted(len(answer.plan), 'operation')}"
        if isinstance(answer, LimitReached):
            return "was not found within the limits, even alone"
        return "cannot even be reached alone"


_RAISE = {Limit.LENGTH: "--max-length", Limit.EXPANSIONS: "--max-expanded"}


def _after(model: BehaviorModel, name: str, state: State) -> State:
    operation = model.operation(name)
    between = apply(operation.pre.a, state)
    after = None if between is None else apply(operation.post.a, between)
    if after is None:
        raise AssertionError(f"{name} leaves a domain, though its plan was validated")
    return after
