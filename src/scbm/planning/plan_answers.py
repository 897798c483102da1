"""The three answers to a planning problem. They are never one boolean (semantics 4.1)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, ClassVar, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable

    Wanted: TypeAlias = Callable[[], bool]


class Limit(StrEnum):
    """What made a search give up."""

    LENGTH = "plan length"
    EXPANSIONS = "expanded states"


@dataclass(frozen=True, slots=True)
class PlanLimits:
    """How far a search may go. Never a time: the same problem has the same answer on every machine.

    Attributes:
        length: the paper's p_max, the most operations that a plan may have.
        expansions: the most states whose successors may be looked at.
    """

    length: int = 1_000
    expansions: int = 1_000_000


@dataclass(frozen=True, slots=True)
class Solved:
    """A plan exists, and this is the canonical one.

    Attributes:
        plan: the names of its operations, in order; empty if the goal holds already.
        expanded: states whose successors were looked at.
    """

    status: ClassVar[str] = "solved"
    plan: tuple[str, ...]
    expanded: int


@dataclass(frozen=True, slots=True)
class Unsolvable:
    """No plan exists: every state that can be reached was looked at.

    Attributes:
        expanded: states whose successors were looked at; here all that can be reached.
    """

    status: ClassVar[str] = "unsolvable"
    expanded: int


@dataclass(frozen=True, slots=True)
class LimitReached:
    """Neither a plan nor a proof that there is none, within the limits.

    Attributes:
        limit: which limit ended the search.
        expanded: states whose successors were looked at.
    """

    status: ClassVar[str] = "limit_reached"
    limit: Limit
    expanded: int


Answer: TypeAlias = Solved | Unsolvable | LimitReached


class SearchCancelledError(Exception):
    """A search was stopped, as nobody wants its answer any more. So there is none, and nothing is known by it."""


def always() -> bool:
    """Every answer is wanted."""
    return True


def raise_if_cancelled(is_wanted: Wanted) -> None:
    """Raises `SearchCancelledError` if nobody wants the answer any more."""
    if not is_wanted():
        raise SearchCancelledError
