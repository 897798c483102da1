"""The situations of runs as valuations of bits: the variables of a run, and which values they have."""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.model import And, Implies, Not, OperationState, Or, Role, Truth
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, operation_state_name

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.closing.symbolic.decision_diagrams import Diagram, DiagramManager
    from scbm.model import Action, BehaviorModel, Predicate, Value

MAX_CHOICES = 100_000
"""Maximum number of combinations of values that one comparison or assignment reads."""


class TooManyValuesError(Exception):
    """A comparison or an assignment reads too many combinations of values."""


class RunVariable(Struct, frozen=True):
    """A variable of a situation, with its values in order."""

    name: str
    values: tuple[Value, ...]

    @property
    def bits(self) -> tuple[str, ...]:
        """The names of its bits, the highest first; a variable with one value has none."""
        count = (len(self.values) - 1).bit_length()
        return tuple(f"{self.name}:{number}" for number in reversed(range(count)))

    def code(self, value: Value) -> dict[str, bool]:
        """Return the bits of a value."""
        index, bits = self.values.index(value), self.bits
        return {bit: bool(index >> len(bits) - 1 - at & 1) for at, bit in enumerate(bits)}


class AssignedValues(Struct, frozen=True):
    """One case of some assignments: where they apply, and the values that they give."""

    where: Diagram
    values: tuple[tuple[str, Value], ...]


class RunSpace:
    """Diagrams over the variables of situations.

    Attributes:
        manager: makes the diagrams.
        variables: the variables by name, in the order of their bits.
    """

    def __init__(self, variables: Sequence[RunVariable], manager: DiagramManager) -> None:
        self.manager = manager
        self.variables = {variable.name: variable for variable in variables}
        self._bits = {variable.name: variable.bits for variable in variables}
        self._known: dict[tuple[str, Value, type], Diagram] = {}

    def has(self, name: str, value: Value) -> Diagram:
        """Return where a variable has a value; nowhere if it never has."""
        key = (name, value, type(value))
        if key not in self._known:
            variable = self.variables[name]
            is_known = value in variable.values
            self._known[key] = self.manager.cube(variable.code(value)) if is_known else self.manager.false
        return self._known[key]

    def has_one_of(self, name: str, values: Iterable[Value]) -> Diagram:
        """Return where a variable has one of some values."""
        return self.any_of(self.has(name, value) for value in values)

    def any_of(self, diagrams: Iterable[Diagram]) -> Diagram:
        """Return the union."""
        found = self.manager.false
        for each in diagrams:
            found |= each
        return found

    def all_of(self, diagrams: Iterable[Diagram]) -> Diagram:
        """Return the intersection."""
        found = self.manager.true
        for each in diagrams:
            found &= each
        return found

    def bits_of(self, names: Iterable[str]) -> tuple[str, ...]:
        """Return the bits of some variables."""
        return tuple(bit for name in names for bit in self._bits[name])

    def equal(self, left: str, right: str) -> Diagram:
        """Return where two variables of the same values are equal."""
        pairs = zip(self.variables[left].bits, self.variables[right].bits, strict=True)
        bits = [(self.manager.var(one), self.manager.var(other)) for one, other in pairs]
        return self.all_of(one & other | ~one & ~other for one, other in reversed(bits))


class SpaceReader:
    """Reads predicates and actions of the model as diagrams: those of the world, or of the state that plans predict."""

    def __init__(self, space: RunSpace, model: BehaviorModel, *, prefix: str = "") -> None:
        """`prefix` begins the names of the variables of predicted states, in which the runner is at rest."""
        self._space = space
        self._model = model
        self._prefix = prefix
        self._operations = {operation_state_name(operation.name): operation.name for operation in model.operations}
        self._known: dict[Predicate, Diagram] = {}

    def holds(self, predicate: Predicate) -> Diagram:
        """Return where a predicate holds. Raises `TooManyValuesError`."""
        if predicate not in self._known:
            self._known[predicate] = self._holds(predicate)
        return self._known[predicate]

    def _holds(self, predicate: Predicate) -> Diagram:
        manager = self._space.manager
        match predicate:
            case Truth(truth):
                return manager.true if truth else manager.false
            case Not(operand):
                return ~self.holds(operand)
            case And(operands):
                return self._space.all_of(map(self.holds, operands))
            case Or(operands):
                return self._space.any_of(map(self.holds, operands))
            case Implies(condition, consequence):
                return ~self.holds(condition) | self.holds(consequence)
            case _:
                found = (where for values, where in self._choices(predicate.reads()) if predicate.holds(values))
                return self._space.any_of(found)

    def cases(self, actions: Sequence[Action]) -> Iterator[AssignedValues]:
        """Yield the cases of actions that are taken together, each where all stay in their domains.

        Actions on variables that situations do not have are left out. Raises `TooManyValuesError`.
        """
        kept = [action for action in actions if self._prefix + action.target in self._space.variables]
        domains = self._model.running_space
        for values, where in self._choices(dict.fromkeys(name for action in kept for name in action.reads())):
            given = [(action.target, action.value(values)) for action in kept]
            if all(value in domains[name].domain for name, value in given):
                yield AssignedValues(where, tuple((self._prefix + name, value) for name, value in given))

    def _choices(self, names: Iterable[str]) -> Iterator[tuple[Mapping[str, Value], Diagram]]:
        """Yield each choice of values that the variables can have together, with where they have them."""
        read = list(names)
        domains = [self._model.running_space[name].domain.values for name in read]
        if prod(map(len, domains)) > MAX_CHOICES:
            raise TooManyValuesError
        for values in product(*domains):
            pairs = list(zip(read, values, strict=True))
            yield dict(pairs), self._space.all_of(self._has(name, value) for name, value in pairs)

    def _has(self, name: str, value: Value) -> Diagram:
        space, variable = self._space, self._model.running_space[name]
        if self._prefix and variable.role.is_runner:
            return space.manager.true if value == variable.initial else space.manager.false
        if variable.role is Role.OPERATION_STATE:
            is_current = space.has(CURRENT_NAME, self._operations[name])
            is_initial = ~is_current if value == OperationState.INITIAL else space.manager.false
            return is_current & space.has(CURRENT_STATE, value) | is_initial
        return space.has(self._prefix + name, value)
