"""Packed states: states as integers, and predicates and actions compiled to functions on them.

Each variable has a field of bits with the index of its value in its domain. A conjunction of equalities is one AND and
one comparison; the assignments of a transition are one AND and one OR. A compiled function gives exactly what the
predicate or the actions give on the named state (checked by property tests).
"""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING, TypeAlias, assert_never, cast

from msgspec import Struct

from scbm.model.normal_form import AllOf, AnyOf, OneOf, Pair, normal_form
from scbm.model.operations import Action, Add, Assign
from scbm.model.predicates import Constant, Extreme, ExtremeKind, Predicate, Reference, Sum, Term
from scbm.model.variables import State

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.model.normal_form import NormalForm
    from scbm.model.values import Domain, Value
    from scbm.model.variables import StateSpace, Variable

    Test: TypeAlias = Callable[[int], bool]
    Update: TypeAlias = Callable[[int], int | None]
    PlacedUpdate: TypeAlias = tuple[int, Update]


class BitRange(Struct, frozen=True):
    """A range of bits of an integer.

    Attributes:
        shift: the lowest bit.
        mask: all its bits, in place.
    """

    shift: int
    mask: int

    def index(self, packed: int) -> int:
        """Return the number that an integer has here."""
        return (packed & self.mask) >> self.shift


class Field(BitRange, frozen=True):
    """The range of bits that has the index of a variable's value in its domain.

    Attributes:
        variable: the variable.
        width: how many bits; 0 for a domain of one value.
    """

    variable: Variable
    width: int

    def bits(self, value: Value) -> int:
        """Return a value, in place. Raises `KeyError` if it is outside the domain."""
        return self.variable.domain.index(value) << self.shift


def bit_width(count: int) -> int:
    """Return the number of bits that `count` different numbers need."""
    return max(count - 1, 0).bit_length()


def lay_out(space: StateSpace) -> tuple[Field, ...]:
    """Return a field for each variable of the space, one after the other."""
    fields = []
    shift = 0
    for variable in space:
        width = bit_width(len(variable.domain))
        fields.append(Field(shift, ((1 << width) - 1) << shift, variable, width))
        shift += width
    return tuple(fields)


_MAX_MEMOIZED_CHANGES = 50_000
"""Maximum number of pairs of states whose changes are memoized: some 20 MB. A campaign repeats the same pairs."""


