"""Every engine of the exploration against a slow reference on named states, on random systems."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.model import Predicate, State, StateSpace, Truth, Value
from scbm.model.operations import apply
from scbm.planning.engines import Exceeded, ExplorationLimits, Move, MovePart, Region, TransitionSystem
from scbm.planning.engines.exploration import ENGINES, Distances, Exploration, Found, Reached, Unreachable
from support.profiles import examples
from support.strategies import actions, predicates, variables

EACH_ENGINE = pytest.mark.parametrize("engine", list(ENGINES))


@st.composite
def systems(draw: st.DrawFn) -> TransitionSystem:
    space = draw(variables())
    parts = st.tuples(predicates(space, 2), actions(space)).map(lambda part: MovePart(*part))
    moves = draw(st.lists(st.lists(parts, min_size=1, max_size=3).map(tuple), max_size=5))
    return TransitionSystem(StateSpace(space), tuple(Move(f"m{index}", parts) for index, parts in enumerate(moves)))


@st.composite
def regions(draw: st.DrawFn, space: StateSpace) -> Region:
    values = {v.name: tuple(draw(st.lists(st.sampled_from(v.domain.values), min_size=1, max_size=2))) for v in space}
    return Region(values, draw(st.one_of(st.just(Truth(True)), predicates(space.variables, 1))))


@st.composite
def problems(draw: st.DrawFn) -> tuple[TransitionSystem, list[Region], Predicate]:
    system = draw(systems())
    starts = draw(st.lists(regions(system.space), max_size=3))
    return system, starts, draw(predicates(system.space.variables, 2))


class Reference:
    """Everything on named states, one after the other."""

    def __init__(self, system: TransitionSystem, starts: list[Region]) -> None:
        self.system = system
        self.starts = list(dict.fromkeys(state for region in starts for state in self._states(region)))
        self.reached = self._reach()

    def _states(self, region: Region) -> list[State]:
        names = self.system.space.names
        combinations = product(*(region.values[name] for name in names))
        states = (State(self.system.space, dict(zip(names, values, strict=True))) for values in combinations)
        return [state for state in states if region.where.holds(state)]

    def _reach(self) -> list[State]:
        found = dict.fromkeys(self.starts)
        queue = deque(self.starts)
        while queue:
            for after in self.successors(queue.popleft()).values():
                if after not in found:
                    found[after] = None
                    queue.append(after)
        return list(found)

    def successors(self, state: State) -> dict[str, State]:
        steps = {move.name: self.step(move, state) for move in self.system.moves}
        return {name: after for name, after in steps.items() if after is not None}

    def step(self, move: Move, state: State) -> State | None:
        now: State | None = state
        for part in move.parts:
            if now is None or not part.guard.holds(now):
                return None
            now = apply(part.actions, now)
        return now

    def distance(self, state: State, goal: Predicate) -> int | None:
        seen = {state: 0}
        queue = deque([state])
        while queue:
            now = queue.popleft()
            if goal.holds(now):
                return seen[now]
            for after in self.successors(now).values():
                if after not in seen:
                    seen[after] = seen[now] + 1
                    queue.append(after)
        return None

    def order(self, state: Mapping[str, Value]) -> list[int]:
        """States are in the order of the last variable, then of the one before it, and so on."""
        return [variable.domain.index(state[variable.name]) for variable in reversed(self.system.space.variables)]


def _explored(system: TransitionSystem, starts: list[Region], engine: str) -> Exploration:
    return Exploration(system, starts, observed=system.space.names, engine=engine)


@EACH_ENGINE
@given(problem=problems())
@examples(80, usual=4)
def test_what_is_reached_is_what_the_reference_reaches(
    problem: tuple[TransitionSystem, list[Region], Predicate], engine: str
) -> None:
    system, starts, predicate = problem
    reference = Reference(system, starts)
    expected = sorted(reference.reached, key=reference.order)
    exploration = _explored(system, starts, engine)
    reached = exploration.reached
    assert isinstance(reached, Reached)
    assert list(reached) == [dict(state) for state in expected]
    assert len(reached) == len(expected)
    everything = Reference(system, [Region.everywhere(system.space)])
    assert [state in reached for state in everything.starts] == [state in expected for state in everything.starts]
    holding = [state for state in expected if predicate.holds(state)]
    assert exploration.find(predicate) == (Found(dict(holding[0])) if holding else Unreachable())


@EACH_ENGINE
@given(problem=problems())
@examples(80, usual=4)
def test_distances_and_first_moves_are_those_of_the_reference(
    problem: tuple[TransitionSystem, list[Region], Predicate], engine: str
) -> None:
    system, starts, goal = problem
    reference = Reference(system, starts)
    distances = _explored(system, starts, engine).distances(goal)
    if isinstance(distances, Unreachable):
        assert not any(goal.holds(state) for state in reference.reached)
        return
    assert isinstance(distances, Distances)
    for state in reference.reached:
        expected = reference.distance(state, goal)
        assert distances.distance(state) == expected
        closer = [
            name
            for name, after in reference.successors(state).items()
            if expected and reference.distance(after, goal) == expected - 1
        ]
        assert distances.first_move(state) == (closer[0] if closer else None)
        plan = distances.plan(state)
        assert plan is None if expected is None else plan is not None and len(plan) == expected


@given(problems())
@examples(80)
def test_variables_that_do_not_matter_change_no_answer(
    problem: tuple[TransitionSystem, list[Region], Predicate],
) -> None:
    system, starts, predicate = problem
    reference = Reference(system, starts)
    exploration = Exploration(system, starts, observed=predicate.reads())
    assert isinstance(exploration.reached, Reached)
    names = exploration.space.names
    projected = dict.fromkeys(tuple(state[name] for name in names) for state in reference.reached)
    assert len(exploration.reached) == len(projected)
    assert all(state in exploration.reached for state in reference.reached)
    found = exploration.find(predicate)
    assert isinstance(found, Found) == any(predicate.holds(state) for state in reference.reached)
    distances = exploration.distances(predicate)
    for state in reference.reached if isinstance(distances, Distances) else []:
        assert isinstance(distances, Distances)
        assert distances.distance(state) == reference.distance(state, predicate)


@given(problems())
@examples(80)
def test_the_values_ever_are_a_superset_of_those_reached(
    problem: tuple[TransitionSystem, list[Region], Predicate],
) -> None:
    system, starts, _ = problem
    exploration = Exploration(system, starts, observed=system.space.names)
    for state in Reference(system, starts).reached:
        assert all(state[name] in values for name, values in exploration.values.items())


@given(problems(), st.integers(0, 12))
@examples(80, usual=4)
def test_a_limit_of_states_is_the_same_in_every_engine_and_never_a_guess(
    problem: tuple[TransitionSystem, list[Region], Predicate], most: int
) -> None:
    system, starts, _ = problem
    full = _explored(system, starts, "hashed").reached
    assert isinstance(full, Reached)
    answers = [
        Exploration(system, starts, system.space.names, ExplorationLimits(states=most), engine).reached
        for engine in ENGINES
    ]
    exceeded = [isinstance(answer, Exceeded) for answer in answers]
    assert exceeded in ([True] * 3, [False] * 3)
    assert exceeded[0] or len(full) <= most
    for answer in answers:
        if isinstance(answer, Reached):
            assert list(answer) == list(full)
