"""The life of the operation at the head of the queue, as a table (paper, Section IV and Figure 4; semantics 5.5).

```
                 pre                      post
   initial ──────────────> executing ──────────────> completed ──> initial, and the queue advances
      │                     ^   │ │
      │ otherwise       pre │   │ └─ `failed`, or an automatic transition ──> failed ────> initial, and a
      v                     │   │                                                           new plan is
   disabled ────────────────┘   └─── the deadline has passed ──────────────> timedout ──> asked for
      └── the disabled deadline has passed ──> initial, and a new plan is asked for
```

At most one operation is anywhere but in `initial`: the current one. In each state its rules are tried in the order of
the table, and the first that applies is one micro-step. Three things make the order of semantics 5 come out:

- Automatic transitions go before the lifecycle. So one that fails the operation comes before its completion, and
  `completed`, `failed` and `timedout` are seen by one round of automatic transitions before they end.
- Within `executing` the table says completed, failed, timedout.
- An operation becomes current in a micro-step of its own, and only the next one looks at its precondition. So an
  injection that waits for `current.name == X` can still disable X.

A rule is a function of the operation, the packed state, and whether the timer of the operation's present state has
passed. It gives the packed state after what it takes, without the operation's own state, which the runner sets; or
`None` if it does not apply.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from typing import TYPE_CHECKING, TypeAlias

from scbm.model import OperationState

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.running.program import RunnableOperation

    Condition: TypeAlias = Callable[[RunnableOperation, int, bool], int | None]


class TimedoutLeavesDomainError(Exception):
    """The actions of a timed-out operation cannot be taken, though the time has passed: a fault of the model."""


class Then(Enum):
    """What becomes of the queue."""

    STAY = "the operation stays current"
    ADVANCE = "the operation is done, and the next one comes"
    REPLAN = "the plan is given up, and a new one is asked for"


@dataclass(frozen=True, slots=True)
class LifecycleRule:
    """A row of the table."""

    source: OperationState
    condition: Condition
    target: OperationState
    then: Then = Then.STAY


def pre_enabled(operation: RunnableOperation, state: int, _: bool) -> int | None:  # noqa: FBT001 - a column of the table
    """The precondition can be taken."""
    return operation.pre.take(state)


def post_enabled(operation: RunnableOperation, state: int, _: bool) -> int | None:  # noqa: FBT001
    """The postcondition can be taken."""
    return operation.post.take(state)


def failed_enabled(operation: RunnableOperation, state: int, _: bool) -> int | None:  # noqa: FBT001
    """The operation has a `failed` transition, and it can be taken."""
    return None if operation.failed is None else operation.failed.take(state)


def deadline_passed(operation: RunnableOperation, state: int, due: bool) -> int | None:  # noqa: FBT001
    """The deadline has passed. Raises `TimedoutLeavesDomainError` if the `timedout` actions cannot be taken."""
    if not due:
        return None
    after = operation.timedout(state)
    if after is None:
        raise TimedoutLeavesDomainError
    return after


def disabled_deadline_passed(_: RunnableOperation, state: int, due: bool) -> int | None:  # noqa: FBT001
    """The operation was disabled for too long."""
    return state if due else None


def otherwise(_: RunnableOperation, state: int, __: bool) -> int | None:  # noqa: FBT001
    """Always, as the last rule of its state."""
    return state


_S = OperationState

LIFECYCLE: tuple[LifecycleRule, ...] = (
    LifecycleRule(_S.INITIAL, pre_enabled, _S.EXECUTING),
    LifecycleRule(_S.INITIAL, otherwise, _S.DISABLED),
    LifecycleRule(_S.DISABLED, pre_enabled, _S.EXECUTING),
    LifecycleRule(_S.DISABLED, disabled_deadline_passed, _S.INITIAL, Then.REPLAN),
    LifecycleRule(_S.EXECUTING, post_enabled, _S.COMPLETED),
    LifecycleRule(_S.EXECUTING, failed_enabled, _S.FAILED),
    LifecycleRule(_S.EXECUTING, deadline_passed, _S.TIMEDOUT),
    LifecycleRule(_S.COMPLETED, otherwise, _S.INITIAL, Then.ADVANCE),
    LifecycleRule(_S.FAILED, otherwise, _S.INITIAL, Then.REPLAN),
    LifecycleRule(_S.TIMEDOUT, otherwise, _S.INITIAL, Then.REPLAN),
)

RULES: dict[OperationState, tuple[LifecycleRule, ...]] = {
    state: tuple(rule for rule in LIFECYCLE if rule.source is state) for state in OperationState
}


def transition_of(rule: LifecycleRule, operation: RunnableOperation) -> str | None:
    """The name of the transition that a rule takes, if it takes one."""
    if rule.condition is pre_enabled:
        return operation.pre.name
    if rule.condition is post_enabled:
        return operation.post.name
    if rule.condition is failed_enabled and operation.failed is not None:
        return operation.failed.name
    return None


def timer_ns(operation: RunnableOperation, state: OperationState) -> int | None:
    """How long the operation may be in a state; `None` for as long as it takes."""
    if state is OperationState.EXECUTING:
        return operation.deadline_ns
    return operation.disabled_deadline_ns if state is OperationState.DISABLED else None
