"""The values of a variable as far as guards and goals distinguish them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model.predicates import And, Equal, Implies, Member, Not, NotEqual, Or, Order
from scbm.model.sources import FreeGroup, free_groups

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model.behavior import BehaviorModel
    from scbm.model.predicates import Predicate
    from scbm.model.values import Value


def distinguishing_values(model: BehaviorModel, name: str, values: Sequence[Value] | None = None) -> tuple[Value, ...]:
    """Return the first value of each class of values that no guard or goal distinguishes.

    Where the variable is compared with another one, or assigned to one, each value is a class of its own.

    Args:
        model: the model.
        name: the variable.
        values: the values to divide into classes; by default those of its domain.
    """
    known = model.space[name].domain.values if values is None else tuple(values)
    outside = (action for each in model.environment for action in each.actions)
    if any(name in action.reads() for action in (*model.actions, *outside)):
        return known
    predicates = [*(transition.running_guard for transition in model.transitions), *(goal for _, goal in model.goals)]
    predicates += [each.guard for each in model.environment]
    leaves = [leaf for predicate in predicates for leaf in comparisons(predicate) if name in leaf.reads()]
    if any(len(leaf.reads()) > 1 for leaf in leaves):
        return known
    kinds: dict[tuple[bool, ...], Value] = {}
    for value in known:
        kinds.setdefault(tuple(leaf.holds({name: value}) for leaf in leaves), value)
    return tuple(kinds.values())


def distinguished_groups(model: BehaviorModel) -> tuple[FreeGroup, ...]:
    """Return what changes freely from outside, with one value of each class; `free_groups` if all differ."""
    return tuple(
        FreeGroup(group.name, tuple((name, distinguishing_values(model, name, known)) for name, known in group.values))
        for group in free_groups(model)
    )


def comparisons(predicate: Predicate) -> Iterator[Equal | NotEqual | Order | Member]:
    """Yield the comparisons that a predicate consists of, in their order."""
    match predicate:
        case Not(operand):
            yield from comparisons(operand)
        case And(operands) | Or(operands):
            for each in operands:
                yield from comparisons(each)
        case Implies(condition, consequence):
            yield from (*comparisons(condition), *comparisons(consequence))
        case Equal() | NotEqual() | Order() | Member():
            yield predicate
