"""The LM-cut heuristic: a lower bound of the distance to the goal (Helmert and Domshlak, 2009).

Without deletions, every plan uses a move of each landmark. The landmarks found here are disjoint, so their number is a
lower bound. The landmarks of a successor are those of its predecessor without the move between them, and some more
(Pommerening and Helmert, 2013).
"""

from __future__ import annotations

from itertools import accumulate, product
from math import prod
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.model.normal_form import AllOf, NormalForm, OneOf, indices_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.planning.engines.joint_moves import JointMove
    from scbm.planning.engines.reduced_system import ReducedSystem

    Landmarks: TypeAlias = tuple[tuple[int, ...], ...]
    """Disjoint sets of relaxed moves, each in ascending order."""

MAX_RELAXED_MOVES = 1 << 13
"""Maximum number of relaxed moves: one for each combination of the values that a move copies or counts."""


class RelaxedMove(Struct, frozen=True):
    """A move for some values of the variables that it copies or counts, without deletions.

    Attributes:
        index: the index of the move in its system.
        needs: the facts that the guard asks for.
        adds: the facts that the move makes true.
    """

    index: int
    needs: tuple[int, ...]
    adds: tuple[int, ...]


class LandmarkCut:
    """Computes landmarks for the states of one system and one goal.

    A fact is a variable with a value. The last two facts are one that always holds, and the goal.
    """

    def __init__(self, system: ReducedSystem, goal: NormalForm) -> None:
        """Prepare the relaxed moves."""
        self._offsets = tuple(accumulate(system.counts, initial=0))
        self._always, self._goal = self._offsets[-1], self._offsets[-1] + 1
        moves = [relaxed for move in system.moves for relaxed in self._relaxed(move, system)]
        moves.append(RelaxedMove(-1, self._facts(_single(goal)) or (self._always,), (self._goal,)))
        self._adds = [move.adds for move in moves]
        self._needed = [len(move.needs) for move in moves]
        self._users: list[list[int]] = [[] for _ in range(self._goal + 1)]
        self._adders: list[list[int]] = [[] for _ in range(self._goal + 1)]
        self._of_move: dict[int, frozenset[int]] = {}
        for number, move in enumerate(moves):
            self._of_move[move.index] = self._of_move.get(move.index, frozenset()) | {number}
            for fact in move.needs:
                self._users[fact].append(number)
            for fact in move.adds:
                self._adders[fact].append(number)

    def landmarks(self, coordinates: Sequence[int], known: Landmarks = ()) -> Landmarks | None:
        """Return disjoint landmarks of a state, some of which are known; `None` if no path leads to the goal."""
        facts = [offset + value for offset, value in zip(self._offsets, coordinates, strict=False)]
        facts.append(self._always)
        costs = [1] * len(self._adds)
        costs[-1] = 0
        for landmark in known:
            for move in landmark:
                costs[move] = 0
        found = list(known)
        while True:
            distance, supporters = self._distances(facts, costs)
            if distance is None:
                return None
            if not distance:
                return tuple(found)
            landmark = self._cut(facts, costs, supporters)
            found.append(landmark)
            for move in landmark:
                costs[move] = 0

    def after(self, landmarks: Landmarks, index: int) -> Landmarks:
        """Return the landmarks that remain after a move of the system, by its index."""
        moves = self._of_move.get(index, frozenset())
        return tuple(landmark for landmark in landmarks if moves.isdisjoint(landmark))

    def _distances(self, facts: Iterable[int], costs: Sequence[int]) -> tuple[int | None, list[int]]:
        """Return the maximum cost of a fact of the goal, and for each reached move its most expensive need (h-max)."""
        missing = list(self._needed)
        supporters = [-1] * len(missing)
        best = [-1] * len(self._users)
        is_done = bytearray(len(best))
        now, level = list(facts), 0
        later: list[int] = []
        for fact in now:
            best[fact] = 0
        while now:
            while now:
                fact = now.pop()
                if is_done[fact]:
                    continue
                is_done[fact] = 1
                for move in self._users[fact]:
                    missing[move] -= 1
                    if not missing[move]:
                        supporters[move] = fact
                        value = level + costs[move]
                        for added in self._adds[move]:
                            if best[added] < 0 or value < best[added]:
                                best[added] = value
                                (later if costs[move] else now).append(added)
            now, later, level = later, [], level + 1
        return (best[self._goal] if is_done[self._goal] else None), supporters

    def _cut(self, facts: Iterable[int], costs: Sequence[int], supporters: Sequence[int]) -> tuple[int, ...]:
        """Return the moves that lead into the zone of the goal, from facts that are reached outside it."""
        zone = self._goal_zone(costs, supporters)
        reached = bytearray(len(zone))
        waiting = list(facts)
        for fact in waiting:
            reached[fact] = 1
        cut: dict[int, None] = {}
        while waiting:
            fact = waiting.pop()
            for move in self._users[fact]:
                if supporters[move] != fact:
                    continue
                for added in self._adds[move]:
                    if zone[added]:
                        cut[move] = None
                    elif not reached[added]:
                        reached[added] = 1
                        waiting.append(added)
        return tuple(sorted(cut))

    def _goal_zone(self, costs: Sequence[int], supporters: Sequence[int]) -> bytearray:
        """Return which facts lead to the goal by moves that cost nothing, each from its most expensive need."""
        zone = bytearray(len(self._users))
        zone[self._goal] = 1
        waiting = [self._goal]
        while waiting:
            for move in self._adders[waiting.pop()]:
                supporter = supporters[move]
                if not costs[move] and supporter >= 0 and not zone[supporter]:
                    zone[supporter] = 1
                    waiting.append(supporter)
        return zone

    def _relaxed(self, move: JointMove, system: ReducedSystem) -> Iterator[RelaxedMove]:
        fixed = dict(_single(move.guard))
        choices = _copied_values(move, system)
        for values in product(*choices.values()):
            before = dict(zip(choices, values, strict=True))
            after = [(w.target, w.indices[before.get(w.source, 0)]) for w in move.writes]
            adds = [(target, value) for target, value in after if value is not None]
            if len(adds) == len(after):
                needs = self._facts((fixed | before).items()) or (self._always,)
                yield RelaxedMove(move.index, needs, self._facts(adds))

    def _facts(self, values: Iterable[tuple[int, int]]) -> tuple[int, ...]:
        return tuple(self._offsets[variable] + value for variable, value in values)


def count_relaxed(system: ReducedSystem) -> int:
    """Return the number of relaxed moves of a system."""
    return sum(prod(map(len, _copied_values(move, system).values())) for move in system.moves)


def _copied_values(move: JointMove, system: ReducedSystem) -> dict[int, tuple[int, ...]]:
    """Return the possible values of each variable that a move copies or counts."""
    asked = {part.variable: part.allowed for part in _literals(move.guard)}
    copied = dict.fromkeys(write.source for write in move.writes if len(frozenset(write.indices)) > 1)
    return {v: indices_of(asked.get(v, (1 << system.counts[v]) - 1)) for v in copied}


def _literals(form: NormalForm) -> list[OneOf]:
    parts = form.parts if isinstance(form, AllOf) else (form,)
    return [part for part in parts if isinstance(part, OneOf)]


def _single(form: NormalForm) -> list[tuple[int, int]]:
    """Return the variables for which a conjunction allows one value, with the value."""
    parts = (part for part in _literals(form) if part.allowed.bit_count() == 1)
    return [(part.variable, part.allowed.bit_length() - 1) for part in parts]
