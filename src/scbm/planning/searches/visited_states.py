"""Sets of states on arrays, sorted by keys of one word."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scbm.planning.engines.array_engine import Codes, Flags, Indices
    from scbm.planning.searches.array_moves import Words


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
