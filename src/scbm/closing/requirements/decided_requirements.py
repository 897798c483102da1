"""The decisions about built-in requirements: they hold, are violated by a case, are undecided, or are switched off."""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.testing import Execution


class RequirementStatus(StrEnum):
    """The answer of closing about a built-in requirement."""

    HOLDS = "holds"
    VIOLATED = "violated"
    UNDECIDED = "undecided"
    OFF = "off"


@dataclass(frozen=True, slots=True)
class DecidedRequirement:
    """The decision about one built-in requirement.

    Attributes:
        name: its name.
        status: the decision.
        reason: in which runs it holds, how the case violates it, what ended the search, or why it is switched off.
        case: the name of the case that violates it; `None` if it is not violated.
        execution: the run of that case, if it is a new one.
        option: the option of `scbm close` that raises the limit that ended the search, if there is one.
    """

    name: str
    status: RequirementStatus
    reason: str
    case: str | None = None
    execution: Execution | None = None
    option: str | None = None


@dataclass(frozen=True, slots=True)
class RequirementDecisions:
    """The decisions about all built-in requirements of a model.

    Attributes:
        decided: one decision for each, in the order of `BUILT_INS`.
        situations: the number of situations of runs that were explored.
        assumptions: what those that hold assume, one sentence each.
        is_interrupted: whether the user ended the search.
    """

    decided: tuple[DecidedRequirement, ...]
    situations: int = 0
    assumptions: tuple[str, ...] = ()
    is_interrupted: bool = False

    @property
    def is_open(self) -> bool:
        """Whether a requirement is undecided."""
        return any(each.status is RequirementStatus.UNDECIDED for each in self.decided)
