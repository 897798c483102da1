"""The search for goals whose canonical plan needs an operation; each is found in plans, none is guessed.

Breadth-first search finds the canonical path to every planning state, in an order in which the first state that
satisfies a goal ends the goal's canonical plan (`planning.plan_search`). So one exploration from an initial state
decides for every goal whether its plan has the operation: the states in which a variable has a value are the bits of
an integer, those of a conjunction are an AND, and the plan ends at the lowest bit.

This module knows the model and the planner; the caller verifies that runs for such a goal execute the operation.
"""

from __future__ import annotations

from itertools import combinations, islice, product, takewhile
from typing import TYPE_CHECKING, TypeAlias

from scbm.model import Constant, Equal, Reference, Role, State, conjunction
from scbm.planning import PlanLimits, Solved, Task
from scbm.planning.engines.breadth_first import BreadthFirst

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.planning import Planner

    Conjunct: TypeAlias = tuple[str, Value]
    """A variable and the value that it should have."""

_MAX_COMBINATIONS = 5_000
"""Maximum number of combinations of random values that are enumerated for initial states."""

_MAX_STARTS = 50
"""Maximum number of initial states that differ for planning and are explored from."""

_MAX_EXPANSIONS = 20_000
"""Maximum number of planning states that are expanded, from all initial states together."""

_MAX_CONJUNCTIONS = 100_000
"""Maximum number of conjunctions of one size that are tested for an operation, each once for every initial state; this
holds for conjunctions with a value that the operation assigns, and again for the others.
"""

_MAX_CONJUNCTS = 3


