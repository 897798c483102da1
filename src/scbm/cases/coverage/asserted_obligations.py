"""The obligations whose transitions cases assert: they notice a mutant that changes such a transition (decision 52)."""

from __future__ import annotations

from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct

from scbm.cases.coverage.obligations import Figure

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.cases.coverage.obligations import Obligation, Obligations


class MutantStatus(StrEnum):
    """The status of a mutant."""

    KILLED = "killed"
    """A case fails on it that passes on the original."""
    EQUIVALENT = "equivalent"
    """Proved: each of its runs equals a run of the original."""
    SURVIVED = "survived"
    """No case fails on it, and a witness shows that it behaves differently."""
    UNDECIDED = "undecided"
    """No case fails on it, and it is not known whether it ever behaves differently."""


NO_MUTANTS = "the store has no results of `scbm mutate`"
"""Why nothing is known, as a clause, where a store has no results of mutants at all."""


class Assertion(StrEnum):
    """Whether cases notice a change of the transition of an obligation that they visit."""

    ASSERTED = "asserted"
    """A case that visits it kills one of its mutants."""
    NOTHING_ASSERTED = "nothing_asserted"
    """No such case does, and one of its mutants behaves differently."""
    UNKNOWN = "unknown"
    """The obligation has no mutants, or all of them are equivalent or undecided."""

    __hash__ = str.__hash__  # of equal value, and without a call of Python for each lookup

    @property
    def words(self) -> str:
        """The answer in words."""
        return self.value.replace("_", " ")


class MutantNotice(NamedTuple):
    """The result of a mutant, for the obligations that it belongs to.

    Attributes:
        belongs: the obligations that it belongs to, as bits.
        noticed: of these the ones that a case visits which kills it.
        status: its status.
    """

    belongs: int
    noticed: int
    status: MutantStatus


class AssertedObligation(Struct, frozen=True):
    """A visited obligation, with the number of its mutants.

    Attributes:
        obligation: the obligation.
        noticed: mutants that a case kills which visits the obligation.
        unnoticed: other mutants that behave differently.
        equivalent: mutants that are proved to behave like the model.
        undecided: mutants of which neither is known.
    """

    obligation: Obligation
    noticed: int = 0
    unnoticed: int = 0
    equivalent: int = 0
    undecided: int = 0

    @staticmethod
    def of(obligation: Obligation, bit: int, notices: Iterable[MutantNotice]) -> AssertedObligation:
        """Count the mutants of one obligation, which has this bit."""
        counts = dict.fromkeys(("noticed", "unnoticed", "equivalent", "undecided"), 0)
        for notice in notices:
            if notice.belongs & bit:
                counts[_group(notice, bit)] += 1
        return AssertedObligation(obligation, **counts)

    @property
    def mutants(self) -> int:
        """The number of its mutants."""
        return self.noticed + self.unnoticed + self.equivalent + self.undecided

    @property
    def counts(self) -> bool:
        """Whether the figure counts it: one of its mutants may behave differently."""
        return self.mutants > self.equivalent

    @property
    def answer(self) -> Assertion:
        """Whether cases notice a change."""
        if self.noticed:
            return Assertion.ASSERTED
        return Assertion.NOTHING_ASSERTED if self.unnoticed else Assertion.UNKNOWN

    @property
    def words(self) -> str:
        """The number of its mutants in words, or why nothing is known."""
        if self.answer is not Assertion.UNKNOWN:
            return f"{self.noticed} of {self.mutants - self.equivalent} changes noticed"
        if self.undecided:
            return "no case notices a change, and it is undecided whether one makes a difference"
        return "no change makes a difference" if self.equivalent else "no mutant changes it"


def _group(notice: MutantNotice, bit: int) -> str:
    if notice.noticed & bit:
        return "noticed"
    match notice.status:
        case MutantStatus.EQUIVALENT:
            return "equivalent"
        case MutantStatus.UNDECIDED:
            return "undecided"
        case MutantStatus.KILLED | MutantStatus.SURVIVED:
            return "unnoticed"


class AssertedObligations(Struct, frozen=True, dict=True):
    """The visited obligations of a model with their answers, in the order of the model, without *queued*."""

    entries: tuple[AssertedObligation, ...]

    @staticmethod
    def of(obligations: Obligations, visited: int, notices: Sequence[MutantNotice]) -> AssertedObligations:
        """Return the answers for the visited obligations.

        Args:
            obligations: the obligations of the model.
            visited: those that the cases visit, as bits.
            notices: all mutants of the model.
        """
        bits = ((obligation, obligations.bit(obligation)) for obligation in obligations if obligation.counts)
        return AssertedObligations(
            tuple(AssertedObligation.of(obligation, bit, notices) for obligation, bit in bits if bit & visited)
        )

    @property
    def figure(self) -> Figure:
        """The asserted obligations among the visited ones that have a mutant which may behave differently."""
        return Figure(len(self.with_answer(Assertion.ASSERTED)), sum(entry.counts for entry in self.entries))

    def with_answer(self, answer: Assertion) -> tuple[AssertedObligation, ...]:
        """Return the obligations with an answer."""
        return tuple(entry for entry in self.entries if entry.answer is answer)

    @cached_property
    def by_obligation(self) -> dict[Obligation, AssertedObligation]:
        """The answer of each visited obligation."""
        return {entry.obligation: entry for entry in self.entries}


class AssertionEvidence(Struct, frozen=True):
    """The answers of a store about the obligations that cases visit.

    Attributes:
        found: the answers; `None` if no result of mutants is about these cases.
        why_none: why there are none, as a clause.
    """

    found: AssertedObligations | None
    why_none: str = ""

    @property
    def has_results(self) -> bool:
        """Whether the store has results of mutants, of these cases or of others."""
        return self.why_none != NO_MUTANTS

    @property
    def figure(self) -> Figure:
        """The figure of asserted obligations; of none if nothing is known."""
        return Figure(0, 0) if self.found is None else self.found.figure
