"""Answers of the exploration engines on small systems; every engine keeps the same contract."""

from __future__ import annotations

import pytest

from scbm.model import (
    Action,
    Add,
    And,
    Assign,
    Constant,
    Domain,
    Equal,
    Not,
    Order,
    Predicate,
    Reference,
    Relation,
    StateSpace,
    Value,
    Variable,
)
from scbm.model.predicates import FALSE, TRUE
from scbm.planning.engines import (
    Exceeded,
    ExplorationBound,
    ExplorationLimits,
    Move,
    MovePart,
    Region,
    TransitionSystem,
    relevant,
)
from scbm.planning.engines.exploration import ENGINES, Distances, Exploration, Found, Reached, Unreachable

EACH_ENGINE = pytest.mark.parametrize("engine", list(ENGINES))


def _variable(name: str, domain: Domain) -> Variable:
    return Variable(name, domain, domain.values[0], (domain.values[0],))


def _is(name: str, value: Value) -> Predicate:
    return Equal(Reference(name), Constant(value))


def _move(name: str, guard: Predicate, *actions: Action) -> Move:
    return Move(name, (MovePart(guard, actions),))


def _counters(count: int, last: int) -> TransitionSystem:
    """Counters from 0 to `last`, each of which can go up, and back to 0 from its end."""
    names = [f"c{index}" for index in range(count)]
    ups = [_move(f"up_{name}", TRUE, Add(name, 1)) for name in names]
    downs = [_move(f"down_{name}", _is(name, last), Assign(name, Constant(0))) for name in names]
    return TransitionSystem(StateSpace(_variable(name, Domain.integers(0, last)) for name in names), (*ups, *downs))


def _nominal(system: TransitionSystem) -> Region:
    return Region.of({variable.name: variable.initial for variable in system.space})


def _explore(
    system: TransitionSystem, engine: str | None = None, limits: ExplorationLimits | None = None
) -> Exploration:
    return Exploration(system, [_nominal(system)], system.space.names, limits or ExplorationLimits(), engine)


@EACH_ENGINE
def test_the_shortest_plan_comes_first_and_of_the_shortest_the_first_in_order(engine: str) -> None:
    space = StateSpace([_variable("at", Domain.symbols("home", "way", "box"))])
    system = TransitionSystem(
        space,
        (
            _move("to_the_way", _is("at", "home"), Assign("at", Constant("way"))),
            _move("from_the_way", _is("at", "way"), Assign("at", Constant("box"))),
            _move("slowly", _is("at", "home"), Assign("at", Constant("box"))),
            _move("fast", _is("at", "home"), Assign("at", Constant("box"))),
        ),
    )
    distances = _explore(system, engine).distances(_is("at", "box"))
    assert isinstance(distances, Distances)
    assert distances.plan({"at": "home"}) == ("slowly",)
    assert distances.plan({"at": "way"}) == ("from_the_way",)
    assert distances.plan({"at": "box"}) == ()
    assert distances.first_move({"at": "box"}) is None


@EACH_ENGINE
def test_a_state_from_which_no_way_leads_has_no_distance(engine: str) -> None:
    space = StateSpace([_variable("at", Domain.symbols("home", "box", "pit"))])
    moves = (_move("fall", TRUE, Assign("at", Constant("pit"))), _move("go", _is("at", "home"), _to("box")))
    distances = _explore(TransitionSystem(space, moves), engine).distances(_is("at", "box"))
    assert isinstance(distances, Distances)
    assert distances.distance({"at": "pit"}) is None
    assert distances.first_move({"at": "pit"}) is None
    assert distances.plan({"at": "pit"}) is None
    assert distances.plan({"at": "home"}) == ("go",)


def _to(place: str) -> Assign:
    return Assign("at", Constant(place))


