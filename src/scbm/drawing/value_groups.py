"""The values of a variable as a picture shows them: one by one, or grouped if they are many."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.closing.distinguished_values import comparisons
from scbm.model import Assign, Constant, Equal, Reference, ValueKind, format_value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import BehaviorModel, Predicate, Value, Variable

_MAX_SINGLE = 12
"""Maximum number of values that are shown one by one, whatever the model compares."""

_MAX_LISTED = 3
"""Maximum number of symbols that the label of a group lists."""


class ValueGroup(Struct, frozen=True):
    """Values that are one node of a picture.

    Attributes:
        values: its values, in the order of the domain.
        is_allowed: whether a run may begin with one of them (semantics 7.2).
    """

    values: tuple[Value, ...]
    is_allowed: bool = False

    def __str__(self) -> str:
        words = [format_value(value) for value in self.values]
        if isinstance(self.values[0], int) and len(words) > 1:
            return f"{words[0]}..{words[-1]}"
        more = f", … ({len(words)} values)" if len(words) > _MAX_LISTED else ""
        return ", ".join(words[:_MAX_LISTED]) + more


def value_groups(model: BehaviorModel, variable: Variable) -> tuple[ValueGroup, ...]:
    """Return the groups of the values of a variable, in the order of its domain.

    More than 12 values are grouped: two values are in one group if no constant that the model compares with the
    variable, or assigns to it, tells them apart. A group of integers has no gaps.
    """
    values = variable.domain.values
    if len(values) <= _MAX_SINGLE:
        return tuple(ValueGroup((value,)) for value in values)
    name = variable.name
    required = (predicate for each in model.requirements for predicate in each.sentence.predicates)
    compared = (leaf for predicate in (*guards_and_goals(model), *required) for leaf in comparisons(predicate))
    leaves = [leaf for leaf in compared if leaf.reads() == (name,)]
    outside = (action for each in model.environment for action in each.actions)
    assigned = (each for each in (*model.actions, *outside) if each.target == name and isinstance(each, Assign))
    leaves += [Equal(Reference(name), action.source) for action in assigned if isinstance(action.source, Constant)]
    kinds = [tuple(leaf.holds({name: value}) for leaf in leaves) for value in values]
    if variable.domain.kind is ValueKind.INTEGER:
        runs = [list(run) for _, run in groupby(range(len(values)), key=kinds.__getitem__)]
    else:
        by_kind: dict[tuple[bool, ...], list[int]] = {}
        for index, kind in enumerate(kinds):
            by_kind.setdefault(kind, []).append(index)
        runs = list(by_kind.values())
    return tuple(ValueGroup(tuple(values[index] for index in run)) for run in runs)


def guards_and_goals(model: BehaviorModel) -> Sequence[Predicate]:
    """Return the guards of a model, those of environment transitions included, and its goals."""
    guards = [*(each.running_guard for each in model.transitions), *(each.guard for each in model.environment)]
    return [*guards, *(goal for _, goal in model.goals)]
