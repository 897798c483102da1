"""SCBM-IAS: which obligations of a model its runs have visited (paper, Section V; semantics 8).

Reads traces, counts, adds up. Never runs anything and never prints.
"""

from scbm.coverage.contexts import only_by, visitors_of_each
from scbm.coverage.cover import Cover, smallest_cover
from scbm.coverage.coverage import Coverage
from scbm.coverage.figures import Figure
from scbm.coverage.growth import Step, growth
from scbm.coverage.hits import visited_by
from scbm.coverage.obligations import STATE_ASPECTS, Aspect, Obligation, Obligations
from scbm.coverage.sets import bits_of
from scbm.coverage.thresholds import KINDS, Threshold

__all__ = [
    "KINDS",
    "STATE_ASPECTS",
    "Aspect",
    "Cover",
    "Coverage",
    "Figure",
    "Obligation",
    "Obligations",
    "Step",
    "Threshold",
    "bits_of",
    "growth",
    "only_by",
    "smallest_cover",
    "visited_by",
    "visitors_of_each",
]
