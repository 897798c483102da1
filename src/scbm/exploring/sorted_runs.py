"""A growing set of codes as sorted arrays. Each is much longer than the next, so there are few to look through."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias, TypeVar

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Codes: TypeAlias = NDArray[np.uint64]

Number = TypeVar("Number", np.uint64, np.int32)


class SortedRuns:
    """Codes, each of them once. An array is merged with the next as soon as that is half as long."""

    def __init__(self) -> None:
        self._runs: list[Codes] = []

    def __len__(self) -> int:
        return sum(map(len, self._runs))

    def add(self, codes: Codes) -> None:
        """Adds sorted codes that are all new."""
        if not len(codes):
            return
        while self._runs and len(self._runs[-1]) <= 2 * len(codes):
            codes = _merged(self._runs.pop(), codes)
        self._runs.append(codes)

    def without(self, codes: Codes) -> Codes:
        """Those of some sorted codes that are not in the set."""
        for run in self._runs:
            codes = codes[~contained(codes, run)]
        return codes

    def all(self) -> Codes:
        """All codes, sorted; there is one run only afterwards."""
        while len(self._runs) > 1:
            self._runs.append(_merged(self._runs.pop(), self._runs.pop()))
        return self._runs[0] if self._runs else np.empty(0, np.uint64)


def distinct(numbers: NDArray[Number]) -> NDArray[Number]:
    """Each of the numbers once, sorted. Sorting takes a tenth of the time that hashing takes (`numpy.unique`)."""
    numbers = np.sort(numbers)
    is_first = np.ones(len(numbers), np.bool_)
    np.not_equal(numbers[1:], numbers[:-1], out=is_first[1:])
    return numbers[is_first]


def contained(codes: Codes, run: Codes) -> NDArray[np.bool_]:
    """Which of the codes are in a sorted array."""
    if not len(run):
        return np.zeros(len(codes), np.bool_)
    places = np.searchsorted(run, codes)
    found: NDArray[np.bool_] = run[np.minimum(places, len(run) - 1)] == codes
    return found


def _merged(one: Codes, other: Codes) -> Codes:
    """Both, sorted; the stable sort finds the two runs and merges them."""
    both = np.concatenate((one, other))
    both.sort(kind="stable")
    return both
