"""The perimeter of a goal: all states at distance 0, 1, 2, … from it, computed backwards on arrays.

Backwards, states appear that no run reaches. Pairs of facts that cannot hold together exclude most of them.
"""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING

import numpy as np
from msgspec import Struct

from scbm.model.normal_form import AllOf, OneOf, indices_of
from scbm.planning.searches.array_states import MAX_CELLS, VisitedStates, columns_of
from scbm.planning.searches.mutexes import FactPairs, literals

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.array_engine import Flags
    from scbm.planning.engines.joint_moves import JointMove
    from scbm.planning.engines.reduced_system import Coordinates, ReducedSystem
    from scbm.planning.searches.array_states import ArrayProblem, WordLayout, Words

_MAX_GOALS = 1 << 16
"""Maximum number of goal states; with more of them a search backwards is of little use."""

_MAX_COLUMNS = 1 << 13
"""Maximum number of ways to undo moves: one for each combination of the values that a move overwrites."""


class TooManyGoalsError(Exception):
    """The goal has too many states, or the moves too many predecessors, for a search backwards."""


class Perimeter:
    """The states near the goal, level by level.

    Attributes:
        levels: for each distance the states with this distance from the goal.
        frontier: the states of the last level.
        expanded: the number of states whose predecessors were computed.
    """

    def __init__(self, search: ArrayProblem, start: Coordinates, attempt: int) -> None:
        """Compute the goal states for a start. Raises `TooManyGoalsError`."""
        pairs = FactPairs(search.system, start)
        self._layout = search.layout
        self._attempt = attempt
        self._undo = _UndoMatrix(search, pairs)
        goals = _goal_states(search.system, search.goal, pairs, search.layout)
        self.frontier = goals[:, search.is_goal(goals)]
        self.levels: list[VisitedStates] = []
        self.expanded = 0
        self._found = VisitedStates(self._layout.words, attempt)
        self._add_level([self.frontier])

    def grow(self) -> None:
        """Compute the next level."""
        self.expanded += self.frontier.shape[1]
        self._add_level(self._undo.predecessors(self.frontier))

    def _add_level(self, parts: Iterator[Words] | list[Words]) -> None:
        new = [part[:, self._found.add(part)] for part in parts]
        self.frontier = np.concatenate([self.frontier[:, :0], *new], axis=1)
        level = VisitedStates(self._layout.words, self._attempt)
        level.add(self.frontier)
        self.levels.append(level)


def _goal_states(system: ReducedSystem, goal: NormalForm, pairs: FactPairs, layout: WordLayout) -> Words:
    """Return the states in which the literals of the goal hold, and no two facts are known to exclude each other."""
    states: Words = np.zeros((layout.words, 1), np.uint64)
    allowed = pairs.together.diagonal()[None, :]
    values = {variable: (1 << count) - 1 for variable, count in enumerate(system.counts)}
    values |= {part.variable: part.allowed for part in literals(goal)}
    # Variables with fewer values come first, so that they exclude values of the others.
    for variable in sorted(values, key=lambda v: (values[v].bit_count(), v)):
        word, shift, _ = layout.places[variable]
        facts = [pairs.fact(variable, value) for value in indices_of(values[variable])]
        chosen = [np.flatnonzero(allowed[:, fact]) for fact in facts]
        if sum(map(len, chosen)) > _MAX_GOALS:
            raise TooManyGoalsError
        bits = np.repeat([np.uint64(v << shift) for v in indices_of(values[variable])], list(map(len, chosen)))
        allowed = np.concatenate(
            [allowed[rows] & pairs.together[fact] for rows, fact in zip(chosen, facts, strict=True)]
        )
        states = states[:, np.concatenate(chosen)]
        states[word] |= bits
    return states


