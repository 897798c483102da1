"""Decides about the mutants that no case of a suite killed: equivalent, survived with a witness, or undecided."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, assert_never

from scbm.closing.mutants.compared_runs import differ_only_in_payloads, first_difference
from scbm.closing.mutants.equivalences import Equivalences
from scbm.closing.mutants.mutant_decisions import DifferentMutant, EquivalentMutant, UndecidedMutant
from scbm.testing.mutants import MutantResult, MutantStatus

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.closing.runs.all_runs import CloseLimits
    from scbm.model import BehaviorModel, State


class Survivors:
    """Decides about mutants of one model that survived a suite; the runs of the model are explored once."""

    def __init__(self, model: BehaviorModel, limits: CloseLimits, progress: Callable[[str], None]) -> None:
        """Explore the runs of the model. For the arguments see `Equivalences`."""
        self._equivalences = Equivalences(model, limits, progress) if model.goals else None

    def decided(self, result: MutantResult) -> MutantResult:
        """Return the result of a mutant with what is decided about it; that of a killed mutant as it is."""
        if result.status is not MutantStatus.UNDECIDED:
            return result
        if self._equivalences is None:
            return replace(result, reason="the model has no goals, and proofs and witnesses are about them")
        nominal = self._equivalences.model.nominal_state
        decision = self._equivalences.decide(result.mutant.model)
        match decision:
            case EquivalentMutant():
                return replace(result, status=MutantStatus.EQUIVALENT)
            case UndecidedMutant(reason, option):
                remedy = "" if option is None else f"; a larger `{option}` may decide it"
                return replace(result, reason=f"{reason}{remedy}")
            case DifferentMutant():
                return _survived(result, decision, nominal)
            case _:
                assert_never(decision)


def _survived(result: MutantResult, found: DifferentMutant, nominal: State) -> MutantResult:
    reason, name = "", f"witness-{found.original.digest[:8]}"
    if not found.original.verdict.passed:
        reason = f"{name} shows it, but fails on the model itself, too"
    elif not found.kills:
        seen = first_difference(found.original, found.mutated, nominal)
        reason = f"{name} shows it, but its recorded result does not: {seen}"
        if differ_only_in_payloads(found.original, found.mutated):
            reason += "; no expectation and no requirement is about what requests carry"
    return replace(
        result,
        status=MutantStatus.SURVIVED,
        reason=reason,
        witness=found.recorded(name),
        is_benign=found.is_benign,
        is_killable=not reason,
    )
