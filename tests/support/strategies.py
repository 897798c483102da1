"""Random models, for Hypothesis. Small enough to be enumerated, and rich enough to use the whole language."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, assert_never, cast

from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.model import (
    FORMS,
    Action,
    Add,
    And,
    Assign,
    BehaviorModel,
    Constant,
    Domain,
    DrawnVariable,
    EnvironmentTransition,
    Equal,
    Extreme,
    ExtremeKind,
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
    Sum,
    Term,
    Transition,
    Truth,
    ValueKind,
    Variable,
)
from scbm.model.predicates import bounds
from scbm.model.requirements import PlaceholderKind, pattern_parts
from scbm.model.variables import PLAN_STATE, request_state_name, resource_variables, runner_variables, trigger_name
from support.draws import flag, one_of, some_of, whole

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


_DOMAINS = domains()


def integer_domains() -> SearchStrategy[Domain]:
    return st.tuples(st.integers(-2, 1), st.integers(1, 3)).map(lambda ends: Domain.integers(ends[0], sum(ends)))


@st.composite
def integer_variables(draw: DrawFn) -> tuple[Variable, ...]:
    """Two to four variables that sums can read."""
    declared = []
    for index in range(whole(draw, 2, 4)):
        domain = draw(_INTEGER_DOMAINS)
        declared.append(Variable(f"n{index}", domain, one_of(draw, domain.values), (domain.values[0],)))
    return tuple(declared)


_INTEGER_DOMAINS = integer_domains()


@st.composite
def variables(draw: DrawFn, most: int = 4) -> tuple[Variable, ...]:
    declared = []
    for index in range(whole(draw, 1, most)):
        domain = draw(_DOMAINS)
        initial = one_of(draw, domain.values)
        random = some_of(draw, domain.values, 1)
        declared.append(Variable(f"v{index}", domain, initial, one_of(draw, [(initial,), tuple(random)])))
    return tuple(declared)


def _integers(space: Sequence[Variable]) -> list[Variable]:
    return [variable for variable in space if variable.domain.kind is ValueKind.INTEGER]


def calculation(draw: DrawFn, space: Sequence[Variable], depth: int = 2) -> Term:
    """A sum, `min` or `max` that reads a variable; all variables of `space` are integers."""
    read: Term = Reference(one_of(draw, space).name)
    others = [_integer_term(draw, space, depth - 1) for _ in range(whole(draw, 1, 2))]
    terms = [read, *others] if flag(draw) else [*others, read]
    if whole(draw, 0, 2) == 0:
        return Extreme(one_of(draw, list(ExtremeKind)), tuple(terms))
    signs = [1, *(one_of(draw, [1, -1]) for _ in others)]
    return Sum.of(zip(signs, terms, strict=True))


def _integer_term(draw: DrawFn, space: Sequence[Variable], depth: int) -> Term:
    shape = whole(draw, 0, 2 if depth else 1)
    if shape == 0:
        return Reference(one_of(draw, space).name)
    return Constant(whole(draw, -3, 4)) if shape == 1 else calculation(draw, space, depth)


def comparison(draw: DrawFn, space: Sequence[Variable]) -> Predicate:
    """A comparison of a sum; all variables of `space` are integers."""
    domains = {variable.name: variable.domain for variable in space}
    left = calculation(draw, space)
    right = _integer_term(draw, space, 2)
    low, high = bounds(left, domains)
    least, most = bounds(right, domains)
    if isinstance(right, Constant) or max(low, least) > min(high, most):
        right = Constant(whole(draw, low, high))
    sides = (right, left) if flag(draw) else (left, right)
    leaves: list[Predicate] = [Equal(*sides), NotEqual(*sides), Order(sides[0], one_of(draw, list(Relation)), sides[1])]
    return one_of(draw, leaves)


def _leaf(draw: DrawFn, space: Sequence[Variable]) -> Predicate:
    variable = one_of(draw, space)
    reference, domain = Reference(variable.name), variable.domain
    if domain.kind is ValueKind.INTEGER and whole(draw, 0, 2) == 2:
        return comparison(draw, _integers(space))
    constant = Constant(one_of(draw, domain.values))
    fitting = [v for v in space if v.domain.kind is domain.kind and any(x in domain for x in v.domain.values)]
    other = Reference(one_of(draw, fitting).name)
    right: Term = constant if flag(draw) else other
    leaves: list[Predicate] = [Equal(reference, right), NotEqual(reference, right), Equal(constant, reference)]
    if domain.kind is ValueKind.INTEGER:
        leaves.append(Order(reference, one_of(draw, list(Relation)), right))
    members = some_of(draw, domain.values, 1, 3)
    leaves.append(Member(reference, tuple(Constant(value) for value in members)))
    return one_of(draw, leaves)


@st.composite
def predicates(draw: DrawFn, space: Sequence[Variable], depth: int = 3) -> Predicate:
    return _predicate(draw, space, depth)


def _predicate(draw: DrawFn, space: Sequence[Variable], depth: int) -> Predicate:
    shape = whole(draw, 0, 7) if depth else 0
    if shape <= 2:
        return _leaf(draw, space)
    if shape == 3:
        return Truth(flag(draw))
    if shape == 4:
        return Not(_predicate(draw, space, depth - 1))
    if shape == 5:
        return Implies(_predicate(draw, space, depth - 1), _predicate(draw, space, depth - 1))
    operands = tuple(_predicate(draw, space, depth - 1) for _ in range(whole(draw, 2, 3)))
    return And(operands) if shape == 6 else Or(operands)


@st.composite
def actions(draw: DrawFn, space: Sequence[Variable], most: int = 3) -> tuple[Action, ...]:
    return _actions(draw, space, most)


def _actions(draw: DrawFn, space: Sequence[Variable], most: int) -> tuple[Action, ...]:
    return tuple(_action(draw, target, space) for target in some_of(draw, space, 0, most))


def _action(draw: DrawFn, target: Variable, space: Sequence[Variable]) -> Action:
    choices: list[Action] = [Assign(target.name, Constant(one_of(draw, target.assignable)))]
    if target.role in (Role.DECLARED, Role.RESOURCE):
        sources = [
            v
            for v in space
            if v.domain.kind is target.domain.kind and any(value in target.domain for value in v.domain.values)
        ]
        choices.append(Assign(target.name, Reference(one_of(draw, sources).name)))
        if target.domain.kind is ValueKind.INTEGER and len(target.domain) > 1:
            amount = whole(draw, 1, len(target.domain) - 1)
            choices.append(Add(target.name, one_of(draw, [amount, -amount])))
        if target.domain.kind is ValueKind.INTEGER:
            term = calculation(draw, _integers(space))
            low, high = bounds(term, {variable.name: variable.domain for variable in space})
            if max(low, int(target.domain.values[0])) <= min(high, int(target.domain.values[-1])):
                choices.append(Assign(target.name, term))
    return one_of(draw, choices)


@st.composite
def planning_models(draw: DrawFn, most_operations: int = 5) -> BehaviorModel:
    """Models of the world alone: variables, operations that set them, goals."""
    space = draw(variables())
    operations = []
    for index in range(whole(draw, 1, most_operations)):
        pre = Transition(f"start_o{index}", _predicate(draw, space, 2), a=_actions(draw, space, 3))
        post = Transition(f"complete_o{index}", _predicate(draw, space, 1), a=_actions(draw, space, 3))
        operations.append(Operation(f"o{index}", pre, post))
    goals = [_predicate(draw, space, 2) for _ in range(whole(draw, 1, 2))]
    named = tuple((f"goal{index}", goal) for index, goal in enumerate(goals))
    return BehaviorModel("planned", space, tuple(operations), goals=named)


@st.composite
def running_models(draw: DrawFn, space: SearchStrategy[tuple[Variable, ...]] | None = None) -> BehaviorModel:
    """Models with everything: resources, deadlines, failures, automatic transitions, requirements."""
    declared = draw(variables(3) if space is None else space)
    resources = tuple(_resource(draw, f"r{index}", declared) for index in range(whole(draw, 1, 2)))
    owned = [variable for resource in resources for variable in resource_variables(resource.name)]
    world = (*declared, *owned)
    names = [f"o{index}" for index in range(whole(draw, 1, 4))]
    operations = tuple(_operation(draw, name, world, resources) for name in names)
    runner = tuple(v for v in runner_variables(names) if v.assignable and v.name != PLAN_STATE)
    everything = (*world, *runner_variables(names))
    automatic = []
    for index in range(whole(draw, 0, 3)):
        acts = _actions(draw, world, 2)
        if whole(draw, 0, 2) == 0:
            acts = (*acts, _action(draw, one_of(draw, runner), world))
        if not acts:
            continue
        guard = _predicate(draw, everything, 2)
        automatic.append(Transition(f"t{index}", guard, _predicate(draw, everything, 1), acts))
    goals = tuple((f"goal{index}", _predicate(draw, declared, 2)) for index in range(2))
    requirements = tuple(Requirement(f"q{index}", draw(sentences(everything))) for index in range(whole(draw, 0, 2)))
    return BehaviorModel(
        "run", declared, operations, resources, tuple(automatic), goals=goals, requirements=requirements
    )


@st.composite
def open_models(draw: DrawFn) -> BehaviorModel:
    """Running models in which the environment acts, resources publish some values only, and others use resources."""
    model = draw(running_models())
    world = (*model.variables, *(v for r in model.resources for v in resource_variables(r.name)))
    resources = tuple(_open_resource(draw, resource, model) for resource in model.resources)
    environment = []
    for index in range(whole(draw, 0, 2)):
        acts = tuple(_action(draw, target, world) for target in some_of(draw, model.variables, 1, 2))
        rate = one_of(draw, [None, *RateKind])
        shape, points = one_of(draw, [(LatencyShape.EXPONENTIAL, (3 * SECOND_NS,)), (LatencyShape.FIXED, (1,))])
        guard = _predicate(draw, world, 1)
        chosen = None if rate is None else Rate(rate, Latency(shape, points))
        environment.append(EnvironmentTransition(f"e{index}", guard, acts, chosen))
    return replace(model, resources=resources, environment=tuple(environment))


def _open_resource(draw: DrawFn, resource: Resource, model: BehaviorModel) -> Resource:
    published = tuple(variable.name for variable in some_of(draw, model.variables, 1, 2))
    values = []
    for name in sorted({*published, *resource.measures}):
        domain = model.space[name].domain.values
        kept = some_of(draw, domain, 1)
        if len(kept) < len(domain) or name in resource.measures:
            values.append((name, tuple(value for value in domain if value in kept)))
    sent = dict(values)
    measured, failed = (
        tuple(DrawnVariable(d.name, sent[d.name]) if d.name in sent else d for d in drawn)
        for drawn in (resource.simulation.measured, resource.simulation.failed)
    )
    simulation = replace(resource.simulation, measured=measured, failed=failed)
    shared = flag(draw)
    return replace(resource, publishes=published, values=tuple(values), shared=shared, simulation=simulation)


def _resource(draw: DrawFn, name: str, declared: Sequence[Variable]) -> Resource:
    names = [variable.name for variable in declared]
    measured = some_of(draw, declared, 0, 1)
    outcomes = one_of(
        draw,
        [
            ((Outcome.SUCCEED, Fraction(1)),),
            ((Outcome.SUCCEED, Fraction(1, 2)), (Outcome.FAIL, Fraction(1, 4)), (Outcome.TIMEOUT, Fraction(1, 4))),
            ((Outcome.SUCCEED, Fraction(0)), (Outcome.FAIL, Fraction(1))),
        ],
    )
    latency = one_of(
        draw,
        [
            Latency(LatencyShape.FIXED, (0,)),
            Latency(LatencyShape.UNIFORM, (1_000, 2 * SECOND_NS)),
            Latency(LatencyShape.TRIANGULAR, (0, SECOND_NS, 3 * SECOND_NS)),
        ],
    )
    return Resource(
        name,
        tuple(some_of(draw, names, 0, 2)),
        tuple(variable.name for variable in measured),
        Simulation(latency, outcomes, _drawn(draw, measured), _drawn(draw, measured if flag(draw) else [])),
    )


def _drawn(draw: DrawFn, variables: Sequence[Variable]) -> tuple[DrawnVariable, ...]:
    """Return what replies measure: all values, half of the time with weights."""
    drawn = []
    for variable in variables:
        weights = [Fraction(one_of(draw, ["0", "1", "0.25", "7"])) for _ in variable.domain.values]
        is_weighted = flag(draw) and any(weights)
        drawn.append(DrawnVariable(variable.name, variable.domain.values, tuple(weights) if is_weighted else ()))
    return tuple(drawn)


def _operation(draw: DrawFn, name: str, world: Sequence[Variable], resources: Sequence[Resource]) -> Operation:
    """Half of the operations send a request as the paper's `scan_box` does, the others are anything."""
    resource = one_of(draw, list(resources))
    trigger, state = trigger_name(resource.name), request_state_name(resource.name)
    free = [variable for variable in world if variable.role is Role.DECLARED]
    deadline_ns = one_of(draw, [None, SECOND_NS, 5 * SECOND_NS])
    if flag(draw):
        idle = And((Equal(Reference(state), Constant("initial")), Equal(Reference(trigger), Constant(False))))
        pre = Transition(f"start_{name}", And((idle, _predicate(draw, free, 1))), a=(Assign(trigger, Constant(True)),))
        succeeded = Equal(Reference(state), Constant("succeeded"))
        done = (Assign(state, Constant("initial")), Assign(trigger, Constant(False)), *_actions(draw, free, 2))
        post = Transition(f"complete_{name}", Truth(True), succeeded, done)
        failed = Transition(
            f"fail_{name}",
            Equal(Reference(state), Constant("failed")),
            a=(Assign(state, Constant("initial")), Assign(trigger, Constant(False))),
        )
        timedout: tuple[Action, ...] = (Assign(trigger, Constant(False)),) if deadline_ns else ()
        return Operation(name, pre, post, deadline_ns, one_of(draw, [None, failed]), timedout)
    pre = Transition(f"start_{name}", _predicate(draw, world, 1), _predicate(draw, world, 1), _actions(draw, world, 2))
    post = Transition(
        f"complete_{name}", _predicate(draw, world, 1), _predicate(draw, world, 1), _actions(draw, world, 2)
    )
    timedout = _actions(draw, world, 1) if deadline_ns else ()
    disabled_ns = one_of(draw, [None, SECOND_NS])
    return Operation(name, pre, post, deadline_ns, None, timedout, disabled_ns)


@st.composite
def sentences(draw: DrawFn, space: Sequence[Variable]) -> RequirementForm:
    """Sentences of each form that there is."""
    form: Callable[..., RequirementForm] = one_of(draw, list(FORMS.values()))
    values: list[object] = []
    for part in pattern_parts(cast("type[RequirementForm]", form).pattern):
        is_left_out = part.is_optional and flag(draw)
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
