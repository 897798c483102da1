"""Requirements: sentences over a run, their forms (`FORMS`), and the patterns of these (semantics 7.3).

A form of requirement is a class and an entry in `FORMS`. The class says how the form is written and which runs violate
it. The grammar, the printed sentence, the JSON Schema and the tables of the documentation follow from the class.
"""

from __future__ import annotations

import re
from abc import abstractmethod
from enum import Enum, StrEnum
from functools import cache
from itertools import product
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol, assert_never, cast

from msgspec import Struct

from scbm.model.durations import format_duration, format_moment
from scbm.model.predicates import Not, Predicate, conjunction
from scbm.model.struct_classes import AbstractStruct

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model.values import Value


class SentenceViolation(NamedTuple):
    """When and how a run violates a sentence.

    Attributes:
        at_ns: when; not later than the state that shows it.
        reason: what is wrong, in words.
        begins: the index of the record from which on the trace shows it; `None` if one record does.
    """

    at_ns: int
    reason: str
    begins: int | None = None


class ObservedState(NamedTuple):
    """A state of a run.

    Attributes:
        at_ns: when it begins.
        record: the index of the record that brought it about.
        values: the values of all variables. Read them before the next state, which changes this mapping.
    """

    at_ns: int
    record: int
    values: Mapping[str, Value]

    def violation(self, reason: str, since: ObservedState | None = None) -> SentenceViolation:
        """Return a violation that this state shows, and that began with the state `since`."""
        return SentenceViolation(self.at_ns, reason, None if since is None else since.record)


class ObservedRun(Protocol):
    """A run as a sentence sees it: its first state, and each state after a change of a variable that it reads."""

    @property
    def end_ns(self) -> int:
        """The time of the last record."""
        ...

    @property
    def ends(self) -> str:
        """How the run ends, as a clause that names a limit if one ended it."""
        ...

    def before_limit(self) -> Iterator[ObservedState]:
        """Yield the states without those that a limit brings about, which ends the run: it cancels and drops."""
        ...

    def __iter__(self) -> Iterator[ObservedState]:
        """Yield the states, in order."""
        ...


class WatchedState(NamedTuple):
    """What a state of a run does to what a sentence remembers of the run.

    Attributes:
        memory: what is remembered then.
        is_violated: whether the state violates the sentence.
    """

    memory: bool
    is_violated: bool = False


class NeededThen(NamedTuple):
    """A predicate that never holds in a run that satisfies a sentence while something is remembered of the run.

    Attributes:
        memory: what is remembered.
        predicate: the predicate.
        when: what that means, as the end of a clause.
    """

    memory: bool
    predicate: Predicate
    when: str


class RequirementForm(Struct, frozen=True, metaclass=AbstractStruct):
    """A sentence that a requirement says. Its subclasses are the forms.

    The fields of a form have the values of the letters of the pattern, in the same order: predicates, durations
    in nanoseconds, numbers. Those of an optional part are `None` if the sentence is written without it.

    Attributes:
        pattern: how the form is written: `p`, `q` and `r` stand for predicates, `d` and `e` for durations, `n` and `m`
            for numbers, all other words for themselves; a part in brackets is optional.
        violated: when a run violates the form, for the documentation: a text for each way to write the pattern.
    """

    pattern: ClassVar[str]
    violated: ClassVar[tuple[str, ...]]

    @abstractmethod
    def first_violation(self, run: ObservedRun) -> SentenceViolation | None:
        """Return the first violation by a run; `None` if the run satisfies the sentence."""

    @property
    def is_safety(self) -> bool:
        """Whether `watched` decides in each state whether a run has violated the sentence."""
        return False

    def watched(self, memory: bool, truths: Sequence[bool]) -> WatchedState:  # noqa: FBT001 - of forms
        """Return what one state does to what is remembered of a run; the truth of each of `predicates` in it is given.

        What is remembered at the beginning is `False`. Only for forms with `is_safety`, and for `leads to`.
        """
        raise NotImplementedError

    @property
    def needed_to_violate(self) -> tuple[Predicate, ...]:
        """Predicates each of which holds in some state of every run that violates the sentence; none are known here.

        If no state satisfies one of them, the requirement requires nothing.
        """
        return ()

    @property
    def needed_then(self) -> NeededThen | None:
        """What violates the sentence in a state, depending on what was before; `None` if nothing is remembered."""
        return None

    @property
    def predicates(self) -> tuple[Predicate, ...]:
        """The predicates of the sentence, in order."""
        return tuple(value for value in self._values() if isinstance(value, Predicate))

    def reads(self) -> tuple[str, ...]:
        """Return the names of the variables that the sentence reads, each once."""
        return tuple(dict.fromkeys(name for predicate in self.predicates for name in predicate.reads()))

    def __str__(self) -> str:
        return written(self.pattern, self._values())

    def _values(self) -> tuple[object, ...]:
        return tuple(getattr(self, name) for name in self.__struct_fields__)


