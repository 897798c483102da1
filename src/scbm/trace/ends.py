"""How the run for a goal can end (semantics 5)."""

from __future__ import annotations

from enum import StrEnum

from scbm.model import PlanState


class End(StrEnum):
    """The end of a run. A planner that gave up is not an unsolvable problem, so it has an end of its own.

    A run that was `lost` with a node came to none of the others, and has no trace: who tests says so, no runner.
    """

    REACHED = "reached"
    UNSOLVABLE = "unsolvable"
    ABORTED = "aborted"
    TIME_LIMIT = "time_limit"
    REPLAN_LIMIT = "replan_limit"
    PLANNER_LIMIT = "planner_limit"
    LIVELOCK = "livelock"
    MODEL_ERROR = "model_error"
    LOST = "lost"

    @property
    def plan_state(self) -> PlanState:
        """What `plan.state` is afterwards."""
        match self:
            case End.REACHED:
                return PlanState.COMPLETED
            case End.UNSOLVABLE:
                return PlanState.UNSOLVABLE
            case _:
                return PlanState.ABORTED
