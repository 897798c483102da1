"""Certificates about all runs as closing makes them, and those of a finder that forgets some of the events."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from unittest.mock import patch

from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.closing.proofs.proofs import Proofs, by_runs
from scbm.closing.runs.all_runs import AllRuns, CloseLimits, RunScope
from scbm.model import BehaviorModel, GoalOrder, PlanSet
from scbm.model.sources import outside_groups
from scbm.proofcheck import Certificate, RunsArgument
from scbm.running.untimed.projected_steps import ProjectedSteps
from scbm.running.untimed.situations import Happening, Position, RunStep


def certificate_of(
    model: BehaviorModel, goals: GoalOrder = GoalOrder.SINGLE, plans: PlanSet = PlanSet.CANONICAL
) -> Certificate:
    """Return the certificate of all that closing proves about these runs."""
    runs = AllRuns(model, CloseLimits(), lambda _: None, RunScope(bool(outside_groups(model)), goals, plans))
    proofs = Proofs(model)
    proofs.explored = (runs,)
    found = ((obligation, by_runs(obligation, runs)) for obligation in Obligations.of(model))
    ((_, certificate),) = proofs.certificates([(obligation, proof) for obligation, proof in found if proof is not None])
    return certificate


def without_situation(certificate: Certificate) -> Iterator[Certificate]:
    """Yield the certificate without one of its situations, for each of them."""
    argument = certificate.argument
    assert isinstance(argument, RunsArgument)
    for goal, runs in enumerate(argument.runs):
        for number in range(len(runs.situations)):
            fewer = replace(runs, situations=(*runs.situations[:number], *runs.situations[number + 1 :]))
            changed = (*argument.runs[:goal], fewer, *argument.runs[goal + 1 :])
            yield replace(certificate, argument=replace(argument, runs=changed))


def forgetful_certificate_of(
    model: BehaviorModel,
    forgets: Callable[[Happening, bool], bool],
    goals: GoalOrder = GoalOrder.SINGLE,
    plans: PlanSet = PlanSet.CANONICAL,
) -> Certificate:
    """Return the certificate of a finder that ignores some events.

    `forgets` gets an event, and whether the runner is at rest, and returns whether the event is ignored.
    """
    following, at_rest = ProjectedSteps.following, ProjectedSteps.at_rest

    def fewer(self: ProjectedSteps, position: Position) -> Iterator[tuple[Happening, RunStep]]:
        return ((each, step) for each, step in following(self, position) if not forgets(each, False))

    def fewer_at_rest(self: ProjectedSteps, rest: Position) -> Iterator[tuple[Happening, RunStep]]:
        return ((each, step) for each, step in at_rest(self, rest) if not forgets(each, True))

    with patch.object(ProjectedSteps, "following", fewer), patch.object(ProjectedSteps, "at_rest", fewer_at_rest):
        return certificate_of(model, goals, plans)