class Always(RequirementForm, frozen=True):
    """`always p`: p holds in every state."""

    pattern = "always p"
    violated = ("in the first state in which `p` does not hold",)
    predicate: Predicate

    @property
    def needed_to_violate(self) -> tuple[Predicate, ...]:
        """A state without p."""
        return (Not(self.predicate),)

    @property
    def is_safety(self) -> bool:
        """Yes."""
        return True

    def watched(self, memory: bool, truths: Sequence[bool]) -> WatchedState:  # noqa: FBT001 - as declared
        """Return that a state without p violates the sentence; nothing is remembered."""
        return WatchedState(memory, not truths[0])

    def first_violation(self, run: ObservedRun) -> SentenceViolation | None:
        """Return the first state in which p does not hold."""
        for state in run:
            if not self.predicate.holds(state.values):
                return state.violation(f"{self.predicate} does not hold")
        return None


class Never(RequirementForm, frozen=True):
    """`never p`: p holds in no state."""

    pattern = "never p"
    violated = ("in the first state in which `p` holds",)
    predicate: Predicate

    @property
    def needed_to_violate(self) -> tuple[Predicate, ...]:
        """A state with p."""
        return (self.predicate,)

    @property
    def is_safety(self) -> bool:
        """Yes."""
        return True

    def watched(self, memory: bool, truths: Sequence[bool]) -> WatchedState:  # noqa: FBT001 - as declared
        """Return that a state with p violates the sentence; nothing is remembered."""
        return WatchedState(memory, truths[0])

    def first_violation(self, run: ObservedRun) -> SentenceViolation | None:
        """Return the first state in which p holds."""
        for state in run:
            if self.predicate.holds(state.values):
                return state.violation(f"{self.predicate} holds")
        return None


class LeadsTo(RequirementForm, frozen=True):
    """`p leads to q [within d]`: whenever p holds, q holds then or later.

    With `within d`, q holds at most d later. Without it, q holds before the run ends, or before a limit ends it. A run
    that ends before d has passed satisfies the requirement.
    """

    pattern = "p leads to q [within d]"
    violated = (
        "at the end of the run, or when a limit ends it, if `q` is still due",
        "as soon as `q` has been due for more than `d`. A run that ends earlier violates nothing",
    )
    cause: Predicate
    effect: Predicate
    within_ns: int | None = None

    @property
    def needed_to_violate(self) -> tuple[Predicate, ...]:
        """A state with p and without q."""
        return (conjunction([self.cause, Not(self.effect)]),)

    def watched(self, memory: bool, truths: Sequence[bool]) -> WatchedState:  # noqa: FBT001 - as declared
        """Return whether q is due after a state."""
        cause, effect = truths
        return WatchedState(not effect and (memory or cause))

    def first_violation(self, run: ObservedRun) -> SentenceViolation | None:
        """Return the moment at which q has been due for too long."""
        due: ObservedState | None = None
        for state in run.before_limit() if self.within_ns is None else run:
            late = self._late(due, state.at_ns)
            if late is not None:
                return late
            if self.effect.holds(state.values):
                due = None
            elif due is None and self.cause.holds(state.values):
                due = state
        if due is not None and self.within_ns is None:
            reason = f"{run.ends}, and {self.effect} has not held since {format_moment(due.at_ns)}"
            return SentenceViolation(run.end_ns, reason, due.record)
        return self._late(due, run.end_ns)

    def _late(self, due: ObservedState | None, now_ns: int) -> SentenceViolation | None:
        """Return the violation if more than d has passed since q is due."""
        if due is None or self.within_ns is None or now_ns - due.at_ns <= self.within_ns:
            return None
        within = format_duration(self.within_ns)
        reason = f"{self.effect} has not held within {within} after {format_moment(due.at_ns)}"
        return SentenceViolation(due.at_ns + self.within_ns, reason, due.record)


