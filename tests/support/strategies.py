"""Random models, for Hypothesis. Small enough to be enumerated, and rich enough to use the whole language."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING, assert_never, cast

from hypothesis import strategies as st

from scbm.model import (
    FORMS,
    Action,
    Add,
    And,
    Assign,
    BehaviorModel,
    Constant,
    Domain,
    EnvironmentTransition,
    Equal,
    Implies,
    Latency,
    LatencyShape,
    Member,
    Not,
    NotEqual,
    Operation,
    Or,
    Order,
    Outcome,
    Predicate,
    Rate,
    RateKind,
    Reference,
    Relation,
    Requirement,
    RequirementForm,
    Resource,
    Role,
    Simulation,
    Term,
    Transition,
    Truth,
    ValueKind,
    Variable,
)
from scbm.model.requirement_patterns import PlaceholderKind, pattern_parts
from scbm.model.variables import PLAN_STATE, request_state_name, resource_variables, runner_variables, trigger_name

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from hypothesis.strategies import DrawFn, SearchStrategy

SECOND_NS = 1_000_000_000


def domains() -> SearchStrategy[Domain]:
    symbols = st.lists(st.sampled_from(["red", "green", "blue", "gone", "here"]), min_size=1, max_size=4, unique=True)
    low = st.integers(-2, 1)
    return st.one_of(
        st.just(Domain.boolean()),
        symbols.map(lambda names: Domain(tuple(names))),
        st.tuples(low, st.integers(0, 3)).map(lambda pair: Domain.integers(pair[0], pair[0] + pair[1])),
    )


@st.composite
def variables(draw: DrawFn, most: int = 4) -> tuple[Variable, ...]:
    declared = []
    for index in range(draw(st.integers(1, most))):
        domain = draw(domains())
        initial = draw(st.sampled_from(domain.values))
        random = draw(st.lists(st.sampled_from(domain.values), min_size=1, unique=True))
        declared.append(Variable(f"v{index}", domain, initial, draw(st.sampled_from([(initial,), tuple(random)]))))
    return tuple(declared)


def _leaf(draw: DrawFn, space: Sequence[Variable]) -> Predicate:
    variable = draw(st.sampled_from(list(space)))
    reference, domain = Reference(variable.name), variable.domain
    constant = Constant(draw(st.sampled_from(domain.values)))
    fitting = [v for v in space if v.domain.kind is domain.kind and any(x in domain for x in v.domain.values)]
    other = Reference(draw(st.sampled_from(fitting)).name)
    right: Term = constant if draw(st.booleans()) else other
    leaves: list[Predicate] = [Equal(reference, right), NotEqual(reference, right), Equal(constant, reference)]
    if domain.kind is ValueKind.INTEGER:
        leaves.append(Order(reference, draw(st.sampled_from(list(Relation))), right))
    members = draw(st.lists(st.sampled_from(domain.values), min_size=1, max_size=3, unique=True))
    leaves.append(Member(reference, tuple(Constant(value) for value in members)))
    return draw(st.sampled_from(leaves))


@st.composite
def predicates(draw: DrawFn, space: Sequence[Variable], depth: int = 3) -> Predicate:
    shape = draw(st.integers(0, 7)) if depth else 0
    if shape <= 2:
        return _leaf(draw, space)
    if shape == 3:
        return Truth(draw(st.booleans()))
    if shape == 4:
        return Not(draw(predicates(space, depth - 1)))
    if shape == 5:
        return Implies(draw(predicates(space, depth - 1)), draw(predicates(space, depth - 1)))
    operands = tuple(draw(st.lists(predicates(space, depth - 1), min_size=2, max_size=3)))
    return And(operands) if shape == 6 else Or(operands)


@st.composite
def actions(draw: DrawFn, space: Sequence[Variable], most: int = 3) -> tuple[Action, ...]:
    targets = draw(st.lists(st.sampled_from(list(space)), max_size=most, unique_by=lambda v: v.name))
    return tuple(_action(draw, target, space) for target in targets)


def _action(draw: DrawFn, target: Variable, space: Sequence[Variable]) -> Action:
    choices: list[Action] = [Assign(target.name, Constant(draw(st.sampled_from(target.assignable))))]
    if target.role in (Role.DECLARED, Role.RESOURCE):
        sources = [
            v
            for v in space
            if v.domain.kind is target.domain.kind and any(value in target.domain for value in v.domain.values)
        ]
        choices.append(Assign(target.name, Reference(draw(st.sampled_from(sources)).name)))
        if target.domain.kind is ValueKind.INTEGER and len(target.domain) > 1:
            amount = draw(st.integers(1, len(target.domain) - 1))
            choices.append(Add(target.name, draw(st.sampled_from([amount, -amount]))))
    return draw(st.sampled_from(choices))


@st.composite
def planning_models(draw: DrawFn, most_operations: int = 5) -> BehaviorModel:
    """Models of the world alone: variables, operations that set them, goals."""
    space = draw(variables())
    operations = []
    for index in range(draw(st.integers(1, most_operations))):
        pre = Transition(f"start_o{index}", draw(predicates(space, 2)), a=draw(actions(space)))
        post = Transition(f"complete_o{index}", draw(predicates(space, 1)), a=draw(actions(space)))
        operations.append(Operation(f"o{index}", pre, post))
    goals = draw(st.lists(predicates(space, 2), min_size=1, max_size=2))
    named = tuple((f"goal{index}", goal) for index, goal in enumerate(goals))
    return BehaviorModel("planned", space, tuple(operations), goals=named)


@st.composite
def running_models(draw: DrawFn) -> BehaviorModel:
    """Models with everything: resources, deadlines, failures, automatic transitions, requirements."""
    declared = draw(variables(3))
    resources = tuple(draw(_resource(f"r{index}", declared)) for index in range(draw(st.integers(1, 2))))
    owned = [variable for resource in resources for variable in resource_variables(resource.name)]
    world = (*declared, *owned)
    names = [f"o{index}" for index in range(draw(st.integers(1, 4)))]
    operations = tuple(draw(_operation(name, world, resources)) for name in names)
    runner = tuple(v for v in runner_variables(names) if v.assignable and v.name != PLAN_STATE)
    everything = (*world, *runner_variables(names))
    automatic = []
    for index in range(draw(st.integers(0, 3))):
        acts = draw(actions(world, 2))
        if draw(st.integers(0, 2)) == 0:
            acts = (*acts, _action(draw, draw(st.sampled_from(runner)), world))
        if not acts:
            continue
        guard = draw(predicates(everything, 2))
        automatic.append(Transition(f"t{index}", guard, draw(predicates(everything, 1)), acts))
    goals = tuple((f"goal{index}", draw(predicates(declared, 2))) for index in range(2))
    requirements = tuple(
        Requirement(f"q{index}", draw(sentences(everything))) for index in range(draw(st.integers(0, 2)))
    )
    return BehaviorModel(
        "run", declared, operations, resources, tuple(automatic), goals=goals, requirements=requirements
    )


@st.composite
def open_models(draw: DrawFn) -> BehaviorModel:
    """Running models in which the environment acts, resources publish some values only, and others use resources."""
    model = draw(running_models())
    world = (*model.variables, *(v for r in model.resources for v in resource_variables(r.name)))
    resources = tuple(draw(_open_resource(resource, model)) for resource in model.resources)
    environment = []
    for index in range(draw(st.integers(0, 2))):
        acts = tuple(_action(draw, target, world) for target in draw(_some(model.variables)))
        rate = draw(st.sampled_from([None, *RateKind]))
        shape, points = draw(
            st.sampled_from([(LatencyShape.EXPONENTIAL, (3 * SECOND_NS,)), (LatencyShape.FIXED, (1,))])
        )
        guard = draw(predicates(world, 1))
        chosen = None if rate is None else Rate(rate, Latency(shape, points))
        environment.append(EnvironmentTransition(f"e{index}", guard, acts, chosen))
    return replace(model, resources=resources, environment=tuple(environment))


def _some(variables: Sequence[Variable]) -> SearchStrategy[list[Variable]]:
    return st.lists(st.sampled_from(list(variables)), min_size=1, max_size=2, unique_by=lambda v: v.name)


@st.composite
def _open_resource(draw: DrawFn, resource: Resource, model: BehaviorModel) -> Resource:
    published = tuple(variable.name for variable in draw(_some(model.variables)))
    values = []
    for name in sorted({*published, *resource.measures}):
        domain = model.space[name].domain.values
        kept = draw(st.lists(st.sampled_from(domain), min_size=1, unique=True))
        if len(kept) < len(domain):
            values.append((name, tuple(value for value in domain if value in kept)))
    sent = dict(values)
    drawn = tuple((name, sent.get(name, known)) for name, known in resource.simulation.measured)
    simulation = replace(resource.simulation, measured=drawn)
    shared = draw(st.booleans())
    return replace(resource, publishes=published, values=tuple(values), shared=shared, simulation=simulation)


@st.composite
def _resource(draw: DrawFn, name: str, declared: Sequence[Variable]) -> Resource:
    names = [variable.name for variable in declared]
    measured = draw(st.lists(st.sampled_from(list(declared)), max_size=1))
    outcomes = draw(
        st.sampled_from(
            [
                ((Outcome.SUCCEED, Fraction(1)),),
                ((Outcome.SUCCEED, Fraction(1, 2)), (Outcome.FAIL, Fraction(1, 4)), (Outcome.TIMEOUT, Fraction(1, 4))),
                ((Outcome.SUCCEED, Fraction(0)), (Outcome.FAIL, Fraction(1))),
            ]
        )
    )
    latency = draw(
        st.sampled_from(
            [
                Latency(LatencyShape.FIXED, (0,)),
                Latency(LatencyShape.UNIFORM, (1_000, 2 * SECOND_NS)),
                Latency(LatencyShape.TRIANGULAR, (0, SECOND_NS, 3 * SECOND_NS)),
            ]
        )
    )
    return Resource(
        name,
        tuple(draw(st.lists(st.sampled_from(names), max_size=2, unique=True))),
        tuple(variable.name for variable in measured),
        Simulation(latency, outcomes, tuple((variable.name, variable.domain.values) for variable in measured)),
    )


@st.composite
def _operation(draw: DrawFn, name: str, world: Sequence[Variable], resources: Sequence[Resource]) -> Operation:
    """Half of the operations send a request as the paper's `scan_box` does, the others are anything."""
    resource = draw(st.sampled_from(list(resources)))
    trigger, state = trigger_name(resource.name), request_state_name(resource.name)
    free = [variable for variable in world if variable.role is Role.DECLARED]
    deadline_ns = draw(st.sampled_from([None, SECOND_NS, 5 * SECOND_NS]))
    if draw(st.booleans()):
        idle = And((Equal(Reference(state), Constant("initial")), Equal(Reference(trigger), Constant(False))))
        pre = Transition(f"start_{name}", And((idle, draw(predicates(free, 1)))), a=(Assign(trigger, Constant(True)),))
        succeeded = Equal(Reference(state), Constant("succeeded"))
        done = (Assign(state, Constant("initial")), Assign(trigger, Constant(False)), *draw(actions(free, 2)))
        post = Transition(f"complete_{name}", Truth(True), succeeded, done)
        failed = Transition(
            f"fail_{name}",
            Equal(Reference(state), Constant("failed")),
            a=(Assign(state, Constant("initial")), Assign(trigger, Constant(False))),
        )
        timedout: tuple[Action, ...] = (Assign(trigger, Constant(False)),) if deadline_ns else ()
        return Operation(name, pre, post, deadline_ns, draw(st.sampled_from([None, failed])), timedout)
    pre = Transition(f"start_{name}", draw(predicates(world, 1)), draw(predicates(world, 1)), draw(actions(world, 2)))
    post = Transition(
        f"complete_{name}", draw(predicates(world, 1)), draw(predicates(world, 1)), draw(actions(world, 2))
    )
    timedout = draw(actions(world, 1)) if deadline_ns else ()
    disabled_ns = draw(st.sampled_from([None, SECOND_NS]))
    return Operation(name, pre, post, deadline_ns, None, timedout, disabled_ns)


@st.composite
def sentences(draw: DrawFn, space: Sequence[Variable]) -> RequirementForm:
    """Sentences of each form that there is."""
    form: Callable[..., RequirementForm] = draw(st.sampled_from(list(FORMS.values())))
    values: list[object] = []
    for part in pattern_parts(cast("type[RequirementForm]", form).pattern):
        is_left_out = part.is_optional and draw(st.booleans())
        values += [None if is_left_out else draw(_values(kind, space)) for kind in part.kinds]
    return form(*values)


def _values(kind: PlaceholderKind, space: Sequence[Variable]) -> SearchStrategy[object]:
    """What stands in the place of a letter of a pattern."""
    match kind:
        case PlaceholderKind.PREDICATE:
            return predicates(space, 2)
        case PlaceholderKind.DURATION:
            return st.sampled_from([1, 1_500_000_000, 10 * SECOND_NS, 90 * 60 * SECOND_NS])
        case PlaceholderKind.NUMBER:
            return st.integers(0, 3)
        case _:
            assert_never(kind)
