"""Sums: what a term is worth, and what packed states, normal forms, planners and the checker make of it."""

from __future__ import annotations

from itertools import product
from typing import TYPE_CHECKING

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.closing import CloseLimits, Closer, Decision
from scbm.closing.proofs.possible_values import possible_values, ruled_out
from scbm.files import parse_predicate
from scbm.files.language.scope import Scope
from scbm.model import (
    Assign,
    BehaviorModel,
    Constant,
    Equal,
    Operation,
    Packing,
    Reference,
    StateSpace,
    Sum,
    Transition,
    Truth,
    conjunction,
)
from scbm.model.operations import apply
from scbm.model.predicates import LinearForm, bounds, substituted
from scbm.model.satisfiability import is_satisfiable
from scbm.planning import PLANNERS, PlanLimits, Planner, Solved, find_flaw
from scbm.planning.pddl_export import PddlDomain
from scbm.planning.plan_search import SEARCHES, search_plan
from scbm.proofcheck import ValuesArgument, check_certificate
from scbm.proofcheck.certificate import claimable_obligations
from scbm.proofcheck.values_check import check_values
from support.draws import flag, one_of, some_of, whole
from support.enumeration import enumerate_runs
from support.pddl_reference import shortest_length
from support.profiles import examples
from support.reference import canonical_plan, step, world
from support.strategies import calculation, comparison, integer_variables, running_models

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from hypothesis.strategies import DrawFn

    from scbm.model import Predicate, Term, Variable


@st.composite
def terms(draw: DrawFn) -> tuple[StateSpace, Term]:
    space = draw(integer_variables())
    return StateSpace(space), calculation(draw, space, 3)


@st.composite
def comparisons(draw: DrawFn) -> tuple[StateSpace, Predicate]:
    space = draw(integer_variables())
    return StateSpace(space), comparison(draw, space)


@st.composite
def assignments(draw: DrawFn) -> tuple[StateSpace, tuple[Assign, ...]]:
    space = draw(integer_variables())
    first, second = space[0], one_of(draw, space[1:])
    return StateSpace(space), tuple(Assign(target.name, calculation(draw, space)) for target in (first, second))


@st.composite
def problems(draw: DrawFn) -> BehaviorModel:
    """Models whose operations calculate, with a goal that some of them reach and one that is drawn."""
    space = draw(integer_variables())
    operations = []
    for index in range(whole(draw, 2, 4)):
        guards = [comparison(draw, space) if flag(draw) else Truth(True) for _ in range(2)]
        first = Transition("start", guards[0], a=tuple(_assignments(draw, space, whole(draw, 0, 1))))
        second = Transition("end", guards[1], a=tuple(_assignments(draw, space, whole(draw, 1, 2))))
        operations.append(Operation(f"o{index}", first, second))
    model = BehaviorModel("calculating", space, tuple(operations))
    state = world(model, model.nominal_state)
    for _ in range(6):
        state = step(model, one_of(draw, operations).name, state) or state
    reached = conjunction(Equal(Reference(v.name), Constant(state[v.name])) for v in space)
    return replace(model, goals=(("reached", reached), ("drawn", comparison(draw, space))))


def _assignments(draw: DrawFn, space: Sequence[Variable], count: int) -> Iterator[Assign]:
    domains = {variable.name: variable.domain for variable in space}
    for target in some_of(draw, space, count, count):
        term = calculation(draw, space, 1)
        low, high = bounds(term, domains)
        if low < int(target.domain.values[-1]) and high > int(target.domain.values[0]):
            yield Assign(target.name, term)


def states(space: StateSpace) -> Iterator[dict[str, int]]:
    for values in product(*(variable.domain.values for variable in space)):
        yield {name: int(value) for name, value in zip(space.names, values, strict=True)}


def worth(text: str, state: dict[str, int]) -> int | bool:
    """The slow and obvious evaluator: sums, `min`, `max` and comparisons are written as in Python."""
    return eval(text, {"min": min, "max": max, "__builtins__": {}}, state)  # type: ignore[no-any-return]  # noqa: S307 - the text is ours


