"""Changes during a run: injections of a tester (paper, Section VI; semantics 7.2), and what the environment does.

An injection assigns variables, or changes the condition of a simulated resource.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from fractions import Fraction
from typing import TYPE_CHECKING, ClassVar

from msgspec import Struct

from scbm.model import Outcome

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model import Predicate, Value


class Intake(Enum):
    """The treatment of a request that arrives at a resource."""

    START = "it starts the request"
    WAIT = "the request waits until the condition changes"
    DROP = "it drops the request, and all that it was doing when the condition began"


def _same_outcome(outcome: Outcome) -> Outcome:
    return outcome


def _failing_outcome(outcome: Outcome) -> Outcome:
    return Outcome.FAIL if outcome is Outcome.SUCCEED else outcome


def _same_time(time_ns: int, _: Fraction) -> int:
    return time_ns


def _multiple_time(time_ns: int, factor: Fraction) -> int:
    return int(time_ns * factor)


@dataclass(frozen=True, slots=True)
class ConditionKind:
    """One way in which a resource treats requests: an entry of `CONDITIONS`.

    Attributes:
        value: its name in case files, traces, logs and messages.
        intake: what the resource does with a request that arrives.
        outcome: from the outcome that the case or the model gives a request to the one that it has.
        time: from the time that a request takes and the factor of the condition to the time that it really takes.
        factor_help: what its factor in a case file means, as in `{slower: 3}`; empty if it has none.
    """

    value: str
    intake: Intake = field(default=Intake.START, repr=False, compare=False)
    outcome: Callable[[Outcome], Outcome] = field(default=_same_outcome, repr=False, compare=False)
    time: Callable[[int, Fraction], int] = field(default=_same_time, repr=False, compare=False)
    factor_help: str = field(default="", repr=False, compare=False)

    WELL: ClassVar[ConditionKind]
    """The resource behaves as the model file and the case define."""
    OCCUPIED: ClassVar[ConditionKind]
    """Another user has the resource; requests wait until it is well again."""
    DEAD: ClassVar[ConditionKind]
    """The resource drops its current request and receives no others."""
    FAILING: ClassVar[ConditionKind]
    """Each request that arrives from now on fails, unless it gets no reply at all."""
    SLOWER: ClassVar[ConditionKind]
    """Each request that arrives from now on takes a multiple of its time."""

    @property
    def has_factor(self) -> bool:
        """Whether a case file gives it a factor."""
        return bool(self.factor_help)


ConditionKind.WELL = ConditionKind("well")
ConditionKind.OCCUPIED = ConditionKind("occupied", Intake.WAIT)
ConditionKind.DEAD = ConditionKind("dead", Intake.DROP)
ConditionKind.FAILING = ConditionKind("failing", outcome=_failing_outcome)
ConditionKind.SLOWER = ConditionKind(
    "slower", time=_multiple_time, factor_help="How many times longer requests take, from 1 to 999999."
)

CONDITIONS: dict[str, ConditionKind] = {
    kind.value: kind
    for kind in (
        ConditionKind.WELL,
        ConditionKind.OCCUPIED,
        ConditionKind.DEAD,
        ConditionKind.FAILING,
        ConditionKind.SLOWER,
    )
}
"""The conditions of resources by their names in case files."""


def condition_kind(name: str) -> ConditionKind:
    """Return the condition of a name. Raises `ValueError` if there is none."""
    if name not in CONDITIONS:
        raise ValueError(f"`becomes` is not one of {', '.join(CONDITIONS)}")
    return CONDITIONS[name]


class Condition(Struct, frozen=True):
    """The condition of a resource: its kind, and for `slower` the factor: at least 1, with at most 15 digits."""

    kind: ConditionKind = ConditionKind.WELL
    factor: Fraction = Fraction(1)

    def __str__(self) -> str:
        return f"{float(self.factor):.15g} times {self.kind.value}" if self.kind.has_factor else self.kind.value


class Injection(Struct, frozen=True):
    """One change during a run; without `when` and `at_ns` it acts at the start.

    Attributes:
        name: its name in the trace.
        assign: the variables that it assigns, each with its value; those that a model may assign.
        when: the predicate that must hold for the injection to act.
        at_ns: the earliest time of the run at which it acts.
        hold_ns: the time after which it restores the variables that nothing else has changed; `None` never restores.
        resource: the resource whose condition it changes, if it changes one.
        condition: the new condition of that resource.
        after_ns: how long after `when` became true it acts; it acts then even if `when` is false again. `None` without
            `when`.
    """

    name: str
    assign: tuple[tuple[str, Value], ...] = ()
    when: Predicate | None = None
    at_ns: int | None = None
    hold_ns: int | None = None
    resource: str | None = None
    condition: Condition | None = None
    after_ns: int | None = None


MAX_CHANGES = 100_000
"""The maximum number of changes of the environment in a case; an input that changes each second reaches it in a day."""


class EnvironmentChange(Struct, frozen=True):
    """One entry under `environment`: changes from outside at a settled moment of a run (semantics 7.2).

    Attributes:
        at_ns: the time of the run; `None` if the entry has `when`.
        assign: the variables that change, each with its new value, in the order of the changes; `None` for what the
            actions of `by` make.
        by: the name of the environment transition that makes the change; empty for anyone who can.
        when: the predicate after which the time of `after_ns` runs; it is tried once the entry before it has acted.
        after_ns: how long after `when` became true the entry acts.
    """

    at_ns: int | None
    assign: tuple[tuple[str, Value], ...] | None
    by: str = ""
    when: Predicate | None = None
    after_ns: int = 0
