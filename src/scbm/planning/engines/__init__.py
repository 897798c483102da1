"""Exploration: the states that a transition system reaches, and the distance of each from a goal; exact.

Imports `model` alone. The engines themselves are imported from `scbm.planning.engines.exploration`: every start of
`scbm` imports this package, and only large models need the engines.
"""

from scbm.planning.engines.breadth_first import DistancesOnDemand
from scbm.planning.engines.engine import Exceeded, ExplorationBound, ExplorationLimits
from scbm.planning.engines.transition_system import (
    Move,
    MovePart,
    Region,
    TransitionSystem,
    may_leave,
    narrowed,
    relevant,
)

__all__ = [
    "DistancesOnDemand",
    "Exceeded",
    "ExplorationBound",
    "ExplorationLimits",
    "Move",
    "MovePart",
    "Region",
    "TransitionSystem",
    "may_leave",
    "narrowed",
    "relevant",
]
