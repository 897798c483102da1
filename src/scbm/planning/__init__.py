"""Planning: a plan from a state to a goal, or why there is none (semantics 4).

The planner uses `g` and `a` of pre- and postconditions; it ignores `gr`, `ar` and everything else that only runs use.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.planning.drawn_plans import DrawnPlans, PreferredPlans, ShortestPlans
    from scbm.planning.plan_answers import (
        Answer,
        Limit,
        LimitReached,
        NoPlanFound,
        PlanFlaw,
        PlanLimits,
        PlanRefusedError,
        SearchCancelledError,
        Solved,
        Unsolvable,
        find_flaw,
    )
    from scbm.planning.plan_search import Reach, explore
    from scbm.planning.planner import PlanCache, Planner, PlanSource, recorded_answer
    from scbm.planning.planners import (
        DEFAULT_PLANNER,
        DRAWN_PLANS,
        PLANNERS,
        PlanFunction,
        PlannerEntry,
        model_planned_by,
        model_with_plans,
        planner_of,
        planner_of_random_runs,
    )
    from scbm.planning.planning_task import PlanProblem, Task, system_of
    from scbm.planning.policy import Policy

__all__ = [
    "DEFAULT_PLANNER",
    "DRAWN_PLANS",
    "PLANNERS",
    "Answer",
    "DrawnPlans",
    "Limit",
    "LimitReached",
    "NoPlanFound",
    "PlanCache",
    "PlanFlaw",
    "PlanFunction",
    "PlanLimits",
    "PlanProblem",
    "PlanRefusedError",
    "PlanSource",
    "Planner",
    "PlannerEntry",
    "Policy",
    "PreferredPlans",
    "Reach",
    "SearchCancelledError",
    "ShortestPlans",
    "Solved",
    "Task",
    "Unsolvable",
    "explore",
    "find_flaw",
    "model_planned_by",
    "model_with_plans",
    "planner_of",
    "planner_of_random_runs",
    "recorded_answer",
    "system_of",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "drawn_plans": "DrawnPlans PreferredPlans ShortestPlans",
        "plan_answers": (
            "Answer Limit LimitReached NoPlanFound PlanFlaw PlanLimits PlanRefusedError SearchCancelledError "
            "Solved Unsolvable find_flaw"
        ),
        "plan_search": "Reach explore",
        "planner": "PlanCache Planner PlanSource recorded_answer",
        "planners": (
            "DEFAULT_PLANNER DRAWN_PLANS PLANNERS PlanFunction PlannerEntry model_planned_by "
            "model_with_plans planner_of planner_of_random_runs"
        ),
        "planning_task": "PlanProblem Task system_of",
        "policy": "Policy",
    },
)
