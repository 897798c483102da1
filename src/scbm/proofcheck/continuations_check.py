"""Checks that no run makes a goal unreachable that plain runs leave reachable (`ContinuationsArgument`).

The requirement is `non_blocking` (semantics 7.12). A goal that is asked for has a distance in each node from which
continuations lead to it. A goal that is not asked for has a plain history, and a set of nodes that no continuation
leaves and in which no run reaches the goal.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model import GoalOrder, PlanSet
from scbm.model.requirements import BuiltIn
from scbm.model.sources import inputs, published_by
from scbm.proofcheck.certificate import CertificateFlaw, ClaimedRequirement
from scbm.proofcheck.listed_runs import ListedRuns, RestNode, SituationNode, StepCause
from scbm.proofcheck.runs_check import wrong_runs
from scbm.proofcheck.valuations import TooManyStepsError

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel, Value
    from scbm.proofcheck.certificate import ContinuationsArgument, GoalContinuations
    from scbm.proofcheck.listed_runs import RunEdge, RunNode

_CLAIM = ClaimedRequirement(BuiltIn.NON_BLOCKING.value, is_built_in=True)
_OF_CONTINUATIONS = (StepCause.GOAL, StepCause.OUTSIDE, StepCause.SUCCESS, StepCause.DEADLINE, StepCause.OTHER)


def check_continuations(
    claimed: Sequence[ClaimedRequirement], argument: ContinuationsArgument, model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the nodes that are listed, or else of the answers about goals."""
    flaws = [CertificateFlaw(f"claim {each}", "continuations prove another one") for each in claimed if each != _CLAIM]
    if argument.goals is not GoalOrder.SEQUENCE or argument.plans is not PlanSet.CANONICAL:
        flaws.append(CertificateFlaw("the runs", "they are not sequences of goals under canonical plans"))
    flaws += wrong_runs(argument, model)
    flaws += _wrong_shape(argument, model)
    yield from flaws
    if flaws:
        return
    check = _ContinuationsCheck(argument, model)
    try:
        yield from check.wrong_histories()
    except TooManyStepsError:
        yield CertificateFlaw("the initial states", "there are too many to check")
        return
    for number, answer in enumerate(argument.answers):
        yield from check.wrong_distances(number, answer) if answer.distances else check.wrong_set(number, answer)
    yield from dict.fromkeys(check.runs.flaws)


def _wrong_shape(argument: ContinuationsArgument, model: BehaviorModel) -> Iterator[CertificateFlaw]:
    domains = [model.running_space[name].domain for name in argument.variables if name in model.running_space.names]
    for number, rest in enumerate(argument.rests, start=1):
        if len(rest) != len(domains) or not all(v in domain for v, domain in zip(rest, domains, strict=True)):
            yield CertificateFlaw(f"rest {number}", "it does not have a value for each variable")
    if [answer.goal for answer in argument.answers] != [name for name, _ in model.goals]:
        yield CertificateFlaw("the answers", "they are not about the goals of the model, each once and in order")
    count = len(argument.rests) + sum(len(runs.situations) for runs in argument.runs)
    for answer in argument.answers:
        if answer.distances and len(answer.distances) != count:
            yield CertificateFlaw(f"goal {answer.goal}", "there is not one distance for each node")
        if not answer.distances and not answer.history:
            yield CertificateFlaw(f"goal {answer.goal}", "it has neither distances nor a history")
        if any(number >= count for number in (*answer.history, *answer.closed)):
            yield CertificateFlaw(f"goal {answer.goal}", "there is no such node")


