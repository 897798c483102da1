"""The life of the current operation, as a table (paper, Section IV and Figure 4; semantics 5.5).

```
                 pre                      post
   initial ──────────────> executing ──────────────> completed ──> initial, and the plan goes on
      │                     ^   │ │
      │ otherwise       pre │   │ └─ `failed`, or an automatic transition ──> failed ────> initial, and a
      v                     │   │                                                           new plan is
   disabled ────────────────┘   └─── the deadline has passed ──────────────> timedout ──> requested
      └── the disabled deadline has passed ──> initial, and a new plan is requested
```

At most one operation is in another state than `initial`: the current one. In each state its rules are tried in the
order of the table, and the first that applies is one micro-step. Three things give the order of semantics 5:

- Automatic transitions precede the lifecycle (see `micro_steps`). So one that fails the operation precedes its
  completion, and automatic transitions can react to `completed`, `failed` and `timedout` before these states end.
- Within `executing` the order of the table is completed, failed, timedout.
- An operation becomes current in a micro-step of its own; the next micro-step tries its precondition. So an injection
  that waits for `current.name == X` can still disable X.

A rule is data: two states, the part of the operation that it takes, its effect on the plan, and whether it needs the
timer. Two readers walk the table. The runner walks it in time. The exploration of all runs (`closing.runs`) walks it
without time: there a running timer may pass at any moment. Functions of this module answer questions about the table,
such as in which states a part is tried (`states_trying`). The checker of certificates implements the same rules a
second time on purpose, and imports nothing from here.
"""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING, NamedTuple, assert_never

from msgspec import Struct

from scbm.model import And, Constant, Equal, Member, OperationState, Reference, Truth
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE
from scbm.running.compiled_steps import OperationPart

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.model import Action, Operation, Predicate
    from scbm.running.compiled_steps import CompiledStep, RunnableOperation


class PlanEffect(Enum):
    """The effect of a rule on the plan."""

    KEEP = "the operation stays current"
    ADVANCE = "the operation is done, and the next one of the plan follows"
    REPLAN = "the rest of the plan is dropped, and a new plan is requested"
    MODEL_ERROR = "the run ends with a model error (semantics 2.4)"


class LifecycleRule(Struct, frozen=True):
    """A row of the table: the current operation takes `part` and goes from `source` to `target`.

    Attributes:
        source: the state before.
        part: the rule applies if this part exists, its guard holds, and its actions stay in their domains.
        target: the state afterwards.
        plan: the effect on the plan.
        needs_timer: whether the rule applies only after the timer of `source` has passed.
    """

    source: OperationState
    part: OperationPart
    target: OperationState
    plan: PlanEffect = PlanEffect.KEEP
    needs_timer: bool = False


_S, _P = OperationState, OperationPart

LIFECYCLE: tuple[LifecycleRule, ...] = (
    LifecycleRule(_S.INITIAL, _P.PRE, _S.EXECUTING),
    LifecycleRule(_S.INITIAL, _P.NOTHING, _S.DISABLED),
    LifecycleRule(_S.DISABLED, _P.PRE, _S.EXECUTING),
    LifecycleRule(_S.DISABLED, _P.NOTHING, _S.INITIAL, PlanEffect.REPLAN, needs_timer=True),
    LifecycleRule(_S.EXECUTING, _P.POST, _S.COMPLETED),
    LifecycleRule(_S.EXECUTING, _P.FAILED, _S.FAILED),
    LifecycleRule(_S.EXECUTING, _P.TIMEDOUT, _S.TIMEDOUT, needs_timer=True),
    LifecycleRule(_S.EXECUTING, _P.NOTHING, _S.INITIAL, PlanEffect.MODEL_ERROR, needs_timer=True),
    LifecycleRule(_S.COMPLETED, _P.NOTHING, _S.INITIAL, PlanEffect.ADVANCE),
    LifecycleRule(_S.FAILED, _P.NOTHING, _S.INITIAL, PlanEffect.REPLAN),
    LifecycleRule(_S.TIMEDOUT, _P.NOTHING, _S.INITIAL, PlanEffect.REPLAN),
)


