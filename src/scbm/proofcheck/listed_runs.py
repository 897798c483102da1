"""The runs that a certificate about requirements lists, as a graph: situations, runners at rest, and the steps between.

Other than in `runs_check`, a runner at rest is a node also after single goals, and each step has its moments.
"""

from __future__ import annotations

from enum import Enum
from functools import partial
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from msgspec import Struct

from scbm.model import GoalOrder, OperationState
from scbm.model.variables import operation_state_name
from scbm.proofcheck.certificate import CertificateFlaw, Situation
from scbm.proofcheck.checked_run import DeadlineEvent, OutsideEvent, ReplyEvent, UncheckableStepError
from scbm.proofcheck.interpreter import Interpreter
from scbm.proofcheck.runs_check import initial_states

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.model import BehaviorModel, Value
    from scbm.proofcheck.certificate import RunsArgument
    from scbm.proofcheck.checked_run import CheckedMoment, CheckedStep, Event
    from scbm.proofcheck.guarded_parts import Values


class RestNode(NamedTuple):
    """A settled runner without a goal: the values of the variables, and whether no other goal is given."""

    values: tuple[Value, ...]
    is_over: bool = False


class SituationNode(NamedTuple):
    """A situation of the run for a goal, by its number."""

    goal: int
    situation: Situation


RunNode: TypeAlias = RestNode | SituationNode


class StepCause(Enum):
    """What starts a step, or ends a run in it."""

    START = "the runner starts"
    GOAL = "a goal is given"
    OUTSIDE = "something changes from outside"
    SUCCESS = "a request succeeds"
    FAILURE = "a request fails"
    DEADLINE = "a deadline passes"
    LIMIT = "a limit ends the run"
    OTHER = "the planner answers, or the run goes on by itself"


class RunEdge(Struct, frozen=True):
    """A step from a node.

    Attributes:
        where: the node and the event, for messages.
        cause: what starts it.
        goal: the number of the goal that is pursued in it; -1 for none.
        moments: its moments.
        target: the node that it leads to; `None` if the run repeats itself without an event.
        has_reached: whether the run ends as its goal is reached.
        start: the initial state, where the runner starts.
    """

    where: str
    cause: StepCause
    goal: int
    moments: tuple[CheckedMoment, ...]
    target: RunNode | None
    has_reached: bool = False
    start: dict[str, Value] | None = None


class ListedRuns:
    """The runs that a certificate lists.

    Attributes:
        flaws: the steps that could not be checked so far, and those that lead to a situation that is not listed.
    """

    def __init__(self, argument: RunsArgument, model: BehaviorModel) -> None:
        """`argument` has all variables that can influence a run, and its situations are well formed."""
        self.model = model
        self.flaws: list[CertificateFlaw] = []
        self._names = argument.variables
        self._is_single = argument.goals is GoalOrder.SINGLE
        self._goals = [name for name, _ in model.goals]
        self._interpreters = [
            Interpreter(model, goal, argument.variables, GoalOrder.SEQUENCE, argument.plans) for _, goal in model.goals
        ]
        self._numbers = [{each: n for n, each in enumerate(runs.situations, start=1)} for runs in argument.runs]
        operations = [operation_state_name(operation.name) for operation in model.operations]
        self._keys = (*argument.variables, *operations)
        self._edges: dict[RunNode, tuple[RunEdge, ...]] = {}

    def starts(self) -> Iterator[RunEdge]:
        """Yield the steps in which the runner starts. Raises `TooManyStepsError`."""
        for state in initial_states(self._names, self.model):
            step = self._interpreters[0].start(state)
            yield RunEdge("the start", StepCause.START, -1, step.moments, self._rest(step.rest), start=state)

    def all_values(self, values: Sequence[Value]) -> tuple[Value, ...]:
        """Return the values of a settled runner without a goal as nodes have them, with the states of operations."""
        return (*values, *(OperationState.INITIAL.value for _ in self.model.operations))

    def edges(self, node: RunNode) -> tuple[RunEdge, ...]:
        """Return the steps from a node."""
        if node not in self._edges:
            self._edges[node] = tuple(self._from_rest(node) if isinstance(node, RestNode) else self._from_goal(node))
        return self._edges[node]

    def values(self, node: RestNode) -> Values:
        """Return the values of a runner at rest, by name."""
        return dict(zip(self._keys, node.values, strict=True))

    def _from_rest(self, node: RestNode) -> Iterator[RunEdge]:
        rest = self.values(node)
        for step in self._interpreters[0].at_rest(rest):
            target = self._rest(step.rest, is_over=node.is_over)
            yield RunEdge("no goal, a change from outside", StepCause.OUTSIDE, -1, step.moments, target)
        for number, interpreter in enumerate(() if node.is_over else self._interpreters):
            where = f"goal {self._goals[number]}, from a runner at rest"
            yield from self._steps(where, StepCause.GOAL, number, partial(interpreter.begin, rest))

    def _from_goal(self, node: SituationNode) -> Iterator[RunEdge]:
        number, situation = node
        interpreter = self._interpreters[number]
        where = f"goal {self._goals[number]}, situation {self._numbers[number].get(situation, 0)}"
        for event in interpreter.events(situation):
            yield from self._steps(
                f"{where}, {event}", _cause(event), number, partial(interpreter.after, situation, event)
            )
        ended = interpreter.cut_off(situation)
        if ended is not None:
            target = self._rest(ended.rest, is_over=self._is_single)
            yield RunEdge(f"{where}, the time limit passes", StepCause.LIMIT, number, ended.moments, target)

    def _steps(self, where: str, cause: StepCause, goal: int, take: Callable[[], CheckedStep]) -> Iterator[RunEdge]:
        """Yield the step that an event starts, and its other ends."""
        try:
            step = take()
        except UncheckableStepError as error:
            self.flaws.append(CertificateFlaw(where, str(error)))
            return
        target: RunNode | None = self._rest(step.rest, is_over=self._is_single)
        if step.situation is not None:
            target = SituationNode(goal, step.situation)
            if step.situation not in self._numbers[goal]:
                self.flaws.append(CertificateFlaw(where, "leads to a situation that is not listed"))
        yield RunEdge(where, cause, goal, step.moments, target, step.has_reached)
        for end in step.ends:
            rest = self._rest(end.rest, is_over=self._is_single)
            ended_by = cause if end.is_livelock else StepCause.LIMIT
            yield RunEdge(f"{where}, the run ends on the way", ended_by, goal, end.moments, rest)

    @staticmethod
    def _rest(values: Values | None, *, is_over: bool = False) -> RestNode | None:
        return None if values is None else RestNode(tuple(values.values()), is_over)


def _cause(event: Event) -> StepCause:
    match event:
        case ReplyEvent(succeeded=succeeded):
            return StepCause.SUCCESS if succeeded else StepCause.FAILURE
        case DeadlineEvent():
            return StepCause.DEADLINE
        case OutsideEvent():
            return StepCause.OUTSIDE
        case _:
            return StepCause.OTHER
