"""The results of mutants: a status for each, and the score (decision 50)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cases.coverage import Figure, MutantStatus

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.cases import Case
    from scbm.mutation.mutants import Mutant


@dataclass(frozen=True, slots=True)
class MutantResult:
    """The result of one mutant.

    Attributes:
        mutant: the mutant.
        status: its status.
        case: the name of the first case that killed it; empty if none did.
        reason: why that case failed, in one sentence; of others why they are undecided, or the witness does not kill.
        runs: the number of cases that were run.
        skipped: the number of cases whose run would have been the same as on the original.
        witness: of a mutant that survived a case whose run on it differs, with the recorded result of the original.
        is_benign: whether the mutant breaks no requirement in the run of the witness that the original keeps there.
        is_killable: whether the witness passes on the original and fails on the mutant.
        belongs: the obligations that the mutant belongs to, as bits.
        noticed: of these the ones that a case visits which kills the mutant; 0 unless `MutationRuns` looks for them.
    """

    mutant: Mutant
    status: MutantStatus
    case: str = ""
    reason: str = ""
    runs: int = 0
    skipped: int = 0
    witness: Case | None = None
    is_benign: bool = False
    is_killable: bool = False
    belongs: int = 0
    noticed: int = 0


@dataclass(frozen=True, slots=True)
class MutantCounts:
    """The number of mutants with each status.

    Attributes:
        killed, equivalent, survived, undecided: the number of mutants with that status.
    """

    killed: int = 0
    equivalent: int = 0
    survived: int = 0
    undecided: int = 0

    @staticmethod
    def of(results: Iterable[MutantResult]) -> MutantCounts:
        """Count the statuses of results."""
        counts = dict.fromkeys(MutantStatus, 0)
        for result in results:
            counts[result.status] += 1
        return MutantCounts(**{status.value: count for status, count in counts.items()})

    def of_status(self, status: MutantStatus) -> int:
        """Return the number of mutants with a status."""
        match status:
            case MutantStatus.KILLED:
                return self.killed
            case MutantStatus.EQUIVALENT:
                return self.equivalent
            case MutantStatus.SURVIVED:
                return self.survived
            case MutantStatus.UNDECIDED:
                return self.undecided

    @property
    def total(self) -> int:
        """The number of mutants."""
        return self.killed + self.equivalent + self.survived + self.undecided

    @property
    def score(self) -> Figure:
        """The killed mutants among all that are not equivalent; undecided ones count as not killed."""
        return Figure(self.killed, self.total - self.equivalent)