@EACH_ENGINE
def test_each_part_looks_at_what_the_one_before_it_has_left(engine: str) -> None:
    space = StateSpace([_variable("a", Domain.integers(0, 3)), _variable("b", Domain.integers(0, 3))])
    through = Move(
        "through", (MovePart(_is("a", 0), (Add("a", 2),)), MovePart(_is("a", 2), (Assign("b", Reference("a")),)))
    )
    swap = Move(
        "swap",
        (
            MovePart(
                _is("b", 2),
                (
                    Assign("a", Reference("b")),
                    Assign("b", Reference("a")),
                ),
            ),
        ),
    )
    never = Move("never", (MovePart(TRUE, (Assign("a", Constant(3)),)), MovePart(TRUE, (Add("a", 1),))))
    reached = _explore(TransitionSystem(space, (through, swap, never)), engine).reached
    assert isinstance(reached, Reached)
    assert list(reached) == [{"a": 0, "b": 0}, {"a": 2, "b": 2}]


@EACH_ENGINE
def test_variables_are_swapped_at_once(engine: str) -> None:
    space = StateSpace([_variable("a", Domain.integers(0, 3)), _variable("b", Domain.integers(0, 3))])
    swap = _move("swap", TRUE, Assign("a", Reference("b")), Assign("b", Reference("a")))
    exploration = Exploration(
        TransitionSystem(space, (swap,)), [Region.of({"a": 1, "b": 3})], engine=engine, observed=("a", "b")
    )
    assert isinstance(exploration.reached, Reached)
    assert list(exploration.reached) == [{"a": 3, "b": 1}, {"a": 1, "b": 3}]


def test_what_the_values_rule_out_is_answered_without_a_search() -> None:
    system = _counters(9, 9)
    unreachable = And((_is("c0", 4), FALSE))
    exploration = _explore(system, limits=ExplorationLimits(states=10))
    assert exploration.find(unreachable) == Unreachable()
    assert exploration.distances(unreachable) == Unreachable()
    assert exploration.find(_is("c0", 4)) == Exceeded(ExplorationBound.STATES, 10)
    assert exploration.distances(_is("c0", 4)) == Exceeded(ExplorationBound.STATES, 10)


def test_guards_bound_the_values_that_a_variable_can_have() -> None:
    space = StateSpace([_variable("level", Domain.integers(0, 100)), _variable("most", Domain.integers(0, 100))])
    below = And((Order(Reference("level"), Relation.LESS, Constant(5)), Not(_is("level", 3))))
    system = TransitionSystem(space, (_move("fill", below, Add("level", 2)),))
    exploration = _explore(system)
    assert exploration.values == {"level": (0, 2, 4, 6), "most": (0,)}
    above = Order(Reference("level"), Relation.LESS, Reference("most"))
    assert exploration.find(above) == Unreachable()


def test_a_variable_that_nothing_reads_does_not_distinguish_states() -> None:
    space = StateSpace([_variable("at", Domain.symbols("home", "box")), _variable("shown", Domain.boolean())])
    moves = (
        _move("go", TRUE, Assign("at", Constant("box"))),
        _move("show", _is("at", "box"), Assign("shown", Constant(True))),
    )
    system = TransitionSystem(space, moves)
    assert relevant(system).names == ("at",)
    assert relevant(system, ("shown",)).names == ("at", "shown")
    exploration = Exploration(system, [_nominal(system)])
    assert isinstance(exploration.reached, Reached)
    assert len(exploration.reached) == 2
    with pytest.raises(KeyError):
        exploration.find(_is("shown", True))


@EACH_ENGINE
def test_a_region_is_all_combinations_that_satisfy_its_predicate(engine: str) -> None:
    space = StateSpace(_variable(name, Domain.integers(0, 9)) for name in "ab")
    ordered = Order(Reference("a"), Relation.LESS, Reference("b"))
    region = Region({"a": (1, 2, 3), "b": (2, 3)}, ordered)
    reached = Exploration(TransitionSystem(space, ()), [region, Region.of({"a": 9, "b": 0})], engine=engine).reached
    assert isinstance(reached, Reached)
    assert [(state["a"], state["b"]) for state in reached] == [(9, 0), (1, 2), (1, 3), (2, 3)]


