"""What is known of a situation as literals: for each variable and each of its values, whether it has that value."""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING, TypeAlias

from scbm.model import And, Implies, Not, OperationState, Or, Truth
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, operation_state_name
from scbm.proofcheck.sets.clauses import TRUE

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.model import Action, BehaviorModel, Predicate, StateSpace, Value
    from scbm.proofcheck.sets.clauses import Clauses

ValueLiterals: TypeAlias = "dict[Value, int]"
"""For each value of a variable the literal that holds where the variable has it: exactly one of them does."""

MAX_CHOICES = 100_000
"""Maximum number of combinations of values that one comparison or assignment reads."""


class TooManyChoicesError(Exception):
    """A comparison or an assignment reads too many combinations of values."""


def new_values(values: Sequence[Value], clauses: Clauses) -> ValueLiterals:
    """Return the literals of a new variable that has any one of some values."""
    bits = [clauses.new() for _ in range((len(values) - 1).bit_length())]
    codes = [[bit if number >> at & 1 else -bit for at, bit in enumerate(bits)] for number in range(1 << len(bits))]
    for code in codes[len(values) :]:
        clauses.add(*(-bit for bit in code))
    return {value: clauses.all_of(code) for value, code in zip(values, codes, strict=False)}


class SituationView:
    """The values of the variables of the running space in a situation, or in a state that a plan predicts."""

    def __init__(self, literals: Mapping[str, ValueLiterals], space: StateSpace, clauses: Clauses) -> None:
        self._literals = literals
        self._space = space
        self._clauses = clauses
        self._known: dict[Predicate, int] = {}

    @staticmethod
    def of_world(literals: Mapping[str, ValueLiterals], model: BehaviorModel, clauses: Clauses) -> SituationView:
        """Return the view of a situation; the states of operations follow from the current one."""
        found = dict(literals)
        names, states = literals[CURRENT_NAME], literals[CURRENT_STATE]
        for operation in model.operations:
            current = names[operation.name]
            own = {value: clauses.all_of((current, literal)) for value, literal in states.items()}
            initial = OperationState.INITIAL.value
            own[initial] = clauses.any_of((-current, states[initial]))
            found[operation_state_name(operation.name)] = own
        return SituationView(found, model.running_space, clauses)

    @staticmethod
    def of_plan(literals: Mapping[str, ValueLiterals], model: BehaviorModel, clauses: Clauses) -> SituationView:
        """Return the view of a state that a plan predicts, in which the runner is at rest (semantics 4.1)."""
        space = model.running_space
        runner = {
            v.name: {x: TRUE if x == v.initial else -TRUE for x in v.domain.values} for v in space if v.role.is_runner
        }
        return SituationView({**literals, **runner}, space, clauses)

    def values(self, name: str) -> ValueLiterals:
        """Return the literals of a variable."""
        return self._literals[name]

    def has(self, name: str, *values: Value) -> int:
        """Return the literal that a variable has one of some values."""
        return self._clauses.any_of(self._literals[name][value] for value in values)

    def holds(self, predicate: Predicate) -> int:
        """Return the literal of a predicate. Raises `TooManyChoicesError`."""
        if predicate not in self._known:
            self._known[predicate] = self._holds(predicate)
        return self._known[predicate]

    def _holds(self, predicate: Predicate) -> int:
        match predicate:
            case Truth(truth):
                return TRUE if truth else -TRUE
            case Not(operand):
                return -self.holds(operand)
            case And(operands):
                return self._clauses.all_of(map(self.holds, operands))
            case Or(operands):
                return self._clauses.any_of(map(self.holds, operands))
            case Implies(condition, consequence):
                return self._clauses.any_of((-self.holds(condition), self.holds(consequence)))
            case _:
                choices = self._choices(predicate.reads())
                return self._clauses.any_of(literal for values, literal in choices if predicate.holds(values))

    def after(self, actions: Iterable[Action]) -> tuple[int, dict[str, ValueLiterals]]:
        """Return whether actions stay in their domains, and the values that they give; of known variables alone."""
        inside, given = TRUE, dict[str, "ValueLiterals"]()
        for action in actions:
            if action.target not in self._literals:
                continue
            domain = self._space[action.target].domain
            ways: dict[Value, list[int]] = {value: [] for value in domain.values}
            for values, literal in self._choices(action.reads()):
                value = action.value(values)
                if value in domain:
                    ways[value].append(literal)
                else:
                    inside = self._clauses.all_of((inside, -literal))
            given[action.target] = {value: self._clauses.any_of(found) for value, found in ways.items()}
        return inside, given

    def following(self, given: Mapping[str, ValueLiterals]) -> SituationView:
        """Return the view in which some variables have got new values."""
        return SituationView({**self._literals, **given}, self._space, self._clauses)

    def _choices(self, names: Sequence[str]) -> Iterator[tuple[Mapping[str, Value], int]]:
        domains = [self._space[name].domain.values for name in names]
        if prod(map(len, domains)) > MAX_CHOICES:
            raise TooManyChoicesError
        for values in product(*domains):
            chosen = dict(zip(names, values, strict=True))
            yield chosen, self._clauses.all_of(self._literals[name][value] for name, value in chosen.items())
