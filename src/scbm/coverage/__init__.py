"""SCBM-IAS: which obligations of a model its runs have visited (paper, Section V; semantics 8).

Reads traces, counts, adds up. Never runs anything and never prints.
"""

from scbm.coverage.coverage import Coverage
from scbm.coverage.figures import Figure
from scbm.coverage.hits import visited_by
from scbm.coverage.obligations import STATE_ASPECTS, Aspect, Obligation, Obligations

__all__ = ["STATE_ASPECTS", "Aspect", "Coverage", "Figure", "Obligation", "Obligations", "visited_by"]
