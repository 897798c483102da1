"""The way that a run goes: where it begins, and what happens in it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.closing.graph import Start
    from scbm.closing.situations import Happening


@dataclass(frozen=True, slots=True)
class Way:
    """A run from its beginning, as far as it is decided.

    Attributes:
        start: the initial state.
        happenings: replies, deadlines that pass, answers of the planner, in order.
    """

    start: Start
    happenings: tuple[Happening, ...]
