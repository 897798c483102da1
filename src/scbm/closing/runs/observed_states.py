"""The states in which the runner evaluates guards, micro-steps included."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from scbm.closing.proofs.possible_values import ValueSets, possible_values

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.closing.runs.all_runs import AllRuns
    from scbm.model import Predicate, Value


class ObservedStates:
    """All such states of the runs of a model; if they are too many, the values that the delete relaxation allows."""

    def __init__(self, runs: AllRuns) -> None:
        self._runs = runs
        self._known: dict[Predicate, bool] = {}

    @property
    def are_known(self) -> bool:
        """Whether all states were explored."""
        return self._runs.stopped is None

    def can_hold(self, predicate: Predicate) -> bool:
        """Return whether a predicate holds in one of the states; `True` also if that is unknown."""
        if predicate not in self._known:
            self._known[predicate] = self._holds(predicate)
        return self._known[predicate]

    def _holds(self, predicate: Predicate) -> bool:
        if not self.are_known:
            return self._values.can_hold(predicate)
        test = self._runs.program.packing.test(predicate)
        return any(test(state) for state in self._runs.observed)

    def __iter__(self) -> Iterator[Mapping[str, Value]]:
        """Yield the states with all their variables; irrelevant variables have any value."""
        for state in self._runs.observed:
            yield self._runs.program.packing.values(state)

    @cached_property
    def _values(self) -> ValueSets:
        model = self._runs.model
        return ValueSets(model.running_space, possible_values(model))
