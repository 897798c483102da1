"""Which states a system of moves can reach, and how far each is from a goal; exactly, and for all states at once.

Knows `model`, and nothing of operations, runners or cases.
"""

from scbm.exploring.engines import EngineKind
from scbm.exploring.exploration import Exploration, Found, Unreachable
from scbm.exploring.limits import Bound, Exceeded, Limits
from scbm.exploring.on_demand import DistancesOnDemand
from scbm.exploring.reached import Distances, Reached
from scbm.exploring.relevance import narrowed, relevant
from scbm.exploring.system import Move, Part, Region, System

__all__ = [
    "Bound",
    "Distances",
    "DistancesOnDemand",
    "EngineKind",
    "Exceeded",
    "Exploration",
    "Found",
    "Limits",
    "Move",
    "Part",
    "Reached",
    "Region",
    "System",
    "Unreachable",
    "narrowed",
    "relevant",
]