class GoalSearch:
    """Finds goals for the operations of one model. Its explorations are shared by all operations."""

    def __init__(self, model: BehaviorModel, planner: Planner) -> None:
        """Prepare a search.

        Args:
            model: the model.
            planner: a planner of this model.
        """
        self._model = model
        self._planner = planner
        self._starts: dict[tuple[str, ...], tuple[State, ...]] = {}
        self._explored: dict[tuple[str, ...], tuple[_Paths, ...]] = {}

    def candidates(self, operation: str) -> Iterator[Predicate]:
        """Yield goals whose canonical plan from some allowed initial state has the operation, preferred goals first.

        Preferred are goals with fewer conjuncts; of these, goals with a value that the operation assigns; then goals
        with
        shorter plans; then the order of the file decides. Raises `KeyError` if there is no such operation.
        """
        paths = self._paths(operation)
        file_order = {conjunct: index for index, conjunct in enumerate(self._conjuncts(paths))}
        own = self._brought_about(operation, paths)
        for goals in _conjunctions(file_order, own):
            found = [
                (length, sorted(map(file_order.__getitem__, goal)), goal)
                for goal in islice(goals, _MAX_CONJUNCTIONS // max(1, len(paths)))
                if (length := _shortest(goal, operation, paths)) is not None
            ]
            yield from (_predicate(goal, file_order) for _, _, goal in sorted(found))

    def example(self, operation: str, goal: Predicate) -> tuple[State, tuple[str, ...]] | None:
        """Return an initial state whose canonical plan to a goal has an operation, with a shortest such plan."""
        limits = PlanLimits(expansions=_MAX_EXPANSIONS)
        found: list[tuple[State, tuple[str, ...]]] = []
        for start in self._allowed_starts(self._planner.task(goal)):
            answer = self._planner.plan(start, goal, limits)
            if isinstance(answer, Solved) and operation in answer.plan:
                found.append((start, answer.plan))
        return min(found, key=lambda example: len(example[1]), default=None)

    def _paths(self, operation: str) -> tuple[_Paths, ...]:
        """Return the paths from those initial states from which the operation is reachable."""
        also = self._also(operation)
        if also not in self._explored:
            task = Task(self._model, also) if also else self._planner.base_task
            starts = [task.pack(start) for start in self._allowed_starts(task)]
            self._explored[also] = tuple(_Paths(task, start, _MAX_EXPANSIONS // len(starts)) for start in starts)
        return tuple(paths for paths in self._explored[also] if paths.using(operation))

    def _also(self, operation: str) -> tuple[str, ...]:
        """Return what the operation sets and no other one reads, such as a lamp at its end, without request parameters.

        The planner need not distinguish these variables, but a goal may read them.
        """
        subject = self._model.operation(operation)
        targets = dict.fromkeys(action.target for action in (*subject.pre.a, *subject.post.a))
        commands = dict.fromkeys(name for resource in self._model.resources for name in resource.request)
        known = self._planner.base_task.packing.space
        return tuple(
            variable.name
            for variable in self._model.variables
            if variable.name in targets and variable.name not in known and variable.name not in commands
        )

    def _allowed_starts(self, task: Task) -> tuple[State, ...]:
        """Return the allowed initial states that differ in variables of the task, the most nominal one first."""
        key = task.packing.space.names
        if key not in self._starts:
            found: dict[int, State] = {}
            for values in islice(self._combinations(task), _MAX_COMBINATIONS):
                if len(found) == _MAX_STARTS:
                    break
                packed = task.pack(values)
                if packed not in found and self._model.initial_states.holds(values):
                    found[packed] = State(self._model.space, values)
            self._starts[key] = tuple(found.values())
        return self._starts[key]

    def _combinations(self, task: Task) -> Iterator[dict[str, Value]]:
        """Yield combinations of random values of the relevant variables, those with more nominal values first."""
        space = self._model.space
        plain = {v.name: v.initial if v.initial in v.random else v.random[0] for v in space}
        decides = dict.fromkeys((*task.packing.space.names, *self._model.initial_states.reads()))
        others = {v.name: [value for value in v.random if value != plain[v.name]] for v in space if v.name in decides}
        free = [name for name, values in others.items() if values]
        for count in range(len(free) + 1):
            for names in combinations(free, count):
                for values in product(*(others[name] for name in names)):
                    yield plain | dict(zip(names, values, strict=True))

    def _conjuncts(self, paths: Sequence[_Paths]) -> Iterator[Conjunct]:
        """Yield the conjuncts of goals, in the order of the file: values of variables that operations change."""
        for variable in self._model.variables:
            if any(each.changes(variable.name) for each in paths):
                for value in variable.domain.values:
                    if any((variable.name, value) in each.holds for each in paths):
                        yield variable.name, value

    def _brought_about(self, operation: str, paths: Sequence[_Paths]) -> dict[Conjunct, None]:
        """Return the conjuncts that hold because the operation assigns them."""
        subject = self._model.operation(operation)
        targets = dict.fromkeys(action.target for action in (*subject.pre.a, *subject.post.a))
        return dict.fromkeys(
            conjunct
            for each in paths
            for conjunct, states in each.holds.items()
            if conjunct[0] in targets and states & each.ending_with(operation)
        )


def goal_name(model: BehaviorModel, operation: str) -> str:
    """Return a name, unique in the model, for a goal that an operation is needed for, such as `needs_scan`."""
    taken = dict.fromkeys(
        (
            *(name for name, _ in model.goals),
            *model.running_space.names,
            *(subject.name for subject in model.operations),
            *(resource.name for resource in model.resources),
            *(transition.name for transition in model.automatic_transitions),
            *(requirement.name for requirement in model.requirements),
        )
    )
    name, number = f"needs_{operation}", 1
    while name in taken:
        number += 1
        name = f"needs_{operation}_{number}"
    return name


class _Paths:
    """The canonical paths from one initial state, in the order of search; bit i of a set stands for path i.

    Attributes:
        holds: for each value of a declared variable the paths that end in a state with this value.
    """

    def __init__(self, task: Task, start: int, most: int) -> None:
        """Explore until every state is found, or `most` states are expanded."""
        self._operations = {name: number for number, name in enumerate(task.operations)}
        search = BreadthFirst((start,), task.successors)
        search.expand(most)
        states = search.states
        self._lengths = [0]
        used, last = [0], [-1]
        numbers = {state: number for number, state in enumerate(states)}
        for parent in islice(search.parents.values(), 1, None):
            assert parent is not None  # noqa: S101 - the start alone has none
            number = numbers[parent[0]]
            self._lengths.append(self._lengths[number] + 1)
            used.append(used[number] | 1 << parent[1])
            last.append(parent[1])
        self.holds: dict[Conjunct, int] = {}
        for variable in task.packing.space:
            if variable.role is Role.DECLARED:
                index = task.packing[variable.name].index
                ends = _bitsets(map(index, states), len(states))
                values = enumerate(variable.domain.values)
                self.holds |= {(variable.name, value): ends[number] for number, value in values if number in ends}
        self._variables = [name for name, _ in self.holds]
        self._endings = _bitsets(last, len(last))
        self._using = _columns(used, len(task.operations))

    def changes(self, variable: str) -> bool:
        """Return whether a variable has several values."""
        return self._variables.count(variable) > 1

    def using(self, operation: str) -> int:
        """Return the paths that have an operation."""
        return self._using[self._operations[operation]]

    def ending_with(self, operation: str) -> int:
        """Return the paths that end with an operation."""
        return self._endings.get(self._operations[operation], 0)

    def plan_with(self, operation: str, goal: Sequence[Conjunct]) -> int | None:
        """Return the length of the canonical plan to a goal, if it has the operation."""
        ends = self.holds.get(goal[0], 0)
        for conjunct in goal[1:]:
            ends &= self.holds.get(conjunct, 0)
        first = ends & -ends
        return self._lengths[first.bit_length() - 1] if first & self.using(operation) else None


def _conjunctions(
    conjuncts: Collection[Conjunct], own: Mapping[Conjunct, None]
) -> Iterator[Iterable[tuple[Conjunct, ...]]]:
    """Yield all conjunctions, size by size; of each size, those with an own conjunct before the others."""
    others = [conjunct for conjunct in conjuncts if conjunct not in own]
    own_first = [*(conjunct for conjunct in conjuncts if conjunct in own), *others]
    for size in range(1, _MAX_CONJUNCTS + 1):
        # With the own ones in front, a conjunction has one of them if it begins with one.
        yield takewhile(lambda goal: goal[0] in own, combinations(own_first, size))
        yield combinations(others, size)


def _shortest(goal: Sequence[Conjunct], operation: str, paths: Sequence[_Paths]) -> int | None:
    """Return the length of the shortest of the canonical plans to a goal that have the operation."""
    lengths = [length for each in paths if (length := each.plan_with(operation, goal)) is not None]
    return min(lengths, default=None)


def _predicate(goal: Sequence[Conjunct], file_order: Mapping[Conjunct, int]) -> Predicate:
    ordered = sorted(goal, key=file_order.__getitem__)
    return conjunction(Equal(Reference(name), Constant(value)) for name, value in ordered)


def _bitsets(keys: Iterable[int], count: int) -> dict[int, int]:
    """Return for each of `count` keys the places at which it occurs, as bits."""
    places: dict[int, bytearray] = {}
    for index, key in enumerate(keys):
        bits = places.get(key)
        if bits is None:
            bits = places[key] = bytearray(count // 8 + 1)
        bits[index >> 3] |= 1 << (index & 7)
    return {key: int.from_bytes(bits, "little") for key, bits in places.items()}


def _columns(rows: Sequence[int], width: int) -> list[int]:
    """Return for each of the first `width` bits the rows that have it, as bits: row 0 is the lowest one."""
    digits = "".join([f"{row:0{width}b}" for row in reversed(rows)])
    return [int(digits[width - 1 - number :: width], 2) for number in range(width)]
