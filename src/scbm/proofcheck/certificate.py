"""What a certificate says: for some obligations, that no run without injections visits them, and why (decision 18).

What is wrong with a certificate that can be read.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from typing import TYPE_CHECKING, ClassVar, Protocol

if TYPE_CHECKING:
    from scbm.model import Value


class Fact(StrEnum):
    """What can be seen in the model file."""

    NO_DEADLINE = "the operation has no deadline"
    CANNOT_FAIL = "nothing fails the operation: it has no `failed` transition, and no automatic one assigns its state"
    ALWAYS_ENABLED = "whatever the state, `g && gr` of its precondition holds and its actions fit"


@dataclass(frozen=True, slots=True)
class Claim:
    """One obligation that cannot be visited.

    Attributes:
        obligation: its name, such as `scan/timedout` or `automatic/scan_failed`.
        reason: one sentence for people; checking does not read it.
    """

    obligation: str
    reason: str


@dataclass(frozen=True, slots=True)
class StructureArgument:
    """Facts of the model file, one for each claim, in the same order."""

    kind: ClassVar[str] = "structure"
    facts: tuple[Fact, ...]


@dataclass(frozen=True, slots=True)
class ValuesArgument:
    """The values that runs can ever give each variable; all others are ruled out (delete relaxation).

    Attributes:
        values: for every variable of the running space its values, in the order of space and domain.
    """

    kind: ClassVar[str] = "values"
    values: tuple[tuple[str, tuple[Value, ...]], ...]


class Awaits(StrEnum):
    """What the runner has asked for, or been told, when it has no operation and no queue."""

    NOTHING = "nothing"
    PLAN = "plan"
    """The planner has been asked, and will answer with the plan in `queue`."""
    UNSOLVABLE = "unsolvable"
    """The planner has been asked, and will answer that there is no plan from the present state."""
    STALE = "stale"
    """The same, but the state has changed since it was asked."""
    CHANGE = "change"
    """It has answered that there is no plan from the present state; requests are in flight, so the runner waits."""


@dataclass(frozen=True, slots=True)
class Situation:
    """Where a run can be between two events, when the runner is settled and the run has not ended.

    Attributes:
        values: of the variables of the argument, in their order. `current.name`, `current.state` and `plan.state` are
            among them; the other operation states follow from these.
        queue: the operations behind the current one; or the plan that will come, if `awaits` is `PLAN`.
        in_flight: the resources that a reply is awaited from, in the order of asking.
        awaits: what the runner waits for beside replies and deadlines.
    """

    values: tuple[Value, ...]
    queue: tuple[str, ...] = ()
    in_flight: tuple[str, ...] = ()
    awaits: Awaits = Awaits.NOTHING


@dataclass(frozen=True, slots=True)
class RunsArgument:
    """All situations of all runs.

    Attributes:
        variables: the variables that make a difference, in the order of the running space, without `<operation>.state`;
            all other variables never influence what happens.
        runs: for each goal of the model, in order, its situations.
    """

    kind: ClassVar[str] = "runs"
    variables: tuple[str, ...]
    runs: tuple[tuple[str, tuple[Situation, ...]], ...]


class Argument(Protocol):
    """Why no run visits the claimed obligations."""

    @property
    def kind(self) -> str:
        """The name of an entry of `ARGUMENTS`."""
        ...


@dataclass(frozen=True, slots=True)
class Certificate:
    """Claims with one argument for all of them.

    Attributes:
        model: the model's name.
        digest: the SHA-256 of the model as `notation.write_model` writes it, so that a certificate of another version
            is told apart.
        claims: at least one.
    """

    model: str
    digest: str
    claims: tuple[Claim, ...]
    argument: Argument


@dataclass(frozen=True, slots=True)
class CertificateFlaw:
    """One reason why a certificate proves nothing.

    Attributes:
        where: the claim, the variable, or the situation and the event.
        reason: what is wrong there, lower case, without a full stop.
    """

    where: str
    reason: str

    def __str__(self) -> str:
        return f"{self.where}: {self.reason}"
