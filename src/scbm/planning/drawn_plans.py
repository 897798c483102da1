"""Plans that are drawn from all shortest ones, operation by operation (semantics 4.4, decision 46).

The canonical planner has one plan for each problem, so of two equal robots it always takes the first. A drawn plan is
as short. Each of its operations is drawn among those that begin a shortest rest of a plan, all equally probable. Where
random numbers come from, the caller decides.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from msgspec.structs import replace

from scbm.planning.plan_answers import PlanLimits, Solved, always

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.cases import RecordedPlan
    from scbm.model import Predicate, Value
    from scbm.planning.plan_answers import Answer, ShouldContinue
    from scbm.planning.planner import PlanCache, Planner

    Plan: TypeAlias = tuple[str, ...]
    Step: TypeAlias = tuple[int, int]
    """An operation by its index, and the packed state that it leads to."""


_DEFAULT_LIMITS = PlanLimits()


class DrawnProblem(NamedTuple):
    """The problem for which a plan is drawn.

    Attributes:
        goal: the goal.
        limits: the limits of each search.
        should_continue: called at intervals; `SearchCancelledError` is raised once it returns `False`.
    """

    goal: Predicate
    limits: PlanLimits
    should_continue: ShouldContinue


class ShortestPlans:
    """Decides which operations begin shortest plans, for the goals of one model.

    Attributes:
        planner: the canonical planner of the model.
        plans: its answers.
    """

    def __init__(self, planner: Planner, plans: PlanCache) -> None:
        """`plans` are the answers of `planner`."""
        self.planner = planner
        self.plans = plans

    def rest_after(self, step: Step, canonical: Plan, problem: DrawnProblem) -> Plan | None:
        """Return the canonical plan after an operation that begins a shortest plan; `None` after any other one.

        `None` also if the planner does not find out within its limits.

        Args:
            step: an operation that is enabled in a state in which the goal does not hold.
            canonical: the canonical plan from the state.
            problem: what is planned for.
        """
        operation, after = step
        if self.planner.task(problem.goal).operations[operation] == canonical[0]:
            return canonical[1:]
        shorter = replace(problem.limits, length=len(canonical) - 1)  # a search that ends there takes a fraction
        answer = self.plans.packed_plan(after, problem.goal, shorter, problem.should_continue)
        return answer.plan if isinstance(answer, Solved) else None


class DrawnPlans:
    """The plans of one run, drawn from all shortest ones. The same stream of random numbers gives the same plans."""

    def __init__(self, shortest: ShortestPlans, random: Callable[[], float]) -> None:
        """Draw nothing yet; `random` returns the next random number, at least 0 and less than 1."""
        self._shortest = shortest
        self._random = random

    def plan(
        self,
        state: Mapping[str, Value],
        goal: Predicate,
        limits: PlanLimits = _DEFAULT_LIMITS,
        should_continue: ShouldContinue = always,
    ) -> Answer:
        """Return a shortest plan from a state of the world to a goal, or why there is none.

        Raises `SearchCancelledError` once `should_continue` returns `False`.
        """
        answer = self._shortest.plans.plan(state, goal, limits, should_continue)
        if not isinstance(answer, Solved):
            return answer
        task = self._shortest.planner.task(goal)
        problem = DrawnProblem(goal, limits, should_continue)
        here, rest, drawn = task.pack(state), answer.plan, list[str]()
        while rest:
            operation, here, rest = self._draw(task.successors(here), rest, problem)
            drawn.append(task.operations[operation])
        chosen = replace(answer, plan=tuple(drawn))
        self._shortest.planner.validate(state, goal, chosen)
        return chosen

    def _draw(self, steps: Iterable[Step], canonical: Plan, problem: DrawnProblem) -> tuple[int, int, Plan]:
        """Return an operation that begins a shortest plan, the state that it leads to, and the canonical plan there.

        An operation that begins none is put aside, and another one drawn: the result is as if only those had been there
        that begin one. So few of them have to be searched for.
        """
        left = list(steps)
        while True:
            step = left.pop(int(self._random() * len(left)))
            rest = self._shortest.rest_after(step, canonical, problem)
            if rest is not None:
                return (*step, rest)


class PreferredPlans:
    """The plans of one run that repeats the plans of another run where they are plans here, too.

    Everywhere else they are canonical. The shrinker runs changed cases so: a plan that matters for a failure stays.
    """

    def __init__(self, shortest: ShortestPlans, preferred: Sequence[RecordedPlan], *, may_be_longer: bool) -> None:
        """`preferred` are the answers of the other run, in the order of its questions; shortest plans, or any."""
        self._shortest = shortest
        self._preferred = iter(preferred)
        self._may_be_longer = may_be_longer

    def plan(
        self,
        state: Mapping[str, Value],
        goal: Predicate,
        limits: PlanLimits = _DEFAULT_LIMITS,
        should_continue: ShouldContinue = always,
    ) -> Answer:
        """Return the plan of the other run if it is such a plan from this state, else the canonical answer."""
        answer = self._shortest.plans.plan(state, goal, limits, should_continue)
        preferred = next(self._preferred, None)
        if preferred is None or not isinstance(answer, Solved):
            return answer
        if len(preferred.plan) != len(answer.plan) and not self._may_be_longer:
            return answer
        flaw = self._shortest.planner.find_flaw(state, goal, preferred.plan)
        return answer if flaw is not None else replace(answer, plan=preferred.plan)
