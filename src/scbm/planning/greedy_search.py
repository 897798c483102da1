"""Greedy best-first search with the FF heuristic, preferred moves, and lookahead along relaxed plans.

The search keeps two open lists: one for the preferred moves of states, one for all (Helmert, Fast Downward, 2006).
Each evaluated state also executes what it can of its relaxed plan, and the state where that ends is evaluated next
(Vidal, YAHSP, 2004). A plan is shortened by leaving out loops and useless moves (Nakhost and Müller,
2010). The search is complete: a state is dropped only if even the relaxation has no plan.
"""

from __future__ import annotations

from heapq import heappop, heappush
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.model.packing import compile_test, compile_update
from scbm.planning.plan_answers import Limit, LimitReached, Solved, Unsolvable, raise_if_cancelled
from scbm.planning.relaxed_plans import RelaxedProblem

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.model.normal_form import NormalForm
    from scbm.model.packing import Packing, Update
    from scbm.planning.engines.joint_moves import JointMove
    from scbm.planning.plan_answers import ShouldContinue
    from scbm.planning.relaxed_plans import RelaxedPlan

_POLL_INTERVAL = 50
"""Number of evaluated states after which a search asks again whether it is cancelled."""

_BOOST = 1_000
"""Number of turns that the preferred moves get in advance when a state is closer to the goal than all before it."""

_MAX_REPLAYED = 200_000
"""Maximum number of moves that are replayed to shorten one plan, which takes a tenth of a second."""


class PackedMoves:
    """The moves of a system as functions of packed states; each is compiled when it is first used."""

    def __init__(self, moves: Sequence[JointMove], packing: Packing) -> None:
        self.joint = tuple(moves)
        self.fields = packing.fields
        self._cases: dict[int, list[JointMove]] = {}
        for move in moves:
            self._cases.setdefault(move.index, []).append(move)
        self._steps: dict[int, Update] = {}

    def successor(self, state: int, move: int) -> int | None:
        """Return the state after a move, by its index; `None` where the move is not enabled."""
        if move not in self._steps:
            cases = [self._compiled(case) for case in self._cases.get(move, ())]
            self._steps[move] = cases[0] if len(cases) == 1 else _first_of(cases)
        return self._steps[move](state)

    def _compiled(self, move: JointMove) -> Update:
        keep, bits = -1, 0
        tables = []
        for write in move.writes:
            index = write.indices[0]
            if index is not None and write.indices.count(index) == len(write.indices):
                keep &= ~self.fields[write.target].mask
                bits |= index << self.fields[write.target].shift
            else:
                tables.append(write)
        update = compile_update(tables, self.fields, (keep, bits))
        if move.guard is True:
            return update
        holds = compile_test(move.guard, self.fields)
        return lambda state: update(state) if holds(state) else None


def _first_of(cases: Sequence[Update]) -> Update:
    """Return the function that gives what the one case gives that is enabled."""

    def update(state: int) -> int | None:
        for case in cases:
            after = case(state)
            if after is not None:
                return after
        return None

    return update


class GreedySearch:
    """Greedy searches for one goal, from any state."""

    def __init__(self, moves: PackedMoves, goal: NormalForm, names: Sequence[str]) -> None:
        """Prepare the heuristic; `names` has the name of each move."""
        self.moves = moves
        self.names = names
        self.is_goal = compile_test(goal, moves.fields)
        self.relaxed = RelaxedProblem(moves.joint, goal, moves.fields)

    def plan(self, start: int, evaluations: int, should_continue: ShouldContinue) -> Solved | Unsolvable | LimitReached:
        """Return some plan from a packed state, or why there is none.

        Args:
            start: the packed state to plan from.
            evaluations: the maximum number of states that are evaluated, which is also how many are expanded.
            should_continue: called at intervals; `SearchCancelledError` is raised once it returns `False`.
        """
        run = _SearchRun(self, start, evaluations, should_continue)
        found = run.search()
        if found is not None:
            plan = shortened(found, start, self.moves, self.is_goal)
            return Solved(tuple(self.names[move] for move in plan), run.evaluated)
        if run.evaluated == evaluations:
            return LimitReached(Limit.EXPANSIONS, run.evaluated)
        return Unsolvable(run.evaluated)


class _Node(Struct):
    """An evaluated state.

    Attributes:
        state: the packed state.
        parent: the node before it; `None` for the start.
        path: the moves that lead from the parent here.
        preferred: the preferred moves that were not tried yet, the next one last.
        enabled: all moves that were not tried yet, the next one last.
    """

    state: int
    parent: _Node | None
    path: tuple[int, ...]
    preferred: list[int]
    enabled: list[int]


