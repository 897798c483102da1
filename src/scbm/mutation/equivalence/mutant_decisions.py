"""The decisions about mutants: equivalent, different with a witness, or undecided (decision 50)."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct
from msgspec.structs import replace

from scbm.testing.recorded_results import differences_of_record

if TYPE_CHECKING:
    from scbm.cases import Case
    from scbm.testing import Execution


class EquivalentMutant(Struct, frozen=True):
    """A mutant whose runs are those of the original model: all of them were explored.

    Attributes:
        situations: the number of situations of the original in which nothing differs.
    """

    situations: int


class DifferentMutant(Struct, frozen=True):
    """A mutant of which a case shows that it differs.

    Attributes:
        case: the witness; its runs on both have different traces.
        original: its run on the original.
        mutated: its run on the mutant.
        is_lost_in_file: whether it kills only until it is written to a file and read back.
    """

    case: Case
    original: Execution
    mutated: Execution
    is_lost_in_file: bool = False

    @property
    def is_benign(self) -> bool:
        """Whether the mutant breaks no requirement in the witness that the original keeps."""
        broken = [violation.requirement for violation in self.original.violations]
        return all(violation.requirement in broken for violation in self.mutated.violations)

    @property
    def kills(self) -> bool:
        """Whether the witness fails on the mutant once it has the recorded result of the original.

        A record has no times, so a difference in time alone does not count. A witness that fails on the original has no
        record. Its order of visits does not count: names of visits are in the order of the model.
        """
        if self.is_lost_in_file or not self.original.verdict.passed:
            return False
        recorded = self.recorded(self.case.name)
        return not self.mutated.verdict.passed or any(differences_of_record(recorded, self.mutated.recorded_goals))

    def recorded(self, name: str) -> Case:
        """Return the witness with the result of the original, under another name."""
        recorded = self.original.recorded
        kept = replace(recorded, trace=None) if recorded.goals else None  # any change of the model changes the trace
        return replace(self.case, name=name, recorded=kept)


class UndecidedMutant(Struct, frozen=True):
    """A mutant of which neither is shown.

    Attributes:
        reason: why, as a clause.
        option: the option that raises the limit that was reached; `None` if there is none.
    """

    reason: str
    option: str | None = None


MutantDecision: TypeAlias = EquivalentMutant | DifferentMutant | UndecidedMutant