@given(terms())
def test_a_term_is_worth_what_is_written(drawn: tuple[StateSpace, Term]) -> None:
    space, term = drawn
    low, high = bounds(term, {variable.name: variable.domain for variable in space})
    for state in states(space):
        value = term.value(state)
        assert value == worth(str(term), state)
        assert low <= int(value) <= high
        linear = LinearForm.difference(term, Sum(((1, term),)))
        assert linear == LinearForm((), 0)
        known = dict(list(state.items())[:2])
        assert substituted(term, known).value(state) == value


@given(comparisons())
def test_a_comparison_is_packed_and_decided_as_written(drawn: tuple[StateSpace, Predicate]) -> None:
    space, leaf = drawn
    packing = Packing(space)
    test = packing.test(leaf)
    truths = [worth(str(leaf), state) for state in states(space)]
    assert [leaf.holds(state) for state in states(space)] == truths
    assert [test(packing.pack(state)) for state in states(space)] == truths
    assert is_satisfiable(leaf, space) is any(truths)
    assert parse_predicate(str(leaf), Scope.over(space)) == leaf


@given(assignments())
def test_assignments_are_packed_as_written(drawn: tuple[StateSpace, tuple[Assign, ...]]) -> None:
    space, actions = drawn
    packing = Packing(space)
    update = packing.update(actions)
    for state in map(packing.unpack, map(packing.pack, states(space))):
        after = apply(actions, state)
        assert update(packing.pack(state)) == (None if after is None else packing.pack(after))


@pytest.mark.parametrize("engine", list(SEARCHES))
@given(problems())
@examples(300, usual=8)
def test_each_search_finds_the_canonical_plan_with_sums(engine: str, model: BehaviorModel) -> None:
    planner, start = Planner(model), model.nominal_state
    for _, goal in model.goals:
        problem = planner.problem(goal)
        answer = search_plan(problem, problem.task.pack(start), PlanLimits(), engine=engine)
        expected = canonical_plan(model, start, goal, most=1_000)
        assert (answer.plan if isinstance(answer, Solved) else None) == expected


@pytest.mark.parametrize("name", [name for name, entry in PLANNERS.items() if not entry.is_external])
@given(problems())
@examples(300, usual=8)
def test_each_planner_plans_with_sums(name: str, model: BehaviorModel) -> None:
    for _, goal in model.goals:
        answer = Planner(model, name).plan(model.nominal_state, goal)
        assert isinstance(answer, Solved) is (canonical_plan(model, model.nominal_state, goal, 1_000) is not None)
        if isinstance(answer, Solved):
            assert find_flaw(model, model.nominal_state, goal, answer.plan) is None


@given(problems())
@examples(300, usual=8)
def test_exported_models_with_sums_have_plans_of_the_same_length(model: BehaviorModel) -> None:
    domain = PddlDomain(model, [goal for _, goal in model.goals])
    for name, goal in model.goals:
        plan = canonical_plan(model, model.nominal_state, goal, most=1_000)
        length = shortest_length(domain.text, domain.problem(name, model.nominal_state, goal))
        assert length == (None if plan is None else len(plan))


@given(running_models(integer_variables()))
@examples(300, usual=8)
def test_the_checker_agrees_with_the_values_of_models_with_sums(model: BehaviorModel) -> None:
    values = possible_values(model)
    known = {str(obligation): obligation for obligation in claimable_obligations(model)}
    claimed = [known[str(obligation)] for obligation, _ in ruled_out(model, values)]
    assert list(check_values(claimed, ValuesArgument(dict(values)), model)) == []


@pytest.mark.slow
@given(running_models(integer_variables()))
@settings(examples(100), suppress_health_check=[HealthCheck.too_slow])
def test_no_proof_about_models_with_sums_is_wrong(model: BehaviorModel) -> None:
    closing = Closer(model, CloseLimits(situations=3_000)).close()
    runs = enumerate_runs(model, 1_000, is_open=True, is_sequence=True)
    proved = [str(d.obligation) for d in closing.decided if d.decision is Decision.UNCOVERABLE]
    assert [name for name in proved if runs.visits(name)] == []
    for kind, certificate in closing.certificates:
        assert [str(flaw) for flaw in check_certificate(certificate, model)] == [], kind
