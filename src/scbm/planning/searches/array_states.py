"""Packed states as columns of arrays: all moves of a system as one matrix, and sorted sets of states.

A move whose guard asks for single values and that sets constants is one column of masks: all moves are tested on all
states by one comparison. Other parts of guards and other effects are computed move by move.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from scbm.model.normal_form import AllOf, NormalForm, OneOf
from scbm.planning.engines.array_engine import Vectors
from scbm.planning.engines.reduced_system import StateCodes

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from scbm.model.packing import ValueTable
    from scbm.planning.engines.array_engine import Codes, Flags, Indices, Test
    from scbm.planning.engines.joint_moves import JointMove
    from scbm.planning.engines.reduced_system import Coordinates, ReducedSystem

    Words: TypeAlias = NDArray[np.uint64]
    """States as columns: `words[w, i]` is word w of state i."""


WORD = 64
_ALL = (1 << WORD) - 1
MAX_CELLS = 1 << 16
"""Number of pairs of a state and a move that are tested together: their flags and words stay in the cache."""


class WordLayout:
    """Fields of whole bits in words of 64 bits; no field is in two words.

    Attributes:
        words: the number of words of a state, at least one.
        places: for each variable its word, its shift in the word, and its mask before the shift.
    """

    def __init__(self, counts: Iterable[int]) -> None:
        places = []
        word = shift = 0
        for count in counts:
            width = max(count - 1, 0).bit_length()
            if shift + width > WORD:
                word, shift = word + 1, 0
            places.append((word, shift, (1 << width) - 1))
            shift += width
        self.words = word + 1
        self.places = tuple(places)

    def pattern(self, values: Iterable[tuple[int, int]]) -> tuple[list[int], list[int]]:
        """Return the masks and the bits, a word each, of variables that have these values."""
        masks, bits = [0] * self.words, [0] * self.words
        for variable, value in values:
            word, shift, mask = self.places[variable]
            masks[word] |= mask << shift
            bits[word] |= value << shift
        return masks, bits

    def state(self, coordinates: Coordinates) -> Words:
        """Return one state, as an array with one column."""
        _, bits = self.pattern(enumerate(coordinates))
        return np.array(bits, np.uint64).reshape(-1, 1)

    def reader(self, variable: int) -> Callable[[Words], Indices]:
        """Return a function that reads a variable of states."""
        word, shift, mask = self.places[variable]
        return lambda states: (states[word] >> np.uint64(shift) & np.uint64(mask)).view(np.int64)


class WordVectors(Vectors):
    """Compiles normal forms for states of several words."""

    def __init__(self, layout: WordLayout, counts: tuple[int, ...]) -> None:
        super().__init__(StateCodes.fields(counts))
        self._words = layout

    def _reader(self, variable: int) -> Callable[[Words], Indices]:
        return self._words.reader(variable)

    def _cube(self, parts: tuple[OneOf, ...]) -> Test:
        masks, bits = self._words.pattern((part.variable, part.allowed.bit_length() - 1) for part in parts)
        tests = [(w, np.uint64(mask), np.uint64(bits[w])) for w, mask in enumerate(masks) if mask]

        def test(states: Words) -> Flags:
            holds: Flags = states[tests[0][0]] & tests[0][1] == tests[0][2]
            for word, mask, wanted in tests[1:]:
                holds &= states[word] & mask == wanted
            return holds

        return test


class MoveMatrix:
    """All moves of a system on arrays of states.

    Attributes:
        indices: for each column the index of its move in the system; ascending.
    """

    def __init__(self, moves: Sequence[JointMove], layout: WordLayout, vectors: WordVectors) -> None:
        self.indices = tuple(move.index for move in moves)
        guards = [_split(move.guard) for move in moves]
        self._guard_masks, self._guard_bits = columns_of(
            layout, ([_literal(p) for p in single] for single, _ in guards)
        )
        self._rests = tuple((column, vectors.test(rest)) for column, (_, rest) in enumerate(guards) if rest is not True)
        set_masks, self._set_bits = columns_of(layout, (map(_constant, filter(_is_constant, m.writes)) for m in moves))
        self._tables = tuple(
            (column, [_SourceTable(write, layout) for write in move.writes if not _is_constant(write)])
            for column, move in enumerate(moves)
            if not all(map(_is_constant, move.writes))
        )
        for column, tables in self._tables:
            for table in tables:
                set_masks[table.word, column] |= table.mask
        self._keeps = ~set_masks

    def successors(self, states: Words) -> Iterator[tuple[Words, Indices, Indices]]:
        """Yield successors with the numbers of their states and of their columns, in the order of states, then moves.

        Each item has the successors of some states in a row.
        """
        size = max(1, MAX_CELLS // max(1, len(self.indices)))
        for begin in range(0, states.shape[1], size):
            after, sources, columns = self._expanded(states[:, begin : begin + size])
            yield after, sources + begin, columns

    def _expanded(self, states: Words) -> tuple[Words, Indices, Indices]:
        enabled = states[0][:, None] & self._guard_masks[0] == self._guard_bits[0]
        for word in range(1, len(states)):
            enabled &= states[word][:, None] & self._guard_masks[word] == self._guard_bits[word]
        for column, test in self._rests:
            enabled[:, column] &= test(states)
        sources, columns = np.nonzero(enabled)
        after: Words = states[:, sources] & self._keeps[:, columns] | self._set_bits[:, columns]
        for column, tables in self._tables:
            chosen = np.flatnonzero(columns == column)
            before = states[:, sources[chosen]]
            for table in tables:
                after[table.word, chosen] |= table.bits[table.read(before)]
        return after, sources, columns


class _SourceTable:
    """A variable that a move sets as a function of a variable."""

    def __init__(self, write: ValueTable, layout: WordLayout) -> None:
        self.word, shift, mask = layout.places[write.target]
        self.mask = np.uint64(mask << shift)
        self.read = layout.reader(write.source)
        # Where the table has no value the move is not enabled, so any value will do.
        bits = [(0 if after is None else after) << shift for after in write.indices]
        self.bits = np.array(bits + [0] * (mask_size(layout, write.source) - len(bits)), np.uint64)


def mask_size(layout: WordLayout, variable: int) -> int:
    """Return how many numbers fit into the field of a variable."""
    return layout.places[variable][2] + 1


def columns_of(layout: WordLayout, patterns: Iterable[Iterable[tuple[int, int]]]) -> tuple[Words, Words]:
    """Return masks and bits with a column for each pattern."""
    found = [layout.pattern(pattern) for pattern in patterns]
    masks, bits = ([pair[part] for pair in found] for part in (0, 1))
    shape = (len(found), layout.words)
    return (
        np.ascontiguousarray(np.array(masks, np.uint64).reshape(shape).T),
        np.ascontiguousarray(np.array(bits, np.uint64).reshape(shape).T),
    )


def _split(guard: NormalForm) -> tuple[list[OneOf], NormalForm]:
    """Return the literals of a conjunction that allow one value, and the rest as one form."""
    parts = guard.parts if isinstance(guard, AllOf) else (guard,)
    single = [part for part in parts if isinstance(part, OneOf) and part.allowed.bit_count() == 1]
    rest = tuple(part for part in parts if part not in single and part is not True)
    return single, AllOf(rest) if len(rest) > 1 else rest[0] if rest else True


def _literal(part: OneOf) -> tuple[int, int]:
    return part.variable, part.allowed.bit_length() - 1


def _is_constant(write: ValueTable) -> bool:
    return len(frozenset(write.indices) - {None}) == 1


def _constant(write: ValueTable) -> tuple[int, int]:
    return write.target, next(after for after in write.indices if after is not None)


class KeyCollisionError(Exception):
    """Two different states have the same key; the search starts again with other keys."""


class VisitedStates:
    """A growing set of states in sorted arrays. Each array is more than twice as long as the next: there are few.

    States are sorted by keys of one word. For states of one word the key is the word. Otherwise it is a hash, and
    `add` raises `KeyCollisionError` where two different states meet under one key.
    """

    def __init__(self, words: int, attempt: int = 0) -> None:
        """Start empty; `attempt` chooses the hash."""
        self._is_hashed = words > 1
        self._factors = [np.uint64(multiplier(attempt * words + word)) for word in range(words)]
        self._runs: list[tuple[Codes, Words]] = []

    def add(self, states: Words) -> Indices:
        """Add states, which may occur more than once; return the numbers of the first of each new one, ascending."""
        keys = self._keys(states)
        order = np.argsort(keys, kind="stable")
        keys = keys[order]
        is_first = np.ones(len(keys), np.bool_)
        np.not_equal(keys[1:], keys[:-1], out=is_first[1:])
        if self._is_hashed:
            ordered = states[:, order]
            _check((ordered[:, 1:] == ordered[:, :-1]).all(axis=0) | is_first[1:])
        first, keys = order[is_first], keys[is_first]
        for run, members in self._runs:
            is_new = self._missing(keys, states, first, run, members)
            first, keys = first[is_new], keys[is_new]
        if len(keys):
            self._merge(keys, states[:, first])
        return np.sort(first)

    def contains(self, states: Words) -> Flags:
        """Return which of some states are in the set."""
        keys = self._keys(states)
        found = np.zeros(len(keys), np.bool_)
        for run, members in self._runs:
            places = np.minimum(np.searchsorted(run, keys), len(run) - 1)
            is_equal = run[places] == keys
            if self._is_hashed:
                is_equal &= (members[:, places] == states).all(axis=0)
            found |= is_equal
        return found

    def _missing(self, keys: Codes, states: Words, places: Indices, run: Codes, members: Words) -> Flags:
        """Return which of some sorted keys are not in a sorted array."""
        found = np.minimum(np.searchsorted(run, keys), len(run) - 1)
        is_missing: Flags = run[found] != keys
        if self._is_hashed:
            _check((members[:, found] == states[:, places]).all(axis=0) | is_missing)
        return is_missing

    def _merge(self, keys: Codes, states: Words) -> None:
        while self._runs and len(self._runs[-1][0]) <= 2 * len(keys):
            run, members = self._runs.pop()
            keys = np.concatenate((run, keys))
            if self._is_hashed:
                order = np.argsort(keys, kind="stable")
                keys, states = keys[order], np.concatenate((members, states), axis=1)[:, order]
            else:
                keys.sort(kind="stable")  # finds the two sorted runs
        self._runs.append((keys, states if self._is_hashed else states[:, :0]))

    def _keys(self, states: Words) -> Codes:
        if not self._is_hashed:
            word: Codes = states[0]
            return word
        keys: Codes = np.zeros(states.shape[1], np.uint64)
        for word, factor in zip(states, self._factors, strict=True):
            keys = (keys ^ word) * factor
            keys ^= keys >> np.uint64(32)
        return keys


def multiplier(number: int) -> int:
    """Return an odd factor of 64 bits; consecutive numbers have factors that are far apart (Weyl sequence)."""
    return (0x9E3779B97F4A7C15 * (number + 1) | 1) & (1 << 64) - 1


def _check(is_consistent: Flags) -> None:
    if not is_consistent.all():
        raise KeyCollisionError


class ArrayProblem:
    """A system and a goal, prepared for searches on arrays.

    Attributes:
        system: the system.
        goal: the goal.
        layout: the fields of packed states.
        vectors: compiles normal forms for them.
        moves: all moves as one matrix.
        is_goal: whether the goal holds, for each of many states.
    """

    def __init__(self, system: ReducedSystem, goal: NormalForm) -> None:
        self.system = system
        self.goal = goal
        self.layout = WordLayout(system.counts)
        self.vectors = WordVectors(self.layout, system.counts)
        self.moves = MoveMatrix(system.moves, self.layout, self.vectors)
        self.is_goal = self.vectors.test(goal)
