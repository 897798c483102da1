"""Plans to many goals of one model, on one core or on several; the answers do not depend on the number of cores."""

from __future__ import annotations

import pickle
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.planning import Planner
from scbm.running.search_guard import plan_guarded
from scbm.testing.batches.all_cores import on_cores
from scbm.testing.batches.worker_processes import WorkerPool

if TYPE_CHECKING:
    from collections.abc import Generator, Iterator

    from scbm.model import BehaviorModel, Predicate, State
    from scbm.planning import Answer, PlanLimits


class GoalSweep(Struct, frozen=True):
    """Planning problems with one model and one state.

    Attributes:
        model: the model, which names the planner.
        start: the state to plan from.
        goals: the goals.
        limits: the limits of each search; the one of memory is that of a process.
    """

    model: BehaviorModel
    start: State
    goals: tuple[Predicate, ...]
    limits: PlanLimits

    def answers(self, jobs: int | None = None) -> Generator[Answer, None, None]:
        """Yield the answer for each goal, in their order.

        Args:
            jobs: the number of worker processes. `None` for none at first, and for all cores once that takes long.

        Raises:
            InputError: a worker process was lost, or the planner failed.
        """
        return on_cores(self._answers(), len(self.goals), jobs, self._rest)

    def _answers(self) -> Iterator[Answer]:
        planner = Planner.of(self.model)
        yield from (plan_guarded(planner, self.start, goal, self.limits) for goal in self.goals)

    def _rest(self, done: int, count: int) -> Generator[Answer, None, None]:
        workers = WorkerPool(_take_sweep, pickle.dumps(self), min(count, len(self.goals) - done))
        return workers.results(_plan_in_worker, range(done, len(self.goals)), "planned", "plan")


# in a worker

_sweeps: list[tuple[GoalSweep, Planner]] = []
"""The sweep of this worker process, with its planner, which keeps the packed model."""


def _take_sweep(sent: bytes) -> None:
    sweep: GoalSweep = pickle.loads(sent)  # noqa: S301 - from our own parent
    _sweeps[:] = [(sweep, Planner.of(sweep.model))]


def _plan_in_worker(index: int) -> Answer:
    ((sweep, planner),) = _sweeps
    return plan_guarded(planner, sweep.start, sweep.goals[index], sweep.limits)
