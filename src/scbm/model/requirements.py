"""Requirements: sentences over a run, and their forms (`FORMS`; semantics 7.3). `testing` checks them with monitors.

A form of requirement is a class with a pattern, and an entry in `FORMS`. The grammar, the printed sentence and the help
follow from the pattern.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, ClassVar, cast

from scbm.model.durations import format_duration
from scbm.model.predicates import Predicate

if TYPE_CHECKING:
    from collections.abc import Iterator

PREDICATES = ("p", "q", "r")
"""The words of a pattern that stand for predicates."""

DURATION = "d"
"""The word of a pattern that stands for a duration."""

_WORD = re.compile(r"\[[^]]*\]|\S+")


def pattern_words(pattern: str) -> list[str]:
    """Return the words of a pattern; an optional part in brackets is one word."""
    return _WORD.findall(pattern)


class RequirementForm:
    """A sentence that a requirement says. Its subclasses are the forms: frozen dataclasses.

    Attributes:
        pattern: how the form is written: `p`, `q` and `r` stand for predicates, `d` for a duration, all other words for
            themselves; a part in brackets is optional. The fields of the dataclass have the values in this order.
    """

    __slots__ = ()
    pattern: ClassVar[str]

    @property
    def predicates(self) -> tuple[Predicate, ...]:
        """The predicates of the sentence, in order."""
        return tuple(value for value in self._values() if isinstance(value, Predicate))

    def reads(self) -> tuple[str, ...]:
        """Return the names of the variables that the sentence reads, each once."""
        return tuple(dict.fromkeys(name for predicate in self.predicates for name in predicate.reads()))

    def __str__(self) -> str:
        return " ".join(_written(pattern_words(self.pattern), iter(self._values())))

    def _values(self) -> tuple[object, ...]:
        return tuple(getattr(self, field.name) for field in fields(cast("Any", self)))


def _written(words: list[str], values: Iterator[object]) -> Iterator[str]:
    """Yield the words with values in the places of `p`, `q`, `r` and `d`."""
    for word in words:
        if word in PREDICATES:
            yield str(next(values))
        elif word == DURATION:
            yield format_duration(cast("int", next(values)))
        elif not word.startswith("["):
            yield word
        elif (value := next(values)) is not None:
            yield from _written(pattern_words(word[1:-1]), iter([value]))


@dataclass(frozen=True, slots=True)
class Always(RequirementForm):
    """`always p`: p holds in every state."""

    pattern: ClassVar[str] = "always p"
    predicate: Predicate


@dataclass(frozen=True, slots=True)
class Never(RequirementForm):
    """`never p`: p holds in no state."""

    pattern: ClassVar[str] = "never p"
    predicate: Predicate


@dataclass(frozen=True, slots=True)
class LeadsTo(RequirementForm):
    """`p leads to q [within d]`: whenever p holds, q holds then or later.

    With `within d`, q holds at most d later. Without it, q holds before the run ends. A run that ends before d has
    passed satisfies the requirement.
    """

    pattern: ClassVar[str] = "p leads to q [within d]"
    cause: Predicate
    effect: Predicate
    within_ns: int | None = None


@dataclass(frozen=True, slots=True)
class Before(RequirementForm):
    """`p before q`: q does not hold until p has held, in the same state or earlier."""

    pattern: ClassVar[str] = "p before q"
    first: Predicate
    second: Predicate


@dataclass(frozen=True, slots=True)
class AfterAlways(RequirementForm):
    """`after p always q until r`: from each state with p on, q holds until a state with r."""

    pattern: ClassVar[str] = "after p always q until r"
    start: Predicate
    predicate: Predicate
    stop: Predicate


FORMS: dict[str, type[RequirementForm]] = {
    "always": Always,
    "never": Never,
    "leads_to": LeadsTo,
    "before": Before,
    "after_always": AfterAlways,
}
"""The forms of requirements. The name of a form is that of its rule in the grammar: lower case, with `_`."""


@dataclass(frozen=True, slots=True)
class Requirement:
    """A sentence with a name."""

    name: str
    sentence: RequirementForm

    def __str__(self) -> str:
        return f"{self.name}: {self.sentence}"
