"""The steps of runs that continue from any state, compiled once for a model and planned as its planner does."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from scbm.planning import DEFAULT_PLANNER, PlanCache, PlanLimits, Planner, Solved, Unsolvable
from scbm.running import Program
from scbm.running.untimed.noted_steps import NotedSteps
from scbm.running.untimed.plan_queues import CanonicalQueues
from scbm.running.untimed.relevance import Relevance
from scbm.running.untimed.situations import PlanningTooLargeError, Visits

if TYPE_CHECKING:
    from scbm.model import BehaviorModel, Predicate
    from scbm.planning import Answer

MOST_SITUATIONS = 5_000
"""Maximum number of situations of one search: a fraction of a second. What a longer search finds is unknown."""


_DEFAULT_LIMITS = PlanLimits()


class SearchTooLongError(Exception):
    """A search has found more situations than it may."""


class ContinuedRuns:
    """The runs of one model from any state on.

    Attributes:
        model: the model.
    """

    def __init__(
        self,
        model: BehaviorModel,
        planner: str = DEFAULT_PLANNER,
        limits: PlanLimits = _DEFAULT_LIMITS,
        program: Program | None = None,
    ) -> None:
        """Compile nothing yet: most runs need no search.

        Args:
            model: the model.
            planner: the name of the planner of the runs.
            limits: the limits of each plan; where one is met, `PlanningTooLargeError` is raised.
            program: the compiled model, if it is compiled.
        """
        self.model = model
        self._program = program
        self._limits = limits
        self._planner_name = planner
        self._steps: dict[tuple[Predicate, int, bool, bool], NotedSteps] = {}

    def steps(self, goal: Predicate, number: int = 0, *, is_open: bool, is_sequence: bool = False) -> NotedSteps:
        """Return the steps of the runs for a goal; memoized.

        Args:
            goal: the goal.
            number: its number, where goals follow each other.
            is_open: whether something outside the model changes variables.
            is_sequence: whether goals follow each other.
        """
        key = (goal, number, is_open, is_sequence)
        if key not in self._steps:
            self._steps[key] = NotedSteps(
                self.program,
                self.relevance(goal),
                self._visits,
                goal,
                lambda state: self._answer(state, goal),
                self._queues,
                number=number,
                is_open=is_open,
                is_sequence=is_sequence,
            )
            self._steps[key].read_goal(goal)
        return self._steps[key]

    def relevance(self, goal: Predicate) -> Relevance:
        """Return the variables that can influence a run for a goal."""
        return Relevance(self.model, self.program.packing, also=goal.reads())

    @cached_property
    def program(self) -> Program:
        """The compiled model."""
        return self._program or Program(self.model)

    def _answer(self, state: int, goal: Predicate) -> Answer:
        answer = self._plans.plan(self.program.packing.values(state), goal, self._limits)
        if isinstance(answer, Solved | Unsolvable):
            return answer
        raise PlanningTooLargeError

    @cached_property
    def _plans(self) -> PlanCache:
        return PlanCache(Planner(self.model, self._planner_name))

    @cached_property
    def _visits(self) -> Visits:
        return Visits(self.model)

    @cached_property
    def _queues(self) -> CanonicalQueues:
        return CanonicalQueues(operation.name for operation in self.model.operations)
