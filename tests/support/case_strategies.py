"""Random cases of random models, for Hypothesis: in the form in which they are read, so that they can be compared."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, Any, assert_never

from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.cases import (
    CONDITIONS,
    NETWORK_FAULTS,
    AnyNetworkFault,
    Case,
    CaseGoal,
    CaseLimits,
    Condition,
    EnvironmentChange,
    Expectations,
    Injection,
    Network,
    Origin,
    OutcomeRule,
    RecordedGoal,
    RecordedRun,
    ShareFault,
    TimeFault,
    WindowFault,
)
from scbm.cases.coverage import Obligations
from scbm.cases.trace import End
from scbm.model import BehaviorModel, Outcome, Requirement, Resource, Role, State, Variable, format_value
from scbm.model.sources import outside_values
from support.strategies import SECOND_NS, predicates, sentences
from support.strings import matching

if TYPE_CHECKING:
    from collections.abc import Iterable

    from hypothesis.strategies import DrawFn, SearchStrategy

MAX_NS = 10**6 * SECOND_NS
TIMES_NS = st.one_of(
    st.sampled_from([0, 1, 1_000, 523_123_000, 1_500_000_000, SECOND_NS, 60 * SECOND_NS, 5400 * SECOND_NS]),
    st.integers(0, MAX_NS),
)
SHARES = st.integers(0, 1000).map(lambda thousandths: Fraction(thousandths, 1000))
DIGESTS = matching("[0-9a-f]{64}")
ENDS = [end for end in End if end not in (End.LOST, End.IMPOSSIBLE)]
"""A run that was lost did not end."""

DELIVERIES = st.lists(TIMES_NS, max_size=3).map(tuple)


def optional(strategy: SearchStrategy[Any]) -> SearchStrategy[Any]:
    return st.one_of(st.none(), strategy)


@st.composite
def cases(draw: DrawFn, model: BehaviorModel) -> Case:
    """A case of a model with everything that a file can say. The model allows all initial states."""
    goal, predicate = draw(_goals(model))
    everything = tuple(model.running_space)
    requirements = [Requirement(f"own{index}", draw(sentences(everything))) for index in range(draw(st.integers(0, 2)))]
    origin = draw(optional(st.builds(Origin, st.integers(-(10**20), 10**20), st.integers(1, 10**6), st.booleans())))
    return Case(
        draw(matching(r"[A-Za-z_][A-Za-z0-9_.-]{0,20}")),
        goal,
        predicate,
        State(model.space, {variable.name: draw(st.sampled_from(variable.domain.values)) for variable in model.space}),
        draw(outcomes(model)),
        draw(injections(model)),
        draw(networks(model, drawn=origin is not None)),
        CaseLimits(draw(optional(TIMES_NS.filter(bool))), draw(optional(st.integers(1, 10**6)))),
        tuple(requirements),
        draw(_expectations(model)),
        origin,
        draw(optional(recorded_runs(model))),
        environment=draw(optional(environment_changes(model))),
        may_end=draw(MAY_END),
        later=tuple(draw(_later_goal(model)) for _ in range(draw(st.integers(0, 2)))),
    )


@st.composite
def recorded_runs(draw: DrawFn, model: BehaviorModel) -> RecordedRun:
    """The result of a run of a model, as a file can say it: of each goal some of its parts."""
    goals = tuple(draw(_recorded_goal(model)) for _ in range(draw(st.integers(0, 3))))
    end = goals[-1].end if goals else str(draw(st.sampled_from(ENDS)))
    if len(goals) == 1 and replace(goals[0], end="") == RecordedGoal(""):
        goals = ()
    return RecordedRun(end, draw(optional(DIGESTS)), goals=goals)


@st.composite
def _recorded_goal(draw: DrawFn, model: BehaviorModel) -> RecordedGoal:
    some = (st.lists(st.sampled_from(names), unique=True) if names else st.just([]) for names in _recordable(model))
    subsets = [draw(optional(each)) for each in some]
    visits, order, final = (None if names is None else tuple(names) for names in subsets)
    if visits is not None:
        visits = tuple(sorted(visits, key=lambda name: name.partition("/")[0]))
    return RecordedGoal(str(draw(st.sampled_from(ENDS))), visits, order, final, draw(optional(TIMES_NS)))


def _recordable(model: BehaviorModel) -> tuple[list[Any], ...]:
    """The names of obligations and operations of a model, and the values of its variables as texts."""
    values = [(variable.name, format_value(variable.domain.values[-1])) for variable in model.space]
    return list(map(str, Obligations.of(model))), [operation.name for operation in model.operations], values


MAY_END = st.lists(st.sampled_from([End.ABORTED, End.UNSOLVABLE, End.NOT_STARTED]), unique=True, max_size=2).map(tuple)


@st.composite
def _later_goal(draw: DrawFn, model: BehaviorModel) -> CaseGoal:
    name, predicate = draw(_goals(model))
    when = draw(optional(predicates(tuple(model.running_space), 2)))
    return CaseGoal(name, predicate, when, draw(_expectations(model)), draw(MAY_END))


@st.composite
def environment_changes(draw: DrawFn, model: BehaviorModel) -> tuple[EnvironmentChange, ...]:
    """What the environment of a model can do; now and then by a transition, if it has some."""
    known = outside_values(model)
    names = ["", *(each.name for each in model.environment)]
    changes = []
    for _ in range(draw(st.integers(0, 2))):
        chosen = draw(st.lists(st.sampled_from(sorted(known)), unique=True, max_size=2)) if known else []
        assign = tuple((name, draw(st.sampled_from(known[name]))) for name in chosen)
        changes.append(EnvironmentChange(draw(TIMES_NS), assign, draw(st.sampled_from(names))))
    return tuple(changes)


@st.composite
def _goals(draw: DrawFn, model: BehaviorModel) -> Any:  # noqa: ANN401 - a name and a predicate
    named_too = draw(st.booleans())
    if model.goals and named_too:
        return draw(st.sampled_from(model.goals))
    predicate = draw(predicates(tuple(model.space), 2))
    named = [name for name, goal in model.goals if goal == predicate]
    return (named or [str(predicate)])[0], predicate


@st.composite
def outcomes(draw: DrawFn, model: BehaviorModel) -> tuple[OutcomeRule, ...]:
    """Rules in the form in which a file says them: name by name, request by request, at most two equal in a row."""
    resources = {resource.name: resource for resource in model.resources}
    names = [*resources, *(operation.name for operation in model.operations)]
    rules: list[OutcomeRule] = []
    for subject in draw(st.lists(st.sampled_from(names), unique=True, max_size=3)):
        measuring = [resources[subject]] if subject in resources else model.resources
        own: list[OutcomeRule] = []
        first = 1
        for length in draw(st.lists(st.sampled_from([1, 1, 1, 2, 3, 40]), max_size=6)):
            first += draw(st.sampled_from([0, 0, 1, 3, 30]))
            own.append(draw(_rules(subject, first, first + length - 1, measuring)))
            first += length
        if draw(st.booleans()):
            own.append(draw(_rules(subject, first + draw(st.sampled_from([0, 1, 5])), None, measuring)))
        rules += _short_rows(own)
    return tuple(rules)


def _short_rows(rules: list[OutcomeRule]) -> list[OutcomeRule]:
    """The rules without single ones that would be counted: those that say the same as the two before them."""
    kept: list[OutcomeRule] = []
    for rule in rules:
        single = rule.first == rule.last
        if not (single and len(kept) > 1 and all(_effect(rule) == _effect(other) for other in kept[-2:])):
            kept.append(rule)
    return kept


def _effect(rule: OutcomeRule) -> tuple[object, ...]:
    return (rule.outcome, rule.latency_ns, rule.measured, rule.request, rule.reply, rule.cancel)


@st.composite
def _rules(draw: DrawFn, subject: str, first: int, last: int | None, measuring: Iterable[Resource]) -> OutcomeRule:
    outcome = draw(optional(st.sampled_from(Outcome)))
    if outcome is not None and draw(st.booleans()):
        return OutcomeRule(subject, first, last, outcome)
    replies = outcome is not Outcome.TIMEOUT
    measures = outcome in (None, Outcome.SUCCEED)
    measured = draw(optional(_values_of(measuring))) if measures else None
    latency_ns = draw(TIMES_NS) if replies else None
    reply = draw(optional(DELIVERIES)) if replies else None
    cancel = draw(DELIVERIES)
    return OutcomeRule(subject, first, last, outcome, latency_ns, measured, draw(optional(DELIVERIES)), reply, cancel)


@st.composite
def _values_of(draw: DrawFn, measuring: Iterable[Resource]) -> Any:  # noqa: ANN401 - variables and their values
    known = {drawn.name: drawn.values for resource in measuring for drawn in resource.simulation.measured}
    names = draw(st.lists(st.sampled_from(list(known)), unique=True)) if known else []
    return tuple((name, draw(st.sampled_from(known[name]))) for name in names)


@st.composite
def injections(draw: DrawFn, model: BehaviorModel) -> tuple[Injection, ...]:
    """Injections at times of their own, so that none contradicts another one."""
    found = []
    for number in range(1, draw(st.integers(0, 3)) + 1):
        name = draw(st.sampled_from([f"injection_{number}", f"own-{number}.x"]))
        at_ns = number * MAX_NS + draw(TIMES_NS)
        when = draw(optional(predicates(tuple(model.running_space), 2)))
        hold_ns = draw(optional(st.integers(0, 1_000))) if number == 1 else None
        after_ns = None if when is None else draw(optional(TIMES_NS))
        acts_on_resource = draw(st.booleans())
        if model.resources and acts_on_resource:
            resource = draw(st.sampled_from(model.resources)).name
            found.append(Injection(name, (), when, at_ns, hold_ns, resource, draw(_conditions()), after_ns))
        else:
            found.append(Injection(name, draw(_assigned(model)), when, at_ns, hold_ns, after_ns=after_ns))
    return tuple(found)


def _conditions() -> SearchStrategy[Condition]:
    factors = st.integers(1_000, 99_999).map(lambda thousandths: Fraction(thousandths, 1000))
    words = st.sampled_from([kind for kind in CONDITIONS.values() if not kind.has_factor])
    with_factors = st.sampled_from([kind for kind in CONDITIONS.values() if kind.has_factor])
    return st.one_of(st.builds(Condition, words), st.builds(Condition, with_factors, factors))


@st.composite
def _assigned(draw: DrawFn, model: BehaviorModel) -> Any:  # noqa: ANN401 - variables and their values
    def target(variable: Variable) -> object:
        is_state = variable.role in (Role.OPERATION_STATE, Role.CURRENT_STATE)
        return Role.CURRENT_STATE if is_state else variable.name

    assignable = [variable for variable in model.running_space if variable.assignable]
    chosen = draw(st.lists(st.sampled_from(assignable), min_size=1, max_size=3, unique_by=target))
    return tuple((variable.name, draw(st.sampled_from(variable.assignable))) for variable in chosen)


@st.composite
def networks(draw: DrawFn, model: BehaviorModel, *, drawn: bool) -> Network:
    """The network of a model that has resources."""
    names = [resource.name for resource in model.resources]
    kinds = [fault for fault in NETWORK_FAULTS.values() if drawn or not fault.is_random]
    return Network(**{fault.attribute: draw(_fault_values(fault, names)) for fault in kinds})


def _fault_values(fault: AnyNetworkFault, names: list[str]) -> st.SearchStrategy[object]:
    match fault:
        case TimeFault():
            return st.just(fault.default) | TIMES_NS
        case ShareFault():
            return SHARES
        case WindowFault():
            named = st.sampled_from(names)
            resource = named if fault.needs_resource else optional(named)
            window = st.builds(fault.window, at_ns=TIMES_NS, for_ns=TIMES_NS, resource=resource)
            return st.lists(window, max_size=2).map(tuple)
        case _:
            assert_never(fault)


@st.composite
def _expectations(draw: DrawFn, model: BehaviorModel) -> Expectations:
    names = st.lists(st.sampled_from([operation.name for operation in model.operations]), max_size=4).map(tuple)
    final = st.lists(predicates(tuple(model.running_space), 2), max_size=2).map(tuple)
    visits = st.lists(st.sampled_from(list(Obligations.of(model))), unique=True, max_size=3).map(tuple)
    fields = st.tuples(optional(st.sampled_from(ENDS)), optional(names), names, final, visits)
    return Expectations(*draw(fields))
