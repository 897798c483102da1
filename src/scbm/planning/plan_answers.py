"""The three answers to a planning problem. They are never one boolean (semantics 4.1)."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, ClassVar, TypeAlias

if TYPE_CHECKING:
    from collections.abc import Callable

    ShouldContinue: TypeAlias = Callable[[], bool]


class Limit(StrEnum):
    """The limit that ended a search."""

    LENGTH = "plan length"
    EXPANSIONS = "expanded states"


@dataclass(frozen=True, slots=True)
class PlanLimits:
    """The limits of a search. None is a time: the same problem has the same answer on every machine.

    Attributes:
        length: the maximum number of operations of a plan; p_max in the paper.
        expansions: the maximum number of states that are expanded.
    """

    length: int = 1_000
    expansions: int = 1_000_000


@dataclass(frozen=True, slots=True)
class Solved:
    """A plan exists, and this is the canonical one.

    Attributes:
        plan: the names of its operations, in order; empty if the goal already holds.
        expanded: the number of expanded states.
    """

    status: ClassVar[str] = "solved"
    plan: tuple[str, ...]
    expanded: int


@dataclass(frozen=True, slots=True)
class Unsolvable:
    """No plan exists: every reachable state was expanded.

    Attributes:
        expanded: the number of expanded states, which is the number of reachable states.
    """

    status: ClassVar[str] = "unsolvable"
    expanded: int


@dataclass(frozen=True, slots=True)
class LimitReached:
    """Neither a plan nor a proof that there is none was found within the limits.

    Attributes:
        limit: the limit that ended the search.
        expanded: the number of expanded states.
    """

    status: ClassVar[str] = "limit_reached"
    limit: Limit
    expanded: int


Answer: TypeAlias = Solved | Unsolvable | LimitReached


class SearchCancelledError(Exception):
    """The caller cancelled a search. There is no answer, and nothing is cached."""


def always() -> bool:
    """Return `True`: a search that is never cancelled."""
    return True


def raise_if_cancelled(should_continue: ShouldContinue) -> None:
    """Raise `SearchCancelledError` if the caller has cancelled the search."""
    if not should_continue():
        raise SearchCancelledError
