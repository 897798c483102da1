"""All runs of a model without injections: one graph for each goal."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from scbm.closing.runs.run_graph import RunGraph, explore_runs
from scbm.closing.runs.run_relevance import Relevance, initial_states
from scbm.closing.runs.run_steps import RunSteps
from scbm.closing.runs.situations import PlanningTooLargeError, Queues, TooManyRepliesError, Visits
from scbm.planning import LimitReached, PlanLimits, Planner, Solved
from scbm.running import Program

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.closing.runs.run_graph import Start
    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.planning import Answer, Policy


@dataclass(frozen=True, slots=True)
class CloseLimits:
    """The limits of closing. None is a time: the same model is decided alike on every machine.

    Attributes:
        situations: the maximum number of situations of runs, over all goals together.
        starts: the maximum number of combinations of random values that are enumerated for initial states.
        planning: the maximum number of states of the world that are expanded to plan for one goal, where planning for
            all of them at once is not possible.
        candidates: the maximum number of cases that are tried for one obligation whose walk did not lead to it.
        beyond: the maximum number of situations of the guided search, where not all situations were explored.
        inputs: the maximum number of situations of runs in which inputs change.
    """

    situations: int = 300_000
    starts: int = 100_000
    planning: int = 200_000
    candidates: int = 100
    beyond: int = 100_000
    inputs: int = 10_000


_ANY_LENGTH = 10_000_000
_WHOLE_WORLD = PlanLimits().expansions
"""Maximum number of states of the world for planning from all of them at once: what the planner of a run may expand."""


class AllRuns:
    """The graphs of all runs.

    Attributes:
        program: the compiled model.
        planner: the planner of all runs.
        relevance: the variables by which situations differ.
        visits: the meaning of the bits of visits.
        starts: the initial states, the nominal one first.
        graphs: one graph for each goal.
        observed: the packed states in which guards were evaluated.
        stopped: why the exploration is incomplete, as a sentence; `None` if it is complete.
    """

    def __init__(
        self,
        model: BehaviorModel,
        limits: CloseLimits,
        progress: Callable[[str], None],
        inputs: Sequence[tuple[str, Value]] = (),
    ) -> None:
        """Explore all runs.

        Args:
            model: the model.
            limits: the limits of the exploration.
            progress: called with a description of each phase as it begins.
            inputs: the values that the environment may give to inputs at any moment; empty for runs without injections.
        """
        self.model = model
        self.program = Program(model)
        self.planner = Planner(model)
        self.relevance = Relevance(model, self.program.packing)
        self.visits = Visits(model)
        self.queues = Queues()
        self.starts: Sequence[Start] = ()
        self.graphs: tuple[RunGraph, ...] = ()
        self.observed: dict[int, None] = {}
        self._policies: dict[Predicate, Policy] = {}
        self.stopped: str | None = None
        self._limits = limits
        self._inputs = inputs
        self._explore(limits, progress)

    @property
    def situations(self) -> int:
        """The number of explored situations."""
        return sum(len(graph.positions) for graph in self.graphs)

    @property
    def plannable(self) -> tuple[tuple[str, Predicate], ...]:
        """The goals whose plans are found within the limits, as far as is known."""
        return tuple(graph.goal for graph in self.graphs if not graph.planning_too_large)

    @property
    def visited(self) -> int:
        """What runs visit, as bits of `Visits`."""
        visited = 0
        for graph in self.graphs:
            visited |= graph.visits
        return visited

    @property
    def cut_off(self) -> int:
        """What runs visit only if a limit of plans ends them."""
        cut_off = 0
        for graph in self.graphs:
            for _, _, visits in graph.cut_offs:
                cut_off |= visits
        return cut_off

    def _explore(self, limits: CloseLimits, progress: Callable[[str], None]) -> None:
        self.starts, complete = initial_states(self.model, self.program, self.relevance, limits.starts)
        if not complete:
            self.stopped = f"there are more than {limits.starts:,} combinations of initial values"
        left = limits.situations
        graphs = []
        for name, goal in self.model.goals:
            progress(f"exploring the runs to {name}")
            try:
                steps = self.steps(goal)
            except TooManyRepliesError:
                self.stopped = "a reply has too many combinations of measured values"
                return
            graph = explore_runs((name, goal), steps, self.starts, left)
            graphs.append(graph)
            self.observed |= steps.evaluated
            left -= len(graph.positions)
            if graph.planning_too_large:
                self.stopped = f"planning for {name} would expand more than {limits.planning:,} states of the world"
            elif not graph.complete:
                self.stopped = f"runs can be in more than {limits.situations:,} situations"
        self.graphs = tuple(graphs)

    def steps(self, goal: Predicate) -> RunSteps:
        """Return the steps of the runs for a goal."""
        if goal not in self._policies:
            plans = PlanLimits(_ANY_LENGTH, self._limits.planning)
            self._policies[goal] = self.planner.policy(goal, plans, whole=_WHOLE_WORLD)
        plan = partial(_plan, _Translation(self.program, self._policies[goal]))
        return RunSteps(
            self.program, self.relevance, self.visits, self.program.test(goal), plan, self.queues, self._inputs
        )


class _Translation:
    """Translates packed states of the runner into packed states of the planner."""

    def __init__(self, program: Program, policy: Policy) -> None:
        self.policy = policy
        fields = [field for field in policy.task.packing.fields if not field.variable.role.is_runner]
        rest = {variable.name: variable.initial for variable in program.packing.space}
        self._base = policy.task.pack(rest)
        for field in fields:
            self._base &= ~field.mask
        self._moves = tuple(
            (program.packing[field.variable.name].mask, program.packing[field.variable.name].shift, field.shift)
            for field in fields
        )

    def translate(self, state: int) -> int:
        """Return the state of the world as the planner packs it; the runner's variables are at rest."""
        packed = self._base
        for mask, source, target in self._moves:
            packed |= (state & mask) >> source << target
        return packed


def _plan(translation: _Translation, state: int) -> Answer:
    answer = translation.policy.plan(translation.translate(state))
    # The planner of a run may have other limits, so its answer is unknown.
    if isinstance(answer, LimitReached) or (isinstance(answer, Solved) and len(answer.plan) > PlanLimits().length):
        raise PlanningTooLargeError
    return answer
