"""`count` as a formula: at least n of some predicates hold, written with `&&` and `||` and few copies of each."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Sequence


class Joint(Struct, frozen=True):
    """A conjunction (`&&`) or a disjunction (`||`) of formulas; a number stands for the predicate with this index."""

    connective: str
    operands: tuple[Threshold, ...]


Threshold: TypeAlias = "Joint | int | bool"


def at_least(number: int, predicates: int) -> Threshold:
    """Return the formula for: at least `number` of the predicates with the indices `0..predicates-1` hold.

    Each half of the predicates has its share of the number, so the size is about n log(n) for a number of 2. Beyond
    the middle, the dual formula is smaller: at least n of N hold if no N-n+1 of them fail.
    """
    indices = range(predicates)
    if number > 1 and 2 * number > predicates + 1:
        return _shared(predicates - number + 1, indices, "&&", "||")
    return _shared(number, indices, "||", "&&")


def copies(number: int, predicates: int) -> int:
    """Return how many copies of predicates `at_least` would have."""
    dual = number > 1 and 2 * number > predicates + 1
    return _copies(predicates - number + 1 if dual else number, predicates)


@cache
def _copies(number: int, predicates: int) -> int:
    if number <= 0 or number > predicates:
        return 0
    if number in (1, predicates):
        return predicates
    left = predicates // 2
    shares = range(max(0, number - predicates + left), min(number, left) + 1)
    return sum(_copies(share, left) + _copies(number - share, predicates - left) for share in shares)


def _shared(number: int, indices: Sequence[int], some: str, both: str) -> Threshold:
    """Return the formula; `some` joins alternatives, and `both` joins what each of them needs."""
    holds = some == "||"
    if number <= 0:
        return holds
    if number > len(indices):
        return not holds
    if number == 1 or number == len(indices):
        connective = some if number == 1 else both
        return indices[0] if len(indices) == 1 else Joint(connective, tuple(indices))
    middle = len(indices) // 2
    left, right = indices[:middle], indices[middle:]
    ways = []
    for share in range(max(0, number - len(right)), min(number, len(left)) + 1):
        parts = [_shared(n, half, some, both) for n, half in ((share, left), (number - share, right))]
        needed = tuple(part for part in parts if not isinstance(part, bool))
        ways.append(needed[0] if len(needed) == 1 else Joint(both, needed))
    return ways[0] if len(ways) == 1 else Joint(some, tuple(ways))
