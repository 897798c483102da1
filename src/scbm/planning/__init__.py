"""Planning: the canonical plan from a state to a goal, or why there is none (semantics 4).

The planner sees `g` and `a` of pre- and postconditions, and nothing that is only for running.
"""

from scbm.planning.plan_answers import Answer, Limit, LimitReached, PlanLimits, SearchCancelledError, Solved, Unsolvable
from scbm.planning.plan_cache import PlanCache
from scbm.planning.plan_search import Reach, explore
from scbm.planning.plan_validation import PlanFlaw, find_flaw
from scbm.planning.planner import Planner
from scbm.planning.planners import DEFAULT_PLANNER, PLANNERS, PlanFunction, PlanProblem
from scbm.planning.planning_task import Task, system_of
from scbm.planning.policy import Policy

__all__ = [
    "DEFAULT_PLANNER",
    "PLANNERS",
    "Answer",
    "Limit",
    "LimitReached",
    "PlanCache",
    "PlanFlaw",
    "PlanFunction",
    "PlanLimits",
    "PlanProblem",
    "Planner",
    "Policy",
    "Reach",
    "SearchCancelledError",
    "Solved",
    "Task",
    "Unsolvable",
    "explore",
    "find_flaw",
    "system_of",
]
