"""The set of all situations that runs reach under any plans, and the predicted states from which no plan leads on."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.closing.symbolic.decision_diagrams import diagram_manager, forget_unused
from scbm.closing.symbolic.run_moves import RunMoves
from scbm.closing.symbolic.run_space import RunSpace, TooManyValuesError
from scbm.closing.symbolic.run_variables import predicted_variables, run_variables
from scbm.proofcheck import GOAL, PHASE, SetPhase, predicted_name

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

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

_NO_ENGINE = "no library of decision diagrams is installed: `pip install 'scbm[symbolic]'` adds one"

_TOO_MANY_VALUES = "a comparison or an assignment reads too many combinations of values for decision diagrams"


class NoSetError(Exception):
    """No set is found; the message says why, as a clause."""


class ReachedSet(Struct):
    """A set that no move leaves.

    Attributes:
        space: its variables.
        moves: the moves.
        reached: the set.
        dead: predicted states from which no plan leads to the goal.
        all_moves: the moves one by one.
    """

    space: RunSpace
    moves: RunMoves
    reached: Diagram
    dead: Diagram
    all_moves: Sequence[RunMove]

    def visited(self, subject_and_aspect: Callable[[RunMove], int]) -> int:
        """Return what the moves that are possible in the set visit, as bits; the function says what one visits."""
        found = 0
        for move in self.all_moves:
            bits = subject_and_aspect(move) & ~found
            if bits and self.moves.image(move, self.reached) != self.space.manager.false:
                found |= bits
        return found


class SetSearch:
    """The search for the set of one model."""

    def __init__(self, model: BehaviorModel, limits: SetLimits, progress: Callable[[str], None]) -> None:
        """`progress` is called with counts."""
        self._model = model
        self._limits = limits
        self._progress = progress
        self._work = 0

    def find(self, is_enough: Callable[[ReachedSet], bool]) -> ReachedSet:
        """Return the set. Raises `NoSetError` beyond the limits, or where no engine is installed.

        Plans may go on with any operation that the planner enables. If that is not enough, operations after which no
        plan leads to the goal are left out, and the set is found again.
        """
        variables = run_variables(self._model)
        manager = diagram_manager([bit for variable in variables for bit in variable.bits])
        if manager is None:
            raise NoSetError(_NO_ENGINE)
        space = RunSpace(variables, manager)
        try:
            found = self._reached(space, manager.false)
            if is_enough(found):
                return found
            dead = self._dead(found)
            return found if dead == manager.false else self._reached(space, dead)
        except TooManyValuesError:
            raise NoSetError(_TOO_MANY_VALUES) from None

    def _reached(self, space: RunSpace, dead: Diagram) -> ReachedSet:
        """Return the least set that no move leaves. Each round takes all moves once from what is new."""
        nothing = space.manager.false
        moves = RunMoves(self._model, space, predicted_variables(self._model), dead)
        all_moves = tuple(moves.moves())
        reached = new = moves.start()
        rounds = 0
        while new != nothing:
            rounds += 1
            self._progress(f"collecting all situations in a set: round {rounds}, {reached.dag_size:,} nodes")
            before = reached
            forget_unused(space.manager)
            for move in all_moves:
                after = moves.image(move, new)
                if after != nothing:
                    self._count(after)
                    new |= after & ~reached
                    reached |= after
            new = reached & ~before
            if reached.dag_size > self._limits.nodes:
                message = f"a decision diagram of all situations has more than {self._limits.nodes:,} nodes"
                raise NoSetError(message)
        return ReachedSet(space, moves, reached, dead, all_moves)

    def _dead(self, found: ReachedSet) -> Diagram:
        """Return the predicted states of a set from which no plan leads to the goal."""
        space, moves = found.space, found.moves
        kept = dict.fromkeys((GOAL, *map(predicted_name, predicted_variables(self._model))))
        planned = space.has_one_of(PHASE, (SetPhase.ASKING, SetPhase.PLAN, SetPhase.PLANNED))
        others = space.bits_of(name for name in space.variables if name not in kept)
        left = space.manager.exist(others, found.reached & planned)
        operations = [moves.following(each, space.manager.true, {}, None) for each in self._model.operations]
        new = left & moves.predicted_goal()
        left &= ~new
        while new != space.manager.false:
            before = left
            for operation in operations:
                nearer = moves.before(operation, new) & left
                if nearer != space.manager.false:
                    self._count(nearer)
                    left &= ~nearer
            new = before & ~left
        return left

    def _count(self, diagram: Diagram) -> None:
        self._work += diagram.dag_size
        if self._work > self._limits.work:
            message = f"the decision diagrams on the way to the set have more than {self._limits.work:,} nodes"
            raise NoSetError(message)