class Before(RequirementForm, frozen=True):
    """`p before q`: q does not hold until p has held, in the same state or earlier."""

    pattern = "p before q"
    violated = ("in the first state in which `q` holds, if `p` holds neither there nor earlier",)
    first: Predicate
    second: Predicate

    @property
    def needed_to_violate(self) -> tuple[Predicate, ...]:
        """A state with q and without p."""
        return (conjunction([self.second, Not(self.first)]),)

    @property
    def needed_then(self) -> NeededThen:
        """A state with q before p has held."""
        return NeededThen(False, self.second, f" before {self.first} has held")

    @property
    def is_safety(self) -> bool:
        """Yes."""
        return True

    def watched(self, memory: bool, truths: Sequence[bool]) -> WatchedState:  # noqa: FBT001 - as declared
        """Return whether p has held; until then a state with q violates the sentence."""
        has_held = memory or truths[0]
        return WatchedState(has_held, not has_held and truths[1])

    def first_violation(self, run: ObservedRun) -> SentenceViolation | None:
        """Return the first state with q, unless p holds there or earlier."""
        for state in run:
            if self.first.holds(state.values):
                return None
            if self.second.holds(state.values):
                return state.violation(f"{self.second} holds, and {self.first} has not held yet")
        return None


class AfterAlways(RequirementForm, frozen=True):
    """`after p always q until r`: from each state with p on, q holds until a state with r."""

    pattern = "after p always q until r"
    violated = ("in the first state in which `q` does not hold, while the requirement is active",)
    start: Predicate
    predicate: Predicate
    stop: Predicate

    @property
    def needed_to_violate(self) -> tuple[Predicate, ...]:
        """A state with p, and one without q and r."""
        return (self.start, conjunction([Not(self.predicate), Not(self.stop)]))

    @property
    def needed_then(self) -> NeededThen:
        """A state without q and r while the sentence is active."""
        lacks = conjunction([Not(self.predicate), Not(self.stop)])
        return NeededThen(True, lacks, f" between {self.start} and {self.stop}")

    @property
    def is_safety(self) -> bool:
        """Yes."""
        return True

    def watched(self, memory: bool, truths: Sequence[bool]) -> WatchedState:  # noqa: FBT001 - as declared
        """Return whether the sentence is active after a state."""
        start, predicate, stop = truths
        is_active = (memory or start) and not stop
        return WatchedState(is_active, is_active and not predicate)

    def first_violation(self, run: ObservedRun) -> SentenceViolation | None:
        """Return the first state without q while the requirement is active."""
        active: ObservedState | None = None
        for state in run:
            if active is None and self.start.holds(state.values):
                active = state
            if active is None or self.stop.holds(state.values):
                active = None
            elif not self.predicate.holds(state.values):
                return state.violation(f"{self.predicate} does not hold, and {self.stop} has not held yet", active)
        return None


FORMS: dict[str, type[RequirementForm]] = {
    "always": Always,
    "never": Never,
    "leads_to": LeadsTo,
    "before": Before,
    "after_always": AfterAlways,
}
"""The forms of requirements by name: lower case, with `_`. The documentation lists them in this order."""


class Requirement(Struct, frozen=True):
    """A sentence with a name."""

    name: str
    sentence: RequirementForm

    def __str__(self) -> str:
        return f"{self.name}: {self.sentence}"


class BuiltIn(StrEnum):
    """The built-in requirements that the code names (semantics 7.12)."""

    NO_ORPHAN = "no_orphan"
    READY_AGAIN = "ready_again"
    RECOVERS = "recovers"
    STOPS = "stops"
    NON_BLOCKING = "non_blocking"
    ONE_REQUEST_AT_A_TIME = "one_request_at_a_time"


