"""Certificates about requirements, as closing would make them of a wrong answer, and changed at random."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from random import Random

from msgspec.structs import replace

from scbm.closing import CloseLimits
from scbm.closing.proofs.proofs import scope_of_proofs
from scbm.closing.requirements.blocking_search import BlockingSearch
from scbm.closing.requirements.requirement_certificates import requirement_certificates
from scbm.closing.requirements.violating_cases import RequirementKey
from scbm.closing.runs.all_runs import AllRuns
from scbm.model import BehaviorModel, GoalOrder, PlanSet
from scbm.proofcheck import Certificate, ContinuationsArgument, GoalContinuations, RequirementsArgument
from scbm.proofcheck.certificate import GoalRuns, Situation


def watched_runs(model: BehaviorModel, limits: CloseLimits) -> AllRuns:
    """All runs under canonical plans, with the truth of all predicates of requirements."""
    watched = dict.fromkeys(each for requirement in model.requirements for each in requirement.sentence.predicates)
    scope = replace(scope_of_proofs(model), keeps_notes=True, watched=tuple(watched))
    return AllRuns(model, limits, lambda _: None, scope)


def claimed(model: BehaviorModel, runs: AllRuns, key: RequirementKey) -> Certificate:
    """The certificate of these runs that claims a requirement, whether it holds or not."""
    ((_, certificate),) = requirement_certificates(model, {key: runs}, None)
    return certificate


def continued(model: BehaviorModel, runs: AllRuns) -> Certificate:
    """The certificate of these runs that claims `non_blocking`, whether it holds or not."""
    ((_, certificate),) = requirement_certificates(model, {}, BlockingSearch(runs))
    return certificate


def forged(certificate: Certificate, random: Random, count: int) -> Iterator[Certificate]:
    """The certificate with so many changes."""
    for _ in range(count):
        argument = certificate.argument
        assert isinstance(argument, RequirementsArgument | ContinuationsArgument)
        if isinstance(argument, ContinuationsArgument) and random.random() < 0.7:
            answers = tuple(_forged_answer(answer, random) for answer in argument.answers)
            certificate = replace(certificate, argument=replace(argument, answers=answers))
        elif random.random() < 0.1:
            other = GoalOrder.SINGLE if argument.goals is GoalOrder.SEQUENCE else GoalOrder.SEQUENCE
            certificate = replace(certificate, argument=replace(argument, goals=other))
        elif random.random() < 0.1:
            certificate = replace(certificate, argument=replace(argument, plans=PlanSet.ANY), planner=None)
        else:
            runs = tuple(_forged_runs(each, random) for each in argument.runs)
            certificate = replace(certificate, argument=replace(argument, runs=runs))
        yield certificate


def _forged_runs(runs: GoalRuns, random: Random) -> GoalRuns:
    """Situations of one goal, of which some are missing, twice there, or changed."""
    situations = list(runs.situations)
    for _ in range(1 + int(random.random() * 3)):
        if not situations:
            break
        number = int(random.random() * len(situations))
        match int(random.random() * 3):
            case 0:
                del situations[number]
            case 1:
                situations.append(_forged_situation(situations[number], situations, random))
            case _:
                situations[number] = _forged_situation(situations[number], situations, random)
    return replace(runs, situations=tuple(situations))


def _forged_situation(situation: Situation, others: Sequence[Situation], random: Random) -> Situation:
    other = others[int(random.random() * len(others))]
    name = ("values", "queue", "in_flight", "awaits")[int(random.random() * 4)]
    return replace(situation, **{name: getattr(other, name)})


def _forged_answer(answer: GoalContinuations, random: Random) -> GoalContinuations:
    """Distances where there are none, other ones, a history of other nodes, or a smaller set."""
    match int(random.random() * 4):
        case 0:
            nearest = int(random.random() * 3)
            return replace(answer, distances=tuple(max(d, nearest) for d in answer.distances))
        case 1:
            shifted = int(random.random() * 3) - 1
            return replace(answer, distances=tuple(max(d + shifted, -1) for d in answer.distances))
        case 2:
            nodes = len(answer.distances) or 1 + max((*answer.history, *answer.closed), default=0)
            history = tuple(int(random.random() * nodes) for _ in range(1 + int(random.random() * 3)))
            return replace(answer, distances=(), history=history, closed=tuple(sorted({*history[-1:], *answer.closed})))
        case _:
            kept = tuple(node for node in answer.closed if random.random() < 0.8)
            return replace(answer, closed=kept)
