"""The results of mutants: a status for each, and the score (decision 50)."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import Figure, MutantStatus
from scbm.files import read_case, write_case
from scbm.store import StoredMutant

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.cases import Case
    from scbm.model import BehaviorModel
    from scbm.mutation.mutants import Mutant


class MutantResult(Struct, frozen=True):
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

    def stored(self, model: BehaviorModel, limits: str | None = None) -> StoredMutant:
        """Return the result as a store and other processes have it: with the name of the mutant.

        Args:
            model: the original.
            limits: the limits under which it was decided, as text; `None` if it was not.
        """
        witness = None if self.witness is None else write_case(self.witness, model, None)
        return StoredMutant(
            self.mutant.name, self.status, self.case, self.reason, self.runs, self.skipped,
            self.belongs, self.noticed, limits, witness, self.is_benign, self.is_killable,
        )  # fmt: skip

    @staticmethod
    def of_stored(stored: StoredMutant, mutant: Mutant, model: BehaviorModel) -> MutantResult:
        """Return the result of the mutant with this name. Raise `InputError` if its witness cannot be read."""
        witness = None if stored.witness is None else read_case(stored.witness, model, stored.name)
        return MutantResult(
            mutant, stored.status, stored.case, stored.reason, stored.runs, stored.skipped,
            witness, stored.is_benign, stored.is_killable, stored.belongs, stored.noticed,
        )  # fmt: skip


class MutantCounts(Struct, frozen=True):
    """The number of mutants with each status."""

    by_status: Mapping[MutantStatus, int]

    @staticmethod
    def of(results: Iterable[MutantResult]) -> MutantCounts:
        """Count the statuses of results."""
        return MutantCounts(Counter(result.status for result in results))

    def of_status(self, status: MutantStatus) -> int:
        """Return the number of mutants with a status."""
        return self.by_status.get(status, 0)

    @property
    def total(self) -> int:
        """The number of mutants."""
        return sum(self.by_status.values())

    @property
    def score(self) -> Figure:
        """The killed mutants among all that are not equivalent; undecided ones count as not killed."""
        return Figure(self.of_status(MutantStatus.KILLED), self.total - self.of_status(MutantStatus.EQUIVALENT))
