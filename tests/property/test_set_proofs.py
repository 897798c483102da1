"""Sets of situations beside all runs: what they prove is true, their certificates hold, and false ones are refused."""

from __future__ import annotations

from functools import cache
from random import Random

import pytest

from scbm.cases.coverage import Obligation, Obligations
from scbm.closing import CloseLimits, Closer, Closing, Decision
from scbm.closing.proofs.proofs import planner_of_proofs, scope_of_proofs
from scbm.closing.runs.all_runs import AllRuns
from scbm.closing.symbolic import decision_diagrams
from scbm.closing.symbolic.reached_sets import NoSetError, SetLimits, SetSearch
from scbm.closing.symbolic.set_proofs import SetProofs
from scbm.files import digest_of
from scbm.model import BehaviorModel, PlanSet
from scbm.proofcheck import Certificate, SetsArgument, certificate_text, check_certificate, read_certificate
from support.enumeration import enumerate_runs
from support.opened_models import opened
from support.profiles import share
from support.random_models import small_random_model
from support.tampered_sets import tampered

_LIMITS = SetLimits(nodes=6_000, work=400_000)
_SITUATIONS = CloseLimits(situations=6_000)
_STRONGER = {
    Decision.UNDECIDED: (Decision.UNDECIDED, Decision.EXCLUDED, Decision.UNCOVERABLE, Decision.COVERED),
    Decision.EXCLUDED: (Decision.EXCLUDED, Decision.UNCOVERABLE),
}
"""What sets may make of an answer: what is excluded by the planner may be proved for any plans."""
_EVERYTHING = (1 << 10_000) - 1


@cache
def model_of(number: int) -> BehaviorModel:
    """Even numbers are models in which nothing but inputs changes from outside."""
    model = small_random_model(number)
    return opened(model, number) if number % 2 else model


_PLANS = pytest.mark.parametrize("plans", PlanSet)


@cache
def sets_of(number: int, plans: PlanSet = PlanSet.ANY) -> SetProofs | None:
    try:
        if plans is PlanSet.ANY:
            return SetProofs.of(model_of(number), _EVERYTHING, lambda _: None, _LIMITS)
        found = sets_of(number)
        return None if found is None else found.canonical(_EVERYTHING)
    except NoSetError:
        return None


@cache
def all_runs_of(number: int, plans: PlanSet = PlanSet.ANY) -> AllRuns:
    model = model_of(number)
    return AllRuns(model, _SITUATIONS, lambda _: None, scope_of_proofs(model, plans))


def proved_in(number: int, plans: PlanSet) -> list[Obligation]:
    sets = sets_of(number, plans)
    return [] if sets is None else [each for each in Obligations.of(model_of(number)) if sets.proves(each)]


def certificate_of(number: int, claims: list[str], argument: SetsArgument) -> Certificate:
    model = model_of(number)
    planner = None if argument.plans is PlanSet.ANY else planner_of_proofs(model)
    return Certificate(model.name, digest_of(model), tuple(claims), argument, planner)


@pytest.mark.longer
@_PLANS
@pytest.mark.parametrize("first", range(1, share(240, usual=20), 20))
def test_no_run_visits_what_a_set_proves(first: int, plans: PlanSet) -> None:
    for number in range(first, first + 20):
        runs = all_runs_of(number, plans)
        never = [str(each) for each in proved_in(number, plans)]
        visited = [name for name in runs.visits.obligations.names(runs.visited | runs.cut_off) if name in never]
        assert visited == [], number
        real = enumerate_runs(model_of(number), 500, is_open=True, is_sequence=True, plans=plans)
        assert [name for name in never if real.visits(name)] == [], number


