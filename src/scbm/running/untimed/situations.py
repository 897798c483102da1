"""Positions of runs between two events, the events that can follow, and what runs visit.

Notes about steps are for what obligations do not show: requests, and how operations and runs end.
"""

from __future__ import annotations

from enum import Enum, StrEnum
from typing import TYPE_CHECKING, NamedTuple

from scbm.cases.coverage import Aspect, Obligations

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.cases.trace import Changes, End
    from scbm.model import BehaviorModel, OperationState, Value
    from scbm.running import Program
    from scbm.running.outside_changes import Maker


MAX_ANSWERS = 10_000
"""Maximum number of plans in one step, with no event between them."""


NO_GOAL = -1
"""The goal of a runner at rest, to which goals can be given."""

NO_MORE_GOALS = -2
"""The goal of a runner at rest after its run, where each run has one goal."""


class WaitsFor(StrEnum):
    """What the runner waits for while no operation is current and its queue is empty, beside replies and deadlines."""

    NOTHING = "nothing"
    PLAN = "plan"
    """The answer of the planner, which will be the plan in the queue."""
    UNSOLVABLE = "unsolvable"
    """The answer of the planner, which will be that no plan exists from the present state."""
    STALE = "stale"
    """The answer `UNSOLVABLE`, but the state has changed since the plan was requested."""
    CHANGE = "change"
    """Another state: no plan exists from the present one."""
    NEXT = "next"
    """The choice of the next operation among several plans; nothing else happens until then."""


class Position(NamedTuple):
    """The position of a run between two events, or of a runner at rest between two runs.

    Attributes:
        state: the packed state; variables that make no difference are 0.
        queue: the number of the queue, see `PlanQueues`; of the plan that will come, if `awaits` is `PLAN`.
        in_flight: the resources that a reply is awaited from, by number, in the order of asking.
        awaits: what the runner waits for beside replies and deadlines.
        goal: the number of the goal; `NO_GOAL` or `NO_MORE_GOALS` for a runner at rest.
    """

    state: int
    queue: int
    in_flight: tuple[int, ...]
    awaits: WaitsFor
    goal: int = 0

    @property
    def is_at_rest(self) -> bool:
        """Whether no goal is pursued."""
        return self.goal < 0

    @property
    def is_asking(self) -> bool:
        """Whether a planning request is pending."""
        return self.awaits in (WaitsFor.PLAN, WaitsFor.UNSOLVABLE, WaitsFor.STALE)


class PlanningTooLargeError(Exception):
    """A plan was not found within the limits of planning, so the step from an event is unknown."""


class TooManyRepliesError(Exception):
    """The values that one reply can measure have too many combinations."""


class TooManyRestsError(Exception):
    """A runner at rest can be in too many states, so what it can visit there is unknown."""


class HappeningKind(Enum):
    """The kinds of events in a run."""

    ANSWER = "the planner answers"
    REPLY = "a resource replies"
    DEADLINE = "the deadline of the current operation passes"
    TIME_LIMIT = "the time limit of the run passes"
    OUTSIDE = "something outside the model changes variables"
    GIVE_UP = "the run ends, as no plan exists and nothing else is awaited"
    NEXT = "it is decided how the plan goes on"
    GOAL = "a goal is given to a runner at rest"
    PLAN_LIMIT = "the limit of plans ends the run while a plan is requested"

    __hash__ = object.__hash__  # without a call of Python for each lookup


class Happening(NamedTuple):
    """One event that can happen in a run.

    Attributes:
        kind: what it is.
        resource: which one replies; of a change from outside who makes it.
        succeeded: what the reply says.
        measured: what it carries; for a change from outside, what it changes.
        number: of the goal that is given; of the way in which the plan goes on, among those that are possible.
        by: of a change from outside the kind of its maker.
    """

    kind: HappeningKind
    resource: str = ""
    succeeded: bool = False
    measured: Changes = ()
    number: int = 0
    by: type[Maker] | None = None


