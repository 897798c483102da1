"""The program of a model: the compiled model with the micro-steps and queues of its runs, memoized.

A program is made once for a model, and is shared by all runners of the model. What it memoizes changes no result.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.running.compiled_model import CompiledModel
from scbm.running.micro_steps import MicroSteps, PlanQueue

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import BehaviorModel, Predicate
    from scbm.running.micro_steps import MemoizedSteps


_MAX_QUEUES = 50_000
"""Maximum number of memoized queues."""


class Program(CompiledModel):
    """The compiled model with what its runs have in common.

    Attributes:
        memoized_steps: the micro-steps of runs, as far as they do not depend on the goal.
    """

    def __init__(self, model: BehaviorModel) -> None:
        super().__init__(model)
        self._forget_runs()

    def _forget_runs(self) -> None:
        """Memoize nothing."""
        self._micro_steps: dict[Predicate | None, MicroSteps] = {}
        self.memoized_steps: MemoizedSteps = {}
        self._no_operations = PlanQueue()
        self._queues: dict[tuple[str, PlanQueue], PlanQueue] = {}

    def _replace(self, mutant: BehaviorModel) -> None:
        super()._replace(mutant)
        self._forget_runs()

    def micro_steps(self, goal: Predicate | None) -> MicroSteps:
        """Return the micro-steps of runs for a goal, or of a runner without one; memoized, as goals are repeated."""
        if goal not in self._micro_steps:
            self._micro_steps[goal] = MicroSteps(self, None if goal is None else self.test(goal), self.memoized_steps)
        return self._micro_steps[goal]

    def queue(self, plan: Sequence[str] = ()) -> PlanQueue:
        """Return the queue with the operations of a plan; memoized, so that equal queues are identical."""
        queue = self._no_operations
        for name in reversed(plan):
            following = (name, queue)
            known = self._queues.get(following)
            queue = PlanQueue(self.operations[name], queue) if known is None else known
            if known is None and len(self._queues) < _MAX_QUEUES:
                self._queues[following] = queue
        return queue
