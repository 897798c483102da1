"""The initial states that runs can begin in, as far as they make a difference."""

from __future__ import annotations

from functools import partial
from itertools import islice, product
from math import prod
from operator import ne
from typing import TYPE_CHECKING

from scbm.closing.graph import Start
from scbm.closing.situations import world_bits

if TYPE_CHECKING:
    from scbm.closing.relevance import Relevance
    from scbm.model import BehaviorModel, Value
    from scbm.running import Program


def initial_states(
    model: BehaviorModel, program: Program, relevance: Relevance, most: int
) -> tuple[tuple[Start, ...], bool]:
    """The allowed initial states that differ in what makes a difference, those nearest to the nominal one first.

    Returns:
        The states, and whether these are all: if there are more than `most` combinations of random values, so many of
        them are gone through.
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
    """The random values of each variable, the nominal one first; one alone if it makes no difference."""
    looked_at = dict.fromkeys((*relevance.names, *model.initial_states.reads()))
    nominal_first = [sorted(v.random, key=partial(ne, v.initial)) for v in model.space]
    return [
        values if variable.name in looked_at else values[:1]
        for variable, values in zip(model.space, nominal_first, strict=True)
    ]
