"""Coverage SCBM-IAS: the obligations of a model that its runs have visited (paper, Section V; semantics 8).

This package reads traces and counts; it runs nothing and prints nothing.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.cases.coverage.asserted_obligations import (
        NO_MUTANTS,
        AssertedObligation,
        AssertedObligations,
        Assertion,
        AssertionEvidence,
        MutantNotice,
        MutantStatus,
    )
    from scbm.cases.coverage.coverage_thresholds import ASSERTED, COVERABLE, KINDS, LIFTED, Threshold
    from scbm.cases.coverage.lifted_obligations import (
        InstanceFolds,
        LiftedStatus,
        LiftedStatuses,
        ObjectListVisits,
        first_missed,
        instances_of,
        lifted_names,
    )
    from scbm.cases.coverage.obligations import STATE_ASPECTS, Aspect, Figure, Obligation, Obligations
    from scbm.cases.coverage.proof_engines import count_engines, engine_counts_in_words, engine_words
    from scbm.cases.coverage.set_cover import Cover, smallest_cover
    from scbm.cases.coverage.statuses import (
        FORCED_NOTE,
        Decision,
        ObligationStatus,
        Statuses,
        StatusProof,
        WaiverReview,
        count_statuses,
        coverable_figure,
        forced_count_in_words,
        status_counts_in_words,
        visits_in_words,
    )
    from scbm.cases.coverage.visits import (
        Coverage,
        GrowthStep,
        Unnamed,
        bits_of,
        growth,
        only_by,
        visited_by,
        visitors_of_each,
    )

__all__ = [
    "ASSERTED",
    "COVERABLE",
    "FORCED_NOTE",
    "KINDS",
    "LIFTED",
    "NO_MUTANTS",
    "STATE_ASPECTS",
    "Aspect",
    "AssertedObligation",
    "AssertedObligations",
    "Assertion",
    "AssertionEvidence",
    "Cover",
    "Coverage",
    "Decision",
    "Figure",
    "GrowthStep",
    "InstanceFolds",
    "LiftedStatus",
    "LiftedStatuses",
    "MutantNotice",
    "MutantStatus",
    "ObjectListVisits",
    "Obligation",
    "ObligationStatus",
    "Obligations",
    "StatusProof",
    "Statuses",
    "Threshold",
    "Unnamed",
    "WaiverReview",
    "bits_of",
    "count_engines",
    "count_statuses",
    "coverable_figure",
    "engine_counts_in_words",
    "engine_words",
    "first_missed",
    "forced_count_in_words",
    "growth",
    "instances_of",
    "lifted_names",
    "only_by",
    "smallest_cover",
    "status_counts_in_words",
    "visited_by",
    "visitors_of_each",
    "visits_in_words",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "asserted_obligations": (
            "NO_MUTANTS AssertedObligation AssertedObligations Assertion AssertionEvidence MutantNotice MutantStatus"
        ),
        "lifted_obligations": (
            "InstanceFolds LiftedStatus LiftedStatuses ObjectListVisits first_missed instances_of lifted_names"
        ),
        "obligations": "STATE_ASPECTS Aspect Figure Obligation Obligations",
        "proof_engines": "count_engines engine_counts_in_words engine_words",
        "coverage_thresholds": "ASSERTED COVERABLE KINDS LIFTED Threshold",
        "set_cover": "Cover smallest_cover",
        "statuses": (
            "FORCED_NOTE Decision ObligationStatus Statuses StatusProof WaiverReview count_statuses coverable_figure "
            "forced_count_in_words status_counts_in_words visits_in_words"
        ),
        "visits": "Coverage GrowthStep Unnamed bits_of growth only_by visited_by visitors_of_each",
    },
)
