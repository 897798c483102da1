"""The states in which the runner looks at guards, micro-steps included: what can ever hold when it matters."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from scbm.closing.graph import Start
from scbm.closing.values import ValueSets, possible_values

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.closing.runs import Runs
    from scbm.model import Predicate, Value

_MOST_EDGES = 200_000


class Looks:
    """All such states of the runs of a model; if they are too many, what the values of variables allow."""

    def __init__(self, runs: Runs) -> None:
        self._runs = runs
        self._known: dict[Predicate, bool] = {}

    @property
    def are_known(self) -> bool:
        """Whether the states can be had."""
        return self._runs.stopped is None and sum(graph.size for graph in self._runs.graphs) <= _MOST_EDGES

    def can_hold(self, predicate: Predicate) -> bool:
        """Whether a predicate holds in one of the states; also if that is not known."""
        if predicate not in self._known:
            self._known[predicate] = self._holds(predicate)
        return self._known[predicate]

    def _holds(self, predicate: Predicate) -> bool:
        if not self.are_known:
            return self._values.can_hold(predicate)
        test = self._runs.program.packing.test(predicate)
        return any(test(state) for state in self._states)

    def __iter__(self) -> Iterator[Mapping[str, Value]]:
        """The states with all their variables; those that make no difference have any value."""
        for state in self._states:
            yield self._runs.program.packing.values(state)

    @cached_property
    def _values(self) -> ValueSets:
        model = self._runs.model
        return ValueSets(model.running_space, possible_values(model))

    @cached_property
    def _states(self) -> dict[int, None]:
        """Every step is taken once more, and watched."""
        found: dict[int, None] = {}
        for graph in self._runs.graphs:
            steps = self._runs.steps(graph.goal[1])
            steps.watch = found.setdefault
            for position, label in graph.steps():
                if isinstance(label, Start):
                    steps.begin(label.packed)
                elif position is not None:
                    steps.after(position, label)
        return found
