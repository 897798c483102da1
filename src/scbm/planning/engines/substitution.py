"""Substitution of tables into normal forms: what must hold before some actions so that a form holds after them.

After actions each variable is a function of one variable before them, given as a `ValueTable`. Substituting the tables
into a normal form gives its weakest precondition. Keeping only some values of each variable is a substitution, too.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, assert_never

from scbm.model.normal_form import AllOf, AnyOf, OneOf, Pair, all_of, any_of, bits_of, one_of
from scbm.model.packing import ValueTable

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.model import StateSpace, Value
    from scbm.model.normal_form import NormalForm


def identity_tables(space: StateSpace) -> tuple[ValueTable, ...]:
    """Return the table of each variable before any action."""
    return tuple(ValueTable(position, position, tuple(range(len(v.domain)))) for position, v in enumerate(space))


def composed(table: ValueTable, before: Sequence[ValueTable]) -> ValueTable:
    """Return the table of an action that follows others; `before` has the table of each variable after those."""
    source = before[table.source]
    indices = tuple(None if index is None else table.indices[index] for index in source.indices)
    return ValueTable(table.target, source.source, indices)


def substitute(form: NormalForm, tables: Sequence[ValueTable]) -> NormalForm:
    """Return what must hold of the sources so that the form holds of the targets; `tables` has one per variable."""
    match form:
        case bool():
            return form
        case OneOf(variable, allowed):
            return _source_literal(tables[variable], lambda index: bool(allowed >> index & 1))
        case Pair():
            return _substituted_pair(form, tables[form.left], tables[form.right])
        case AllOf(parts):
            return all_of(substitute(part, tables) for part in parts)
        case AnyOf(parts):
            return any_of(substitute(part, tables) for part in parts)
        case _:
            assert_never(form)


def restricted(form: NormalForm, values: Sequence[tuple[int, ...]]) -> NormalForm:
    """Return the form for variables that keep only these of their values, which are numbered anew."""
    return substitute(form, [ValueTable(variable, variable, kept) for variable, kept in enumerate(values)])


def inside_domain(table: ValueTable) -> NormalForm:
    """Return the condition that the target is inside its domain."""
    return _source_literal(table, lambda _: True)


def _source_literal(table: ValueTable, allows: Callable[[int], bool]) -> NormalForm:
    allowed = bits_of(i for i, index in enumerate(table.indices) if index is not None and allows(index))
    return one_of(table.source, allowed, len(table.indices))


def _substituted_pair(pair: Pair, left: ValueTable, right: ValueTable) -> NormalForm:
    """A comparison with one value on a side, or of one variable on both sides, is a literal about one variable."""
    lefts, rights = _column(pair.left_values, left), _column(pair.right_values, right)
    if left.source == right.source:
        both = enumerate(zip(lefts, rights, strict=True))
        return one_of(left.source, bits_of(i for i, (one, other) in both if pair.holds(one, other)), len(lefts))
    if len(lefts) == 1:
        row = bits_of(i for i, value in enumerate(rights) if pair.holds(lefts[0], value))
        return one_of(right.source, row, len(rights))
    if len(rights) == 1:
        row = bits_of(i for i, value in enumerate(lefts) if pair.holds(value, rights[0]))
        return one_of(left.source, row, len(lefts))
    return replace(pair, left=left.source, left_values=lefts, right=right.source, right_values=rights)


def _column(values: Sequence[Value | None], table: ValueTable) -> tuple[Value | None, ...]:
    return tuple(None if index is None else values[index] for index in table.indices)
