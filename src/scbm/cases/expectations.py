"""What a case expects to come of its run."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.coverage import Obligation
    from scbm.model import Predicate
    from scbm.trace import End


@dataclass(frozen=True, slots=True)
class Expectations:
    """What must be true afterwards; what is empty or `None` is not asked.

    Attributes:
        verdict: how the run ends.
        plan: the operations of the first plan, all of them.
        order: operations that complete in this order; others may complete between them.
        final: predicates over the state at the end.
        visits: obligations that the run visits.
    """

    verdict: End | None = None
    plan: tuple[str, ...] | None = None
    order: tuple[str, ...] = ()
    final: tuple[Predicate, ...] = ()
    visits: tuple[Obligation, ...] = ()
