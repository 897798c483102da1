"""Small changes of sums, `min` and `max`: another constant, another variable, another sign."""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from scbm.model import Constant, Extreme, ExtremeKind, Reference, Sum
from scbm.model.predicates import bounds

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from scbm.model import StateSpace, Term

    TermEdit = Callable[[Term], Iterable[Term]]


def with_other_part(term: Term, edit: TermEdit) -> Iterator[Term]:
    """Yield the term with one variable or constant in it changed, for each of them and each change of it by `edit`."""
    match term:
        case Reference() | Constant():
            yield from edit(term)
        case Sum(parts):
            for index, (sign, part) in enumerate(parts):
                for other in with_other_part(part, edit):
                    yield Sum((*parts[:index], (sign, other), *parts[index + 1 :]))
        case Extreme(kind, terms):
            for index, part in enumerate(terms):
                for other in with_other_part(part, edit):
                    yield Extreme(kind, (*terms[:index], other, *terms[index + 1 :]))
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
                    yield Sum.of((*parts[:index], (-sign, part), *parts[index + 1 :]))
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
