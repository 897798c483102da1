"""Parts of a model compiled for running: each guard is a test and each transition an update of packed integers."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from scbm.model import OperationState, Resource
    from scbm.model.packing import Test, Update


class CompiledStep(Struct, frozen=True):
    """A transition as the runner takes it: the guard `g && gr`, and the actions `a` and `ar` together.

    Attributes:
        name: the name of the transition; empty if the model file has none.
        test: whether the guard holds in a packed state.
        update: the packed state after the actions; `None` if one of them would leave its domain.
        cube: `(mask, bits)` with `state & mask == bits` wherever the guard holds; for automatic transitions alone.
        fails_operation: whether the actions fail the current operation.
    """

    name: str
    test: Test
    update: Update
    cube: tuple[int, int] = (0, 0)
    fails_operation: bool = False


class OperationPart(Enum):
    """The part of an operation whose guard and actions a rule takes."""

    PRE = "the precondition"
    POST = "the postcondition"
    FAILED = "the `failed` transition"
    TIMEDOUT = "the `timedout` actions, without a guard"
    NOTHING = "neither a guard nor actions"

    @property
    def key(self) -> str:
        """The key of the part in a model file; `NOTHING` has none."""
        return self.name.lower()


class RunnableOperation(Struct, frozen=True):
    """An operation compiled for running.

    Attributes:
        name: its name.
        parts: the parts that it has; `FAILED` is missing if the operation has no `failed` transition.
        deadline_ns: maximum time in `executing`; `None` if there is none.
        disabled_deadline_ns: maximum time in `disabled`; `None` if there is none.
        become: for each state, `(keep, bits)` that set it; for `initial` no operation is current afterwards.
        take_current: `(keep, bits)` that make it the current operation.
    """

    name: str
    parts: dict[OperationPart, CompiledStep]
    deadline_ns: int | None
    disabled_deadline_ns: int | None
    become: dict[OperationState, tuple[int, int]]
    take_current: tuple[int, int]


class RequestLine(Struct, frozen=True):
    """The request variables of one resource, as masks and bits of packed states.

    Attributes:
        number: the position of the resource in the model.
        resource: the resource.
        watched: the bits of the trigger and of the request state.
        ready: these bits where a request has to be sent: the trigger is true and the request state initial.
        trigger: the bit of the trigger.
        executing, succeeded, failed: `(keep, bits)` that set the request state.
        idle: `(keep, bits)` that set the request state to initial and leave the trigger.
        cleared: the same, and the trigger becomes false.
        occupied: the watched bits where the trigger is true and the request state executing.
    """

    number: int
    resource: Resource
    watched: int
    ready: int
    trigger: int
    executing: tuple[int, int]
    succeeded: tuple[int, int]
    failed: tuple[int, int]
    idle: tuple[int, int]
    cleared: tuple[int, int]
    occupied: int

    def used_by_others(self, state: int) -> tuple[int, ...]:
        """Return the state after another user has occupied or left the resource; none if neither can happen.

        The resource is shared, and no request of the controller to it is in flight (semantics 9.5).
        """
        keep, bits = self.idle
        free = state & keep | bits
        keep, bits = self.executing
        used = state & keep | bits
        return (used,) if state == free else (free,) if state == used else ()

    def given_up(self, state: int) -> int:
        """Return the state once the run has ended: a request that was triggered or answered is cleared.

        Of a resource that something else occupies only the trigger becomes false (semantics 5, after the ends).
        """
        if (state | self.trigger) & self.watched == self.occupied:
            return state & ~self.trigger
        keep, bits = self.cleared
        return state & keep | bits
