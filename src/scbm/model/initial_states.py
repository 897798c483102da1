"""The initial states that tests may start from: combinations of the random values that satisfy `initial_states`."""

from __future__ import annotations

from math import prod
from typing import TYPE_CHECKING

from scbm.model.state import State

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model.behavior import BehaviorModel
    from scbm.model.values import Value


class InitialStates:
    """The combinations of random values of a model, by number, in the order of variables and values."""

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        self.combinations = prod(len(variable.random) for variable in model.space)

    def combination(self, number: int) -> dict[str, Value]:
        """Combination `number`, whether it is allowed or not; the last variable runs fastest."""
        values: dict[str, Value] = {}
        for variable in reversed(self._model.space.variables):
            number, index = divmod(number, len(variable.random))
            values[variable.name] = variable.random[index]
        return values

    def allows(self, values: dict[str, Value]) -> bool:
        """Whether the model's `initial_states` predicate holds."""
        return self._model.initial_states.holds(values)

    def allowed(self, most: int) -> Iterator[State]:
        """The allowed states among the first `most` combinations, in order."""
        for number in range(min(most, self.combinations)):
            values = self.combination(number)
            if self.allows(values):
                yield State(self._model.space, values)
