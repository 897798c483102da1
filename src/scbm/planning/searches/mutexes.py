"""Pairs of facts that can hold together (h², Haslum and Geffner, 2000); all other pairs are mutexes.

A fact is a variable with one of its values. Starting from the pairs of the initial state, each move adds the pairs that
it could make true if only pairs of facts mattered. So the pairs at the fixed point are a superset of those that hold
in reachable states.
"""

from __future__ import annotations

from itertools import accumulate
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from scbm.model.normal_form import AllOf, NormalForm, OneOf, indices_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from scbm.model.packing import ValueTable
    from scbm.planning.engines.array_engine import Flags, Indices
    from scbm.planning.engines.joint_moves import JointMove
    from scbm.planning.engines.reduced_system import Coordinates, ReducedSystem

    Matrix: TypeAlias = NDArray[np.bool_]


class FactPairs:
    """The pairs of facts that can hold together in states that are reachable from one start.

    Attributes:
        offsets: for each variable the number of the fact of its first value; at last the number of facts.
        together: `together[f, g]` is whether the facts f and g can hold together, `together[f, f]` whether f can hold.
    """

    def __init__(self, system: ReducedSystem, start: Coordinates) -> None:
        self.offsets = tuple(accumulate(system.counts, initial=0))
        size = self.offsets[-1]
        variables = np.repeat(np.arange(len(system.counts)), system.counts)
        self._exclusive = (variables[:, None] == variables) & ~np.eye(size, dtype=np.bool_)
        facts = np.array([self.fact(variable, value) for variable, value in enumerate(start)], np.int64)
        self.together: Matrix = np.zeros((size, size), np.bool_)
        self.together[np.ix_(facts, facts)] = True
        moves = [_PairRule(move, self) for move in system.moves]
        count = -1
        while count != (count := int(np.count_nonzero(self.together))):
            for move in moves:
                self._apply(move)

    def fact(self, variable: int, value: int) -> int:
        """Return the number of the fact that a variable has a value."""
        return self.offsets[variable] + value

    def literal(self, part: OneOf) -> Indices:
        """Return the facts of which one holds where the literal holds."""
        return np.array([self.fact(part.variable, value) for value in indices_of(part.allowed)], np.int64)

    def possible(self, parts: list[Indices]) -> Flags:
        """Return the facts that can hold together with some fact of each part."""
        found: Flags = self.together.diagonal().copy()
        for facts in parts:
            found &= self.together[facts].any(axis=0)
        return found

    def _apply(self, rule: _PairRule) -> None:
        """Add the pairs after a move, if its guard can hold and all its effects have a value."""
        possible = self.possible(rule.guard)
        if not all(possible[facts].any() for facts in (*rule.guard, *(before for before, _ in rule.effects))):
            return
        made = [(before[possible[before]], after[possible[before]]) for before, after in rule.effects]
        for before, after in made:
            for fact in np.unique(after):
                rows = self.together[before[after == fact]].any(axis=0) & possible & rule.kept
                self.together[fact] |= rows
                self.together[:, fact] |= rows
        facts = np.concatenate([after for _, after in made])
        pairs = np.ix_(facts, facts)
        self.together[pairs] |= ~self._exclusive[pairs]


class _PairRule:
    """A move as a rule that adds pairs.

    Attributes:
        guard: for each literal of the guard its facts.
        effects: for each variable that is set the facts before the move, and for each of them the fact after it.
        kept: the facts of variables that the move does not set.
    """

    def __init__(self, move: JointMove, pairs: FactPairs) -> None:
        self.guard = [pairs.literal(part) for part in literals(move.guard)]
        self.effects = [_effect(write, pairs) for write in move.writes]
        self.kept = np.ones(pairs.offsets[-1], np.bool_)
        for write in move.writes:
            self.kept[pairs.offsets[write.target] : pairs.offsets[write.target + 1]] = False


def _effect(write: ValueTable, pairs: FactPairs) -> tuple[Indices, Indices]:
    values = [(old, new) for old, new in enumerate(write.indices) if new is not None]
    before = np.array([pairs.fact(write.source, old) for old, _ in values], np.int64)
    after = np.array([pairs.fact(write.target, new) for _, new in values], np.int64)
    return before, after


def literals(form: NormalForm) -> list[OneOf]:
    """Return the literals about one variable of a conjunction."""
    parts = form.parts if isinstance(form, AllOf) else (form,)
    return [part for part in parts if isinstance(part, OneOf)]
