"""Which cases visit each obligation, and which alone: counted once, as several pages ask."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.coverage import visitors_of_each

if TYPE_CHECKING:
    from scbm.coverage import Obligation, Obligations
    from scbm.storing import History


@dataclass(frozen=True, slots=True)
class Visitors:
    """The cases that visit each obligation, as indices into `History.cases`, in their order."""

    obligations: Obligations
    by_bit: tuple[tuple[int, ...], ...]

    @staticmethod
    def of(history: History) -> Visitors:
        """One pass over all cases."""
        return Visitors(history.obligations, visitors_of_each(history.coverage))

    def visiting(self, obligation: Obligation) -> tuple[int, ...]:
        """The cases that visit an obligation of the model."""
        return self.by_bit[self.obligations.bit(obligation).bit_length() - 1]