class Packing:
    """The fields of a space. Immutable; everything it returns is a pure function."""

    def __init__(self, space: StateSpace) -> None:
        self.space = space
        self.fields = lay_out(space)
        # The same as the fields, unpacked: these are read for every record of every run.
        readers = [(f.variable.name, f.variable.domain.values, f.mask, f.shift) for f in self.fields]
        self._readers = tuple(readers)
        self._by_bit = [r for f, r in zip(self.fields, readers, strict=True) for _ in range(f.width)]
        self._changes: dict[tuple[int, int], tuple[tuple[str, Value], ...]] = {}
        self._writers = tuple((f.variable.name, {v: f.bits(v) for v in f.variable.domain.values}) for f in self.fields)

    def __getitem__(self, name: str) -> Field:
        return self.fields[self.space.position(name)]

    def pack(self, state: Mapping[str, Value]) -> int:
        """Return the state as an integer. `state` may have more variables than the space."""
        packed = 0
        for name, bits in self._writers:
            packed |= bits[state[name]]
        return packed

    def value(self, packed: int, name: str) -> Value:
        """Return the value of a variable in the packed state."""
        field = self[name]
        return field.variable.domain.values[field.index(packed)]

    def values(self, packed: int) -> dict[str, Value]:
        """Return all variables of the packed state by name, in order."""
        return {name: values[(packed & mask) >> shift] for name, values, mask, shift in self._readers}

    def reader(self, names: Iterable[str]) -> Callable[[int], tuple[Value, ...]]:
        """Return a function from packed states to the values of these variables, in their order."""
        fields = [self[name] for name in names]
        readers = tuple((field.variable.domain.values, field.mask, field.shift) for field in fields)
        return lambda packed: tuple([values[(packed & mask) >> shift] for values, mask, shift in readers])

    def unpack(self, packed: int) -> State:
        """Return the packed state as a named state."""
        return State(self.space, self.values(packed))

    def changes(self, before: int, after: int) -> tuple[tuple[str, Value], ...]:
        """Return the variables that differ, in order, with their values in `after`; memoized, as runs repeat them."""
        known = self._changes.get((before, after))
        if known is None:
            known = self._new_changes(before, after)
            if len(self._changes) < _MAX_MEMOIZED_CHANGES:
                self._changes[before, after] = known
        return known

    def _new_changes(self, before: int, after: int) -> tuple[tuple[str, Value], ...]:
        changes = []
        difference = before ^ after
        while difference:
            name, values, mask, shift = self._by_bit[(difference & -difference).bit_length() - 1]
            changes.append((name, values[(after & mask) >> shift]))
            difference &= ~mask
        return tuple(changes)

    def assignment(self, values: Mapping[str, Value]) -> tuple[int, int]:
        """Return `(keep, bits)`, so that `packed & keep | bits` assigns these values and keeps all others."""
        mask = bits = 0
        for name, value in values.items():
            mask |= self[name].mask
            bits |= self[name].bits(value)
        return ~mask, bits

    def test(self, predicate: Predicate) -> Test:
        """Return the predicate as a function of packed states."""
        return compile_test(normal_form(predicate, self.space), self.fields)

    def cube(self, predicate: Predicate) -> tuple[int, int]:
        """Return `(mask, bits)`, so that `packed & mask == bits` wherever the predicate holds: a cheap first test."""
        return self.cube_of(normal_form(predicate, self.space))

    def cube_of(self, form: NormalForm) -> tuple[int, int]:
        """Return the same for a predicate in normal form."""
        return _cube(form.parts if isinstance(form, AllOf) else (form,), self.fields)

    def update(self, actions: Iterable[Action]) -> Update:
        """Return the actions, at once, as a function of packed states; it gives `None` if a domain would be left."""
        fixed: dict[str, Value] = {}
        moves: list[ValueTable] = []
        sums: list[PlacedUpdate] = []
        for action in actions:
            if isinstance(action, Assign) and isinstance(action.source, Constant):
                fixed[action.target] = action.source.constant
            elif isinstance(action, Assign) and len(action.reads()) > 1:
                sums.append((self.space.position(action.target), self._calculated(action)))
            else:
                moves.append(value_table(action, self.space))
        return compile_update(moves, self.fields, self.assignment(fixed), sums)

    def _calculated(self, action: Assign) -> Update:
        """Return the function to the new bits of the target, as `_compile_move` does."""
        value, field = self._number(action.source), self[action.target]
        bits = {each: field.bits(each) for each in field.variable.domain.values}
        return lambda packed: bits.get(value(packed))

    def _number(self, term: Term) -> Callable[[int], int]:
        """Return a term as a function from packed states to integers."""
        match term:
            case Constant(constant):
                number = int(constant)
                return lambda _: number
            case Reference(name):
                field = self[name]
                numbers, mask, shift = tuple(map(int, field.variable.domain.values)), field.mask, field.shift
                return lambda packed: numbers[(packed & mask) >> shift]
            case Sum(parts):
                signed = [(sign, self._number(part)) for sign, part in parts]
                return lambda packed: sum([sign * read(packed) for sign, read in signed])
            case Extreme(kind, terms):
                reads = [self._number(part) for part in terms]
                if kind is ExtremeKind.LEAST:
                    return lambda packed: min([read(packed) for read in reads])
                return lambda packed: max([read(packed) for read in reads])
            case _:
                assert_never(term)


class ValueTable(Struct, frozen=True):
    """A variable that is set, as a function of one variable before the assignment.

    Attributes:
        target: the position of the variable that is set.
        source: the position of the variable that is read.
        indices: for each value of the source the index of the new value; `None` where that is outside the domain.
    """

    target: int
    source: int
    indices: tuple[int | None, ...]

    @property
    def is_identity(self) -> bool:
        """Whether the variable keeps its value, wherever the new value is inside the domain."""
        return self.target == self.source and all(new in (None, old) for old, new in enumerate(self.indices))


def value_table(action: Action, space: StateSpace) -> ValueTable:
    """Return an action as a table; where it reads nothing, the source is the target itself.

    Raises `ValueError` if it reads more than one variable.
    """
    target, domain = space.position(action.target), space[action.target].domain
    if isinstance(action, Add):
        moved = (int(value) + action.amount for value in domain.values)
        return ValueTable(target, target, _located(moved, domain))
    if not action.reads():
        return ValueTable(target, target, _located([action.value({})], domain) * len(domain))
    (name,) = action.reads()
    values = (action.value({name: value}) for value in space[name].domain.values)
    return ValueTable(target, space.position(name), _located(values, domain))


def _located(values: Iterable[Value], domain: Domain) -> tuple[int | None, ...]:
    """Return the index of each value; `None` outside the domain."""
    return tuple(domain.index(value) if value in domain else None for value in values)