ANSWER = Happening(HappeningKind.ANSWER)
DEADLINE = Happening(HappeningKind.DEADLINE)
TIME_LIMIT = Happening(HappeningKind.TIME_LIMIT)
GIVE_UP = Happening(HappeningKind.GIVE_UP)
PLAN_LIMIT = Happening(HappeningKind.PLAN_LIMIT)


class RunStep(NamedTuple):
    """The step that an event starts.

    Attributes:
        target: where the run is then; `None` if it has ended.
        visits: what it visits on the way, as bits of `Visits`.
        cut_off: what it would visit if the limit of plans ended it on the way.
        rests: the states of the runner at rest after the end, where goals follow each other; mostly one.
        cut_off_rests: those after an end by the limit of plans on the way.
        notes: what is noted on the way, where notes are kept.
    """

    target: Position | None
    visits: int
    cut_off: int = 0
    rests: tuple[int, ...] = ()
    cut_off_rests: tuple[int, ...] = ()
    notes: tuple[RunNote, ...] = ()


class Visits:
    """The bits of what runs visit: the obligations of a model, then *is current* for each operation."""

    def __init__(self, model: BehaviorModel) -> None:
        self.obligations = Obligations.of(model)
        self._beyond = len(self.obligations.all)
        self._operations = {operation.name: index for index, operation in enumerate(model.operations)}

    @property
    def mask(self) -> int:
        """The bits of the obligations."""
        return (1 << self._beyond) - 1

    def current(self, operation: str) -> int:
        """Return the bit for an operation that becomes current."""
        return 1 << (self._beyond + self._operations[operation])

    def bit(self, subject: str, aspect: Aspect) -> int:
        """Return the bit of an obligation."""
        return self.obligations.bit_of(subject, aspect)


def world_bits(program: Program, values: Mapping[str, Value]) -> int:
    """Return a state of the world as a packed state, with the runner's variables at rest."""
    space = program.packing.space
    return program.packing.pack({v.name: v.initial if v.role.is_runner else values[v.name] for v in space})


class NoteKind(Enum):
    """The kind of a note."""

    BECOMES_CURRENT = "an operation becomes current while requests are left"
    ASKS_PLAN = "a plan is asked for while requests are left"
    REACHES_GOAL = "the goal is reached while requests are left"
    TRIGGERS = "an operation makes a trigger true"
    ENDS_OPERATION = "an operation completes, fails, times out or is given up"
    SENDS = "a request is sent"
    SENDS_AFTER_END = "a request is sent after an abort, or while no goal is pursued"
    ENDS_RUN = "a run ends by itself, and not by the time limit"
    MAY_BE_CUT_OFF = "a limit of plans can end the run here"
    MAY_END = "a livelock can end the run here"
    OBSERVES = "the watched predicates are true or false in a state"

    __hash__ = object.__hash__  # without a call of Python for each lookup

    @property
    def is_moment(self) -> bool:
        """Whether requests are judged at it (semantics 7.12)."""
        return self in _MOMENTS


_MOMENTS = (NoteKind.BECOMES_CURRENT, NoteKind.ASKS_PLAN, NoteKind.REACHES_GOAL)


class RunNote(NamedTuple):
    """A note about a micro-step.

    Attributes:
        kind: what is noted.
        operation: the operation that it is about.
        resource: the number of the resource that it is about.
        ended: how the operation ended; `DISABLED` if it was given up.
        end: how the run ended.
        state: the packed state before it, for moments and ends of runs; the state at rest after an end that may come;
            for a state that is observed the truth of the watched predicates, as bits.
        truths: the truth of the watched predicates in the states after an end that may come.
    """

    kind: NoteKind
    operation: str = ""
    resource: int = -1
    ended: OperationState | None = None
    end: End | None = None
    state: int = 0
    truths: tuple[int, ...] = ()
