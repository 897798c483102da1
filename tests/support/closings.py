"""What closing may come to, by hand: quick, and of every kind."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from scbm.cases import Case
from scbm.cases.coverage import Coverage, Obligation, Obligations
from scbm.closing import Closing, ClosingCase, Decided, Decision, Suggestion
from scbm.closing.closing_result import ClosingResult
from scbm.files import digest_of
from scbm.model import BehaviorModel
from scbm.proofcheck import Certificate, Fact, StructureArgument
from scbm.testing import Campaign, Tester
from scbm.testing.suite import Suite


def closing_of(
    model: BehaviorModel,
    cases: Sequence[Case] = (),
    suite: Sequence[Case] = (),
    undecided: Sequence[str] = (),
    suggestions: Sequence[Suggestion] = (),
) -> Closing:
    """What cases visit is covered; the rest is uncoverable for a made-up reason, but for what is named."""
    tester = Tester(model)
    before = Campaign.of(model, tester.results(suite)).coverage
    made, after = [], before
    for case in cases:
        execution = tester.execute(case)
        adds = tuple(o for o in before.obligations if before.obligations.bit(o) & execution.visited & ~after.visited)
        after += Coverage(before.obligations, ((case.name, execution.visited),))
        made.append(ClosingCase(case, execution, adds))
    decided = tuple(_decided(obligation, after, undecided) for obligation in before.obligations)
    claims = tuple(str(d.obligation) for d in decided if d.certificate is not None)
    argument = StructureArgument(tuple(Fact.NO_DEADLINE for _ in claims))
    certificates = (("structure", Certificate(model.name, digest_of(model), claims, argument)),) if claims else ()
    return Closing(model, before, after, decided, tuple(made), certificates, tuple(suggestions))


def result_of(closing: Closing, suite: Suite | None = None, campaign: Campaign | None = None) -> ClosingResult:
    """What a command came to that closed a model like that; by default there were no cases before."""
    before = campaign or Campaign.of(closing.model, ())
    return ClosingResult(closing, suite or Suite(closing.model, Path("cell.yaml")), before)


def _decided(obligation: Obligation, coverage: Coverage, undecided: Sequence[str]) -> Decided:
    case = coverage.first_visitor(obligation)
    if case is not None:
        return Decided(obligation, Decision.COVERED, f"{case} visits it", case=case)
    if str(obligation) in undecided:
        return Decided(obligation, Decision.UNDECIDED, "not all runs were explored")
    reason = f"{obligation.subject} has no way there"
    return Decided(obligation, Decision.UNCOVERABLE, reason, certificate="structure")


def obligation(model: BehaviorModel, name: str) -> Obligation:
    return next(each for each in Obligations.of(model) if str(each) == name)
