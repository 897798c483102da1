"""The relevant variables of runs, and the initial states that differ in them.

Other variables, such as the parameters of requests, would only multiply the situations.
"""

from __future__ import annotations

from functools import partial
from itertools import islice, product
from math import prod
from operator import ne
from typing import TYPE_CHECKING

from scbm.closing.runs.run_graph import Start
from scbm.closing.runs.situations import world_bits
from scbm.model import Role, Truth
from scbm.planning.engines import Move, MovePart, TransitionSystem, relevant

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Packing, Value
    from scbm.running import Program


class Relevance:
    """The variables of the running space that decide what can happen in a run.

    Attributes:
        packing: the packing of the running space.
        names: the relevant variables, in the order of the space.
        mask: their bits.
    """

    def __init__(self, model: BehaviorModel, packing: Packing) -> None:
        self.packing = packing
        self.names = relevant(_steps(model), _observed_names(model)).names
        self.mask = sum(packing[name].mask for name in self.names)


def _steps(model: BehaviorModel) -> TransitionSystem:
    """Return everything that changes variables in runs, each as a move of its own."""
    parts = [MovePart(transition.running_guard, transition.running_actions) for transition in model.transitions]
    parts += [MovePart(Truth(True), operation.timedout) for operation in model.operations]
    return TransitionSystem(model.running_space, tuple(Move(str(number), (part,)) for number, part in enumerate(parts)))


def _observed_names(model: BehaviorModel) -> Iterator[str]:
    """Yield the variables that goals read, those that automatic transitions change, and all that are not declared."""
    for _, goal in model.goals:
        yield from goal.reads()
    for transition in model.automatic_transitions:
        yield from (action.target for action in transition.running_actions)
    yield from (variable.name for variable in model.running_space if variable.role is not Role.DECLARED)


def initial_states(
    model: BehaviorModel, program: Program, relevance: Relevance, most: int
) -> tuple[tuple[Start, ...], bool]:
    """Return the allowed initial states that differ in relevant variables, those nearest to the nominal state first.

    Returns:
        The states, and whether these are all: of the combinations of random values at most `most` are enumerated.
    """
    found: dict[int, Start] = {}
    choices = _choices(model, relevance)
    for combination in islice(product(*choices), most):
        values = dict(zip(model.space.names, combination, strict=True))
        if model.initial_states.holds(values):
            packed = world_bits(program, values)
            found.setdefault(packed & relevance.mask, Start(values, packed))
    nominal = model.nominal_state
    nearest = sorted(found.values(), key=lambda start: sum(nominal[name] != v for name, v in start.values.items()))
    return tuple(nearest), prod(map(len, choices)) <= most


def _choices(model: BehaviorModel, relevance: Relevance) -> list[list[Value]]:
    """Return the random values of each variable, the nominal one first; only this one if it is irrelevant."""
    read = dict.fromkeys((*relevance.names, *model.initial_states.reads()))
    nominal_first = [sorted(v.random, key=partial(ne, v.initial)) for v in model.space]
    return [
        values if variable.name in read else values[:1]
        for variable, values in zip(model.space, nominal_first, strict=True)
    ]