BUILT_IN_NAMES: dict[str, str] = {
    BuiltIn.NO_ORPHAN.value: "no request outlives its operation",
    BuiltIn.READY_AGAIN.value: "a resource can be used again after its operation failed or timed out",
    BuiltIn.RECOVERS.value: "one failed or missing reply does not keep a run from its goal",
    BuiltIn.STOPS.value: "nothing is sent after an abort or the end of a run",
    BuiltIn.NON_BLOCKING.value: "no run makes a goal unreachable for all runs after it",
}
"""The names of all requirements that each model has unless it switches them off, each with what it says.

`BUILT_INS` in `testing/built_in_requirements.py` has the class of each, which finds violations in a run.
"""

OPTIONAL_NAMES: dict[str, str] = {
    BuiltIn.ONE_REQUEST_AT_A_TIME.value: "no device starts a request while it works at another one",
}
"""The names of the requirements that `requirements_on` of a model switches on, each with what it says.

`OPTIONAL_BUILT_INS` in `testing/built_in_requirements.py` has the class of each.
"""


class PlaceholderKind(Enum):
    """The kind of value that a letter of a pattern stands for. A new kind needs a case in each match over kinds."""

    PREDICATE = "predicate"
    DURATION = "duration"
    """Whole nanoseconds, written with a unit."""
    NUMBER = "number"
    """A whole number from 0 on."""


PLACEHOLDERS: dict[str, PlaceholderKind] = {
    **dict.fromkeys("pqr", PlaceholderKind.PREDICATE),
    **dict.fromkeys("de", PlaceholderKind.DURATION),
    **dict.fromkeys("mn", PlaceholderKind.NUMBER),
}
"""The letters of patterns. All other words of a pattern stand for themselves."""

_PART = re.compile(r"\[(?P<optional>[^][]+)\]|(?P<required>[^][]+)")


class PatternPart(Struct, frozen=True):
    """Words of a pattern that are either all required or all in the same brackets, and so optional together."""

    words: tuple[str, ...]
    is_optional: bool

    @property
    def kinds(self) -> tuple[PlaceholderKind, ...]:
        """The kinds of the letters, in order."""
        return tuple(PLACEHOLDERS[word] for word in self.words if word in PLACEHOLDERS)


@cache
def pattern_parts(pattern: str) -> tuple[PatternPart, ...]:
    """Return the parts of a pattern, in order."""
    parts = ((match["required"] or match["optional"], match["optional"]) for match in _PART.finditer(pattern))
    return tuple(PatternPart(tuple(text.split()), optional is not None) for text, optional in parts if text.strip())


def kinds_of(pattern: str) -> tuple[PlaceholderKind, ...]:
    """Return the kinds of all letters of a pattern, in order."""
    return tuple(kind for part in pattern_parts(pattern) for kind in part.kinds)


def spellings(pattern: str) -> tuple[str, ...]:
    """Return all ways to write a pattern: without and with each optional part."""
    ways = ([(), part.words] if part.is_optional else [part.words] for part in pattern_parts(pattern))
    return tuple(" ".join(word for words in way for word in words) for way in product(*ways))


def written(pattern: str, values: Sequence[object]) -> str:
    """Return a pattern with values in the places of its letters; leave out optional parts whose values are `None`."""
    left = iter(values)
    return " ".join(word for part in pattern_parts(pattern) for word in _written_part(part, left))


def _written_part(part: PatternPart, left: Iterator[object]) -> Iterator[str]:
    values = [(kind, next(left)) for kind in part.kinds]
    if any(value is None for _, value in values):
        return
    texts = (_text(kind, value) for kind, value in values)
    for word in part.words:
        yield next(texts) if word in PLACEHOLDERS else word


def _text(kind: PlaceholderKind, value: object) -> str:
    match kind:
        case PlaceholderKind.PREDICATE | PlaceholderKind.NUMBER:
            return str(value)
        case PlaceholderKind.DURATION:
            return format_duration(cast("int", value))
        case _:
            assert_never(kind)
