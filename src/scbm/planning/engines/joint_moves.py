"""Moves with their parts joined: one guard on the state before, and a table for each variable that is set.

After actions each variable is a function of one variable before them, given as a `ValueTable`. Substituting the tables
into a normal form gives its weakest precondition: what must hold before the actions so that the form holds after them.
Keeping only some values of each variable is a substitution, too.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from msgspec import Struct
from msgspec.structs import replace

from scbm.model.normal_form import AllOf, AnyOf, NormalForm, OneOf, Pair, all_of, any_of, bits_of, normal_form, one_of
from scbm.model.packing import ValueTable, value_table

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.model import Action, StateSpace, Value
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


class JointMove(Struct, frozen=True):
    """A move as one step.

    Attributes:
        index: the place of the move in its system; moves in a row may be the cases of one (decision 51).
        guard: the states before the move in which it is enabled.
        writes: the table of each variable that is set, in the order of the space.
    """

    index: int
    guard: NormalForm
    writes: tuple[ValueTable, ...]


def joint_moves(system: TransitionSystem) -> tuple[JointMove, ...]:
    """Return all moves of a system, joined, over the whole domains of its variables.

    A move with sums of several variables becomes several, with the same index and no common state.
    """
    untouched = identity_tables(system.space)
    numbered = enumerate(system.moves)
    return tuple(joined for index, move in numbered for joined in _joined(index, move, system.space, untouched))


def restricted_moves(moves: Iterable[JointMove], values: Sequence[tuple[int, ...]]) -> tuple[JointMove, ...]:
    """Return the moves for variables that keep only these of their values, which are numbered anew."""
    tables = restricting_tables(values)
    numbers = [{old: new for new, old in enumerate(kept)} for kept in values]
    found = []
    for move in moves:
        writes = tuple(_restricted_table(write, values, numbers) for write in move.writes)
        found.append(JointMove(move.index, substitute(move.guard, tables), _without_identities(writes)))
    return tuple(found)


def _joined(index: int, move: Move, space: StateSpace, untouched: tuple[ValueTable, ...]) -> Iterator[JointMove]:
    """Yield a move as one step, or as one for each case of the variables that its sums read."""
    parts = [(normal_form(part.guard, space), part.actions) for part in move.parts]
    pending: list[dict[int, int]] = [{}]
    while pending:
        case = pending.pop()
        found = _JoinedCase(index, parts, space, untouched, case).joined()
        if isinstance(found, JointMove):
            if found.guard is not False or not case:
                yield found
        else:
            pending += [{**case, found: value} for value in reversed(range(len(untouched[found].indices)))]


class _JoinedCase:
    """A move where some variables have certain values."""

    def __init__(
        self,
        index: int,
        parts: Sequence[tuple[NormalForm, Sequence[Action]]],
        space: StateSpace,
        untouched: Sequence[ValueTable],
        case: Mapping[int, int],
    ) -> None:
        self._index, self._parts, self._space = index, parts, space
        self._tables = list(untouched)
        self._conditions: list[NormalForm] = []
        for variable, value in case.items():
            count = len(untouched[variable].indices)
            self._tables[variable] = ValueTable(variable, variable, _only(value, count))
            self._conditions.append(one_of(variable, 1 << value, count))
        self._is_case = self._is_changed = bool(case)

    def joined(self) -> JointMove | int:
        """Return the move, or a variable whose cases must be distinguished because a sum reads several variables."""
        targets: set[int] = set()
        for guard, actions in self._parts:
            # before any action each variable is itself
            self._conditions.append(substitute(guard, self._tables) if self._is_changed else guard)
            if self._is_case and all_of(self._conditions) is False:
                return JointMove(self._index, False, ())
            written = []
            for action in actions:
                table = self._written(action)
                if isinstance(table, int):
                    return table
                written.append(table)
            self._conditions.extend(map(inside_domain, written))
            for table in written:
                self._tables[table.target] = table
                targets.add(table.target)
            self._is_changed = self._is_changed or bool(written)
        written = [self._tables[target] for target in sorted(targets)]
        return JointMove(self._index, all_of(self._conditions), _without_identities(written))

    def _written(self, action: Action) -> ValueTable | int:
        """Return the table of an action, or a variable that has to have one value before."""
        names = action.reads()
        if len(names) <= 1:
            table = value_table(action, self._space)
            return composed(table, self._tables) if self._is_changed else table
        read = [self._tables[self._space.position(name)] for name in names]
        sources = list(dict.fromkeys(table.source for table in read if not _is_known(table)))
        if len(sources) > 1:
            return min(sources, key=lambda source: len(self._space.variables[source].domain))
        target = self._space.position(action.target)
        source = sources[0] if sources else target
        count = len(self._space.variables[source].domain)
        return ValueTable(target, source, tuple(self._image(action, names, read, index) for index in range(count)))

    def _image(self, action: Action, names: Sequence[str], read: Sequence[ValueTable], index: int) -> int | None:
        """Return the new value of a target where the one open source has a value; `None` outside the domain."""
        values: dict[str, Value] = {}
        for name, table in zip(names, read, strict=True):
            found = _known(table) if _is_known(table) else table.indices[index]
            if found is None:
                return None
            values[name] = self._space[name].domain.values[found]
        domain, value = self._space[action.target].domain, action.value(values)
        return domain.index(value) if value in domain else None


def _only(value: int, count: int) -> tuple[int | None, ...]:
    return tuple(index if index == value else None for index in range(count))


def _is_known(table: ValueTable) -> bool:
    """Return whether a table gives one value wherever it gives any."""
    return len(frozenset(table.indices) - {None}) <= 1


def _known(table: ValueTable) -> int | None:
    return next((index for index in table.indices if index is not None), None)


def _without_identities(tables: Sequence[ValueTable]) -> tuple[ValueTable, ...]:
    return tuple(table for table in tables if not table.is_identity)


def _restricted_table(
    table: ValueTable, values: Sequence[tuple[int, ...]], numbers: Sequence[Mapping[int, int]]
) -> ValueTable:
    renumbered = numbers[table.target]
    indices = (table.indices[old] for old in values[table.source])
    kept = tuple(None if index is None else renumbered.get(index) for index in indices)
    return ValueTable(table.target, table.source, kept)
