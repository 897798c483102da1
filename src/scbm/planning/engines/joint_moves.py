"""Moves with their parts joined: one guard on the state before, and a table for each variable that is set.

After actions each variable is a function of one variable before them, given as a `ValueTable`. Substituting the tables
into a normal form gives its weakest precondition: what must hold before the actions so that the form holds after them.
Keeping only some values of each variable is a substitution, too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, assert_never

from scbm.model.normal_form import AllOf, AnyOf, NormalForm, OneOf, Pair, all_of, any_of, bits_of, normal_form, one_of
from scbm.model.packing import ValueTable, value_table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.model import StateSpace, Value
    from scbm.planning.engines.transition_system import Move, TransitionSystem


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
    return substitute(form, restricting_tables(values))


def restricting_tables(values: Sequence[tuple[int, ...]]) -> tuple[ValueTable, ...]:
    """Return the tables for variables that keep only these of their values, which are numbered anew."""
    return tuple(ValueTable(variable, variable, kept) for variable, kept in enumerate(values))


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


@dataclass(frozen=True, slots=True)
class JointMove:
    """A move as one step.

    Attributes:
        index: the place of the move in its system.
        guard: the states before the move in which it is enabled.
        writes: the table of each variable that is set, in the order of the space.
    """

    index: int
    guard: NormalForm
    writes: tuple[ValueTable, ...]


def joint_moves(system: TransitionSystem) -> tuple[JointMove, ...]:
    """Return all moves of a system, joined, over the whole domains of its variables."""
    untouched = identity_tables(system.space)
    return tuple(_joined(index, move, system.space, untouched) for index, move in enumerate(system.moves))


def restricted_moves(moves: Iterable[JointMove], values: Sequence[tuple[int, ...]]) -> tuple[JointMove, ...]:
    """Return the moves for variables that keep only these of their values, which are numbered anew."""
    tables = restricting_tables(values)
    numbers = [{old: new for new, old in enumerate(kept)} for kept in values]
    found = []
    for move in moves:
        writes = tuple(_restricted_table(write, values, numbers) for write in move.writes)
        found.append(JointMove(move.index, substitute(move.guard, tables), _without_identities(writes)))
    return tuple(found)


def _joined(index: int, move: Move, space: StateSpace, untouched: tuple[ValueTable, ...]) -> JointMove:
    tables = list(untouched)
    targets: set[int] = set()
    conditions: list[NormalForm] = []
    for part in move.parts:
        guard = normal_form(part.guard, space)
        written = [value_table(action, space) for action in part.actions]
        if targets:  # before any action each variable is itself
            guard = substitute(guard, tables)
            written = [composed(table, tables) for table in written]
        conditions.append(guard)
        conditions.extend(map(inside_domain, written))
        for table in written:
            tables[table.target] = table
            targets.add(table.target)
    return JointMove(index, all_of(conditions), _without_identities([tables[target] for target in sorted(targets)]))


def _without_identities(tables: Sequence[ValueTable]) -> tuple[ValueTable, ...]:
    return tuple(table for table in tables if not table.is_identity)


def _restricted_table(
    table: ValueTable, values: Sequence[tuple[int, ...]], numbers: Sequence[Mapping[int, int]]
) -> ValueTable:
    renumbered = numbers[table.target]
    indices = (table.indices[old] for old in values[table.source])
    kept = tuple(None if index is None else renumbered.get(index) for index in indices)
    return ValueTable(table.target, table.source, kept)
