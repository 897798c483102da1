"""Mutants: models changed in one small way each, to see whether the cases of a suite notice (decision 50).

No other package imports this one: the command line names the module of its verb as text. The rows of mutants in a store
belong to `store`, and what they say about obligations to `cases.coverage`.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.mutation.distinct_mutants import mutants_of
    from scbm.mutation.mutant_results import MutantCounts, MutantResult
    from scbm.mutation.mutants import Mutant, MutatedPart, SubjectKind
    from scbm.mutation.mutation_operators import MUTATIONS, MutationOperator
    from scbm.mutation.mutation_runs import MutantUnderTest, MutationRuns

__all__ = [
    "MUTATIONS",
    "Mutant",
    "MutantCounts",
    "MutantResult",
    "MutantUnderTest",
    "MutatedPart",
    "MutationOperator",
    "MutationRuns",
    "SubjectKind",
    "mutants_of",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "distinct_mutants": "mutants_of",
        "mutant_results": "MutantCounts MutantResult",
        "mutants": "Mutant MutatedPart SubjectKind",
        "mutation_operators": "MUTATIONS MutationOperator",
        "mutation_runs": "MutantUnderTest MutationRuns",
    },
)
