"""Random models whose environment acts, and whose resources are shared."""

from __future__ import annotations

from dataclasses import replace
from random import Random

from scbm.model import (
    Assign,
    BehaviorModel,
    Constant,
    DrawnVariable,
    EnvironmentTransition,
    Equal,
    Latency,
    LatencyShape,
    Predicate,
    Rate,
    RateKind,
    Reference,
    Resource,
    Variable,
)

SECOND_NS = 1_000_000_000


def opened(model: BehaviorModel, number: int) -> BehaviorModel:
    """The model with others who use its resources, values that are ruled out, and an environment that acts."""
    random = Random(f"environment {number}")
    declared = [variable for variable in model.variables if len(variable.domain) > 1]
    transitions = [_transition(f"moves_{index}", random, declared) for index in range(random.randint(1, 3)) if declared]
    resources = tuple(_open(resource, random, model) for resource in model.resources)
    return replace(model, environment=tuple(transitions), resources=resources)


def _transition(name: str, random: Random, declared: list[Variable]) -> EnvironmentTransition:
    target = random.choice(declared)
    guard: Predicate = _is(random.choice(declared), random)
    rate = Rate(random.choice(list(RateKind)), Latency(LatencyShape.UNIFORM, (SECOND_NS // 10, 3 * SECOND_NS)))
    actions = (Assign(target.name, Constant(random.choice(target.domain.values))),)
    return EnvironmentTransition(name, guard, actions, rate)


def _is(variable: Variable, random: Random) -> Predicate:
    return Equal(Reference(variable.name), Constant(random.choice(variable.domain.values)))


def _open(resource: Resource, random: Random, model: BehaviorModel) -> Resource:
    values = []
    for name in resource.measures:
        domain = model.space[name].domain.values
        kept = tuple(value for value in domain if random.random() < 0.7)
        values += [(name, kept)] if 0 < len(kept) < len(domain) else []
    sent = dict(values)
    measured = tuple(DrawnVariable(d.name, sent.get(d.name, d.values)) for d in resource.simulation.measured)
    simulation = replace(resource.simulation, measured=measured)
    return replace(resource, shared=random.random() < 0.6, values=tuple(values), simulation=simulation)