class _UndoMatrix:
    """All ways to undo moves on arrays of states, a column for each move and combination of overwritten values."""

    def __init__(self, search: ArrayProblem, pairs: FactPairs) -> None:
        self._layout = search.layout
        self._offsets = pairs.offsets
        columns = [column for move in search.system.moves for column in _undo_columns(move, search.system, pairs)]
        if len(columns) > _MAX_COLUMNS:
            raise TooManyGoalsError
        self._masks, self._bits = columns_of(self._layout, [column.after.items() for column in columns])
        set_masks, self._set_bits = columns_of(self._layout, [column.before.items() for column in columns])
        self._keeps = ~set_masks
        self._allowed = np.array([column.allowed for column in columns], np.bool_).reshape(-1, pairs.offsets[-1])
        excluded = {variable for column in columns for variable in column.excluding(pairs)}
        self._restricted = sorted(excluded)
        self._tests = [
            (place, search.vectors.test(column.guard)) for place, column in enumerate(columns) if column.needs_test
        ]

    def predecessors(self, states: Words) -> Iterator[Words]:
        """Yield the predecessors of states, in parts; a state may occur more than once."""
        size = max(1, MAX_CELLS // max(1, self._masks.shape[1]))
        for begin in range(0, states.shape[1], size):
            yield self._undone(states[:, begin : begin + size])

    def _undone(self, states: Words) -> Words:
        matching = states[0][:, None] & self._masks[0] == self._bits[0]
        for word in range(1, len(states)):
            matching &= states[word][:, None] & self._masks[word] == self._bits[word]
        sources, columns = np.nonzero(matching)
        before: Words = states[:, sources] & self._keeps[:, columns] | self._set_bits[:, columns]
        is_possible = np.ones(len(columns), np.bool_)
        for variable in self._restricted:
            facts = self._layout.reader(variable)(before) + self._offsets[variable]
            is_possible &= self._allowed[columns, facts]
        for column, test in self._tests:
            chosen = np.flatnonzero(columns == column)
            is_possible[chosen] &= test(before[:, chosen])
        return before[:, is_possible]


class _UndoColumn(Struct, frozen=True):
    """One way to undo a move.

    Attributes:
        guard: the guard of the move.
        before: the values that the move overwrites, and those that it copies.
        after: the values of the state after the move.
        allowed: the facts that can hold together with the guard and the values before the move.
    """

    guard: NormalForm
    before: dict[int, int]
    after: dict[int, int]
    allowed: Flags

    @property
    def needs_test(self) -> bool:
        """Whether the guard has other parts than literals about one variable."""
        parts = self.guard.parts if isinstance(self.guard, AllOf) else (self.guard,)
        return not all(isinstance(part, OneOf) or part is True for part in parts)

    def excluding(self, pairs: FactPairs) -> Iterator[int]:
        """Yield the variables of which some possible values are not allowed, besides those of `after`."""
        for variable, begin in enumerate(pairs.offsets[:-1]):
            facts = slice(begin, pairs.offsets[variable + 1])
            if variable not in self.after and (pairs.together.diagonal()[facts] & ~self.allowed[facts]).any():
                yield variable


def _undo_columns(move: JointMove, system: ReducedSystem, pairs: FactPairs) -> Iterator[_UndoColumn]:
    """Yield the ways to undo a move that are possible under the pairs; raise `TooManyGoalsError` for very many."""
    asked = {part.variable: part for part in literals(move.guard)}
    variables = list(dict.fromkeys(v for write in move.writes for v in (write.target, write.source)))
    possible = pairs.possible([pairs.literal(part) for part in asked.values()])
    choices = [[v for v in range(system.counts[x]) if possible[pairs.fact(x, v)]] for x in variables]
    if prod(map(len, choices)) > _MAX_COLUMNS:
        raise TooManyGoalsError
    fixed = {x: part.allowed.bit_length() - 1 for x, part in asked.items() if part.allowed.bit_count() == 1}
    for values in product(*choices):
        before = dict(zip(variables, values, strict=True))
        written = {write.target: write.indices[before[write.source]] for write in move.writes}
        if None in written.values() or written.items() <= before.items():
            continue
        facts = [np.array([pairs.fact(x, value)]) for x, value in before.items()]
        allowed = pairs.possible([*facts, *map(pairs.literal, asked.values())])
        if all(allowed[fact[0]] for fact in facts):
            after = fixed | before | {x: value for x, value in written.items() if value is not None}
            yield _UndoColumn(move.guard, before, after, allowed)
