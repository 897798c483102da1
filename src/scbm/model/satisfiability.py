"""Whether a predicate is satisfiable: forward checking and backtracking over its normal form.

A node of the search first narrows the variables by all literals about one variable, then discards the branch if some
disjunction or comparison has no choice left, and only then branches (Russell and Norvig, chapter 6).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from scbm.model.normal_form import AllOf, AnyOf, OneOf, Pair, bits_of, indices_of, normal_form

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model.normal_form import NormalForm
    from scbm.model.predicates import Predicate
    from scbm.model.values import Value
    from scbm.model.variables import StateSpace

_MAX_BRANCHES = 100_000
"""Maximum number of branches of one search, which takes a second at most; beyond it the answer is unknown."""

_VALUES_PER_BRANCH = 16
"""A comparison with this many values costs about as much as one branch."""


class _TooManyBranchesError(Exception):
    pass


def is_satisfiable(
    predicate: Predicate, space: StateSpace, values: Mapping[str, Sequence[Value]] | None = None
) -> bool | None:
    """Return whether a state of the space satisfies the predicate; `None` if the search met its limit.

    Args:
        predicate: what is to hold.
        space: the variables.
        values: for some variables the only values that they may have.
    """
    try:
        form = normal_form(predicate, space)
    except RecursionError:
        return None
    allowed = [*space.all_values]
    for name, known in (values or {}).items():
        allowed[space.position(name)] = bits_of(map(space[name].domain.index, known))
    return satisfiable(form, allowed)


def satisfiable(form: NormalForm, values: Sequence[int], most_branches: int = _MAX_BRANCHES) -> bool | None:
    """Return whether the form holds for some choice of values; `None` if the search met its limit.

    Args:
        form: what is to hold.
        values: for each variable of the space the values that it may have, as bits.
        most_branches: the maximum number of branches of the search.
    """
    try:
        return _Backtracking(most_branches).satisfy((form,), values)
    except (_TooManyBranchesError, RecursionError):
        return None


class _Backtracking:
    def __init__(self, most_branches: int) -> None:
        self._branches, self._most_branches = 0, most_branches

    def satisfy(self, forms: Sequence[NormalForm], values: Sequence[int]) -> bool:
        """Return whether all forms can hold at once. Raises `_TooManyBranchesError`."""
        left = list(values)
        choices = _narrow(forms, left)
        if choices is None or not all(_may_hold(choice, left) for choice in choices):
            return False
        if not choices or (len(choices) == 1 and isinstance(choices[0], Pair)):
            return True
        options = self._options(choices[0], left)
        return any(self.satisfy((option, *choices[1:]), left) for option in options)

    def _options(self, choice: AnyOf | Pair, values: Sequence[int]) -> Iterator[NormalForm]:
        """Yield the branches of a choice."""
        if isinstance(choice, AnyOf):
            for part in choice.parts:
                self._count(1)
                yield part
            return
        for index in indices_of(values[choice.left]):
            self._count(1 + len(choice.right_values) // _VALUES_PER_BRANCH)
            left = OneOf(choice.left, 1 << index, len(choice.left_values))
            yield AllOf((left, OneOf(choice.right, choice.row(index), len(choice.right_values))))

    def _count(self, branches: int) -> None:
        self._branches += branches
        if self._branches > self._most_branches:
            raise _TooManyBranchesError


def _narrow(forms: Sequence[NormalForm], values: list[int]) -> list[AnyOf | Pair] | None:
    """Narrow `values` by all literals about one variable, and return what is left to choose; `None` if that fails."""
    pending, choices = list(forms), []
    while pending:
        form = pending.pop()
        match form:
            case bool():
                if not form:
                    return None
            case OneOf(variable, allowed):
                values[variable] &= allowed
                if not values[variable]:
                    return None
            case AllOf(parts):
                pending += parts
            case AnyOf() | Pair():
                choices.append(form)
            case _:
                assert_never(form)
    return choices


def _may_hold(form: NormalForm, values: Sequence[int]) -> bool:
    """Return whether each part of the form can hold by itself; `False` is certain, `True` only for a literal."""
    match form:
        case bool():
            return form
        case OneOf(variable, allowed):
            return bool(allowed & values[variable])
        case Pair():
            return _may_compare(form, values)
        case AllOf(parts):
            return all(_may_hold(part, values) for part in parts)
        case AnyOf(parts):
            return any(_may_hold(part, values) for part in parts)
        case _:
            assert_never(form)


def _may_compare(pair: Pair, values: Sequence[int]) -> bool:
    """Decide orders by the extremes of both sides, equality by a common value, inequality by two values."""
    left = [v for i in indices_of(values[pair.left]) if (v := pair.left_values[i]) is not None]
    right = [v for i in indices_of(values[pair.right]) if (v := pair.right_values[i]) is not None]
    if not left or not right:
        return False
    if pair.is_order:
        ends = (min(map(int, right)), max(map(int, right)))
        return any(pair.holds(one, other) for one in (min(map(int, left)), max(map(int, left))) for other in ends)
    if pair.holds(left[0], left[0]):
        return not frozenset(left).isdisjoint(right)
    return any(value != left[0] for value in (*left, *right))
