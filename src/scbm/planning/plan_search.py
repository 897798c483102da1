"""The planner's search for the canonical plan: the first that a breadth-first search finds (semantics 4.2).

The breadth-first search on packed states decides small problems. Where it has expanded `MAX_PLAIN` states, the delete
relaxation reduces the problem, and an engine of `SEARCHES` decides it. The shape of the problem and the limits choose
the engine, so answers are the same on every machine. Where an engine meets the limit on expanded states, the next one
that suits goes on. To add an engine: a class with the methods of `PlanSearch`, and an entry in `SEARCHES`.
"""

from __future__ import annotations

from bisect import bisect_right
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.planning.engines.breadth_first import BreadthFirst
from scbm.planning.plan_answers import (
    Answer,
    Limit,
    LimitReached,
    PlanLimits,
    Solved,
    Unsolvable,
    always,
    raise_if_cancelled,
)
from scbm.planning.searches import SearchEntry, SearchRequest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.reduced_system import ReducedSystem
    from scbm.planning.plan_answers import ShouldContinue
    from scbm.planning.planning_task import Problem, Task
    from scbm.planning.searches import PlanSearch

MAX_PLAIN = 256
"""Number of states that the breadth-first search on packed states expands before an engine takes over.

It is the fastest for so few states: the successors of states are cached, and nothing has to be prepared.
"""

_MAX_SHORTCUT = 500
"""Number of states that an informed search may evaluate as a shortcut: it finds the plan where its bound is exact."""

POLL_INTERVAL = 1_000
"""Number of expanded states after which a search asks again whether it is cancelled."""

_EXPLORED_AT_ONCE = 100
"""Number of states that an exploration expands before it counts again; each may have many successors."""


class Reach(Struct, frozen=True):
    """The planning states that were found reachable.

    Attributes:
        states: packed states, in the order of discovery.
        complete: whether these are all; `False` if the limit ended the exploration.
    """

    states: tuple[int, ...]
    complete: bool


def explore(task: Task, starts: Iterable[int], limit: int, progress: Callable[[int], None] | None = None) -> Reach:
    """Return the states that operations reach from `starts`; no more are expanded once there are more than `limit`.

    `progress` is called at intervals with the number of states found so far.
    """
    search = BreadthFirst(starts, task.successors)
    while search.frontier and len(search.states) <= limit:
        search.expand(search.expanded + _EXPLORED_AT_ONCE)
        if progress is not None:
            progress(len(search.states))
    return Reach(tuple(search.states[: limit + 1]), not search.frontier)


def brief_answer(
    problem: Problem, start: int, limits: PlanLimits, should_continue: ShouldContinue = always
) -> Answer | None:
    """Return the answer of `search_plan` if its first part finds it; `None` if the search would go on for longer."""
    try:
        return search_plan(problem, start, limits, should_continue, briefly=True)
    except LongSearchError:
        return None


def search_plan(  # noqa: PLR0913 - a problem with limits, and which part of the search to use
    problem: Problem,
    start: int,
    limits: PlanLimits,
    should_continue: ShouldContinue = always,
    engine: str | None = None,
    *,
    briefly: bool = False,
) -> Answer:
    """Return the canonical plan from a packed state, or why there is none.

    Args:
        problem: the goal and the packed task.
        start: the state to plan from.
        limits: the limits of the search.
        should_continue: called at intervals; `SearchCancelledError` is raised once it returns `False`.
        engine: the name of the one engine to use, to compare engines; by default the first one that suits.
        briefly: whether the search ends after its first part, which takes a fraction of a second.

    Raises:
        SearchCancelledError: the search was cancelled.
        LongSearchError: the first part has not found the answer, with `briefly`.
    """
    if problem.is_goal(start):
        return Solved((), 0)
    if engine is None:
        plain = PlanLimits(limits.length, min(limits.expansions, MAX_PLAIN))
        answer = breadth_first(problem, start, plain, should_continue)
        if limits.expansions <= MAX_PLAIN or not _has_spent_expansions(answer):
            return answer
    system = problem.task.reduced(start)
    goal = system.condition(problem.goal)
    if goal is False:
        return Unsolvable(0 if engine else MAX_PLAIN)
    coordinates = system.coordinates(problem.task.packing.values(start))
    assert coordinates is not None  # noqa: S101 - the reduced system has all states that are reachable from the start
    engines = _Engines(problem, system, goal, SearchRequest(coordinates, limits, should_continue))
    if engine is not None:
        return engines.one(engine)
    return engines.briefly() if briefly else engines.all()


class LongSearchError(Exception):
    """A search has not found its answer in its first part."""


