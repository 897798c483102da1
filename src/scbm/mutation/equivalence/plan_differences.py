"""The states in which the planner of a mutant has another answer than the planner of the original."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import RunPlans
from scbm.model.sources import still
from scbm.mutation.equivalence.observed_runs import StateOfGoal
from scbm.mutation.equivalence.runner_differences import StateDifference
from scbm.planning import Planner, Solved, Unsolvable
from scbm.running.untimed.run_answers import RunAnswers
from scbm.running.untimed.situations import WaitsFor

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Predicate
    from scbm.mutation.equivalence.observed_runs import ObservedRuns
    from scbm.planning import Answer
    from scbm.running import Program

_WAITING = (WaitsFor.CHANGE, WaitsFor.STALE)
"""The waits of a runner that may ask for a plan again, or not, after the planner found no plan."""


class PlanDifferences:
    """The differences between the plans of a model and of one mutant."""

    def __init__(self, observed: ObservedRuns, mutant: BehaviorModel, comparable: Program, most_planned: int) -> None:
        """Compare later.

        Args:
            observed: the runs of the original.
            mutant: the mutant, with its operations in its own order.
            comparable: the program of the mutant with the operations of the original.
            most_planned: the maximum number of states that are expanded to plan for one goal.
        """
        self._observed = observed
        self._mutant = mutant
        self._comparable = comparable
        self._most_planned = most_planned

    def __iter__(self) -> Iterator[StateDifference]:
        """Yield the states in which plans differ, then those in which only one runner asks for a plan.

        Raises `PlanningTooLargeError` where a plan of the mutant is not found within the limits.
        """
        if _planned_parts(self._observed.model) == _planned_parts(self._mutant):
            return
        planner = Planner.of(self._mutant)
        answers = RunAnswers(planner, self._observed.program, self._most_planned)
        for number, (_, goal) in enumerate(self._observed.model.goals):
            yield from self._of_answers(number, goal, answers)
            yield from self._of_questions(number, goal)
            if self._observed.model.runs.plans is RunPlans.DRAWN:
                yield from self._of_shortest(number, goal, answers)

    def _of_answers(self, number: int, goal: Predicate, answers: RunAnswers) -> Iterator[StateDifference]:
        original, mutated = self._observed.runs.answers.to(goal), answers.to(goal)
        for state in self._observed.runs.asked[number]:
            if _content(original(state)) != _content(mutated(state)):
                yield StateDifference(StateOfGoal(number, state))

    def _of_questions(self, number: int, goal: Predicate) -> Iterator[StateDifference]:
        """Yield the states in which only one runner asks for a plan again after the answer that there is none.

        A runner asks again when a variable has changed that the planner reads (semantics 5.6), and other variables may
        count for the mutant. Any state without a plan is taken to precede any state in which the runner needs a plan.
        """
        masks = [each.planner_reads(goal) for each in (self._observed.program, self._comparable)]
        if masks[0] == masks[1] or not self._waits(number):
            return
        constant = sum(self._observed.program.packing[name].mask for name in still(self._observed.model))
        answer = self._observed.runs.answers.to(goal)
        refused = [state for state in self._observed.runs.asked[number] if isinstance(answer(state), Unsolvable)]
        for same, other in ((masks[0] | constant, masks[1]), (masks[1] | constant, masks[0])):
            before: dict[int, dict[int, None]] = {}
            for state in refused:
                before.setdefault(state & same, {})[state & other] = None
            for state in self._observed.unplanned(number):
                known = before.get(state & same, {})
                if len(known) > 1 or (known and state & other not in known):
                    yield StateDifference(StateOfGoal(number, state))

    def _of_shortest(self, number: int, goal: Predicate, answers: RunAnswers) -> Iterator[StateDifference]:
        """Yield the states from which the shortest plans differ, where runs may get any of these."""
        sides = [_ShortestRests(each, goal) for each in (self._observed.runs.answers, answers)]
        known: dict[tuple[int, int], None] = {}
        for state in self._observed.runs.asked[number]:
            todo = [(sides[0].world(state), sides[1].world(state))]
            while todo:
                pair = todo.pop()
                if pair in known:
                    continue
                known[pair] = None
                before, after = sides[0].following(pair[0]), sides[1].following(pair[1])
                if before.keys() != after.keys():
                    yield StateDifference(StateOfGoal(number, state))
                    break
                todo += [(world, after[name]) for name, world in before.items()]

    def _waits(self, goal: int) -> bool:
        """Return whether a run for a goal waits for a change, as there is no plan."""
        return any(
            position.awaits in _WAITING and not position.is_at_rest and self._observed.goal_of(number, position) == goal
            for number, graph in enumerate(self._observed.graphs)
            for position in graph.positions
        )


class _ShortestRests:
    """The operations that can follow in the shortest plans to one goal."""

    def __init__(self, answers: RunAnswers, goal: Predicate) -> None:
        self._policy = answers.policy(goal)
        self.world = answers.translation(goal).translate

    def following(self, world: int) -> dict[str, int]:
        """Return the operations that begin a shortest rest from a state of the world, each with the state after it."""
        length, task = self._length(world), self._policy.task
        if length is None:
            return {}
        nearer = ((step, after) for step, after in task.successors(world) if self._length(after) == length - 1)
        return {task.operations[step]: after for step, after in nearer}

    def _length(self, world: int) -> int | None:
        answer = self._policy.plan(world)
        return len(answer.plan) if isinstance(answer, Solved) else None


def _planned_parts(model: BehaviorModel) -> list[tuple[object, ...]]:
    """Return everything of the operations that the planner reads."""
    return [(each.name, each.pre.g, each.pre.a, each.post.g, each.post.a) for each in model.operations]


def _content(answer: Answer) -> tuple[str, tuple[str, ...]]:
    return answer.status, answer.plan if isinstance(answer, Solved) else ()
