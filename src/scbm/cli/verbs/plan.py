"""`scbm plan`: prints a plan to a goal, or the reason why there is none."""

from typing import Any

from msgspec import Struct
from rich.text import Text

from scbm.cli.options.option_errors import option_error
from scbm.cli.options.option_values import read_goal, read_state
from scbm.cli.options.planner_options import (
    MaxExpanded,
    MaxLength,
    MaxMemory,
    MaxTime,
    PlannerName,
    PlannerOptions,
)
from scbm.cli.options.verb_options import Goals, Jobs, Json, Model, StateValues
from scbm.cli.output.terminal import TerminalOutput, results, write_json
from scbm.closing.advice.unreachable_goals import why_unreachable
from scbm.files import load_model
from scbm.model import And, BehaviorModel, Diagnostic, InputError, Place, Predicate, RunPlans, Slug, State, format_value
from scbm.model.operations import apply
from scbm.model.visible_text import counted
from scbm.planning import (
    DEFAULT_PLANNER,
    PLANNERS,
    Answer,
    Limit,
    LimitReached,
    NoPlanFound,
    PlanLimits,
    Planner,
    Solved,
    model_with_plans,
    planner_of,
)
from scbm.running.search_guard import plan_guarded

FORMAT_VERSION = 2


def command(
    model: Model,
    *,
    goal: Goals = None,
    state: StateValues = None,
    jobs: Jobs = None,
    planner: PlannerName = None,
    max_length: MaxLength = None,
    max_expanded: MaxExpanded = None,
    max_time: MaxTime = None,
    max_memory: MaxMemory = None,
    json: Json = False,
) -> int:
    """Find a plan to a goal, or show why there is none; without `--goal` for each goal of the model."""
    options = PlannerOptions(planner, max_length, max_expanded, max_time, max_memory)
    loaded = options.applied(model_with_plans(RunPlans.CANONICAL, load_model(model)))  # no case draws plans here
    start, limits = read_state(state or [], loaded), options.limits(loaded)
    if goal is None:
        return _plan_all(loaded, str(model), start, limits, jobs, json=json)
    if jobs is not None:
        raise option_error("-j", "one goal takes one process", "leave it out")
    name, predicate = read_goal(goal, loaded)
    plans = Planner.of(loaded)
    answer = plan_guarded(plans, start, predicate, limits)
    if json:
        write_json(_heading(loaded, {"goal": str(predicate)}) | _answer_json(answer))
    else:
        _Drawing(plans, start, name, predicate, limits, results()).draw(answer)
    return 0 if isinstance(answer, Solved) else 1


def _plan_all(
    model: BehaviorModel, file: str, start: State, limits: PlanLimits, jobs: int | None, *, json: bool
) -> int:
    """Plan for each goal of the model, and print a line for each. Raise `InputError` if there is none."""
    from scbm.testing.batches.goal_sweep import GoalSweep  # noqa: PLC0415 - most plans are for one goal

    if not model.goals:
        remedy = "name one: `--goal 'robot_at == home'`"
        raise InputError([Diagnostic(Slug.NO_GOALS, "the model has no goals to plan for", Place(file), remedy)])
    names, goals = zip(*model.goals, strict=True)
    answers = []
    width = max(map(len, names))
    for name, answer in zip(names, GoalSweep(model, start, goals, limits).answers(jobs), strict=True):
        answers.append(answer)
        if not json:
            results().prose(f"{name:<{width}}   {_in_short(answer)}{_effort(model, answer)}")
    if json:
        entries = [
            {"name": name, "goal": str(goal)} | _answer_json(answer)
            for name, goal, answer in zip(names, goals, answers, strict=True)
        ]
        write_json(_heading(model, {}) | {"goals": entries})
    return 0 if all(isinstance(answer, Solved) for answer in answers) else 1


def _heading(model: BehaviorModel, goal: dict[str, str]) -> dict[str, Any]:
    planner = planner_of(model)
    identity = {"name": planner.name, "version": planner.version}
    return {"format_version": FORMAT_VERSION, "model": model.name, **goal, "planner": identity}


def _answer_json(answer: Answer) -> dict[str, Any]:
    return {
        "status": answer.status,
        "plan": list(answer.plan) if isinstance(answer, Solved) else None,
        "expanded": answer.expanded,
        "limit": answer.limit.value if isinstance(answer, LimitReached) else None,
    }


