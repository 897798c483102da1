"""Which states a system of moves can reach, and how far each is from a goal; exactly, and for all states at once.

Knows `model`, and nothing of operations, runners or cases. What explores has a door of its own,
`scbm.exploring.exploration`: planning passes here whenever `scbm` starts, and needs the engines for large models only.
"""

from scbm.exploring.limits import Bound, Exceeded, Limits
from scbm.exploring.on_demand import DistancesOnDemand
from scbm.exploring.relevance import may_leave, narrowed, relevant
from scbm.exploring.system import Move, Part, Region, System

__all__ = [
    "Bound",
    "DistancesOnDemand",
    "Exceeded",
    "Limits",
    "Move",
    "Part",
    "Region",
    "System",
    "may_leave",
    "narrowed",
    "relevant",
]
