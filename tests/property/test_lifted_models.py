"""The expansion of objects and parameters agrees with an independent one, which is slow and simple."""

from __future__ import annotations

from itertools import product
from random import Random
from typing import TYPE_CHECKING

from hypothesis import given

from scbm.files import read_model
from support.lifted_models import lifted_models
from support.profiles import examples

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.model import BehaviorModel, Predicate, Value

STATES = 40
"""Random states of each model in which predicates are compared."""


def states(model: BehaviorModel) -> Iterator[Mapping[str, Value]]:
    random = Random(1)
    for _ in range(STATES):
        yield {variable.name: random.choice(variable.domain.values) for variable in model.variables}


def predicates(model: BehaviorModel) -> dict[str, Predicate]:
    found = {f"operation {each.name}": each.pre.g for each in model.operations}
    found |= {f"automatic {each.name}": each.g for each in model.automatic_transitions}
    found |= {f"environment {each.name}": each.guard for each in model.environment}
    found |= {f"goal {name}": goal for name, goal in model.goals}
    found |= {f"requirement {each.name}": each.sentence.predicates[0] for each in model.requirements}
    return {**found, "initial states": model.initial_states}


def actions(model: BehaviorModel) -> list[str]:
    found = [f"{each.name}: {each.post.a}" for each in model.operations]
    found += [f"{each.name}: {each.a}" for each in model.automatic_transitions]
    return [*found, *(f"{each.name}: {each.actions}" for each in model.environment)]


@given(lifted_models())
@examples(300, usual=5)
def test_our_expansion_is_the_naive_one(texts: tuple[str, str]) -> None:
    ours, naive = (read_model(text) for text in texts)
    assert ours.variables == naive.variables
    left, right = predicates(ours), predicates(naive)
    dropped = [name for name in right if name not in left]
    assert list(left) == [name for name in right if name not in dropped]
    assert actions(ours) == [
        text for text in actions(naive) if not any(text.startswith(f"{n.split()[1]}: ") for n in dropped)
    ]
    for state, name in product(states(naive), right):
        assert right[name].holds(state) == (name in left and left[name].holds(state)), (name, texts)