def _in_short(answer: Answer) -> str:
    if isinstance(answer, Solved):
        return counted(len(answer.plan), "operation") if answer.plan else "nothing to do: the goal holds already"
    if isinstance(answer, LimitReached):
        return f"no answer: limit on {answer.limit.value}; set another one with {_RAISE[answer.limit]}"
    if isinstance(answer, NoPlanFound):
        return "no answer: no plan found by an incomplete search"
    return "no plan: the goal is unreachable"


def _effort(model: BehaviorModel, answer: Answer) -> str:
    """Return the number of expanded states, where the search counted them."""
    is_external = PLANNERS[model.planner.name or DEFAULT_PLANNER].is_external
    is_timed = isinstance(answer, LimitReached) and answer.limit in (Limit.TIME, Limit.MEMORY)
    return "" if is_external or is_timed else f"   ({counted(answer.expanded, 'state')} expanded)"


class _Drawing(Struct, frozen=True):
    """A planning problem, and the output for its answer."""

    planner: Planner
    start: State
    name: str
    goal: Predicate
    limits: PlanLimits
    out: TerminalOutput

    def draw(self, answer: Answer) -> None:
        """Print the plan step by step, or the reason why there is none."""
        shown = self.name if self.name == str(self.goal) else f"{self.name}: {self.goal}"
        expanded = _effort(self.planner.model, answer)
        if isinstance(answer, Solved) and not answer.plan:
            self.out.prose(f"Nothing to do: the goal holds already: {shown}")
        elif isinstance(answer, Solved):
            self.out.prose(f"{counted(len(answer.plan), 'operation')} to {shown}{expanded}")
            self._draw_steps(answer.plan)
        elif isinstance(answer, LimitReached):
            self.out.prose(f"No answer: the search for {shown} reached its limit on {answer.limit.value}{expanded}")
            self.out.prose(f"  set another limit with {_RAISE[answer.limit]}")
        elif isinstance(answer, NoPlanFound):
            self.out.prose(f"No answer: the planner {self.planner.name} found no plan to {shown}{expanded}")
            self.out.prose(
                f"  its search is incomplete, so a plan may exist; --planner {DEFAULT_PLANNER} can decide it"
            )
        else:
            self.out.prose(f"No plan: the goal is unreachable: {shown}{expanded}")
            for line in self._reasons():
                self.out.prose(f"  {line}")

    def _draw_steps(self, plan: tuple[str, ...]) -> None:
        """Show the operations by number, each with its changes of the variables that guards read."""
        model, space = self.planner.model, self.planner.task(self.goal).packing.space
        width = max(len(name) for name in plan)
        now = State(model.running_space, {v.name: self.start.get(v.name, v.initial) for v in model.running_space})
        for number, name in enumerate(plan, start=1):
            after = _after(model, name, now)
            changes = [f"{key} <- {format_value(after[key])}" for key in space.names if after[key] != now[key]]
            head = f"  {number:>3}  {name:<{width}}"
            line = f"{head}   {', '.join(changes)}".rstrip()
            if self.out.fits(line):
                self.out.line(line)
            else:
                self.out.line(head.rstrip())
                self.out.lines(Text(f"         {change}") for change in changes)
            now = after

    def _reasons(self) -> list[str]:
        """Return for each conjunct of the goal whether it is reachable alone."""
        parts = self.goal.operands if isinstance(self.goal, And) else (self.goal,)
        alone = [f"{part}: {self._alone(part)}" for part in parts] if len(parts) > 1 else []
        return [*alone, *why_unreachable(self.planner, self.start, self.goal)]

    def _alone(self, part: Predicate) -> str:
        answer = plan_guarded(self.planner, self.start, part, self.limits)
        if isinstance(answer, Solved):
            return f"reachable alone, with {counted(len(answer.plan), 'operation')}"
        if isinstance(answer, LimitReached):
            return "no plan found within the limits, even alone"
        if isinstance(answer, NoPlanFound):
            return "no plan found, even alone"
        return "unreachable, even alone"


_RAISE = {
    Limit.LENGTH: "--max-length",
    Limit.EXPANSIONS: "--max-expanded",
    Limit.TIME: "--max-time",
    Limit.MEMORY: "--max-memory",
}


def _after(model: BehaviorModel, name: str, state: State) -> State:
    operation = model.operation(name)
    between = apply(operation.pre.a, state)
    after = None if between is None else apply(operation.post.a, between)
    if after is None:
        raise AssertionError(f"{name} leaves a domain, though its plan was validated")
    return after
