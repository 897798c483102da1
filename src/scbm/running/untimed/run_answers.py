"""The answers that runs get from a planner, in the packed states of the runner."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from scbm.planning import DEFAULT_PLANNER, PlanLimits, Solved, Unsolvable
from scbm.running.untimed.situations import PlanningTooLargeError

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model import Predicate
    from scbm.planning import Answer, Planner, Policy
    from scbm.running import Program

_ANY_LENGTH = 10_000_000

SATISFICING_SHARE = 20
"""A planner other than the canonical one evaluates a state in about the time in which that one expands so many."""


class RunAnswers:
    """The answers of one planner to the questions of runs."""

    def __init__(self, planner: Planner, program: Program, most_planned: int) -> None:
        """Prepare the answers.

        Args:
            planner: the planner of the runs.
            program: packs the states of the runner. It may belong to another model with the same variables.
            most_planned: the maximum number of states of the world that are expanded to plan for one goal.
        """
        self._planner = planner
        self._program = program
        self._most_planned = most_planned
        self._limits = PlanLimits.of(planner.model)
        self._policies: dict[Predicate, Policy] = {}

    @property
    def planned(self) -> int:
        """The work of planning so far, as a number of states (`Policy.planned`)."""
        return sum(policy.planned for policy in self._policies.values())

    def policy(self, goal: Predicate) -> Policy:
        """Return the answers for one goal, in the packed states of the planner."""
        if goal not in self._policies:
            whole = self._limits.expansions  # as many states as the planner of a run may expand
            plans = PlanLimits(_ANY_LENGTH, min(self._most_planned, whole))
            if (
                self._planner.name != DEFAULT_PLANNER
            ):  # its answers decide what follows, so its limits are those of a run
                plans = self._limits
            self._policies[goal] = self._planner.shared_policy(goal, plans, whole)
        return self._policies[goal]

    def to(self, goal: Predicate) -> Callable[[int], Answer]:
        """Return the answers for one goal as a function of the packed states of the runner.

        The function raises `PlanningTooLargeError` where the planner of a run may have another answer, and beyond the
        limit of planning.
        """
        translation = self.translation(goal)
        if self._planner.name != DEFAULT_PLANNER:
            return _BoundedPlans(translation, self._most_planned // SATISFICING_SHARE).plan
        return partial(_plan, translation, self._limits.length)

    def translation(self, goal: Predicate) -> StateTranslation:
        """Return the translation of states of the runner into states of the planner for one goal."""
        return StateTranslation(self._program, self.policy(goal))


class StateTranslation:
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


def _plan(translation: StateTranslation, most_operations: int, state: int) -> Answer:
    answer = translation.policy.plan(translation.translate(state))
    # The planner of a run may have other limits, so its answer is unknown.
    if isinstance(answer, Unsolvable) or (isinstance(answer, Solved) and len(answer.plan) <= most_operations):
        return answer
    raise PlanningTooLargeError


class _BoundedPlans:
    """The answers of a planner that is not canonical, until its searches have evaluated too many states together."""

    def __init__(self, translation: StateTranslation, most: int) -> None:
        self._translation = translation
        self._left = most

    def plan(self, state: int) -> Answer:
        """Return the answer in a packed state; raise `PlanningTooLargeError` beyond the limit."""
        if self._left < 0:
            raise PlanningTooLargeError
        answer = self._translation.policy.plan(self._translation.translate(state))
        self._left -= answer.expanded
        return answer
