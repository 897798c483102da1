"""The operations that parts of a model name; without such an operation the model could not be read."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import Constant, Equal, Member, NotEqual, Reference
from scbm.model.variables import CURRENT_NAME, operation_state_name
from scbm.mutation.expression_edits import comparisons_of

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import Action, BehaviorModel, Predicate, StateSpace, Transition
    from scbm.mutation.expression_edits import Leaf


_OUTSIDE = ""
"""Stands for all entries that are no operations; no operation has this name."""


def operations_named_elsewhere(model: BehaviorModel) -> frozenset[str]:
    """Return the operations that another entry of a model names, or whose state it reads or assigns."""
    by_state = {operation_state_name(operation.name): operation.name for operation in model.operations}
    named: list[str] = []
    for owner, predicates, actions in _expressions(model):
        variables = [name for part in (*predicates, *actions) for name in part.reads()]
        variables += [action.target for action in actions]
        found = [by_state[name] for name in variables if name in by_state]
        found += values_of_current(predicates, model.running_space)
        if any(CURRENT_NAME in action.reads() for action in actions):
            found += by_state.values()  # the domain of `current.name` has to fit that of the target
        named += (name for name in found if name != owner)
    return frozenset(named)


def _expressions(model: BehaviorModel) -> Iterator[tuple[str, tuple[Predicate, ...], tuple[Action, ...]]]:
    """Yield the predicates and actions of each entry that can name an operation, each after its owner."""
    for operation in model.operations:
        for transition in (operation.pre, operation.post, operation.failed):
            if transition is not None:
                yield _of_transition(operation.name, transition)
        yield operation.name, (), operation.timedout
    for transition in model.automatic_transitions:
        yield _of_transition(_OUTSIDE, transition)
    for requirement in model.requirements:
        yield _OUTSIDE, requirement.sentence.predicates, ()


def _of_transition(owner: str, transition: Transition) -> tuple[str, tuple[Predicate, Predicate], tuple[Action, ...]]:
    return owner, (transition.g, transition.gr), transition.running_actions


def values_of_current(predicates: Iterable[Predicate], space: StateSpace) -> Iterator[str]:
    """Yield the values that `current.name` is compared with; of a variable all values of its domain."""
    for predicate in predicates:
        for leaf in comparisons_of(predicate):
            if CURRENT_NAME in leaf.reads():
                yield from _opposite_values(leaf, space)


def _opposite_values(leaf: Leaf, space: StateSpace) -> Iterator[str]:
    terms = leaf.members if isinstance(leaf, Member) else (leaf.left, leaf.right)
    for term in terms:
        match term:
            case Constant(value):
                yield str(value)
            case Reference(name) if name != CURRENT_NAME and isinstance(leaf, Equal | NotEqual):
                yield from map(str, space[name].domain.values)
            case _:
                pass
