"""The planners by name (`PLANNERS`): each finds plans for the runs of a model.

To add one: a function from a planning problem and limits to an answer, and an entry here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from msgspec import Struct
from msgspec.structs import replace

from scbm.model import PlannerIdentity, RunPlans
from scbm.planning.plan_answers import PlanLimits, Solved, Unsolvable
from scbm.planning.plan_search import brief_answer, search_plan

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model import BehaviorModel
    from scbm.planning.plan_answers import Answer
    from scbm.planning.planning_task import PlanProblem


class PlanFunction(Protocol):
    """A planner. Its answer depends on the problem and the limits alone, never on earlier calls."""

    def __call__(self, problem: PlanProblem, limits: PlanLimits) -> Answer:
        """Return a plan, the proof that there is none, the limit that ended the search, or that it found nothing."""
        ...


def canonical(problem: PlanProblem, limits: PlanLimits) -> Answer:
    """Return the canonical plan: the shortest, and of the shortest the first in the order of the model."""
    return search_plan(problem.problem, problem.start, limits, problem.should_continue)


def canonical_briefly(problem: PlanProblem, limits: PlanLimits) -> Answer | None:
    """Return the answer of `canonical` if it takes a fraction of a second; otherwise `None`."""
    return brief_answer(problem.problem, problem.start, limits, problem.should_continue)


_EVALUATED_SHARE = 20
"""Evaluating a state by its relaxed plan takes about as long as expanding this many states."""

_MIN_EVALUATED = 1_000


def greedy(problem: PlanProblem, limits: PlanLimits) -> Answer:
    """Return some plan, mostly a short one.

    The greedy search has a share of the limit. Where that is not enough, the canonical search has the rest: it ends
    on small systems, and it finds the plans that are shorter than a limit on their length.
    """
    share = min(limits.expansions, max(limits.expansions // _EVALUATED_SHARE, _MIN_EVALUATED))
    answer = problem.problem.greedy.plan(problem.start, share, problem.should_continue)
    if isinstance(answer, Unsolvable) or (isinstance(answer, Solved) and len(answer.plan) <= limits.length):
        return answer
    rest = PlanLimits(limits.length, limits.expansions - answer.expanded)
    exact = canonical(problem, rest)
    return replace(exact, expanded=exact.expanded + answer.expanded)


class PlannerEntry(Struct, frozen=True):
    """A planner that `--planner` and `planner:` can name.

    Attributes:
        version: changes whenever the planner may answer a problem differently. Traces, cases, stores and certificates
            record it beside the name.
        search: the function that plans.
        help: what its plans are, in a few words for `--help`.
        is_external: whether another program plans. Its answers may depend on the machine and the time, so traces and
            cases record them, and a replay never asks the planner again.
        program_version: returns the version of the other program.
        brief: the cheap first part of `search`, if it has one: it returns the answer of `search`, or `None` where the
            search would go on for longer.
    """

    version: str
    search: PlanFunction
    help: str
    is_external: bool = False
    program_version: Callable[[], str] | None = None
    brief: Callable[[PlanProblem, PlanLimits], Answer | None] | None = None

    @property
    def whole_version(self) -> str:
        """The version, with that of the program that plans. Raise `InputError` if the program is not installed."""
        return self.version if self.program_version is None else f"{self.version}/{self.program_version()}"


def _fast_downward(function: str) -> PlanFunction:
    """Return a planner of the module `fast_downward`, which is imported when it is first asked."""

    def search(problem: PlanProblem, limits: PlanLimits) -> Answer:
        from scbm.planning import fast_downward  # noqa: PLC0415 - most commands do not use it

        answer: Answer = getattr(fast_downward, function)(problem, limits)
        return answer

    return search


def _version_of_fast_downward() -> str:
    from scbm.planning.fast_downward import program_version  # noqa: PLC0415 - most commands do not use it

    return program_version()


def _external(function: str, help_text: str) -> PlannerEntry:
    return PlannerEntry("2", _fast_downward(function), help_text, True, _version_of_fast_downward)


PLANNERS: dict[str, PlannerEntry] = {
    "canonical": PlannerEntry(
        "1", canonical, "the shortest plan, and of these the first in the order of the file", brief=canonical_briefly
    ),
    "greedy": PlannerEntry("1", greedy, "some plan, found fast in large models"),
    "fast-downward": _external("lama_first", "some plan, by Fast Downward; an extra"),
    "fast-downward-optimal": _external("optimal", "a plan of proved length, by Fast Downward; an extra"),
}
"""The planners by the names that `--planner` takes."""


def planner_of(model: BehaviorModel) -> PlannerIdentity:
    """Return the planner that the model names, or the default one, with the limits that the model sets."""
    name, choice = model.planner.name or DEFAULT_PLANNER, model.planner
    return PlannerIdentity(name, PLANNERS[name].whole_version, choice.max_length, choice.max_expanded)


def planner_of_random_runs(model: BehaviorModel) -> PlannerIdentity:
    """Return what makes the plans of random cases, as traces and stores record it: `planner_of`, or draws."""
    planner = planner_of(model)
    is_drawn = model.runs.plans is RunPlans.DRAWN
    return replace(planner, name=DRAWN_PLANS, version=_DRAWING_VERSION) if is_drawn else planner


def model_with_plans(plans: RunPlans, model: BehaviorModel) -> BehaviorModel:
    """Return the model whose random cases have these plans."""
    return replace(model, runs=replace(model.runs, plans=plans))


def model_planned_by(planner: PlannerIdentity, model: BehaviorModel) -> BehaviorModel:
    """Return the model with the planner of a recorded run, and with plans that are drawn if those of the run were."""
    is_drawn = planner.name == DRAWN_PLANS
    model = model_with_plans(RunPlans.DRAWN if is_drawn else RunPlans.CANONICAL, model)
    return replace(model, planner=replace(planner, name=DEFAULT_PLANNER).choice if is_drawn else planner.choice)


DRAWN_PLANS = "drawn"
"""The name that traces, cases and stores give to plans drawn from all shortest ones; no planner has this name."""

_DRAWING_VERSION = "1"
"""Changes whenever the same stream of random numbers may give another plan."""

DEFAULT_PLANNER = "canonical"
"""The planner of commands and models that name none; the proofs of `scbm close` rely on canonical plans."""
