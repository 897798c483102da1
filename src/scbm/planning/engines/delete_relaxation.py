"""The delete relaxation: the least fixed point of rules that only ever add values to variables (Hoffmann, FF, 2001).

Where the guard of a rule can hold under the values found so far, its effects add values, and no value is ever removed.
So the values at the fixed point are a superset of those that any sequence of the rules can produce.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.model.normal_form import variables_of
from scbm.model.satisfiability import satisfiable

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from scbm.model.normal_form import NormalForm


class Effect(Struct, frozen=True):
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


class RelaxedRule(Struct, frozen=True):
    """A step without its deletions.

    Attributes:
        guard: where the step can be taken.
        effects: what it sets; it can be taken only if each of them has an image.
    """

    guard: NormalForm
    effects: tuple[Effect, ...]

    @property
    def reads(self) -> Iterable[int]:
        """The variables that decide whether the step can be taken, each once."""
        return dict.fromkeys((*variables_of(self.guard), *(effect.source for effect in self.effects)))

    def can_be_taken(self, values: Sequence[int]) -> bool:
        """Return whether the guard can hold, or may hold as far as the search shows, and each effect has an image."""
        return satisfiable(self.guard, values) is not False and self.has_images(values)

    def has_images(self, values: Sequence[int]) -> bool:
        """Return whether each effect can give its variable a value, under these values of all variables."""
        return all(effect.image(values[effect.source]) for effect in self.effects)


def relaxed_values(rules: Iterable[RelaxedRule], starts: Sequence[int]) -> tuple[int, ...]:
    """Return the values of each variable at the fixed point, as bits.

    A rule is tried again only after a variable that it reads got a value.

    Args:
        rules: the steps.
        starts: the values of each variable at the beginning, as bits.
    """
    waiting = dict(enumerate(rules))
    readers: dict[int, list[int]] = {}
    for number, rule in waiting.items():
        for variable in rule.reads:
            readers.setdefault(variable, []).append(number)
    reached = _ReachedValues(starts)
    tried: Iterable[int] = tuple(waiting)
    while tried:
        values = reached.values
        ready = [number for number in tried if waiting[number].can_be_taken(values)]
        grown = reached.add(effect for number in ready for effect in waiting.pop(number).effects)
        touched = dict.fromkeys(number for variable in grown for number in readers.get(variable, ()))
        tried = [number for number in touched if number in waiting]
    return tuple(reached.values)


class _ReachedValues:
    """The values that the effects of the rules so far give each variable.

    Attributes:
        values: the values of each variable, as bits.
    """

    def __init__(self, starts: Sequence[int]) -> None:
        self.values = list(starts)
        self._effects: list[list[Effect]] = [[] for _ in starts]

    def add(self, effects: Iterable[Effect]) -> Iterable[int]:
        """Follow more effects until no variable gets a new value; return the variables that got one, each once."""
        news: list[tuple[int, int]] = []
        for effect in effects:
            self._effects[effect.source].append(effect)
            news += self._follow(effect, self.values[effect.source])
        grown = dict.fromkeys(variable for variable, _ in news)
        while news:
            source, new = news.pop()
            for effect in self._effects[source]:
                more = self._follow(effect, new)
                news += more
                grown |= dict.fromkeys(variable for variable, _ in more)
        return grown

    def _follow(self, effect: Effect, sources: int) -> Sequence[tuple[int, int]]:
        """Add the image of some values of the source; return the variable with its new values, if there are any."""
        added = effect.image(sources) & ~self.values[effect.variable]
        self.values[effect.variable] |= added
        return ((effect.variable, added),) if added else ()
