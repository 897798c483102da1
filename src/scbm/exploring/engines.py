"""Which engine searches a box: its shape and the limits decide alone, so that it is the same everywhere."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from scbm.exploring.dense import DenseEngine
from scbm.exploring.hashed import HashedEngine
from scbm.exploring.layout import Layout

if TYPE_CHECKING:
    from scbm.exploring.box import Box
    from scbm.exploring.engine import Engine
    from scbm.exploring.limits import Limits

_MOST_BITS = 63
"""Of a code in an array."""


class EngineKind(Enum):
    """How a box can be searched."""

    DENSE = "the whole box at once, as one integer"
    ARRAYS = "level by level, in sorted arrays of codes"
    HASHED = "state by state, in dictionaries"


def suited(box: Box, limits: Limits) -> EngineKind:
    """The engine that is made for boxes of this shape."""
    if DenseEngine.suits(box, limits):
        return EngineKind.DENSE
    return EngineKind.ARRAYS if Layout.fields(box.counts).size <= 1 << _MOST_BITS else EngineKind.HASHED


def engine_of(kind: EngineKind, box: Box, limits: Limits) -> Engine:
    """An engine for the box. Raises `LimitExceededError` if it would need too much memory from the beginning."""
    match kind:
        case EngineKind.DENSE:
            return DenseEngine(box, limits)
        case EngineKind.HASHED:
            return HashedEngine(box, limits)
        case EngineKind.ARRAYS:
            # It brings numpy, which takes longer to load than all other rooms, and few systems need it.
            from scbm.exploring.arrays import ArrayEngine  # noqa: PLC0415

            return ArrayEngine(box, limits)
