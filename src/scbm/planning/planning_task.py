"""A model as the planner sees it: a transition system on packed integers (semantics 3.3).

Each operation is one move of two parts: it is enabled in S when `pre.g` holds in S and `post.g` holds in S' =
`pre.a`(S), and it leads to `post.a`(S'). Only relevant variables are packed: those that a guard, a goal or an action of
another packed variable reads. The others, such as the parameters of requests, cannot change which operations are
enabled. The variables of the runner are constant during planning.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from msgspec import Struct

from scbm.model import Assign, Constant, Packing
from scbm.model.normal_form import AllOf, OneOf, indices_of, is_cube, normal_form
from scbm.model.predicates import TRUE
from scbm.planning.engines import Move, MovePart, Region, TransitionSystem, narrowed, relevant
from scbm.planning.plan_answers import always

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Iterable, Mapping

    from scbm.model import Action, BehaviorModel, Operation, Predicate, Value
    from scbm.model.normal_form import NormalForm
    from scbm.planning.engines.reduced_system import ReducedSystem, SystemReducer
    from scbm.planning.greedy_search import GreedySearch, PackedMoves
    from scbm.planning.plan_answers import ShouldContinue
    from scbm.planning.searches import PlanSearch

    Step: TypeAlias = Callable[[int], int | None]
    Steps: TypeAlias = tuple[tuple[int, int], ...]
    _CandidateTable: TypeAlias = tuple[int, int, tuple[int, ...]]
    """The mask and the shift of a variable, and for the index of each of its values the moves that it allows."""


@dataclass(frozen=True)
class Problem:
    """A goal with its packed task; the state to plan from is open. Engines that were prepared for it are cached.

    Attributes:
        is_goal: whether the goal holds in a packed state of the task.
    """

    model: BehaviorModel
    goal: Predicate
    task: Task
    is_goal: Callable[[int], bool]
    _searches: dict[Hashable, PlanSearch] = field(default_factory=dict, compare=False, repr=False)

    def prepared(
        self,
        engine: str,
        system: ReducedSystem,
        goal: NormalForm,
        make: Callable[[ReducedSystem, NormalForm], PlanSearch],
    ) -> PlanSearch:
        """Return the engine of this name for the reduced system; starts with the same possible values share it."""
        key = (engine, system.values)
        if key not in self._searches:
            while len(self._searches) >= _MAX_PREPARED:
                del self._searches[next(iter(self._searches))]
            self._searches[key] = make(system, goal)
        return self._searches[key]

    @cached_property
    def greedy(self) -> GreedySearch:
        """The greedy search for the goal."""
        from scbm.planning.greedy_search import GreedySearch  # noqa: PLC0415 - other planners do not need it

        goal = normal_form(self.goal, self.task.packing.space)
        return GreedySearch(self.task.moves, goal, self.task.operations)


def system_of(model: BehaviorModel) -> TransitionSystem:
    """Return the operations of a model as moves over all variables; no move changes the runner's variables."""
    return TransitionSystem(model.running_space, tuple(map(_move, model.operations)))


def _move(operation: Operation) -> Move:
    halves = (operation.pre, operation.post)
    return Move(operation.name, tuple(MovePart(half.g, half.a) for half in halves))


_MAX_PREPARED = 8
"""Maximum number of engines that are kept for one goal; each may need some tens of megabytes."""

_MAX_CACHED = 200_000
"""Maximum number of states whose successors are cached for later searches on the same task."""


class Task:
    """The packed transition system of a model. The successors of states are cached.

    Attributes:
        packing: the fields of the relevant variables, in the order of the model.
        operations: the names of the operations, in the order of the model.
        successors: maps a packed state to the operations that are enabled in it, by index and in order, each with the
            state that it leads to.
    """

    def __init__(self, model: BehaviorModel | TransitionSystem, also: Iterable[str] = ()) -> None:
        """Pack the operations of a model, or any other moves.

        `also` names variables that are relevant besides those of the moves, such as a goal's.
        """
        system = model if isinstance(model, TransitionSystem) else system_of(model)
        self.packing = Packing(relevant(system, also))
        self._at_rest = {v.name: v.initial for v in self.packing.space if v.role.is_runner}
        self.operations = tuple(move.name for move in system.moves)
        self._system = narrowed(system, self.packing.space)
        moves = tuple(_packed_move(index, move, self.packing) for index, move in enumerate(self._system.moves))
        tables = _candidate_tables(self._system.moves, self.packing)
        self.successors: Callable[[int], Steps] = _SuccessorCache(moves, tables).__getitem__
        self._last_reduced: tuple[int, ReducedSystem] | None = None

    def pack(self, state: Mapping[str, Value]) -> int:
        """Return a state of the world, packed; the runner's variables are at rest, whatever `state` says."""
        return self.packing.pack({**state, **self._at_rest})

    def reduced(self, state: int) -> ReducedSystem:
        """Return the system of the states that are reachable from a packed state, reduced by the delete relaxation."""
        if self._last_reduced is None or self._last_reduced[0] != state:  # goals are often tried from the same state
            self._last_reduced = state, self._reducer.reduced([Region.of(self.packing.values(state))])
        return self._last_reduced[1]

    @cached_property
    def _reducer(self) -> SystemReducer:
        from scbm.planning.engines.reduced_system import SystemReducer  # noqa: PLC0415 - few problems need it

        return SystemReducer(self._system)

    @cached_property
    def moves(self) -> PackedMoves:
        """The operations as single steps, compiled one by one when they are first used."""
        from scbm.planning.engines.joint_moves import joint_moves  # noqa: PLC0415 - few planners need it
        from scbm.planning.greedy_search import PackedMoves  # noqa: PLC0415 - the same

        return PackedMoves(joint_moves(self._system), self.packing)

    def update(self, actions: Iterable[Action]) -> Step:
        """Return actions as a function of packed states; `None` where they would leave a domain."""
        return self.packing.update(action for action in actions if action.target in self.packing.space)


