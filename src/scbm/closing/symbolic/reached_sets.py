"""The set of all situations that runs reach, and the predicted states from which no plan leads on.

A first set is about any plans. A second one, inside it, is about canonical plans: the first set has all states in which
plans are asked for, and backward from the goal among these each has its distance and the choice of the planner.
"""

from __future__ import annotations

from math import prod
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.closing.symbolic.decision_diagrams import diagram_manager, forget_unused
from scbm.closing.symbolic.run_moves import RunMoves
from scbm.closing.symbolic.run_space import RunSpace, TooManyValuesError
from scbm.closing.symbolic.run_variables import planned_names, predicted_variables, run_variables
from scbm.model.variables import CURRENT_NAME, NO_OPERATION
from scbm.proofcheck import GOAL, MAX_CHANGES, PHASE, SetPhase, predicted_name

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    from scbm.closing.symbolic.decision_diagrams import Diagram
    from scbm.closing.symbolic.run_moves import RunMove
    from scbm.model import BehaviorModel


class SetLimits(Struct, frozen=True):
    """The limits of a search for a set. They count nodes of diagrams, which depend on the model alone.

    Attributes:
        nodes: the maximum number of nodes of the set.
        work: the maximum number of nodes of all sets that moves lead to, each time that they are not empty.
    """

    nodes: int = 150_000
    work: int = 10_000_000


DEFAULT_LIMITS = SetLimits()

_EASY_WORK = 100_000
"""So many nodes may be made to find all states from which no plan leads to the goal, whether runs reach them or not."""

_NO_ENGINE = "no library of decision diagrams is installed: `pip install 'scbm[symbolic]'` adds one"

_TOO_MANY_VALUES = "a comparison or an assignment reads too many combinations of values for decision diagrams"


class NoSetError(Exception):
    """No set is found; the message says why, as a clause."""


class PlanLayers(Struct):
    """What a breadth-first search backward from the goals finds out about predicted states, goal by goal.

    Attributes:
        layers: for each distance, from 0 on, the states from which the goal is so many operations away.
        choices: for each operation the states in which a canonical plan goes on with it: of all operations that lead
            to the next layer it is the first one in the order of the model.
        dead: the states from which no plan leads to the goal.
    """

    layers: tuple[Diagram, ...]
    choices: Mapping[str, Diagram]
    dead: Diagram


class ReachedSet(Struct):
    """A set that no move leaves.

    Attributes:
        space: its variables.
        moves: the moves.
        reached: the set.
        dead: predicted states from which no plan leads to the goal.
        visited: the obligations that the moves which are possible in the set visit, as bits.
        surely: those of them that moves visit which are not loose, as bits.
        is_complete: whether the search was not over before, because nothing was left to prove.
        plans: the plans of these runs; `None` for any plans.
    """

    space: RunSpace
    moves: RunMoves
    reached: Diagram
    dead: Diagram
    visited: int
    surely: int
    is_complete: bool
    plans: PlanLayers | None = None


class _Part(Struct, eq=False):
    """The situations with the same current operation, those without one, or those in which plans are listed.

    Attributes:
        where: all situations of this part.
        reached: the situations found so far.
        new: those of them from which no move was taken yet.
        inside: the moves that stay in it.
        leaving: the moves to the part without a current operation.
        entering: the moves from that part.
        nodes: the number of nodes of the situations found, where they were counted last.
        seen: the situations of that part from which they were taken.
    """

    where: Diagram
    reached: Diagram
    new: Diagram
    seen: Diagram
    inside: list[RunMove]
    leaving: list[RunMove]
    entering: list[RunMove]
    nodes: int = 0

    def add(self, found: Diagram) -> None:
        """Add situations."""
        found &= ~self.reached
        self.reached |= found
        self.new |= found


