"""The differences between the worlds of a model and of a mutant: where runs start, and what changes from outside."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import RateKind

if TYPE_CHECKING:
    from scbm.model import BehaviorModel
    from scbm.mutation.equivalence.observed_runs import ObservedRuns
    from scbm.running import Program


class WorldDifferences:
    """The differences between the worlds of a model and of one mutant: where runs start, what changes in them."""

    def __init__(self, observed: ObservedRuns, mutant: Program) -> None:
        self._observed = observed
        self._original = observed.program
        self._mutant = mutant

    @property
    def has_other_starts(self) -> bool:
        """Whether runs begin in other states."""
        return self._starts(self._original.model) != self._starts(self._mutant.model)

    @staticmethod
    def _starts(model: BehaviorModel) -> list[tuple[object, ...]]:
        """Return the nominal values, which cases have that name none, and the random ones."""
        return [(variable.initial, variable.random) for variable in model.variables]

    @property
    def has_other_changes(self) -> bool:
        """Whether an environment transition does something else in a state of a run."""
        before, after = self._original.model.environment, self._mutant.model.environment
        if before == after:
            return False
        rates = {each.name: each.rate for each in before}
        if any(rates.get(each.name, each.rate) != each.rate for each in after):
            return True
        return any(
            self._changes(self._original, state) != self._changes(self._mutant, state) for _, state in self._observed
        )

    @property
    def without_rate(self) -> str | None:
        """The first environment transition that differs and has no rate, so that no simulation shows it."""
        before, after = self._original.model.environment, self._mutant.model.environment
        changed = (each for each in (*before, *after) if each not in before or each not in after)
        return next((each.name for each in changed if each.rate is None), None)

    def _changes(self, program: Program, state: int) -> list[tuple[str, int]]:
        """Return the environment transitions that can fire; a clock of `after` runs even where one changes nothing."""
        kept, found = self._observed.kept, []
        for step, transition in zip(program.environment, program.model.environment, strict=True):
            after = step.update(state) if step.test(state) else None
            has_clock = transition.rate is not None and transition.rate.kind is RateKind.AFTER
            if after is not None and (has_clock or (after ^ state) & kept):
                found.append((step.name, after & kept))
        return found