class _SuccessorCache(dict[int, "Steps"]):
    """The successors of packed states, computed at the first look-up."""

    def __init__(self, moves: tuple[_PackedMove, ...], tables: tuple[_CandidateTable, ...]) -> None:
        super().__init__()
        self._moves = moves
        self._all = (1 << len(moves)) - 1
        # A look-up in a table costs about as much as four guards that do not hold.
        self._tables = tables if 4 * len(tables) < len(moves) else ()

    def __missing__(self, state: int) -> Steps:
        moves = self._moves
        if self._tables:
            candidates = self._all
            for mask, shift, by_value in self._tables:
                candidates &= by_value[(state & mask) >> shift]
            moves = tuple(map(self._moves.__getitem__, indices_of(candidates)))
        successors = []
        for index, mask, bits, keep, sets, step in moves:
            if state & mask == bits:
                after = state & keep | sets if step is None else step(state)
                if after is not None:
                    successors.append((index, after))
        found = tuple(successors)
        if len(self) < _MAX_CACHED:
            self[state] = found
        return found


def _candidate_tables(moves: Iterable[Move], packing: Packing) -> tuple[_CandidateTable, ...]:
    """Return for each variable the moves that its values allow, so that most guards need not be evaluated.

    The moves that every variable allows are a superset of those that are enabled.
    """
    allows = [_allowed(move, packing) for move in moves]
    every_move = (1 << len(allows)) - 1
    tables: dict[int, list[int]] = {}
    for index, allowed in enumerate(allows):
        for variable, values in allowed.items():
            count = len(packing.fields[variable].variable.domain)
            by_value = tables.setdefault(variable, [every_move] * count)
            for value in range(count):
                by_value[value] &= ~((~values >> value & 1) << index)
    fields = packing.fields
    return tuple((fields[v].mask, fields[v].shift, tuple(by_value)) for v, by_value in tables.items())


def _allowed(move: Move, packing: Packing) -> dict[int, int]:
    """Return the values (bits) that the first guard of a move allows, for each variable that it restricts alone."""
    form = normal_form(move.parts[0].guard, packing.space)
    parts = form.parts if isinstance(form, AllOf) else (form,)
    return {part.variable: part.allowed for part in parts if isinstance(part, OneOf)}


class _PackedMove(NamedTuple):
    """A move on packed states.

    Most moves compare variables with values and set variables to values: one AND and one comparison, then one AND and
    one OR, without the call of a function.

    Attributes:
        operation: the index of the operation.
        mask: the bits that are compared.
        bits: what they are in every state in which the move is enabled.
        keep: the bits that the move keeps.
        sets: the bits that the move sets.
        step: the whole move if it does more; it gives `None` where the move is not enabled or would leave a domain.
    """

    operation: int
    mask: int
    bits: int
    keep: int = -1
    sets: int = 0
    step: Step | None = None


def _packed_move(index: int, move: Move, packing: Packing) -> _PackedMove:
    pre, post = _halves(move)
    form = normal_form(pre.guard, packing.space)
    mask, bits = packing.cube_of(form)
    constants = {
        action.target: action.source.constant
        for action in (*pre.actions, *post.actions)
        if isinstance(action, Assign) and isinstance(action.source, Constant)
    }
    is_constant = all(
        isinstance(action, Assign) and isinstance(action.source, Constant) for action in (*pre.actions, *post.actions)
    )
    if is_constant and is_cube(form) and post.guard == TRUE:
        keep, sets = packing.assignment(constants)
        return _PackedMove(index, mask, bits, keep, sets)
    return _PackedMove(index, mask, bits, step=_step(move, packing))


def _halves(move: Move) -> tuple[MovePart, MovePart]:
    """Return the two parts of a move; the second one does nothing where there is only one."""
    return move.parts[0], move.parts[1] if len(move.parts) > 1 else MovePart(TRUE)


def _step(move: Move, packing: Packing) -> Step:
    """Return the move as a function of packed states; `None` where it is not enabled or would leave a domain."""
    pre, post = _halves(move)
    pre_holds, post_holds = packing.test(pre.guard), packing.test(post.guard)
    start, complete = packing.update(pre.actions), packing.update(post.actions)

    def step(state: int) -> int | None:
        if not pre_holds(state):
            return None
        between = start(state)
        if between is None or not post_holds(between):
            return None
        return complete(between)

    return step


class PlanProblem(Struct, frozen=True):
    """One planning problem: find operations that lead from `start` to a state in which `is_goal` holds.

    States are packed integers of `task`. `task.successors(state)` gives each enabled operation, by its index in
    `task.operations`, with the state that it leads to.

    Attributes:
        problem: the model and the goal, with their packed task.
        start: the packed state to plan from.
        should_continue: called at intervals by long searches, through `raise_if_cancelled`.
    """

    problem: Problem
    start: int
    should_continue: ShouldContinue = always

    @property
    def task(self) -> Task:
        """The model as a packed transition system."""
        return self.problem.task

    @property
    def is_goal(self) -> Callable[[int], bool]:
        """Whether the goal holds in a packed state."""
        return self.problem.is_goal
