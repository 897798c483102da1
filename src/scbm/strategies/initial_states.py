"""Where a run begins."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from hypothesis import strategies as st

from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.model import InitialStates, State
from scbm.strategies.choices import one_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from hypothesis.strategies import SearchStrategy

    from scbm.model import BehaviorModel, Variable

_MOST_LISTED = 10_000
"""So many combinations of random values are looked through; of a model with more, others are drawn beside these."""


def initial_states(model: BehaviorModel) -> SearchStrategy[State]:
    """The allowed states among the combinations of random values, and the nominal one if that is allowed.

    Shrinks towards the nominal state: first to fewer variables that differ from it.

    Raises:
        InputError: no combination satisfies `initial_states`.
    """
    initial = InitialStates(model)
    listed = list(_listed(model, initial))
    if initial.combinations <= _MOST_LISTED:
        if not listed:
            message = "no combination of the random initial values satisfies `initial_states`"
            remedy = f"it says: {model.initial_states}"
            raise InputError([Diagnostic(Slug.NO_INITIAL_STATE, message, Place(model.name), remedy)])
        return one_of(listed)
    drawn = st.fixed_dictionaries({variable.name: _values(variable) for variable in model.space})
    allowed = drawn.filter(initial.allows).map(lambda values: State(model.space, values))
    return one_of(listed) | allowed if listed else allowed


def _listed(model: BehaviorModel, initial: InitialStates) -> Iterator[State]:
    """Some allowed states, the plainest first."""
    nominal = model.nominal_state
    if model.initial_states.holds(nominal):
        yield nominal
    others = (state for state in initial.allowed(_MOST_LISTED) if state != nominal)
    yield from sorted(islice(others, _MOST_LISTED), key=lambda state: _difference(state, nominal))


def _difference(state: State, nominal: State) -> int:
    return sum(state[name] != nominal[name] for name in nominal)


def _values(variable: Variable) -> SearchStrategy[bool | int | str]:
    """The random values of a variable, the nominal one first if it is among them."""
    return one_of(sorted(variable.random, key=lambda value: value != variable.initial))
