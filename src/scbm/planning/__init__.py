"""Which operations lead from a state to a goal: the canonical plan, or why there is none (semantics 4).

Sees a model as the planner does: `g` and `a` of pre- and postconditions, and nothing that is only for running.
"""

from scbm.planning.answers import Answer, Limit, LimitReached, PlanLimits, Solved, Unsolvable, UnwantedError
from scbm.planning.planner import Planner
from scbm.planning.policy import Policy
from scbm.planning.reachability import Reach, explore
from scbm.planning.remembered import RememberedPlans
from scbm.planning.system import system_of
from scbm.planning.task import Task
from scbm.planning.validation import Flaw, find_flaw

__all__ = [
    "Answer",
    "Flaw",
    "Limit",
    "LimitReached",
    "PlanLimits",
    "Planner",
    "Policy",
    "Reach",
    "RememberedPlans",
    "Solved",
    "Task",
    "Unsolvable",
    "UnwantedError",
    "explore",
    "find_flaw",
    "system_of",
]
