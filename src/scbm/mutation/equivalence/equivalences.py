"""Decides whether mutants of one model are equivalent to it, as a proof or by a witness (decision 50)."""

from __future__ import annotations

from itertools import chain
from typing import TYPE_CHECKING, assert_never

from msgspec.structs import replace

from scbm.cases.coverage import MutantStatus
from scbm.closing.runs.all_runs import CloseLimits
from scbm.model import PlanSet
from scbm.mutation.equivalence.comparable_mutant import IncomparableError, changed_names, comparable
from scbm.mutation.equivalence.mutant_decisions import DifferentMutant, EquivalentMutant, UndecidedMutant
from scbm.mutation.equivalence.observed_runs import ObservedRuns
from scbm.mutation.equivalence.plan_differences import PlanDifferences
from scbm.mutation.equivalence.runner_differences import RunnerDifferences, WorldDifferences
from scbm.mutation.equivalence.witness_search import WitnessSearch, differ_only_in_payloads, first_difference
from scbm.running.untimed.situations import PlanningTooLargeError

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model import BehaviorModel, Requirement, State
    from scbm.mutation.equivalence.mutant_decisions import MutantDecision
    from scbm.mutation.mutant_results import MutantResult
    from scbm.running import Program


class Equivalences:
    """Decides about the mutants of one model; its runs are explored once, for all of them."""

    def __init__(
        self,
        model: BehaviorModel,
        limits: CloseLimits = CloseLimits(),  # noqa: B008 - an immutable value
        progress: Callable[[str], None] | None = None,
        requirements: tuple[Requirement, ...] = (),
    ) -> None:
        """Explore the runs of the model.

        Args:
            model: the original.
            limits: the limits of the exploration, of planning, and of the cases that are tried.
            progress: called with what is being explored, with counts.
            requirements: what witnesses are judged by, beside the requirements of the model.

        Raises:
            KeyboardInterrupt: the user ended the exploration.
        """
        self._limits = limits
        report = progress or (lambda _: None)
        self._observed = shown = ObservedRuns(model, limits, report, model.runs.proved_plans)
        if model.runs.proved_plans is not PlanSet.CANONICAL:  # cases that follow walks have canonical plans
            shown = ObservedRuns(model, limits, report, PlanSet.CANONICAL)
        self._witnesses = WitnessSearch(shown, limits.candidates, requirements)

    @property
    def model(self) -> BehaviorModel:
        """The original."""
        return self._observed.model

    def decide(self, mutant: BehaviorModel) -> MutantDecision:
        """Return whether a mutant is equivalent to the original, with a proof or with a witness.

        The mutant is equivalent if in no situation of the original, with the goals, plans and changes from outside that
        the original declares, it does anything else. Forced states are no such situations. One that reads an input that
        nothing in the original reads or declares is never equivalent: no run of the original changes this input.
        """
        try:
            return self._compare(mutant, self._observed.program.of_mutant(comparable(self.model, mutant)))
        except IncomparableError as error:
            reason = str(error)
        except PlanningTooLargeError:
            reason = "the plans of the mutant are not found within the limits of planning"
        return self._witnesses.from_random(mutant) or UndecidedMutant(reason)

    def _compare(self, mutant: BehaviorModel, program: Program) -> MutantDecision:
        world = WorldDifferences(self._observed, program)
        if world.has_other_starts or world.new_inputs or world.has_other_changes:
            found = self._witnesses.from_random(mutant, redraws=True)
            return found or UndecidedMutant(_why_hidden(world))
        differences = chain(
            RunnerDifferences(self._observed, program),
            PlanDifferences(self._observed, mutant, program, self._limits.planning),
        )
        first = next(differences, None)
        if first is None:
            return self._without_difference(mutant, program)
        shown = self._witnesses.from_differences(mutant, chain((first,), differences))
        found = shown or self._witnesses.from_random(mutant)
        return found or UndecidedMutant("a run differs, and no simulated case that was tried shows it")

    def _without_difference(self, mutant: BehaviorModel, program: Program) -> MutantDecision:
        runs = self._observed.runs
        reason, option = runs.stopped, runs.option
        if reason is None:
            known = dict.fromkeys(runs.relevance.names)
            unknown = [name for name in changed_names(self.model, program.model) if name not in known]
            if not unknown:
                return EquivalentMutant(runs.situations)
            reason = f"runs can be in more situations than are explored if {unknown[0]} is distinguished"
            option = "--max-states"
        return self._witnesses.from_random(mutant) or UndecidedMutant(reason, option)


def _why_hidden(world: WorldDifferences) -> str:
    if world.new_inputs:
        name = world.new_inputs[0]
        read = f"the mutant reads {name}, which nothing in the model reads, assigns or declares as an input"
        return f"{read}: it may change from outside"
    if world.without_rate is not None:
        return f"the environment transition {world.without_rate} has no rate, so it fires in no simulation"
    return "something else changes from outside, or at first, and no simulated case that was tried shows it"


class Survivors:
    """Decides about mutants of one model that survived a suite; the runs of the model are explored once."""

    def __init__(
        self,
        model: BehaviorModel,
        limits: CloseLimits,
        progress: Callable[[str], None],
        requirements: tuple[Requirement, ...],
    ) -> None:
        """Explore the runs of the model. For the arguments see `Equivalences`."""
        self._equivalences = Equivalences(model, limits, progress, requirements) if model.goals else None

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
            reason += "; no expectation and no requirement reads the values in requests"
    return replace(
        result,
        status=MutantStatus.SURVIVED,
        reason=reason,
        witness=found.recorded(name),
        is_benign=found.is_benign,
        is_killable=not reason,
    )