@EACH_ENGINE
def test_from_no_state_nothing_is_reached(engine: str) -> None:
    system = _counters(2, 3)
    for starts in ([], [Region.everywhere(system.space)][:0], [Region({"c0": (0,), "c1": (1, 2)}, FALSE)]):
        exploration = Exploration(system, starts, engine=engine, observed=system.space.names)
        assert isinstance(exploration.reached, Reached)
        assert len(exploration.reached) == 0
        assert {"c0": 0, "c1": 0} not in exploration.reached
        assert exploration.find(TRUE) == Unreachable()


@EACH_ENGINE
def test_a_state_that_is_not_reached_has_no_distance_to_ask_for(engine: str) -> None:
    space = StateSpace([_variable("a", Domain.integers(0, 5))])
    system = TransitionSystem(space, (_move("up", _is("a", 0), Add("a", 2)),))
    distances = _explore(system, engine).distances(_is("a", 2))
    assert isinstance(distances, Distances)
    for value in (1, 5):
        with pytest.raises(LookupError):
            distances.distance({"a": value})


@EACH_ENGINE
def test_more_memory_than_allowed_is_an_answer_of_its_own(engine: str) -> None:
    exploration = _explore(_counters(4, 9), engine, ExplorationLimits(bytes=10_000))
    assert exploration.reached == Exceeded(ExplorationBound.BYTES, 10_000)


def test_edges_count_as_memory_too() -> None:
    exploration = _explore(_counters(3, 9), "arrays", ExplorationLimits(bytes=1_000 * 40))
    assert isinstance(exploration.reached, Reached)
    assert exploration.distances(_is("c0", 9)) == Exceeded(ExplorationBound.BYTES, 40_000)


@EACH_ENGINE
def test_a_limit_of_states_counts_the_combinations_to_start_from(engine: str) -> None:
    system = _counters(2, 9)
    everywhere = Region.everywhere(system.space)
    exact = Exploration(system, [everywhere], system.space.names, ExplorationLimits(states=100), engine)
    assert isinstance(exact.reached, Reached)
    less = Exploration(system, [everywhere], system.space.names, ExplorationLimits(states=99), engine)
    assert less.reached == Exceeded(ExplorationBound.STATES, 99)


def test_the_shape_decides_which_engine_searches() -> None:
    assert _explore(_counters(3, 9)).engine == "dense"
    assert _explore(_counters(3, 9), limits=ExplorationLimits(bytes=5_000)).engine == "arrays"
    assert _explore(_counters(15, 9)).engine == "arrays"
    assert _explore(_counters(16, 9)).engine == "hashed"


@pytest.mark.slow
def test_the_engines_agree_on_many_states() -> None:
    system = _counters(6, 7)
    goal = And(tuple(Equal(Reference(name), Constant(7)) for name in system.space.names))
    dense, arrays = (_explore(system, engine) for engine in ("dense", "arrays"))
    assert isinstance(dense.reached, Reached)
    assert isinstance(arrays.reached, Reached)
    assert len(dense.reached) == len(arrays.reached) == 8**6
    one, other = dense.distances(goal), arrays.distances(goal)
    assert isinstance(one, Distances)
    assert isinstance(other, Distances)
    for state in list(dense.reached)[::997]:
        assert state in arrays.reached
        assert one.distance(state) == other.distance(state) == sum(7 - int(value) for value in state.values())
        assert one.plan(state) == other.plan(state)
    found = And((_is("c5", 3), Order(Reference("c0"), Relation.GREATER, Reference("c1"))))
    expected = Found({"c0": 1, "c1": 0, "c2": 0, "c3": 0, "c4": 0, "c5": 3})
    assert dense.find(found) == arrays.find(found) == expected