class _SearchRun:
    """One search from one state.

    Attributes:
        evaluated: the number of evaluated states.
    """

    def __init__(self, search: GreedySearch, start: int, evaluations: int, should_continue: ShouldContinue) -> None:
        self.evaluated = 0
        self._successor, self._is_goal, self._relaxed = search.moves.successor, search.is_goal, search.relaxed
        self._start = start
        self._most = evaluations
        self._should_continue = should_continue
        self._seen: dict[int, None] = {}
        self._open = _OpenLists()

    def search(self) -> tuple[int, ...] | None:
        """Return a plan; `None` if there is none, or at the limit."""
        if self._is_goal(self._start):
            return ()
        plan = self._descend(self._start, None, ())
        while plan is None and self.evaluated < self._most and (found := self._next_successor()) is not None:
            plan = self._descend(*found)
        return plan

    def _next_successor(self) -> tuple[int, _Node, tuple[int, ...]] | None:
        """Return the next new state, its predecessor and the move between; `None` once the open lists are exhausted."""
        while (found := self._open.first()) is not None:
            node, moves = found
            while moves:
                move = moves.pop()
                state = self._successor(node.state, move)
                if state is not None and state not in self._seen:
                    return state, node, (move,)
            self._open.remove_first()
        return None

    def _descend(self, state: int, parent: _Node | None, path: tuple[int, ...]) -> tuple[int, ...] | None:
        """Evaluate a state, then where its relaxed plan leads, and so on; return a plan if that reaches the goal."""
        while state not in self._seen:
            if self._is_goal(state):
                return _whole_path(parent, path)
            if self.evaluated == self._most:
                return None
            self._seen[state] = None
            relaxed = self._evaluate(state)
            if relaxed is None:
                return None
            node = _Node(state, parent, path, list(relaxed.preferred[::-1]), list(relaxed.enabled[::-1]))
            self._open.add(node, len(relaxed.steps))
            parent, (state, path) = node, self._executed(state, relaxed.steps)
        return None

    def _evaluate(self, state: int) -> RelaxedPlan | None:
        if self.evaluated % _POLL_INTERVAL == 0:
            raise_if_cancelled(self._should_continue)
        self.evaluated += 1
        return self._relaxed.plan(state)

    def _executed(self, state: int, steps: Sequence[int]) -> tuple[int, tuple[int, ...]]:
        """Return the state after all moves of a relaxed plan that are enabled one after the other, and these moves."""
        path: list[int] = []
        waiting, is_moving = list(steps), True
        while is_moving:
            is_moving, delayed = False, []
            for move in waiting:
                after = self._successor(state, move)
                if after is None or after == state:
                    delayed.append(move)
                    continue
                state, is_moving = after, True
                path.append(move)
                if self._is_goal(state):
                    return state, tuple(path)
            waiting = delayed
        return state, tuple(path)


def _whole_path(parent: _Node | None, path: tuple[int, ...]) -> tuple[int, ...]:
    """Return the moves from the start to the end of a path."""
    parts = [path]
    while parent is not None:
        parts.append(parent.path)
        parent = parent.parent
    return tuple(move for part in reversed(parts) for move in part)


class _OpenLists:
    """Two queues of the same nodes, the nearest to the goal first: one for preferred moves, one for all moves.

    They take turns. A node that is closer to the goal than all before it gives the preferred moves many turns.
    """

    def __init__(self) -> None:
        self._queues: tuple[list[tuple[int, int, _Node]], ...] = ([], [])
        self._turns = [0, 0]
        self._chosen = 0
        self._count = 0
        self._least: int | None = None

    def add(self, node: _Node, distance: int) -> None:
        """Add a node; of the same distance, those that were added first come first."""
        self._count += 1
        for queue in self._queues:
            heappush(queue, (distance, self._count, node))
        if self._least is None or distance < self._least:
            self._least = distance
            self._turns[0] -= _BOOST

    def first(self) -> tuple[_Node, list[int]] | None:
        """Return the first node of the queue whose turn it is, and its moves that were not tried yet."""
        waiting = [number for number, queue in enumerate(self._queues) if queue]
        if not waiting:
            return None
        self._chosen = min(waiting, key=self._turns.__getitem__)
        self._turns[self._chosen] += 1
        node = self._queues[self._chosen][0][2]
        return node, (node.enabled if self._chosen else node.preferred)

    def remove_first(self) -> None:
        """Remove the node that `first` has returned from its queue."""
        heappop(self._queues[self._chosen])


def shortened(plan: Sequence[int], start: int, moves: PackedMoves, is_goal: Callable[[int], bool]) -> tuple[int, ...]:
    """Return a valid plan without loops, and without moves that can be left out together with those that need them."""
    left, replayed = _without_loops(plan, start, moves), 0
    position, state = 0, start
    while position < len(left) and replayed < _MAX_REPLAYED:
        end, kept = _replayed(left[position + 1 :], state, moves)
        replayed += len(left) - position
        if is_goal(end):
            left = left[:position] + kept
            continue
        after = moves.successor(state, left[position])
        assert after is not None  # noqa: S101 - a replay keeps enabled moves only
        state, position = after, position + 1
    return tuple(left)


def _without_loops(plan: Sequence[int], start: int, moves: PackedMoves) -> list[int]:
    """Return the plan without the moves between two visits of one state."""
    path: list[int] = []
    states = [start]
    places = {start: 0}
    for move in plan:
        state = moves.successor(states[-1], move)
        assert state is not None  # noqa: S101 - the plan is valid
        if state in places:
            begin = places[state]
            for skipped in states[begin + 1 :]:
                del places[skipped]
            del path[begin:], states[begin + 1 :]
        else:
            places[state] = len(states)
            path.append(move)
            states.append(state)
    return path


def _replayed(plan: Sequence[int], state: int, moves: PackedMoves) -> tuple[int, list[int]]:
    """Return the state after those moves of the plan that are enabled and change something, and these moves."""
    kept = []
    for move in plan:
        after = moves.successor(state, move)
        if after is not None and after != state:
            state = after
            kept.append(move)
    return state, kept
