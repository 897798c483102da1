"""Requirements by sets beside all runs: what a set says to hold does, certificates hold, and false ones are refused."""

from __future__ import annotations

from functools import cache
from random import Random

import pytest
from msgspec.structs import replace

from property.test_user_requirements import model_of
from scbm.closing import CloseLimits
from scbm.closing.proofs.proofs import scope_of_proofs
from scbm.closing.requirements.requirement_certificates import requirement_certificates
from scbm.closing.requirements.sentence_monitor import SentenceMonitor
from scbm.closing.requirements.violating_cases import RequirementKey
from scbm.closing.requirements.violation_search import ViolationSearch
from scbm.closing.runs.all_runs import AllRuns
from scbm.closing.symbolic import decision_diagrams
from scbm.closing.symbolic.reached_sets import NoSetError, SetLimits
from scbm.closing.symbolic.requirement_sets import RequirementSets
from scbm.closing.symbolic.set_certificates import sets_argument
from scbm.model import BehaviorModel, PlanSet, Requirement
from scbm.proofcheck import RequirementSetsArgument, certificate_text, check_certificate, read_certificate
from support.profiles import share
from support.reference_requirements import violated_by_some_run
from support.tampered_sets import tampered

_LIMITS = SetLimits(nodes=6_000, work=400_000)
_SITUATIONS = CloseLimits(situations=1_500)
_PLANS = pytest.mark.parametrize("plans", PlanSet)
_TENS = pytest.mark.parametrize("first", range(0, share(240, usual=10), 10))
_MOST = 20_000


def safety_of(model: BehaviorModel) -> list[Requirement]:
    return [each for each in model.requirements if each.sentence.is_safety]


@cache
def sets_of(number: int, plans: PlanSet = PlanSet.ANY) -> RequirementSets | None:
    model = model_of(number)
    try:
        if plans is PlanSet.ANY:
            return RequirementSets.of(model, safety_of(model), lambda _: None, _LIMITS)
        found = sets_of(number)
        return None if found is None else found.canonical()
    except NoSetError:
        return None


@cache
def violated_in(number: int, plans: PlanSet) -> dict[str, bool | None]:
    """Whether the graph of all runs has a violation; `None` if it is incomplete and has none."""
    model = model_of(number)
    watched = dict.fromkeys(each for requirement in safety_of(model) for each in requirement.sentence.predicates)
    scope = replace(scope_of_proofs(model, plans), keeps_notes=True, watched=tuple(watched))
    runs, found = AllRuns(model, _SITUATIONS, lambda _: None, scope), dict[str, bool | None]()
    for requirement in safety_of(model):
        search = ViolationSearch(runs, SentenceMonitor(requirement, runs.scope.watched), _MOST)
        violated = bool(search.violated())
        found[requirement.name] = violated if violated or search.is_complete else None
    return found


@pytest.mark.longer
@_PLANS
@_TENS
def test_a_set_says_what_all_runs_say(first: int, plans: PlanSet) -> None:
    """It may say less where the end of runs decides, as a plan may be answered by *unsolvable* anywhere."""
    for number in range(first, first + 10):
        sets, violated = sets_of(number, plans), violated_in(number, plans)
        for requirement in safety_of(model_of(number)):
            if sets is None:
                break
            says_less = "plan.state" in requirement.sentence.reads() and not sets.proves(requirement)
            assert says_less or violated[requirement.name] in {None, not sets.proves(requirement)}, (
                number,
                requirement,
            )


@pytest.mark.longer
@_TENS
def test_no_run_of_the_second_interpreter_violates_what_a_set_proves(first: int) -> None:
    for number in range(first, first + 10, 3):
        sets = sets_of(number)
        for requirement in safety_of(model_of(number)):
            if sets is not None and sets.proves(requirement):
                assert violated_by_some_run(model_of(number), requirement.sentence, 300) is not True, number


@pytest.mark.longer
@_PLANS
@_TENS
def test_certificates_hold(first: int, plans: PlanSet) -> None:
    for number in range(first, first + 10):
        sets, model = sets_of(number, plans), model_of(number)
        proved = [] if sets is None else [each for each in safety_of(model) if sets.proves(each)]
        if sets is not None and proved:
            keys = dict.fromkeys((RequirementKey(each.name) for each in proved), sets)
            ((_, certificate),) = requirement_certificates(model, keys, None)
            assert read_certificate(certificate_text(certificate)) == certificate
            assert [str(flaw) for flaw in check_certificate(certificate, model)] == [], number


@pytest.mark.longer
@_PLANS
@_TENS
def test_false_claims_are_refused(first: int, plans: PlanSet) -> None:
    """Each certificate claims what a run violates: with the set that was found, or with one that is tampered with."""
    for number in range(first, first + 10):
        sets, model, dice = sets_of(number, plans), model_of(number), Random(number)
        violated = [name for name, is_violated in violated_in(number, plans).items() if is_violated]
        for each in range(0 if sets is None or not violated else 6):
            assert sets is not None
            name = dice.choice(violated)
            ((_, certificate),) = requirement_certificates(model, {RequirementKey(name): forged(sets, model)}, None)
            argument = certificate.argument
            assert isinstance(argument, RequirementSetsArgument)
            false = replace(certificate, argument=tampered(argument, dice) if each else argument)
            assert check_certificate(false, model), (number, each, false.claims)


def forged(sets: RequirementSets, model: BehaviorModel) -> RequirementSets:
    """A finder that watches all claims in all situations."""

    class Forged(RequirementSets):
        def argument(self, names: object) -> RequirementSetsArgument:
            argument = sets_argument(sets.found, model.runs.goals, [sets.found.reached for _ in [names]])
            assert isinstance(argument, RequirementSetsArgument)
            return argument

    return Forged(model, sets.found, sets._search)


@pytest.mark.longer
@pytest.mark.parametrize("number", [3, 7, 16])
def test_answers_are_equal_with_every_engine(number: int, monkeypatch: pytest.MonkeyPatch) -> None:
    found, model = sets_of(number), model_of(number)
    monkeypatch.setattr(decision_diagrams, "ENGINES", {"python": decision_diagrams.ENGINES["python"]})
    again = RequirementSets.of(model, safety_of(model), lambda _: None, _LIMITS)
    assert found is not None
    for one, other in ((found, again), (found.canonical(), again.canonical())):
        proved = [each.name for each in safety_of(model) if one.proves(each)]
        assert proved == [each.name for each in safety_of(model) if other.proves(each)]
        assert one.argument(proved) == other.argument(proved)
