"""The states that plans and recovery can reach: a superset of those of all runs without injections.

Plans alone do not reach every state of a run: a failure, a timeout, an automatic transition or a measured value can
enable an operation. These are moves here, beside the start and the completion of each
operation. Conditions on requests, on the states of operations and on what changes from outside are left out, so that
more moves are possible than in runs, never fewer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import And, Assign, Constant, Equal, Reference, conjunction
from scbm.model.predicates import TRUE
from scbm.model.sources import moved, outside_values, published_by
from scbm.model.variables import CURRENT_NAME, NO_OPERATION, VariableSource
from scbm.planning.engines import Move, MovePart, TransitionSystem

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import Action, BehaviorModel, Operation, Predicate


def recovery_system(model: BehaviorModel) -> TransitionSystem:
    """Return what plans and recovery can do; the first moves start the operations, in their order."""
    weakening = _Weakening(model)
    moves = [weakening.start(operation) for operation in model.operations]
    for operation in model.operations:
        moves += weakening.ends(operation)
    for transition in model.automatic_transitions:
        moves.append(weakening.move(transition.name, transition.running_guard, transition.running_actions))
    moves += weakening.free_values()
    return TransitionSystem(model.running_space, tuple(moves))


def _changed_from_outside(model: BehaviorModel) -> Iterator[str]:
    """Yield the variables that change from outside by declaration.

    One that nothing assigns counts as an input elsewhere. Here it does not: the model may lack what assigns it.
    """
    undeclared = [variable.name for variable in model.variables if variable.source is not VariableSource.INPUT]
    by_others = [*moved(model), *(name for resource in model.resources for name in published_by(resource, model))]
    yield from (name for name in outside_values(model) if name not in undeclared or name in by_others)


class _Weakening:
    """Makes moves from the transitions of a model; a move is possible wherever its transition is."""

    def __init__(self, model: BehaviorModel) -> None:
        self._model = model
        requests = [resource.request_state for resource in model.resources]
        runner = [v.name for v in model.running_space if v.role.is_runner and v.name != CURRENT_NAME]
        self._left_out = dict.fromkeys((*requests, *runner, *_changed_from_outside(model)))

    def start(self, operation: Operation) -> Move:
        """Return the start of an operation."""
        guard = conjunction([Equal(Reference(CURRENT_NAME), Constant(NO_OPERATION)), operation.pre.g])
        starting = (*operation.pre.running_actions, Assign(CURRENT_NAME, Constant(operation.name)))
        return self.move(operation.name, guard, starting)

    def ends(self, operation: Operation) -> Iterator[Move]:
        """Yield the completion, the timeout and the failure of an operation, and its end without actions.

        An automatic transition can fail it, and a run can abort it; then none of its own actions are taken.
        """
        ends = [(operation.post.running_guard, operation.post.running_actions), (TRUE, operation.timedout), (TRUE, ())]
        if operation.failed is not None:
            ends.append((operation.failed.running_guard, operation.failed.running_actions))
        is_current = Equal(Reference(CURRENT_NAME), Constant(operation.name))
        for guard, actions in ends:
            ending = (*actions, Assign(CURRENT_NAME, Constant(NO_OPERATION)))
            yield self.move(f"{operation.name} ends", conjunction([is_current, guard]), ending)

    def free_values(self) -> Iterator[Move]:
        """Yield moves that give any of their values to variables whose changes nothing here describes.

        These are measured variables, and those that copy a left-out one.
        """
        measured = [name for resource in self._model.resources for name in resource.measures]
        copies = [action.target for action in self._model.actions if self._reads_left_out(action)]
        for name in dict.fromkeys((*measured, *copies)):
            for value in self._model.running_space[name].domain.values:
                yield self.move(f"{name} changes", TRUE, [Assign(name, Constant(value))])

    def move(self, name: str, guard: Predicate, actions: Iterable[Action]) -> Move:
        """Return a move without conditions on left-out variables, and without actions that set or read them."""
        kept = [action for action in actions if action.target not in self._left_out]
        return Move(name, (MovePart(self._weakened(guard), tuple(a for a in kept if not self._reads_left_out(a))),))

    def _weakened(self, guard: Predicate) -> Predicate:
        """Return a guard that holds wherever `guard` holds: without conjuncts that read left-out variables."""
        if isinstance(guard, And):
            return conjunction(map(self._weakened, guard.operands))
        return TRUE if any(name in self._left_out for name in guard.reads()) else guard

    def _reads_left_out(self, action: Action) -> bool:
        return any(name in self._left_out for name in action.reads())
