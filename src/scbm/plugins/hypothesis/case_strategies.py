"""Strategies for whole cases and for their parts: goals, initial states, injections, networks, outcomes."""

from __future__ import annotations

from fractions import Fraction
from itertools import islice
from typing import TYPE_CHECKING, TypeVar, assert_never

from hypothesis import note
from hypothesis import strategies as st
from hypothesis.vendor.pretty import for_type_by_name
from msgspec.structs import replace

from scbm.cases import (
    CONDITIONS,
    NETWORK_FAULTS,
    Case,
    CaseGoal,
    Condition,
    ConditionKind,
    FaultAction,
    Injection,
    Network,
    Origin,
    OutcomeRule,
    ShareFault,
    TimeFault,
    WindowFault,
)
from scbm.files import Scope, parse_requirement, write_case
from scbm.model import (
    Constant,
    Diagnostic,
    Equal,
    InitialStates,
    InputError,
    Outcome,
    Place,
    Reference,
    Requirement,
    Role,
    Slug,
    State,
)
from scbm.model.variables import CURRENT_NAME
from scbm.running.simulation import typical_ns

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from hypothesis.strategies import DrawFn, SearchStrategy
    from hypothesis.vendor.pretty import RepresentationPrinter

    from scbm.cases import AnyNetworkFault, FaultWindow
    from scbm.cases.trace import Changes
    from scbm.model import BehaviorModel, Latency, Predicate, Resource, Value, Variable


_T = TypeVar("_T")


def one_of(choices: Sequence[_T]) -> SearchStrategy[_T]:
    """Draw one of the choices; shrinks towards the first.

    Hypothesis writes down what it draws from, and warns if that is long, as predicates and states are. So it draws a
    number.
    """
    return st.sampled_from(range(len(choices))).map(lambda number: choices[number])


def goals(model: BehaviorModel) -> SearchStrategy[tuple[str, Predicate]]:
    """Draw a goal of a model, with its name; shrinks towards the first.

    Raises:
        InputError: the model has none.
    """
    if not model.goals:
        message, remedy = "the model has no goals to draw from", "add `goals:` to the model"
        raise InputError([Diagnostic(Slug.NO_GOALS, message, Place(model.name), remedy)])
    return one_of(model.goals)


_MAX_LISTED = 10_000
"""Number of combinations of random values that are enumerated; in a model with more, further ones are drawn."""


def initial_states(model: BehaviorModel) -> SearchStrategy[State]:
    """Draw an allowed state among the combinations of random values, or the nominal one if that is allowed.

    Shrinks towards the nominal state: first to fewer variables that differ from it.

    Raises:
        InputError: no combination satisfies `initial_states`.
    """
    initial = InitialStates(model)
    listed = list(_listed(model, initial))
    if initial.combinations <= _MAX_LISTED:
        if not listed:
            message = "no combination of the random initial values satisfies `initial_states`"
            remedy = f"it says: {model.initial_states}"
            raise InputError([Diagnostic(Slug.NO_INITIAL_STATE, message, Place(model.name), remedy)])
        return one_of(listed)
    drawn = st.fixed_dictionaries({variable.name: _values(variable) for variable in model.space})
    allowed = drawn.filter(initial.allows).map(lambda values: State(model.space, values))
    return one_of(listed) | allowed if listed else allowed


def _listed(model: BehaviorModel, initial: InitialStates) -> Iterator[State]:
    """Yield some allowed states, the plainest first."""
    nominal = model.nominal_state
    if model.initial_states.holds(nominal):
        yield nominal
    others = (state for state in initial.allowed(_MAX_LISTED) if state != nominal)
    yield from sorted(islice(others, _MAX_LISTED), key=lambda state: _difference(state, nominal))


def _difference(state: State, nominal: State) -> int:
    return sum(state[name] != nominal[name] for name in nominal)


def _values(variable: Variable) -> SearchStrategy[bool | int | str]:
    """Draw a random value of a variable; shrinks towards the nominal one if it is among them."""
    return one_of(sorted(variable.random, key=lambda value: value != variable.initial))


_MILLISECOND_NS = 1_000_000
_SECOND_MS = 1_000
_LATEST_MS = 20_000