@pytest.mark.longer
@_PLANS
@pytest.mark.parametrize("first", range(1, share(240, usual=20), 20))
def test_runs_visit_what_a_set_visits_surely(first: int, plans: PlanSet) -> None:
    """So no graph of runs with any plans is explored for proofs about it."""
    for number in range(first, first + 20):
        sets, runs = sets_of(number, plans), all_runs_of(number, plans)
        if sets is not None and runs.stopped is None:
            surely = runs.visits.obligations.names(sets.surely)
            visited = tuple(runs.visits.obligations.names(runs.visited | runs.cut_off))
            assert [name for name in surely if name not in visited] == [], number


@pytest.mark.longer
@pytest.mark.parametrize("number", range(1, share(40, usual=4)))
def test_a_set_is_what_all_moves_together_lead_to(number: int) -> None:
    """Sets are collected one operation after the other; here all moves are taken again and again."""
    search = SetSearch(model_of(number), _LIMITS, lambda _: None, lambda _: 0)
    try:
        found = search.find(_EVERYTHING)
    except NoSetError:
        return
    moves, reached, before = list(found.moves.moves()), found.moves.start(), found.space.manager.false
    while reached != before:
        before = reached
        for move in moves:
            reached |= found.moves.image(move, reached)
    assert found.is_complete
    assert found.reached == reached


@pytest.mark.longer
@_PLANS
@pytest.mark.parametrize("first", range(1, share(240, usual=20), 20))
def test_certificates_of_sets_hold(first: int, plans: PlanSet) -> None:
    for number in range(first, first + 20):
        sets, claims = sets_of(number, plans), [str(each) for each in proved_in(number, plans)]
        if sets is not None and claims:
            certificate = certificate_of(number, claims, sets.argument)
            assert read_certificate(certificate_text(certificate)) == certificate
            assert [str(flaw) for flaw in check_certificate(certificate, model_of(number))] == [], number


@pytest.mark.longer
@_PLANS
@pytest.mark.parametrize("first", range(1, share(240, usual=20), 20))
def test_false_claims_about_sets_are_refused(first: int, plans: PlanSet) -> None:
    """Each certificate claims what a run visits. One has the set that was found, the others have been tampered with."""
    for number in range(first, first + 20):
        sets, runs, dice = sets_of(number, plans), all_runs_of(number, plans), Random(number)
        visited = runs.visits.obligations.names(runs.visited | runs.cut_off)
        for each in range(0 if sets is None or not visited else 5):
            assert sets is not None
            argument = tampered(sets.argument, dice) if each else sets.argument
            false = certificate_of(number, [dice.choice(visited)], argument)
            assert check_certificate(false, model_of(number)), (number, each, false.claims)


@pytest.mark.longer
@pytest.mark.parametrize("number", [7, 18, 27, 31])
def test_sets_are_equal_with_every_engine(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    found = sets_of(number)
    monkeypatch.setattr(decision_diagrams, "ENGINES", {"python": decision_diagrams.ENGINES["python"]})
    again = SetProofs.of(model_of(number), _EVERYTHING, lambda _: None, _LIMITS)
    assert found is not None
    assert again.argument == found.argument
    assert again.canonical(_EVERYTHING).argument == found.canonical(_EVERYTHING).argument


def closing_of(number: int) -> Closing:
    """What closing decides where a graph may have few situations."""
    limits = CloseLimits(situations=200, planning=5_000, candidates=5, beyond=200, random=10, changes=10)
    return Closer(model_of(number), limits).close()


@pytest.mark.longer
@pytest.mark.parametrize("number", range(1, share(20, least=4, usual=4)))
def test_no_answer_is_worse_with_sets(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    with_sets = closing_of(number)
    monkeypatch.setattr(decision_diagrams, "ENGINES", {})
    without = closing_of(number)
    for better, worse in zip(with_sets.decided, without.decided, strict=True):
        may_become = _STRONGER.get(worse.decision, (worse.decision,))
        assert better.decision in may_become, better.obligation
    assert [str(f) for _, each in with_sets.certificates for f in check_certificate(each, model_of(number))] == []
