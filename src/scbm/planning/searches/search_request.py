"""The interface of searches for the canonical plan.

A search is prepared for one reduced system and one goal, and then answers for any start. All searches give the plan and
the status of the breadth-first search wherever that one decides within the limits.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.reduced_system import Coordinates, ReducedSystem
    from scbm.planning.plan_answers import Answer, PlanLimits, ShouldContinue


def no_shortcut() -> None:
    """Return no answer."""


class SearchRequest(Struct, frozen=True):
    """One search.

    Attributes:
        start: the state to plan from; the goal does not hold in it.
        limits: the limits of the search.
        should_continue: called at intervals; the search raises `SearchCancelledError` once it returns `False`.
        shortcut: called once by a search that has expanded many states; returns the answer if a short attempt of
            another engine finds it.
    """

    start: Coordinates
    limits: PlanLimits
    should_continue: ShouldContinue
    shortcut: Callable[[], Answer | None] = no_shortcut


class PlanSearch(Protocol):
    """Finds canonical plans to one goal."""

    def __init__(self, system: ReducedSystem, goal: NormalForm) -> None: ...

    def answer(self, request: SearchRequest) -> Answer:
        """Return the canonical plan, the proof that there is none, or the limit that ended the search."""
        ...


class SearchEntry(Struct, frozen=True):
    """A search, and the systems that it is made for.

    Attributes:
        suits: whether the search is made for a system of this shape under these limits.
        make: prepares the search for a system and a goal.
    """

    suits: Callable[[ReducedSystem, PlanLimits], bool]
    make: Callable[[ReducedSystem, NormalForm], PlanSearch]
