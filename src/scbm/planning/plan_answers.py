"""The four answers to a planning problem, and a check that a plan is valid.

The answers are never one boolean (semantics 4.1). The check replays a plan step by step on named states, independent of
the planner.
"""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING, ClassVar, TypeAlias

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate, Value

    ShouldContinue: TypeAlias = Callable[[], bool]


class Limit(StrEnum):
    """The limit that ended a search."""

    LENGTH = "plan length"
    EXPANSIONS = "expanded states"
    TIME = "time"
    MEMORY = "memory"


class PlanLimits(Struct, frozen=True):
    """The limits of a search. With the first two alone, the same problem has the same answer on every machine.

    Attributes:
        length: the maximum number of operations of a plan; p_max in the paper.
        expansions: the maximum number of states that are expanded, for each end of each engine of the canonical search;
            planners that are other programs do not know it.
        time_ns: the maximum wall time, in nanoseconds; `None` for no limit, and for the default of another program.
        memory_bytes: the maximum memory of the process; `None` for no limit.
    """

    length: int = 1_000
    expansions: int = 1_000_000
    time_ns: int | None = None
    memory_bytes: int | None = None

    @staticmethod
    def of(model: BehaviorModel) -> PlanLimits:
        """Return the limits that a model sets, and the default for others."""
        choice, default = model.planner, PlanLimits()
        return PlanLimits(
            default.length if choice.max_length is None else choice.max_length,
            default.expansions if choice.max_expanded is None else choice.max_expanded,
        )


class Solved(Struct, frozen=True):
    """A plan exists, and this is one; which one, the planner decides.

    Attributes:
        plan: the names of its operations, in order; empty if the goal already holds.
        expanded: the number of expanded states.
    """

    status: ClassVar[str] = "solved"
    plan: tuple[str, ...]
    expanded: int


class Unsolvable(Struct, frozen=True):
    """No plan exists; this is proved.

    Attributes:
        expanded: the number of expanded states; a proof may need fewer than all reachable states.
    """

    status: ClassVar[str] = "unsolvable"
    expanded: int


class LimitReached(Struct, frozen=True):
    """Neither a plan nor a proof that there is none was found within the limits.

    Attributes:
        limit: the limit that ended the search.
        expanded: the number of expanded states.
    """

    status: ClassVar[str] = "limit_reached"
    limit: Limit
    expanded: int


class NoPlanFound(Struct, frozen=True):
    """An incomplete search ended without a plan. A plan may exist nevertheless, whatever the limits are.

    Attributes:
        expanded: the number of expanded states.
    """

    status: ClassVar[str] = "no_plan_found"
    expanded: int


Answer: TypeAlias = Solved | Unsolvable | LimitReached | NoPlanFound
"""The result of a search for a plan."""


class SearchCancelledError(Exception):
    """The caller cancelled a search. There is no answer, and nothing is cached."""


class PlanRefusedError(Exception):
    """A source of plans does not answer a question: the search would take more than its caller allows."""


def always() -> bool:
    """Return `True`: a search that is never cancelled."""
    return True


def raise_if_cancelled(should_continue: ShouldContinue) -> None:
    """Raise `SearchCancelledError` if the caller has cancelled the search."""
    if not should_continue():
        raise SearchCancelledError


class PlanFlaw(Struct, frozen=True):
    """Why a plan is invalid.

    Attributes:
        step: the index of the operation that is not enabled; the length of the plan if the goal does not hold at its
            end.
        reason: one sentence.
    """

    step: int
    reason: str


class PlanValidator:
    """Replays plans of one model on named states; shares no code with the planners."""

    def __init__(self, model: BehaviorModel) -> None:
        self._operations = {operation.name: operation for operation in model.operations}
        self._domains = {variable.name: variable.domain for variable in model.running_space}
        self._world = tuple(variable.name for variable in model.running_space if not variable.role.is_runner)
        self._rest = {variable.name: variable.initial for variable in model.running_space if variable.role.is_runner}

    def find_flaw(self, state: Mapping[str, Value], goal: Predicate, plan: Sequence[str]) -> PlanFlaw | None:
        """Return the first flaw of a plan from `state` to `goal`; `None` if the plan is valid (semantics 3.3)."""
        now = {name: state[name] for name in self._world} | self._rest
        for step, name in enumerate(plan):
            if name not in self._operations:
                return PlanFlaw(step, f"the model has no operation {name}")
            operation = self._operations[name]
            for part, words, does in (
                (operation.pre, "precondition", "starting"),
                (operation.post, "postcondition", "completing"),
            ):
                if not part.g.holds(now):
                    return PlanFlaw(step, f"the {words} of {name} does not hold: {part.g}")
                changes = {action.target: action.value(now) for action in part.a}
                if any(value not in self._domains[target] for target, value in changes.items()):
                    return PlanFlaw(step, f"{does} {name} leaves a domain")
                now.update(changes)
        return None if goal.holds(now) else PlanFlaw(len(plan), f"the goal does not hold at the end: {goal}")


def find_flaw(
    model: BehaviorModel, state: Mapping[str, Value], goal: Predicate, plan: Sequence[str]
) -> PlanFlaw | None:
    """Return the first flaw of a plan from `state` to `goal`; `None` if the plan is valid (semantics 3.3)."""
    return PlanValidator(model).find_flaw(state, goal, plan)
