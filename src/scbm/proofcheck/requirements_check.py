"""Checks that no listed run violates requirements: the checker follows each of them from the beginning of runs.

The certificate lists the situations of runs (`RequirementsArgument`), and no step leads out of them. What a requirement
remembers of a run is not listed: the check finds it, situation by situation.
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

from scbm.model.requirements import AfterAlways, Always, Before, BuiltIn, Never
from scbm.proofcheck.certificate import CertificateFlaw
from scbm.proofcheck.checked_run import MomentKind
from scbm.proofcheck.listed_runs import ListedRuns
from scbm.proofcheck.request_judgement import RequestRule
from scbm.proofcheck.runs_check import wrong_runs
from scbm.proofcheck.valuations import TooManyStepsError

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.model.requirements import RequirementForm
    from scbm.proofcheck.certificate import ClaimedRequirement, RequirementsArgument
    from scbm.proofcheck.checked_run import CheckedMoment
    from scbm.proofcheck.listed_runs import RunEdge, RunNode

    Memory: TypeAlias = Any
    """What a rule remembers of a run; each rule has its own type."""


class FollowedRule(Protocol):
    """A requirement, followed from moment to moment."""

    start: Memory
    """What is remembered before the first moment."""

    def noted(self, moments: Iterable[CheckedMoment]) -> tuple[Any, ...]:
        """Return what counts of the moments of a step."""
        ...

    def followed(self, memory: Memory, moments: Sequence[Any]) -> tuple[Memory, bool]:
        """Return what is remembered after a step, and whether it violates the requirement."""
        ...


class SentenceRule:
    """A requirement of the user that one state can violate.

    Attributes:
        start: what is remembered before the first state: `before` remembers that p has held, `after … until` is active.
    """

    start = False

    def __init__(self, sentence: RequirementForm) -> None:
        self._sentence = sentence

    def noted(self, moments: Iterable[CheckedMoment]) -> tuple[tuple[bool, ...], ...]:
        """Return the truth of the predicates in each state that differs in it from the one before."""
        found: list[tuple[bool, ...]] = []
        for moment in moments:
            if moment.kind is MomentKind.STATE:
                truths = tuple(predicate.holds(moment.values) for predicate in self._sentence.predicates)
                found += [truths] if found[-1:] != [truths] else []
        return tuple(found)

    def followed(self, memory: bool, moments: Sequence[tuple[bool, ...]]) -> tuple[bool, bool]:  # noqa: FBT001 - a bit
        """Return what is remembered after some states, and whether one of them violates the sentence."""
        for truths in moments:
            match self._sentence, truths:
                case Always(), (holds,):
                    is_violated = not holds
                case Never(), (holds,):
                    is_violated = holds
                case Before(), (first, second):
                    memory = memory or first
                    is_violated = second and not memory
                case AfterAlways(), (start, holds, stop):
                    memory = (memory or start) and not stop
                    is_violated = memory and not holds
                case _:
                    is_violated = True  # no rule proves the other forms
            if is_violated:
                return memory, True
        return memory, False


class _StopsRule:
    """`stops`: the steps of the checker send nothing after the end of a run, as the runner does."""

    start = None

    @staticmethod
    def noted(_: Iterable[CheckedMoment]) -> tuple[Any, ...]:
        return ()

    @staticmethod
    def followed(memory: None, _: Sequence[Any]) -> tuple[None, bool]:
        return memory, False


def check_requirements(
    claimed: Sequence[ClaimedRequirement], argument: RequirementsArgument, model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the runs that are listed, or else of the claims."""
    sentences = {requirement.name: requirement.sentence for requirement in model.requirements}
    asked = [sentences[claim.name] for claim in claimed if not claim.is_built_in]
    flaws = [*wrong_runs(argument, model, (name for sentence in asked for name in sentence.reads()))]
    yield from flaws
    if flaws:
        return
    runs = ListedRuns(argument, model)
    for claim in claimed:
        rule = _built_in_rule(claim.name, model) if claim.is_built_in else SentenceRule(sentences[claim.name])
        if rule is None:
            yield CertificateFlaw(f"claim {claim}", "no certificate of this kind proves it")
            continue
        try:
            yield from _violations(rule, claim, runs)
        except TooManyStepsError:
            yield CertificateFlaw("the initial states", "there are too many to check")
            return
    yield from dict.fromkeys(runs.flaws)


def _built_in_rule(name: str, model: BehaviorModel) -> FollowedRule | None:
    match name:
        case BuiltIn.NO_ORPHAN | BuiltIn.READY_AGAIN:
            return RequestRule(model, asks_ready=name == BuiltIn.READY_AGAIN)
        case BuiltIn.STOPS:
            return _StopsRule()
        case _:
            return None


def _violations(rule: FollowedRule, claim: ClaimedRequirement, runs: ListedRuns) -> Iterator[CertificateFlaw]:
    """Yield a flaw for each step that violates the requirement after some run."""
    notes: dict[int, tuple[Any, ...]] = {}
    todo: deque[tuple[RunNode, Memory]] = deque()
    seen: dict[tuple[RunNode, Memory], None] = {}

    def follow(edges: Iterable[RunEdge], memory: Memory) -> Iterator[CertificateFlaw]:
        for edge in edges:
            if id(edge) not in notes:
                notes[id(edge)] = rule.noted(edge.moments)
            after, is_violated = rule.followed(memory, notes[id(edge)])
            if is_violated:
                yield CertificateFlaw(edge.where, f"violates {claim}, which is claimed to hold")
            elif edge.target is not None and (edge.target, after) not in seen:
                seen[edge.target, after] = None
                todo.append((edge.target, after))

    starts = tuple(runs.starts())  # they live as long as their numbers are used
    yield from follow(starts, rule.start)
    while todo:
        node, memory = todo.popleft()
        yield from follow(runs.edges(node), memory)