def times(most_ms: int = _LATEST_MS, least_ms: int = 0) -> SearchStrategy[int]:
    """Draw nanoseconds that are whole milliseconds, often whole seconds."""
    milliseconds = st.integers(least_ms, most_ms)
    if most_ms - least_ms >= _SECOND_MS:
        seconds = st.integers(-(-least_ms // _SECOND_MS), most_ms // _SECOND_MS)
        milliseconds = seconds.map(lambda count: count * _SECOND_MS) | milliseconds
    return milliseconds.map(lambda ms: ms * _MILLISECOND_NS)


_MOST = 3

_HOLDS = st.none() | times(least_ms=1)

_FACTOR = Fraction(3)
_SIMPLEST_FIRST = (ConditionKind.FAILING, ConditionKind.DEAD, ConditionKind.OCCUPIED, ConditionKind.SLOWER)


def _drawn_conditions() -> list[Condition]:
    """Return all conditions but `well`, those that are simplest to understand first."""
    others = [kind for kind in CONDITIONS.values() if kind not in (*_SIMPLEST_FIRST, ConditionKind.WELL)]
    return [Condition(kind, _FACTOR) if kind.has_factor else Condition(kind) for kind in (*_SIMPLEST_FIRST, *others)]


def injections(model: BehaviorModel) -> SearchStrategy[tuple[Injection, ...]]:
    """Draw injections that give a variable a value, or a resource a condition; now, at a time, or during an operation.

    No two of them act on the same thing, so they do not contradict each other. Shrinks towards none.
    """
    kinds = _assignments(model) | _conditions(model) if model.resources else _assignments(model)
    return st.lists(kinds, max_size=_MOST, unique_by=lambda injection: _target(injection, model)).map(
        _numbered_injections
    )


def _target(injection: Injection, model: BehaviorModel) -> str:
    """Return the target of an injection. The states of all operations are one target, as in a transition."""
    if injection.resource is not None:
        return f"resource {injection.resource}"
    name, _ = injection.assign[0]
    is_state = model.running_space[name].role in (Role.OPERATION_STATE, Role.CURRENT_STATE)
    return "the state of the operation" if is_state else f"variable {name}"


def _numbered_injections(drawn: Sequence[Injection]) -> tuple[Injection, ...]:
    """Give injections the names that they have in a file without names."""
    return tuple(replace(one, name=f"injection_{number}") for number, one in enumerate(drawn, start=1))


def _assignments(model: BehaviorModel) -> SearchStrategy[Injection]:
    targets = [variable for variable in model.running_space if variable.assignable]
    moments = _moments(model)

    @st.composite
    def assignment(draw: DrawFn) -> Injection:
        variable = draw(one_of(targets))
        value = draw(one_of(variable.assignable))
        holds = variable.role in (Role.DECLARED, Role.RESOURCE)
        hold_ns = draw(_HOLDS) if holds else None
        when, at_ns = draw(moments)
        return Injection("injection", ((variable.name, value),), when, at_ns, hold_ns)

    return assignment()


def _conditions(model: BehaviorModel) -> SearchStrategy[Injection]:
    moments = _moments(model)

    @st.composite
    def change(draw: DrawFn) -> Injection:
        resource = draw(one_of(model.resources))
        condition = draw(one_of(_drawn_conditions()))
        when, at_ns = draw(moments)
        return Injection("injection", (), when, at_ns, draw(_HOLDS), resource.name, condition)

    return change()


def _moments(model: BehaviorModel) -> SearchStrategy[tuple[Predicate | None, int | None]]:
    """Draw when an injection acts: a predicate, a time, both, or neither."""
    names = [operation.name for operation in model.operations]
    whens = st.none() | st.sampled_from(names).map(_is_current) if names else st.none()
    return st.tuples(whens, st.none() | times())


def _is_current(operation: str) -> Predicate:
    return Equal(Reference(CURRENT_NAME), Constant(operation))


_MAX_PER_CENT = 20
_LONGEST_MS = 5_000
_MAX_FAULTS = 2

_SHARE = st.integers(0, _MAX_PER_CENT).map(lambda per_cent: Fraction(per_cent, 100))


def networks(model: BehaviorModel) -> SearchStrategy[Network]:
    """Draw networks with faults of all kinds, such as latency, loss and partitions: see `NETWORK_FAULTS`.

    Shrinks towards a perfect one. A network that is a matter of chance (`Network.draws`) needs a case with an origin.
    """
    resources = [resource.name for resource in model.resources]
    return st.fixed_dictionaries(
        {fault.attribute: _fault_values(fault, resources) for fault in NETWORK_FAULTS.values()}
    ).map(lambda values: Network(**values))


def _fault_values(fault: AnyNetworkFault, resources: Sequence[str]) -> SearchStrategy[object]:
    """Return values of a kind of fault by its form; shrinks towards its default."""
    match fault:
        case TimeFault(action=FaultAction.LIMIT):
            return st.just(fault.default) | times(fault.most_drawn_ms, 1)
        case TimeFault():
            return times(fault.most_drawn_ms)
        case ShareFault():
            return _SHARE
        case WindowFault():
            subjects = resources if fault.needs_resource else [None, *resources]
            return st.lists(_windows(fault, subjects), max_size=_MAX_FAULTS if subjects else 0).map(tuple)
        case _:
            assert_never(fault)


def _windows(fault: WindowFault, subjects: Sequence[str | None]) -> SearchStrategy[FaultWindow]:
    lengths = times(_LONGEST_MS, 1 if fault.needs_duration else 0)
    resource = one_of(subjects) if subjects else st.nothing()
    return st.builds(fault.window, at_ns=times(), for_ns=lengths, resource=resource)


_MAX_REQUESTS = 5
"""Maximum number of requests to each resource whose outcome a case gives."""

_MS_NS = 1_000_000


def outcomes(model: BehaviorModel) -> SearchStrategy[tuple[OutcomeRule, ...]]:
    """Draw rules for the first requests to each resource: any outcome, a possible latency, measured values.

    Shrinks towards saying nothing, so that all requests succeed. An outcome whose share is 0 is drawn, too: to bring
    about what chance does not is what cases are for.
    """
    rules = [_rules(resource) for resource in model.resources]
    return st.tuples(*rules).map(lambda rule_lists: tuple(rule for of_one in rule_lists for rule in of_one))


def _rules(resource: Resource) -> SearchStrategy[tuple[OutcomeRule, ...]]:
    return st.lists(_rule(resource), max_size=_MAX_REQUESTS).map(_numbered)


def _numbered(rules: Sequence[OutcomeRule]) -> tuple[OutcomeRule, ...]:
    """Return the rules of the first, second, … request, without empty ones."""
    numbered = (
        (rule, OutcomeRule(rule.subject, number, number, rule.outcome, rule.latency_ns, rule.measured))
        for number, rule in enumerate(rules, start=1)
    )
    return tuple(
        numbered_rule for rule, numbered_rule in numbered if rule != OutcomeRule(rule.subject, rule.first, rule.last)
    )


def _rule(resource: Resource) -> SearchStrategy[OutcomeRule]:
    """Return the rule of one request; `None` for a default success."""
    latencies = st.none() | _latencies(resource.simulation.latency)
    measured = {None: _measured(resource, Outcome.SUCCEED), Outcome.FAIL: _measured(resource, Outcome.FAIL)}

    @st.composite
    def rule(draw: DrawFn) -> OutcomeRule:
        outcome = draw(st.sampled_from((None, Outcome.FAIL, Outcome.TIMEOUT)))
        if outcome is Outcome.TIMEOUT:
            return OutcomeRule(resource.name, 1, 1, outcome)
        return OutcomeRule(resource.name, 1, 1, outcome, draw(latencies), draw(measured[outcome]))

    return rule()


def _latencies(latency: Latency) -> SearchStrategy[int]:
    """Draw latencies between the shortest and the longest: whole milliseconds where there are any."""
    low_ns, high_ns = latency.points_ns[0], latency.points_ns[-1]
    low_ms, high_ms = -(-low_ns // _MS_NS), high_ns // _MS_NS
    between = times(high_ms, low_ms) if low_ms < high_ms else st.sampled_from([low_ns, high_ns])
    return st.just(typical_ns(latency)) | between


def _measured(resource: Resource, outcome: Outcome) -> SearchStrategy[Changes | None]:
    """Draw a value for each variable that a reply measures, whatever the weights; or nothing, for the plain values."""
    values: list[SearchStrategy[tuple[str, Value]]] = [
        _named(drawn.name, drawn.values) for drawn in resource.drawn(outcome)
    ]
    return st.none() | st.tuples(*values) if values else st.none()


def _named(name: str, values: Sequence[Value]) -> SearchStrategy[tuple[str, Value]]:
    return st.sampled_from(values).map(lambda value: (name, value))


_any_injections, _any_outcomes = injections, outcomes
"""By other names, as `cases` has parameters of these."""

_Part = TypeVar("_Part")

_SEEDS = st.integers(0, 2**32 - 1)


def cases(  # noqa: PLR0913 - the parts of a case
    model: BehaviorModel,
    *,
    goal: SearchStrategy[tuple[str, Predicate]] | None = None,
    initial: SearchStrategy[State] | None = None,
    outcomes: bool | SearchStrategy[tuple[OutcomeRule, ...]] = True,
    injections: bool | SearchStrategy[tuple[Injection, ...]] = False,
    network: bool | SearchStrategy[Network] = False,
    requirements: Mapping[str, str] | None = None,
    max_goals: int = 1,
) -> SearchStrategy[Case]:
    """Return a strategy for cases of a model. Hypothesis shows a failing one as a case file, which can be saved.

    Nothing is left to chance in them but the fate of messages, if the network says so; then a seed is drawn, too.

    Args:
        model: what is tested.
        goal: what runs are for; the goals of the model, if missing.
        initial: where runs begin; the initial states that the model allows, if missing.
        outcomes: what becomes of requests: drawn or plain, or a strategy of your own.
        injections: what is changed on the way: drawn or nothing, or a strategy of your own.
        network: how messages travel: drawn or at once, or a strategy of your own.
        requirements: further requirements, by name, as in a case file.
        max_goals: the maximum number of goals of a case; each begins where the one before ended.

    Raises:
        InputError: a requirement is wrong, or the model has no goals or no initial state.
    """
    drawn_goal = goals(model) if goal is None else goal
    drawn_initial = initial_states(model) if initial is None else initial
    drawn_outcomes = _either(outcomes, _any_outcomes(model), ())
    drawn_injections = _either(injections, _any_injections(model), ())
    drawn_network = _either(network, networks(model), Network())
    asked = _read(requirements or {}, model)
    later_goals = st.lists(drawn_goal, max_size=max_goals - 1) if max_goals > 1 else st.just([])

    @st.composite
    def case(draw: DrawFn) -> Case:
        name, predicate = draw(drawn_goal)
        drawn = Case(
            "found",
            name,
            predicate,
            draw(drawn_initial),
            draw(drawn_outcomes),
            draw(drawn_injections),
            draw(drawn_network),
            requirements=asked,
            later=tuple(CaseGoal(*each) for each in draw(later_goals)),
        )
        if drawn.network.draws:
            drawn = replace(drawn, origin=Origin(draw(_SEEDS)))
        note(_File(drawn, model))
        return drawn

    return case()


def _either(asked: bool | SearchStrategy[_Part], drawn: SearchStrategy[_Part], plain: _Part) -> SearchStrategy[_Part]:  # noqa: FBT001 - it is one of the two that users may give
    if isinstance(asked, bool):
        return drawn if asked else st.just(plain)
    return asked


def _read(requirements: Mapping[str, str], model: BehaviorModel) -> tuple[Requirement, ...]:
    scope = Scope.of(model)
    return tuple(
        Requirement(name, parse_requirement(sentence, scope, file=f"requirement {name}"))
        for name, sentence in requirements.items()
    )


class _File:
    """The file of a case, written only when Hypothesis shows it: for the smallest failing case."""

    def __init__(self, case: Case, model: BehaviorModel) -> None:
        self._case = case
        self._model = model

    def __repr__(self) -> str:
        return f"The case as a file:\n\n{write_case(self._case, self._model, None)}"


def _show(case: Case, printer: RepresentationPrinter, cycle: bool) -> None:  # noqa: ARG001, FBT001 - as the printer calls it
    """Show a case in the report of Hypothesis, which shows its file."""
    printer.text(f"<case {case.name}: goal {case.goal_names}>")


for_type_by_name(Case.__module__, Case.__name__, _show)