class _Engines:
    """The engines of `SEARCHES` on one problem."""

    def __init__(self, problem: Problem, system: ReducedSystem, goal: NormalForm, request: SearchRequest) -> None:
        self._problem = problem
        self._system = system
        self._goal = goal
        self._request = request

    def one(self, name: str, request: SearchRequest | None = None) -> Answer:
        """Return the answer of one engine."""
        search = self._problem.prepared(name, self._system, self._goal, SEARCHES[name].make)
        return search.answer(request or self._request)

    def all(self) -> Answer:
        """Return the answer of the first engine that suits and stays within the limit on expanded states."""
        request = replace(self._request, shortcut=self._shortcut)
        answer: Answer = LimitReached(Limit.EXPANSIONS, 0)
        for name in SEARCHES:
            if self._suits(name) and _has_spent_expansions(answer):
                found = self.one(name, request)
                answer = replace(found, expanded=answer.expanded + found.expanded)
        return answer

    def briefly(self) -> Answer:
        """Return the answer of the first engine that suits; raise `LongSearchError` where its shortcut fails."""

        def shortcut() -> Answer:
            answer = self._shortcut()
            if answer is None:
                raise LongSearchError
            return answer

        first = next(name for name in SEARCHES if self._suits(name))
        return self.one(first, replace(self._request, shortcut=shortcut))

    def _suits(self, name: str) -> bool:
        return SEARCHES[name].suits(self._system, self._request.limits)

    def _shortcut(self) -> Answer | None:
        """Return the answer of the informed search if it needs few states."""
        if not self._suits("informed"):
            return None
        limits = PlanLimits(self._request.limits.length, _MAX_SHORTCUT)
        answer = self.one("informed", replace(self._request, limits=limits))
        return None if _has_spent_expansions(answer) else answer


def _has_spent_expansions(answer: Answer) -> bool:
    return isinstance(answer, LimitReached) and answer.limit is Limit.EXPANSIONS


def _dense_search(system: ReducedSystem, goal: NormalForm) -> PlanSearch:
    from scbm.planning.searches.dense_search import DenseSearch  # noqa: PLC0415 - few problems need an engine

    return DenseSearch(system, goal)


def _suits_dense_search(system: ReducedSystem, limits: PlanLimits) -> bool:
    from scbm.planning.searches.dense_search import DenseSearch  # noqa: PLC0415 - as above

    return DenseSearch.suits(system, limits)


def _array_search(system: ReducedSystem, goal: NormalForm) -> PlanSearch:
    # It loads numpy, which takes longer than all other packages together, and few problems need it.
    from scbm.planning.searches.array_search import ArraySearch  # noqa: PLC0415

    return ArraySearch(system, goal)


def _informed_search(system: ReducedSystem, goal: NormalForm) -> PlanSearch:
    from scbm.planning.searches.informed_search import InformedSearch  # noqa: PLC0415 - as above

    return InformedSearch(system, goal)


def _suits_informed_search(system: ReducedSystem, limits: PlanLimits) -> bool:
    from scbm.planning.searches.informed_search import InformedSearch  # noqa: PLC0415 - as above

    return InformedSearch.suits(system, limits)


def _suits_all(_: ReducedSystem, __: PlanLimits) -> bool:
    return True


SEARCHES: dict[str, SearchEntry] = {
    "dense": SearchEntry(_suits_dense_search, _dense_search),
    "arrays": SearchEntry(_suits_all, _array_search),
    "informed": SearchEntry(_suits_informed_search, _informed_search),
}
"""The engines by name. The first one that suits a problem searches for its plan; at its limit the next one does."""


def breadth_first(problem: Problem, start: int, limits: PlanLimits, should_continue: ShouldContinue = always) -> Answer:
    """Return the answer of the breadth-first search on packed states; the goal does not hold at the start."""
    task, is_goal = problem.task, problem.is_goal
    search = BreadthFirst((start,), task.successors)
    levels = _Levels(search)
    while search.frontier:
        expanded = search.expanded
        if expanded == limits.expansions:
            return LimitReached(Limit.EXPANSIONS, expanded)
        if expanded and expanded % POLL_INTERVAL == 0:
            raise_if_cancelled(should_continue)
        until = min(limits.expansions, expanded + POLL_INTERVAL - expanded % POLL_INTERVAL)
        if expanded < limits.length:  # no path is longer than the number of states expanded before its end
            goal = search.expand(min(until, limits.length), is_goal)
        elif levels.advance() < limits.length:
            goal = search.expand(min(until, levels.end), is_goal)
        elif search.expand(min(until, levels.end), _any_state) is not None:
            return LimitReached(Limit.LENGTH, search.expanded)
        else:
            goal = None
        if goal is not None:
            return Solved(tuple(task.operations[action] for action in search.actions_to(goal)), search.expanded)
    return Unsolvable(search.expanded)


class _Levels:
    """The levels of a search: all states at one distance from the start.

    Attributes:
        end: the number of states up to the end of the present level.
    """

    def __init__(self, search: BreadthFirst[int, int]) -> None:
        self.end = 0
        self._search = search
        self._depth = 0

    def advance(self) -> int:
        """Return the distance of the state that is expanded next, and set `end` to the end of its level."""
        states, expanded = self._search.states, self._search.expanded
        if not self.end:
            self._depth = self._search.depth(states[expanded])
            self.end = bisect_right(states, self._depth, lo=expanded, key=self._search.depth)
        elif expanded == self.end:
            self._depth, self.end = self._depth + 1, len(states)
        return self._depth


def _any_state(_: int) -> bool:
    return True
