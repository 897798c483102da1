"""Small changes of sums, `min` and `max`: another constant, another variable, another sign; and of any tuples."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, TypeVar, assert_never

from scbm.model import Constant, Extreme, ExtremeKind, Reference, Sum
from scbm.model.predicates import bounds

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from scbm.model import StateSpace, Term

    TermEdit = Callable[[Term], Iterable[Term]]


T = TypeVar("T")


def replaced(items: tuple[T, ...], index: int, *others: T) -> tuple[T, ...]:
    """Return the items with `others` in place of the one at `index`; without that one if there are no others."""
    return (*items[:index], *others, *items[index + 1 :])


def with_swapped_neighbours(items: tuple[T, ...]) -> Iterator[tuple[T, T, tuple[T, ...]]]:
    """Yield each pair of neighbours, and the items in which these two have changed places."""
    for index, (first, second) in enumerate(pairwise(items)):
        yield first, second, (*items[:index], second, first, *items[index + 2 :])


def with_other_part(term: Term, edit: TermEdit) -> Iterator[Term]:
    """Yield the term with one variable or constant in it changed, for each of them and each change of it by `edit`."""
    match term:
        case Reference() | Constant():
            yield from edit(term)
        case Sum(parts):
            for index, (sign, part) in enumerate(parts):
                for other in with_other_part(part, edit):
                    yield Sum(replaced(parts, index, (sign, other)))
        case Extreme(kind, terms):
            for index, part in enumerate(terms):
                for other in with_other_part(part, edit):
                    yield Extreme(kind, replaced(terms, index, other))
        case _:
            assert_never(term)


def other_constants(term: Term) -> Iterator[Term]:
    """Yield the term with each constant in it one less and one greater."""
    yield from with_other_part(term, _neighbours)


def _neighbours(term: Term) -> Iterator[Term]:
    if isinstance(term, Constant):
        yield from (Constant(int(term.constant) + step) for step in (-1, 1))


def other_calculations(term: Term) -> Iterator[Term]:
    """Yield the term with the other sign of each part, and with `max` in place of `min`; only on its outside."""
    match term:
        case Sum(parts):
            for index, (sign, part) in enumerate(parts):
                if index:
                    yield Sum.of(replaced(parts, index, (-sign, part)))
        case Extreme(kind, terms):
            other = ExtremeKind.GREATEST if kind is ExtremeKind.LEAST else ExtremeKind.LEAST
            yield Extreme(other, terms)
        case Reference() | Constant():
            return
        case _:
            assert_never(term)


def can_meet(left: Term, right: Term, space: StateSpace) -> bool:
    """Return whether two integer terms may have a common value, which a model file asks for (semantics 2.2)."""
    domains = {name: space[name].domain for name in (*left.reads(), *right.reads())}
    (low, high), (least, most) = bounds(left, domains), bounds(right, domains)
    return max(low, least) <= min(high, most)