class _ContinuationsCheck:
    """The check of the answers about goals.

    Attributes:
        runs: the runs that the certificate lists.
    """

    def __init__(self, argument: ContinuationsArgument, model: BehaviorModel) -> None:
        self.runs = ListedRuns(argument, model)
        self._model = model
        self._answers = argument.answers
        self._nodes: list[RunNode] = [RestNode(self.runs.all_values(rest)) for rest in argument.rests]
        for number, runs in enumerate(argument.runs):
            self._nodes += [SituationNode(number, situation) for situation in runs.situations]
        self._numbers = {node: number for number, node in enumerate(self._nodes)}

    def wrong_histories(self) -> Iterator[CertificateFlaw]:
        """Yield a flaw for each step of a history that leads to no node, or to a rest from which a goal is far."""
        asked = [answer for answer in self._answers if answer.distances]
        again = dict.fromkeys(self._model.reachable_again)
        for answer in self._answers:
            if not answer.distances and answer.goal in again:
                yield CertificateFlaw(f"goal {answer.goal}", "`reachable_again` asks for it, and it has no distances")
        seen: dict[int, None] = {}
        todo = [*self.runs.starts()]
        while todo:
            edge = todo.pop()
            if edge.target is None or edge.cause is StepCause.LIMIT:
                continue
            number = self._numbers.get(edge.target)
            if number is None:
                yield CertificateFlaw(edge.where, "leads to a node that is not listed")
            elif number not in seen:
                seen[number] = None
                if isinstance(edge.target, RestNode):
                    for answer in asked:
                        if answer.distances[number] < 0:
                            yield CertificateFlaw(
                                edge.where, f"nothing is said about how {answer.goal} is reached then"
                            )
                todo += self.runs.edges(edge.target)

    def wrong_distances(self, goal: int, answer: GoalContinuations) -> Iterator[CertificateFlaw]:
        """Yield a flaw for each node that has no continuation to one that is nearer to the goal."""
        for number, distance in enumerate(answer.distances):
            if distance >= 0 and not any(
                edge.has_reached and edge.goal == goal
                if distance == 0
                else self._distance(answer, edge) == distance - 1
                for edge in self._continuations(number)
            ):
                yield CertificateFlaw(f"goal {answer.goal}, node {number}", f"it is not at the distance {distance}")

    def _distance(self, answer: GoalContinuations, edge: RunEdge) -> int:
        number = None if edge.target is None else self._numbers.get(edge.target)
        return -1 if number is None else answer.distances[number]

    def wrong_set(self, goal: int, answer: GoalContinuations) -> Iterator[CertificateFlaw]:
        """Yield the flaws of a plain history, and of the nodes in which the goal cannot be reached any more."""
        where = f"goal {answer.goal}"
        first, *others = [self._nodes[number] for number in answer.history]
        if not any(edge.target == first for edge in self._plain_starts()):
            yield CertificateFlaw(where, "its history does not begin with a plain start")
        before = first
        for node in others:
            if not any(edge.target == node and _is_plain(before, edge) for edge in self.runs.edges(before)):
                yield CertificateFlaw(where, "a step of its history is not one of a plain run")
            before = node
        if not isinstance(before, RestNode) or self._numbers[before] not in answer.closed:
            yield CertificateFlaw(where, "its history does not end at rest in the set")
        inside = dict.fromkeys(answer.closed)
        for number in inside:
            for edge in self._continuations(number):
                if edge.has_reached and edge.goal == goal:
                    yield CertificateFlaw(edge.where, f"reaches {answer.goal}, which is said not to be reachable")
                if edge.target is not None and self._numbers.get(edge.target) not in inside:
                    yield CertificateFlaw(edge.where, f"leaves the nodes from which {answer.goal} is not reachable")

    def _continuations(self, number: int) -> Iterator[RunEdge]:
        return (edge for edge in self.runs.edges(self._nodes[number]) if edge.cause in _OF_CONTINUATIONS)

    def _plain_starts(self) -> list[RunEdge]:
        """Return the starts with nominal inputs and published values; all if none of these is allowed."""
        published = [name for resource in self._model.resources for name in published_by(resource, self._model)]
        outside = dict.fromkeys((*inputs(self._model), *published))

        def is_nominal(start: dict[str, Value]) -> bool:
            nominal = self._model.nominal_state
            return all(value == nominal[name] for name, value in start.items() if name in outside)

        starts = [*self.runs.starts()]
        return [edge for edge in starts if is_nominal(edge.start or {})] or starts


def _is_plain(node: RunNode, edge: RunEdge) -> bool:
    """Return whether a plain run may have a step: a deadline passes only while no request is in flight."""
    if edge.cause is StepCause.DEADLINE:
        return isinstance(node, SituationNode) and not node.situation.in_flight
    return edge.cause in _OF_CONTINUATIONS and edge.cause is not StepCause.OUTSIDE
