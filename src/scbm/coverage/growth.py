"""How coverage grew, case by case."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.coverage.coverage import Coverage
    from scbm.coverage.figures import Figure
    from scbm.coverage.obligations import Obligation


@dataclass(frozen=True, slots=True)
class Step:
    """A case that added to the figure.

    Attributes:
        number: its place among the cases, from 1.
        case: its name.
        added: the obligations in the figure that it visited first.
        figure: the figure of all cases up to it.
    """

    number: int
    case: str
    added: tuple[Obligation, ...]
    figure: Figure


def growth(coverage: Coverage) -> Iterator[Step]:
    """The cases that added to the figure, in the order in which they were run."""
    obligations = coverage.obligations
    counted = obligations.counted
    union = 0
    for number, (case, visited) in enumerate(coverage.cases, start=1):
        new = visited & counted & ~union
        if new:
            union |= new
            added = tuple(obligation for obligation in obligations if obligations.bit(obligation) & new)
            yield Step(number, case, added, obligations.figure(union))