def compile_update(
    moves: Sequence[ValueTable],
    fields: Sequence[BitRange],
    fixed: tuple[int, int] = (-1, 0),
    sums: Sequence[PlacedUpdate] = (),
) -> Update:
    """Return a function of packed states that sets variables at once; it gives `None` where a table does.

    Args:
        moves: the variables that are set as functions of a variable.
        fields: the field of each variable.
        fixed: `(keep, bits)` of the variables that are set to constants.
        sums: the variables that are set to sums of several variables: the position of each, and its new bits.
    """
    keep, bits = fixed
    updates = [(move.target, _compile_move(move, fields)) for move in moves] + list(sums)
    if not updates:
        return lambda packed: packed & keep | bits
    for target, _ in updates:
        keep &= ~fields[target].mask
    return _combined(keep, bits, tuple(update for _, update in updates))


def _compile_move(move: ValueTable, fields: Sequence[BitRange]) -> Update:
    """Return the function to the new bits of the target."""
    place = fields[move.target].shift
    table = [None if index is None else index << place for index in move.indices]
    shift, mask = fields[move.source].shift, fields[move.source].mask
    return lambda packed: table[(packed & mask) >> shift]


def _combined(keep: int, bits: int, moves: tuple[Update, ...]) -> Update:
    def update(packed: int) -> int | None:
        result = packed & keep | bits
        for move in moves:
            moved = move(packed)
            if moved is None:
                return None
            result |= moved
        return result

    return update


def compile_test(form: NormalForm, fields: Sequence[BitRange]) -> Test:
    """Return a normal form as a function of packed states; `fields` has the field of each variable."""
    match form:
        case bool():
            return lambda _: form
        case OneOf():
            return _compile_one_of(form, fields[form.variable])
        case Pair():
            return _compile_pair(form, fields[form.left], fields[form.right])
        case AnyOf(parts):
            return _any_of([compile_test(part, fields) for part in parts])
        case AllOf(parts):
            return _compile_all(parts, fields)
        case _:
            assert_never(form)


def _compile_one_of(literal: OneOf, field: BitRange) -> Test:
    mask, shift, allowed = field.mask, field.shift, literal.allowed
    if allowed.bit_count() == 1:
        bits = (allowed.bit_length() - 1) << shift
        return lambda packed: packed & mask == bits
    refused = literal.all_values & ~allowed
    if refused.bit_count() == 1:
        bits = (refused.bit_length() - 1) << shift
        return lambda packed: packed & mask != bits
    return lambda packed: bool(allowed >> ((packed & mask) >> shift) & 1)


def _compile_pair(pair: Pair, left: BitRange, right: BitRange) -> Test:
    left_mask, left_shift, left_values = left.mask, left.shift, pair.left_values
    right_mask, right_shift, right_values = right.mask, right.shift, pair.right_values
    holds, compare, wanted = pair.holds, pair.compare, pair.wanted
    if None in left_values or None in right_values:
        return lambda packed: holds(
            left_values[(packed & left_mask) >> left_shift], right_values[(packed & right_mask) >> right_shift]
        )
    lefts = cast("tuple[Value, ...]", left_values)
    rights = cast("tuple[Value, ...]", right_values)
    return lambda packed: (
        compare(lefts[(packed & left_mask) >> left_shift], rights[(packed & right_mask) >> right_shift]) is wanted
    )


def _compile_all(parts: tuple[NormalForm, ...], fields: Sequence[BitRange]) -> Test:
    """Compile literals with one value as one cube (mask and bits), and the other parts as tests after it."""
    mask, bits = _cube(parts, fields)
    rest = [compile_test(part, fields) for part in parts if not _is_single(part)]
    if not mask:
        return _all_of(rest)
    if not rest:
        return lambda packed: packed & mask == bits
    others = _all_of(rest)
    return lambda packed: packed & mask == bits and others(packed)


def _cube(parts: tuple[NormalForm, ...], fields: Sequence[BitRange]) -> tuple[int, int]:
    """Return the mask and bits of the literals that allow only one value."""
    mask = bits = 0
    for part in parts:
        if isinstance(part, OneOf) and _is_single(part):
            mask |= fields[part.variable].mask
            bits |= (part.allowed.bit_length() - 1) << fields[part.variable].shift
    return mask, bits


def _is_single(part: NormalForm) -> bool:
    return isinstance(part, OneOf) and part.allowed.bit_count() == 1


_MAX_NESTED = 4
"""Maximum number of tests that call each other, which is fastest; more tests are called in a loop."""


def _all_of(tests: list[Test]) -> Test:
    if len(tests) > _MAX_NESTED:
        return lambda packed: all(test(packed) for test in tests)
    return reduce(lambda first, second: lambda packed: first(packed) and second(packed), tests)


def _any_of(tests: list[Test]) -> Test:
    if len(tests) > _MAX_NESTED:
        return lambda packed: any(test(packed) for test in tests)
    return reduce(lambda first, second: lambda packed: first(packed) or second(packed), tests)