def states_trying(part: OperationPart) -> tuple[OperationState, ...]:
    """Return the states in which a part is tried, in the order of the table."""
    return tuple(dict.fromkeys(rule.source for rule in LIFECYCLE if rule.part is part))


def parts_by_end() -> dict[OperationState, OperationPart]:
    """Return the last states of an operation that has executed, each with the part that it ends with."""
    ends = (rule for rule in LIFECYCLE if rule.source is OperationState.EXECUTING)
    return {rule.target: rule.part for rule in ends if rule.part is not OperationPart.NOTHING}


def timer_moves() -> tuple[tuple[OperationState, OperationState], ...]:
    """Return the states before and after each move that a timer makes, except the move that ends a run."""
    timed = (rule for rule in LIFECYCLE if rule.needs_timer)
    return tuple((rule.source, rule.target) for rule in timed if rule.plan is not PlanEffect.MODEL_ERROR)


def is_current_in(operation: str, states: Iterable[OperationState]) -> And:
    """Return the predicate that an operation is current and in one of some states."""
    state, values = Reference(CURRENT_STATE), tuple(Constant(state.value) for state in states)
    is_in = Member(state, values) if len(values) > 1 else Equal(state, values[0])
    return And((Equal(Reference(CURRENT_NAME), Constant(operation)), is_in))


def guard_and_actions(operation: Operation, part: OperationPart) -> tuple[Predicate, tuple[Action, ...]] | None:
    """Return the guard and the actions of a part of an operation; `None` if the operation lacks the part."""
    match part:
        case OperationPart.PRE:
            return operation.pre.running_guard, operation.pre.running_actions
        case OperationPart.POST:
            return operation.post.running_guard, operation.post.running_actions
        case OperationPart.FAILED:
            failed = operation.failed
            return None if failed is None else (failed.running_guard, failed.running_actions)
        case OperationPart.TIMEDOUT:
            return None if operation.deadline_ns is None else (Truth(True), operation.timedout)
        case OperationPart.NOTHING:
            return Truth(True), ()
        case _:
            assert_never(part)


def timer_ns(operation: RunnableOperation, state: OperationState) -> int | None:
    """Return the maximum time that an operation may be in a state, in nanoseconds; `None` if there is none."""
    if state is OperationState.EXECUTING:
        return operation.deadline_ns
    return operation.disabled_deadline_ns if state is OperationState.DISABLED else None


class OperationMove(NamedTuple):
    """The micro-step in which the current operation follows a rule of the table.

    Attributes:
        operation: the current operation.
        rule: the rule.
        transition: what the rule takes; its name is empty unless it is a transition of the model file.
        after: the packed state afterwards, with the operation in the target state.
        timer_ns: the maximum time that the operation may be in the target state; `None` if there is none.
    """

    operation: RunnableOperation
    rule: LifecycleRule
    transition: CompiledStep
    after: int
    timer_ns: int | None


class LifecycleState:
    """The current operation in one of its states, with the rules of that state compiled for it.

    Attributes:
        operation: the operation.
        state: the state.
        is_initial: whether the state is `initial`.
        has_timer: whether the operation may be in this state for a limited time only.
    """

    def __init__(self, operation: RunnableOperation, state: OperationState) -> None:
        self.operation = operation
        self.state = state
        self.is_initial = state is OperationState.INITIAL
        self.has_timer = timer_ns(operation, state) is not None
        rules = [rule for rule in LIFECYCLE if rule.source is state and rule.part in operation.parts]
        self._rows = tuple(
            (
                rule.needs_timer,
                operation.parts[rule.part],
                operation.become[rule.target],
                timer_ns(operation, rule.target),
                rule,
            )
            for rule in rules
        )

    def move(self, state: int, *, timer_passed: bool) -> OperationMove | None:
        """Return the move in a packed state by the first rule that applies; `None` if none applies.

        Args:
            state: the packed state, in which this operation is current and in this state.
            timer_passed: whether the timer of this state has passed.
        """
        for needs_timer, transition, (keep, bits), target_timer_ns, rule in self._rows:
            if (timer_passed or not needs_timer) and transition.test(state):
                after = transition.update(state)
                if after is not None:
                    return OperationMove(self.operation, rule, transition, after & keep | bits, target_timer_ns)
        return None
