"""The engines of the search for canonical plans: one contract, and the shapes that choose between them."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache

import pytest
from published import GOAL, PROBLEMS, flags, gripper

from scbm.model import (
    Action,
    Add,
    And,
    Assign,
    BehaviorModel,
    Constant,
    Domain,
    Equal,
    Not,
    NotEqual,
    Operation,
    Or,
    Order,
    Predicate,
    Reference,
    Relation,
    Transition,
    Truth,
    Value,
    Variable,
)
from scbm.planning import (
    Answer,
    Limit,
    LimitReached,
    PlanLimits,
    Planner,
    SearchCancelledError,
    Solved,
    Unsolvable,
)
from scbm.planning.plan_answers import always
from scbm.planning.plan_search import MAX_PLAIN, SEARCHES, breadth_first, brief_answer, search_plan
from scbm.planning.planning_task import Problem
from scbm.planning.searches import array_search, array_states

FROM_BOTH_ENDS = "arrays from both ends"
EACH_ENGINE = pytest.mark.parametrize("engine", [*SEARCHES, FROM_BOTH_ENDS])
_TRUE = Truth(True)


def _is(name: str, value: Value) -> Predicate:
    return Equal(Reference(name), Constant(value))


def _let(name: str, value: Value) -> Action:
    return Assign(name, Constant(value))


def _operation(name: str, guard: Predicate, *actions: Action) -> Operation:
    return Operation(name, Transition(f"start_{name}", guard), Transition(f"end_{name}", _TRUE, a=actions))


def _model(variables: dict[str, Domain], operations: list[Operation], goal: Predicate) -> BehaviorModel:
    declared = tuple(Variable(name, d, d.values[0], (d.values[0],)) for name, d in variables.items())
    return BehaviorModel("made", declared, tuple(operations), goals=((GOAL, goal),))


def _counters(count: int, last: int, wanted: int) -> BehaviorModel:
    """Counters that go up by one; each of them must reach a value."""
    names = [f"c{i}" for i in range(count)]
    operations = [_operation(f"up_{name}", _TRUE, Add(name, 1)) for name in names]
    goal = And((*(_is(name, wanted) for name in names), _TRUE))
    return _model({name: Domain.integers(0, last) for name in names}, operations, goal)


def _search(
    model: BehaviorModel,
    engine: str | None,
    limits: PlanLimits | None = None,
    should_continue: Callable[[], bool] = always,
) -> Answer:
    """The answer of an engine; a search from both ends starts at once from both of them."""
    problem = Planner(model).problem(model.goals[0][1])
    start = problem.task.pack(model.nominal_state)
    with pytest.MonkeyPatch.context() as patch:
        if engine == FROM_BOTH_ENDS:
            patch.setattr(array_search, "PERIMETER_AFTER", 0)
            engine = "arrays"
        return search_plan(problem, start, limits or PlanLimits(), should_continue, engine)


def _plain(model: BehaviorModel, limits: PlanLimits | None = None) -> Answer:
    problem = Planner(model).problem(model.goals[0][1])
    return breadth_first(problem, problem.task.pack(model.nominal_state), limits or PlanLimits())


def _plan(answer: Answer) -> tuple[str, ...]:
    assert isinstance(answer, Solved)
    return answer.plan


@EACH_ENGINE
def test_the_shortest_plan_comes_first_and_of_the_shortest_the_first_in_order(engine: str) -> None:
    places = Domain.symbols("home", "way", "box")
    operations = [
        _operation("to_the_way", _is("at", "home"), _let("at", "way")),
        _operation("from_the_way", _is("at", "way"), _let("at", "box")),
        _operation("slowly", _is("at", "home"), _let("at", "box")),
        _operation("fast", _is("at", "home"), _let("at", "box")),
    ]
    assert _plan(_search(_model({"at": places}, operations, _is("at", "box")), engine)) == ("slowly",)


@EACH_ENGINE
def test_the_first_operation_decides_before_the_second(engine: str) -> None:
    """The plan `a, z` comes before `b, a`, although the operation `a` ends the other one."""
    operations = [
        _operation("a", _is("at", 0), _let("at", 1)),
        _operation("a_after_b", _is("at", 2), _let("at", 3)),
        _operation("b", _is("at", 0), _let("at", 2)),
        _operation("z", _is("at", 1), _let("at", 3)),
    ]
    model = _model({"at": Domain.integers(0, 3)}, operations, _is("at", 3))
    assert _plan(_search(model, engine)) == ("a", "z")


@EACH_ENGINE
def test_a_goal_that_no_path_reaches_is_unsolvable(engine: str) -> None:
    operations = [
        _operation("fall", _TRUE, _let("at", "pit")),
        _operation("go", _is("at", "home"), _let("at", "box")),
        _operation("press", _is("at", "pit"), _let("lamp", True)),
    ]
    places = Domain.symbols("home", "box", "pit")
    model = _model({"at": places, "lamp": Domain.boolean()}, operations, And((_is("at", "box"), _is("lamp", True))))
    assert isinstance(_search(model, engine), Unsolvable)


@EACH_ENGINE
def test_a_limit_on_the_length_is_exact(engine: str) -> None:
    model = _counters(3, 9, 3)
    assert isinstance(_search(model, engine, PlanLimits(length=9)), Solved)
    answer = _search(model, engine, PlanLimits(length=8))
    assert isinstance(answer, LimitReached)
    assert answer.limit is Limit.LENGTH


@EACH_ENGINE
def test_a_search_is_cancelled(engine: str) -> None:
    model = _counters(4, 9, 9)
    with pytest.raises(SearchCancelledError):
        _search(model, engine, should_continue=lambda: False)


@pytest.mark.parametrize("name", ["blocks-6-0", "gripper-6", "machining_cell"])
@pytest.mark.parametrize("engine", [None, FROM_BOTH_ENDS])
def test_published_problems_have_the_plan_of_the_breadth_first_search(engine: str | None, name: str) -> None:
    model = PROBLEMS[name]()
    assert _plan(_search(model, engine)) == _plan(_plain(model))


def test_few_states_are_searched_without_an_engine() -> None:
    model = _counters(3, 9, 3)
    assert _search(model, None) == _plain(model)
    small = PlanLimits(expansions=MAX_PLAIN)
    assert _search(gripper(6), None, small) == _plain(gripper(6), small)


def test_more_states_are_searched_by_the_engine_for_their_shape() -> None:
    assert _plan(_search(flags(12), None)) == _plan(_plain(flags(12)))
    suits = {name: entry.suits for name, entry in SEARCHES.items()}

    def chosen(model: BehaviorModel, limits: PlanLimits) -> str:
        problem = Planner(model).problem(model.goals[0][1])
        system = problem.task.reduced(problem.task.pack(model.nominal_state))
        return next(name for name, suited in suits.items() if suited(system, limits))

    assert chosen(_counters(3, 9, 9), PlanLimits()) == "dense"
    assert chosen(_counters(3, 9, 9), PlanLimits(expansions=999)) == "arrays"
    assert chosen(_counters(6, 9, 9), PlanLimits()) == "arrays"


def test_a_limit_on_states_counts_on_arrays_as_in_the_breadth_first_search() -> None:
    model = gripper(6)
    exact = _plain(model).expanded
    for most in (300, exact - 1, exact):
        limits = PlanLimits(expansions=most)
        assert _search(model, "arrays", limits) == _plain(model, limits)


def test_states_of_several_words_with_equal_hashes_are_not_confused(monkeypatch: pytest.MonkeyPatch) -> None:
    model = _counters(40, 5, 1)
    reduced = PlanLimits(length=2)
    expected = _plain(model, reduced)
    assert _search(model, "arrays", reduced) == expected
    factors = array_states.multiplier
    monkeypatch.setattr(array_states, "multiplier", lambda number: 0 if number < 4 else factors(number))
    assert _search(model, "arrays", reduced) == expected


@pytest.mark.slow
def test_a_long_search_goes_on_from_both_ends() -> None:
    answer = _search(PROBLEMS["blocks-9-0"](), None)
    assert len(_plan(answer)) == 30
    assert answer.expanded < 100_000


@pytest.mark.slow
@pytest.mark.parametrize(("name", "length"), [("logistics-8-0", 31), ("rovers-05", 22)])
def test_at_its_limit_the_breadth_first_search_is_followed_by_the_informed_one(name: str, length: int) -> None:
    assert len(_plan(_search(PROBLEMS[name](), None))) == length


def test_independent_parts_are_planned_one_after_the_other_in_file_order() -> None:
    model = PROBLEMS["independent-10x10"]()
    expected = [operation.name for operation in model.operations]
    assert list(_plan(_search(model, "informed"))) == expected
    shortcut = _search(model, None)
    assert list(_plan(shortcut)) == expected
    assert shortcut.expanded < 30_000


def test_small_limits_are_those_of_the_breadth_first_search() -> None:
    model = PROBLEMS["independent-10x10"]()
    for most in (10, 1_000, 20_000):
        answer = _search(model, None, PlanLimits(expansions=most))
        assert isinstance(answer, LimitReached)
        assert answer.limit is Limit.EXPANSIONS
    assert isinstance(_search(model, None, PlanLimits(length=3)), LimitReached)


def test_a_problem_without_a_plan_that_the_relaxation_does_not_see_is_proved_unsolvable() -> None:
    """Each of two switches can be set, but setting one resets the other."""
    operations = [
        _operation("left", _TRUE, _let("left", True), _let("right", False)),
        _operation("right", _TRUE, _let("right", True), _let("left", False)),
    ]
    switches = dict.fromkeys(("left", "right"), Domain.boolean())
    model = _model(switches, operations, And((_is("left", True), _is("right", True))))
    for engine in SEARCHES:
        assert isinstance(_search(model, engine), Unsolvable)


@EACH_ENGINE
def test_a_goal_with_alternatives_is_reached_by_the_shortest_plan(engine: str) -> None:
    """No value is part of every goal state, so the goal has no landmarks."""
    operations = [
        _operation("walk", _is("at", "home"), _let("at", "way")),
        _operation("enter", _is("at", "way"), _let("at", "box")),
        _operation("press", _TRUE, _let("lamp", True)),
    ]
    goal = Or((_is("at", "box"), _is("lamp", True)))
    model = _model({"at": Domain.symbols("home", "way", "box"), "lamp": Domain.boolean()}, operations, goal)
    assert _plan(_search(model, engine)) == ("press",)


@EACH_ENGINE
def test_values_that_are_copied_swapped_and_compared(engine: str) -> None:
    operations = [
        _operation("up", Order(Reference("a"), Relation.LESS, Reference("limit")), Add("a", 1)),
        _operation("swap", _TRUE, Assign("a", Reference("b")), Assign("b", Reference("a"))),
        _operation("copy", Or((_is("b", 2), _is("limit", 1))), Assign("limit", Reference("b"))),
        _operation("raise_limit", Not(_is("a", 2)), Add("limit", 1)),
    ]
    numbers = Domain.integers(0, 4)
    goal = And((_is("a", 3), _is("b", 4), NotEqual(Reference("limit"), Reference("a"))))
    model = _model(dict.fromkeys(("a", "b", "limit"), numbers), operations, goal)
    assert _plan(_search(model, engine)) == _plan(_plain(model))


@pytest.mark.slow
def test_plans_are_the_same_under_every_hash_seed() -> None:
    program = (
        "from published import PROBLEMS\n"
        "from scbm.planning import PlanLimits, Planner\n"
        "from scbm.planning.plan_search import search_plan\n"
        "for name in ('gripper-6', 'machining_cell'):\n"
        "    model = PROBLEMS[name]()\n"
        "    problem = Planner(model).problem(model.goals[0][1])\n"
        "    start = problem.task.pack(model.nominal_state)\n"
        "    for engine in (None, 'arrays'):\n"
        "        print(name, engine, search_plan(problem, start, PlanLimits(), engine=engine))\n"
    )
    path = os.pathsep.join(sys.path)
    outputs = [
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": path},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    ]
    assert outputs[0] == outputs[1]
    assert outputs[0]


# the first part of the search


@cache
def published(name: str) -> tuple[Problem, int]:
    """Return a published problem, and its initial state."""
    model = PROBLEMS[name]()
    problem = Planner(model).problem(dict(model.goals)[GOAL])
    return problem, problem.task.pack(model.nominal_state)


@pytest.mark.longer
@pytest.mark.parametrize("name", ["gripper-6", "blocks-6-0", "blocks-8-0", "flags_all_16", "independent-10x10"])
@pytest.mark.parametrize("limits", [PlanLimits(), PlanLimits(5), PlanLimits(expansions=300), PlanLimits(50, 20_000)])
def test_a_brief_search_has_the_answer_of_the_whole_one_or_none(name: str, limits: PlanLimits) -> None:
    problem, start = published(name)
    brief = brief_answer(problem, start, limits)
    assert brief is None or brief == search_plan(problem, start, limits)


def test_a_brief_search_leaves_long_ones_unanswered() -> None:
    answers = [brief_answer(*published(name), PlanLimits()) for name in ("blocks-6-0", "blocks-8-0")]
    assert [answer is None for answer in answers] == [False, True]
