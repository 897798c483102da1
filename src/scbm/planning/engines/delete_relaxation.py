"""The delete relaxation: the least fixed point of rules that only ever add values to variables (Hoffmann, FF, 2001).

Where the guard of a rule can hold under the values found so far, its effects add values, and no value is ever removed.
So the values at the fixed point are a superset of those that any sequence of the rules can produce.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model.satisfiability import satisfiable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from scbm.model.normal_form import NormalForm


@dataclass(frozen=True, slots=True)
class Effect:
    """A variable that a rule sets as a function of one variable.

    Attributes:
        variable: the position of the variable that is set.
        source: the position of the variable that is read.
        image: maps values of the source to values of the variable, both as bits. The image of a union is the union of
            the images; an empty image means that the effect leaves the domain.
    """

    variable: int
    source: int
    image: Callable[[int], int]


@dataclass(frozen=True, slots=True)
class RelaxedRule:
    """A step without its deletions.

    Attributes:
        guard: where the step can be taken.
        effects: what it sets; it can be taken only if each of them has an image.
    """

    guard: NormalForm
    effects: tuple[Effect, ...]

    def has_images(self, values: Sequence[int]) -> bool:
        """Return whether each effect can give its variable a value, under these values of all variables."""
        return all(effect.image(values[effect.source]) for effect in self.effects)


def relaxed_values(rules: Iterable[RelaxedRule], starts: Sequence[int]) -> tuple[int, ...]:
    """Return the values of each variable at the fixed point, as bits.

    Args:
        rules: the steps.
        starts: the values of each variable at the beginning, as bits.
    """
    values = list(starts)
    waiting = list(rules)
    applied: list[_AppliedEffect] = []
    grown = True
    while grown:
        ready = [satisfiable(rule.guard, values) is not False and rule.has_images(values) for rule in waiting]
        applied += [
            _AppliedEffect(effect)
            for rule, is_ready in zip(waiting, ready, strict=True)
            if is_ready
            for effect in rule.effects
        ]
        waiting = [rule for rule, is_ready in zip(waiting, ready, strict=True) if not is_ready]
        grown = _apply(applied, values)
    return tuple(values)


class _AppliedEffect:
    """An effect of a rule that can be taken, with the values of its source that were followed already."""

    __slots__ = ("effect", "followed")

    def __init__(self, effect: Effect) -> None:
        self.effect = effect
        self.followed = 0


def _apply(applied: Sequence[_AppliedEffect], values: list[int]) -> bool:
    """Add the images of all new values, until there are none; return whether a variable got a new value."""
    before = tuple(values)
    changed = True
    while changed:
        changed = False
        for each in applied:
            effect = each.effect
            while new := values[effect.source] & ~each.followed:
                each.followed |= new
                added = effect.image(new) & ~values[effect.variable]
                if added:
                    values[effect.variable] |= added
                    changed = True
    return tuple(values) != before
