"""Mutants: models changed in one small way each, to see whether the cases of a suite notice (decision 50).

A mutation operator is a class and an entry in `MUTATIONS`.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.testing.mutants.asserted_obligations import (
        NO_MUTANTS,
        AssertedObligation,
        AssertedObligations,
        Assertion,
        AssertionEvidence,
        MutantNotice,
    )
    from scbm.testing.mutants.mutant_results import MutantCounts, MutantResult, MutantStatus
    from scbm.testing.mutants.mutation import Mutant, MutatedPart, Mutation, SubjectKind
    from scbm.testing.mutants.mutation_runs import MutantUnderTest, MutationRuns
    from scbm.testing.mutants.mutations import MUTATIONS, OPERATORS_VERSION, mutants_of

__all__ = [
    "MUTATIONS",
    "NO_MUTANTS",
    "OPERATORS_VERSION",
    "AssertedObligation",
    "AssertedObligations",
    "Assertion",
    "AssertionEvidence",
    "Mutant",
    "MutantCounts",
    "MutantNotice",
    "MutantResult",
    "MutantStatus",
    "MutantUnderTest",
    "MutatedPart",
    "Mutation",
    "MutationRuns",
    "SubjectKind",
    "mutants_of",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "asserted_obligations": (
            "NO_MUTANTS AssertedObligation AssertedObligations Assertion AssertionEvidence MutantNotice"
        ),
        "mutant_results": "MutantCounts MutantResult MutantStatus",
        "mutation": "Mutant MutatedPart Mutation SubjectKind",
        "mutation_runs": "MutantUnderTest MutationRuns",
        "mutations": "MUTATIONS OPERATORS_VERSION mutants_of",
    },
)
