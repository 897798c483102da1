"""All runs of the original model, with the states in which the runner evaluates each part of it."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from msgspec.structs import replace

from scbm.closing.proofs.proofs import scope_of_proofs
from scbm.closing.runs.all_runs import AllRuns
from scbm.model import GoalOrder
from scbm.running.lifecycle import OperationMove
from scbm.running.micro_steps import RequestSending, RunTurn

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.closing.runs.all_runs import CloseLimits
    from scbm.closing.runs.run_graph import RunGraph
    from scbm.model import BehaviorModel, PlanSet
    from scbm.running.untimed.situations import Position


class StateOfGoal(NamedTuple):
    """A state of a run.

    Attributes:
        goal: the position of the goal in the model.
        state: the packed state.
    """

    goal: int
    state: int


class ObservedRuns:
    """The runs of one model under all choices from outside, explored once.

    A state keeps all variables, since a record of a run shows each change of each variable. Where these are too many
    situations, it keeps the variables that can influence a run of the model.

    Attributes:
        runs: the graphs of all runs.
    """

    def __init__(
        self, model: BehaviorModel, limits: CloseLimits, progress: Callable[[str], None], plans: PlanSet
    ) -> None:
        """Explore the runs with these plans. Raises `KeyboardInterrupt` if the user interrupts."""
        scope = replace(scope_of_proofs(model, plans), keeps_all=True)
        self.runs = AllRuns(model, limits, progress, scope)
        if self.runs.stopped is not None and not self.runs.is_interrupted:
            self.runs = AllRuns(model, limits, progress, replace(scope, keeps_all=False))
        if self.runs.is_interrupted:
            raise KeyboardInterrupt
        self.program = self.runs.program
        self.kept = self.runs.relevance.mask

    @property
    def model(self) -> BehaviorModel:
        """The model."""
        return self.runs.model

    @property
    def is_sequence(self) -> bool:
        """Whether goals follow each other, in one graph."""
        return self.runs.goals is GoalOrder.SEQUENCE

    def goals_of(self, number: int) -> range:
        """Return the positions of the goals that a graph is about."""
        return range(len(self.model.goals)) if self.is_sequence else range(number, number + 1)

    def __iter__(self) -> Iterator[StateOfGoal]:
        """Yield the states in which automatic transitions are evaluated, in the order of exploration."""
        for goal, states in enumerate(self.runs.evaluated):
            for state in states:
                yield StateOfGoal(goal, state)

    def tried(self, operation: str) -> list[StateOfGoal]:
        """Return the states in which the runner tries the lifecycle rules of an operation."""
        return self._tried.get(operation, [])

    def sent(self, resource: str) -> list[StateOfGoal]:
        """Return the states in which the runner sends a request to a resource."""
        return self._sent.get(resource, [])

    @cached_property
    def _sent(self) -> dict[str, list[StateOfGoal]]:
        return self._by_micro_step[1]

    @cached_property
    def _tried(self) -> dict[str, list[StateOfGoal]]:
        return self._by_micro_step[0]

    @cached_property
    def _by_micro_step(self) -> tuple[dict[str, list[StateOfGoal]], dict[str, list[StateOfGoal]]]:
        """The states by the operation that is tried in them, and by the resource that a request is sent to."""
        tried: dict[str, list[StateOfGoal]] = {}
        sent: dict[str, list[StateOfGoal]] = {}
        for goal, state in self:
            steps = self.program.micro_steps(self.model.goals[goal][1])
            step, current = steps.first(state, (), timer_passed=False), self.program.current(state)
            if isinstance(step, RequestSending):
                sent.setdefault(step.line.resource.name, []).append(StateOfGoal(goal, state))
            elif current is not None and (step is None or isinstance(step, OperationMove)):
                tried.setdefault(current.operation.name, []).append(StateOfGoal(goal, state))
        return tried, sent

    def unplanned(self, goal: int) -> Iterator[int]:
        """Yield the states of the runs for a goal in which no operation is current, and the next one is wanted."""
        steps = self.program.micro_steps(self.model.goals[goal][1])
        for state in self.runs.evaluated[goal]:
            if steps.first(state, (), timer_passed=False) is RunTurn.FOLLOW_PLAN:
                yield state

    def settled(self, operation: str) -> list[StateOfGoal]:
        """Return the states in which the runner is settled while an operation is current."""
        return self._settled.get(operation, [])

    @cached_property
    def _settled(self) -> dict[str, list[StateOfGoal]]:
        found: dict[str, dict[StateOfGoal, None]] = {}
        for number, graph in enumerate(self.runs.graphs):
            for position in graph.positions:
                current = None if position.is_at_rest else self.program.current(position.state)
                if current is not None:
                    where = StateOfGoal(self.goal_of(number, position), position.state)
                    found.setdefault(current.operation.name, {})[where] = None
        return {name: list(states) for name, states in found.items()}

    def goal_of(self, graph: int, position: Position) -> int:
        """Return the position of the goal that is pursued in a position of a graph."""
        return position.goal if self.is_sequence else graph

    @property
    def graphs(self) -> tuple[RunGraph, ...]:
        """The graphs of runs."""
        return self.runs.graphs