class SetSearch:
    """The search for the set of one model."""

    def __init__(
        self,
        model: BehaviorModel,
        limits: SetLimits,
        progress: Callable[[str], None],
        visits: Callable[[RunMove], int],
        also: Sequence[str] = (),
    ) -> None:
        """Search for nothing yet.

        Args:
            model: the model.
            limits: the limits.
            progress: called with counts.
            visits: returns what a move visits, as bits.
            also: variables that situations have beside those that can influence a run.
        """
        self._model = model
        self._also = also
        self._limits = limits
        self._progress = progress
        self._visits = visits
        self._work = self._visited = 0

    def find(self, missing: int) -> ReachedSet:
        """Return the set. Raises `NoSetError` beyond the limits, or where no engine is installed.

        Operations after which no plan leads to the goal are left out of plans. Where the states before them are too
        many, they are looked for among those of a first set.

        Args:
            missing: the obligations that proofs are looked for, as bits.
        """
        variables = run_variables(self._model, self._also)
        manager = diagram_manager([bit for variable in variables for bit in variable.bits])
        if manager is None:
            raise NoSetError(_NO_ENGINE)
        space = RunSpace(variables, manager)
        try:
            moves = RunMoves(self._model, space, predicted_variables(self._model))
            every = space.all_of(space.has_one_of(name, space.variables[name].values) for name in self._of_plans)
            plans = self._plans(moves, every, min(_EASY_WORK, self._limits.work))
            if plans is not None:
                return self._reached(space, plans.dead, missing)
            found = self._reached(space, manager.false, -1)
            if not missing & found.visited:
                return found
            dead = self._plans_in(found).dead
            return found if dead == manager.false else self._reached(space, dead, missing)
        except TooManyValuesError:
            raise NoSetError(_TOO_MANY_VALUES) from None

    def find_canonical(self, found: ReachedSet, missing: int) -> ReachedSet:
        """Return the set of runs with canonical plans. Raises `NoSetError` beyond the limits, which count anew.

        Args:
            found: the set of runs with any plans.
            missing: the obligations that proofs are looked for, as bits.
        """
        self._work = 0
        predicted = predicted_variables(self._model)
        for operation in self._model.operations:
            read = dict.fromkeys(n for n in planned_names(operation) if n in predicted)
            if prod(len(self._model.space[name].domain.values) for name in read) > MAX_CHANGES:
                raise NoSetError(_TOO_MANY_VALUES)
        whole = found if found.is_complete else self._reached(found.space, found.dead, -1)
        plans = self._plans_in(whole)
        plans = replace(plans, dead=plans.dead | found.dead)
        return self._reached(found.space, plans.dead, missing, plans)

    @property
    def _of_plans(self) -> tuple[str, ...]:
        """The variables that plans depend on: the goal, and the predicted state."""
        return (GOAL, *map(predicted_name, predicted_variables(self._model)))

    def _plans_in(self, found: ReachedSet) -> PlanLayers:
        """Return the canonical plans from all predicted states of a complete set."""
        space, kept = found.space, self._of_plans
        planned = space.has_one_of(PHASE, (SetPhase.ASKING, SetPhase.PLAN, SetPhase.PLANNED))
        others = space.bits_of(name for name in space.variables if name not in kept)
        states = space.manager.exist(others, found.reached & planned)
        plans = self._plans(found.moves, states, self._limits.work)
        if plans is None:
            raise self._too_much_work()
        return plans

    def _reached(self, space: RunSpace, dead: Diagram, missing: int, plans: PlanLayers | None = None) -> ReachedSet:
        """Return the least set that no move leaves; a part of it if its moves visit all that is missing.

        Operations are taken one after the other. All that can happen while one is current is found at once, then all
        that follows until the next one. So most sets on the way are near to closed ones, and small. Loose moves come
        last.
        """
        moves = self._moves(space, dead, plans)
        return self._collected(moves, moves.start(), missing, dead, plans)

    def following(self, found: ReachedSet, first: Diagram, beyond: Diagram) -> Diagram:
        """Return the situations that runs reach from some without any of `beyond`, the `first` ones included.

        Raises `NoSetError` beyond the limits, which count on.
        """
        moves = self._moves(found.space, found.dead, found.plans, beyond)
        return self._collected(moves, first & ~beyond, -1, found.dead, found.plans).reached

    def _moves(
        self, space: RunSpace, dead: Diagram, plans: PlanLayers | None, beyond: Diagram | None = None
    ) -> RunMoves:
        choices = None if plans is None else plans.choices
        return RunMoves(self._model, space, predicted_variables(self._model), dead, choices, beyond)

    def _collected(
        self, moves: RunMoves, first: Diagram, missing: int, dead: Diagram, plans: PlanLayers | None
    ) -> ReachedSet:
        """Return the least set with some first situations that no move leaves, as in `_reached`."""
        space, parts = moves.space, self._parts(moves)
        self._visited = 0
        for part in parts:
            part.add(first & part.where)
        self._place((move for move in moves.moves() if not move.is_loose), moves, parts)
        is_complete = self._grow(moves, parts, missing)
        surely = self._visited
        if is_complete and missing & ~surely:
            self._place((move for move in moves.moves() if move.is_loose), moves, parts)
            for part in parts:
                part.new = part.reached
            is_complete = self._grow(moves, parts, missing)
        reached = space.any_of(part.reached for part in parts)
        return ReachedSet(space, moves, reached, dead, self._visited, surely, is_complete, plans)

    def _grow(self, moves: RunMoves, parts: Sequence[_Part], missing: int) -> bool:
        """Take all moves from what is new until nothing is, and return `True`; `False` if all missing is visited."""
        nothing, (idle, *others) = moves.space.manager.false, parts
        rounds, is_new = 0, True
        while is_new:
            if not missing & ~self._visited:
                return False
            rounds += 1
            forget_unused(moves.space.manager)
            nodes = sum(part.nodes for part in parts)
            self._progress(f"collecting all situations in a set: round {rounds}, {nodes:,} nodes")
            is_new = self._close(moves, idle) != nothing
            for part in others:
                since, part.seen = idle.reached & ~part.seen, idle.reached
                if since != nothing or part.new != nothing:
                    is_new = True
                    self._take(moves, part.entering, since, part)
                    self._take(moves, part.leaving, self._close(moves, part), idle)
                    self._close(moves, idle)
                    self._refuse_beyond(sum(each.nodes for each in parts))
        return True

    def _parts(self, moves: RunMoves) -> list[_Part]:
        """Return the parts without moves, the part without a current operation first."""
        space, nothing = moves.space, moves.space.manager.false
        listed = space.has(PHASE, SetPhase.PLANNED)
        names = (NO_OPERATION, *(operation.name for operation in self._model.operations))
        wheres = [*(space.has(CURRENT_NAME, name) & ~listed for name in names), listed]
        return [_Part(where, nothing, nothing, nothing, [], [], []) for where in wheres]

    @staticmethod
    def _place(some: Iterable[RunMove], moves: RunMoves, parts: Sequence[_Part]) -> None:
        """Add moves to the parts in which they are possible."""
        nothing = moves.space.manager.false
        for move in some:
            for part in parts:
                where = move.where & part.where
                if where == nothing:
                    continue  # most are
                here = replace(move, where=where)
                after = moves.image(here, where)
                if after == nothing:
                    continue
                if after & ~part.where == nothing:
                    part.inside.append(here)
                elif after & ~parts[0].where == nothing:
                    part.leaving.append(here)
                else:
                    next(each for each in parts if after & ~each.where == nothing).entering.append(here)

    def _close(self, moves: RunMoves, part: _Part) -> Diagram:
        """Take all moves inside a part from what is new in it until nothing is; return all that was new."""
        nothing = found = moves.space.manager.false
        while part.new != nothing:
            new, part.new = part.new, nothing
            found |= new
            self._take(moves, part.inside, new, part)
            part.nodes = part.reached.dag_size
            self._refuse_beyond(part.nodes)
        return found

    def _refuse_beyond(self, nodes: int) -> None:
        if nodes > self._limits.nodes:
            raise NoSetError(f"a decision diagram of all situations has more than {self._limits.nodes:,} nodes")

    def _take(self, moves: RunMoves, some: Sequence[RunMove], situations: Diagram, target: _Part) -> None:
        """Take some moves one after the other, inside the target also from what those before have found."""
        for move in some:
            after = moves.image(move, situations)
            if after != moves.space.manager.false:
                self._count(after)
                self._visited |= self._visits(move)
                if some is target.inside:
                    situations |= after & ~target.reached
                target.add(after)

    def _plans(self, moves: RunMoves, left: Diagram, most: int) -> PlanLayers | None:
        """Return the canonical plans from some predicted states, which no operation leaves; `None` beyond `most` nodes.

        Operations may lead from these states to dead ones.
        """
        nothing, begin = moves.space.manager.false, self._work
        operations = [(each.name, moves.following(each, ~nothing, {}, None)) for each in self._model.operations]
        choices = dict.fromkeys((name for name, _ in operations), nothing)
        layers: list[Diagram] = []
        new = left & moves.predicted_goal()
        left &= ~new
        while new != nothing:
            layers.append(new)
            before = left
            for name, operation in operations:
                nearer = moves.before(operation, new) & left
                if nearer != nothing:
                    self._work += nearer.dag_size
                    if self._work - begin > most:
                        return None
                    choices[name] |= nearer
                    left &= ~nearer
            new = before & ~left
        return PlanLayers(tuple(layers), choices, left)

    def _count(self, diagram: Diagram) -> None:
        self._work += diagram.dag_size
        if self._work > self._limits.work:
            raise self._too_much_work()

    def _too_much_work(self) -> NoSetError:
        return NoSetError(f"the decision diagrams on the way to the set have more than {self._limits.work:,} nodes")
