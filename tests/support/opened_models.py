"""Random models whose environment acts, and whose resources are shared."""

from __future__ import annotations

from random import Random

from msgspec.structs import replace

from scbm.model import (
    Always,
    And,
    Assign,
    Before,
    BehaviorModel,
    Constant,
    Domain,
    DrawnVariable,
    EnvironmentTransition,
    Equal,
    GoalOrder,
    Latency,
    LatencyShape,
    Never,
    Not,
    Predicate,
    Rate,
    RateKind,
    Reference,
    Requirement,
    Resource,
    RunsDeclaration,
    Transition,
    Variable,
    VariableSource,
)
from support.random_models import small_random_model

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


def varied(number: int) -> BehaviorModel:
    """A small random model with probes and requirements; its goals are single, or follow each other.

    Two of three are open: with transitions of the environment, shared resources, published values, declared inputs.
    """
    random = Random(f"runs {number}")
    model = small_random_model(number)
    if number % 3:
        model = _with_sources(opened(model, number), random)
    order = GoalOrder.SINGLE if random.random() < 0.3 else GoalOrder.SEQUENCE
    requirements = tuple(_requirement(f"rule_{index}", random, model) for index in range(3))
    return _probed(replace(model, runs=RunsDeclaration(order), requirements=requirements), random)


def _with_sources(model: BehaviorModel, random: Random) -> BehaviorModel:
    """The model with another source of changes: an input that the model assigns, a transition, or published values."""
    first, second = random.sample(list(model.variables), 2)
    kind = random.random()
    if kind < 0.3:
        changed = [replace(v, source=VariableSource.INPUT) if v is first else v for v in model.variables]
        return replace(model, variables=tuple(changed))
    if kind < 0.5:
        actions = tuple(Assign(v.name, Constant(random.choice(v.domain.values))) for v in (first, second))
        return replace(model, environment=(EnvironmentTransition("both", _is(first, random), actions),))
    if kind < 0.8:
        return model
    resource, *others = model.resources
    known = dict(resource.values)
    for variable in (first, second):
        kept = tuple(value for value in variable.domain.values if random.random() < 0.7)
        if 0 < len(kept) < len(variable.domain) and variable.name not in resource.measures:
            known[variable.name] = kept
    published = (first.name, second.name)
    return replace(model, resources=(replace(resource, publishes=published, values=tuple(known.items())), *others))


def _probed(model: BehaviorModel, random: Random) -> BehaviorModel:
    """The model with transitions that are taken in some state of the runner, and that change nothing else."""
    runner = [variable for variable in model.running_space if variable.role.is_runner]
    variables, transitions = [], []
    for name in ("probe_0", "probe_1"):
        guard = [_is(random.choice(runner), random), *(_is(random.choice(model.variables), random) for _ in range(2))]
        variables.append(Variable(name, Domain.boolean(), False, (False,), source=VariableSource.STATE))
        action = Assign(name, Constant(True))
        transitions.append(Transition(f"see_{name}", And(tuple(guard)), a=(action,)))
    automatic = (*transitions, *model.automatic_transitions)
    return replace(model, variables=(*model.variables, *variables), automatic_transitions=automatic)


def _requirement(name: str, random: Random, model: BehaviorModel) -> Requirement:
    """A requirement that some runs may violate."""
    space = [variable for variable in model.running_space if len(variable.domain) > 1]
    first, second = _is(random.choice(space), random), _is(random.choice(model.variables), random)
    return Requirement(name, random.choice((Always(Not(first)), Never(And((first, second))), Before(first, second))))
