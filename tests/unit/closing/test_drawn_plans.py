"""Closing of models that draw plans: cases have the plans that are not canonical, and proofs are about any plans."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Decision
from scbm.closing import CloseLimits, Closer
from scbm.closing.decisions import Closing, SuggestionKind
from scbm.files import read_model
from scbm.model import RunPlans
from scbm.planning import model_with_plans
from scbm.proofcheck import check_certificate
from scbm.testing import RandomCases, Tester
from support.profiles import share, slow_beyond
from support.random_models import random_model
from support.shared_closings import shared_closing
from support.two_robots import two_robots
from support.wording import Wording

_FEW = CloseLimits(
    situations=4_000, planning=20_000, candidates=20, beyond=2_000, random=share(100), changes=share(100)
)
"""The limits for random models, some of which take minutes to close."""

# It never is on a shortest way: the box would have to come back.
DETOUR = """  put_back:
    pre: {g: box == held_2, a: [box <- shelf]}
    post: {g: true}
"""


def _decisions(closing: Closing) -> dict[str, Decision]:
    return {str(decided.obligation): decided.decision for decided in closing.decided}


def test_what_only_other_shortest_plans_visit_is_covered_by_cases_with_these_plans() -> None:
    model = two_robots()
    closing = shared_closing(model)
    decisions = _decisions(closing)
    for name in ("executing", "failed", "timedout", "completed", "queued"):
        assert decisions[f"pick_2/{name}"] is decisions[f"place_2/{name}"] is Decision.COVERED
    assert Decision.UNDECIDED not in decisions.values()
    planned = [made for made in closing.cases if made.case.plans]
    assert planned
    for made in closing.cases:
        again = Tester(model).execute(made.case)
        assert (again.verdict.passed, again.digest) == (True, made.execution.digest)
    assert str(Tester(model).execute(planned[0].case).trace.planner) == "drawn 1"


def test_under_canonical_plans_they_are_excluded_by_the_planner() -> None:
    decisions = _decisions(shared_closing(two_robots("canonical")))
    assert decisions["pick_2/executing"] is Decision.EXCLUDED


def test_another_shortest_plan_with_what_canonical_plans_exclude_is_suggested(wording: Wording) -> None:
    model = two_robots("canonical", more=DETOUR)
    closing = shared_closing(model)
    (found,) = (each for each in closing.suggestions if each.kind is SuggestionKind.PLANS)
    about = {str(obligation) for obligation in found.obligations}
    assert {"pick_2/executing", "place_2/queued"} <= about
    assert not any(name.startswith(("pick_1", "put_back")) for name in about)  # no shortest plan has `put_back`
    drawn = _decisions(shared_closing(model_with_plans(RunPlans.DRAWN, model)))
    assert {drawn[name] for name in about} == {Decision.COVERED}
    wording(found.text)


# Only a plan with `detour` can block the way to the right before the robot goes there.
BLOCKED = """
behavior_model: blocked
variables:
  at: {domain: [start, left, right, end], initial: start}
  tried: {domain: bool, initial: false, source: state}
  blocked: {domain: bool, initial: false, source: state}
operations:
  go_left: {pre: {g: at == start}, post: {g: true, a: [at <- left]}}
  go_right: {pre: {g: at == start && blocked == false}, post: {g: true, a: [at <- right]}}
  from_left: {pre: {g: at == left}, post: {g: true, a: [at <- end]}}
  from_right: {pre: {g: at == right}, post: {g: true, a: [at <- end]}}
  detour: {pre: {g: at == start}, post: {g: true, a: [tried <- true]}}
automatic_transitions:
  block: {g: tried == true && blocked == false, a: [blocked <- true]}
goals:
  end: at == end
"""


@pytest.mark.slow
def test_what_only_forced_states_visit_is_not_promised_of_another_plan(wording: Wording) -> None:
    model = read_model(BLOCKED)
    closing = shared_closing(model)
    assert _decisions(closing)["go_right/disabled"] is Decision.EXCLUDED
    (found,) = (each for each in closing.suggestions if each.kind is SuggestionKind.PLANS)
    drawn = _decisions(shared_closing(model_with_plans(RunPlans.DRAWN, model)))
    assert {drawn[str(each)] for each in found.obligations} == {Decision.COVERED}
    assert {str(each): drawn[str(each)] for each in found.by_force} == {"go_right/disabled": Decision.UNDECIDED}
    wording(found.text)


def test_no_other_plan_is_suggested_where_plans_are_drawn_or_all_shortest_ones_are_canonical() -> None:
    for model in (two_robots(more=DETOUR), two_robots("canonical", goals="  held: box == held_1\n")):
        suggestions = shared_closing(model).suggestions
        assert suggestions
        assert SuggestionKind.PLANS not in [each.kind for each in suggestions]


def test_what_a_longer_plan_could_visit_stays_undecided(wording: Wording) -> None:
    closing = shared_closing(two_robots(more=DETOUR))
    decisions = _decisions(closing)
    assert decisions["put_back/executing"] is Decision.UNDECIDED
    assert decisions["pick_2/executing"] is Decision.COVERED
    assert Decision.EXCLUDED not in decisions.values()
    (reason,) = {d.reason for d in closing.decided if str(d.obligation) == "put_back/executing"}
    wording(reason)
    wording(closing.assumptions)


def test_a_certificate_about_any_plans_holds_for_canonical_ones_and_not_the_other_way_round(wording: Wording) -> None:
    drawn = two_robots(more=DETOUR)
    canonical = model_with_plans(RunPlans.CANONICAL, drawn)
    about_any = dict(shared_closing(drawn).certificates)["runs"]
    assert check_certificate(about_any, drawn) == check_certificate(about_any, canonical) == ()
    about_canonical = dict(shared_closing(canonical).certificates)["runs-canonical"]
    assert check_certificate(about_canonical, canonical) == ()
    (flaw,) = check_certificate(about_canonical, drawn)
    assert flaw.where == "the plans"
    wording(flaw.reason)


def test_the_order_of_operations_in_the_file_does_not_decide_what_is_covered() -> None:
    model = two_robots()
    decisions = _decisions(shared_closing(replace(model, operations=model.operations[::-1])))
    assert decisions["pick_1/executing"] is decisions["pick_2/executing"] is Decision.COVERED


QUICK_FIRST = (2, 9, 10, 0, 1, 3, 4, 5, 6, 7, 8, 11)
"""Numbers of random models: a usual run takes the one at the front, which is closed fastest."""


@pytest.mark.longer
@pytest.mark.parametrize("number", slow_beyond(1, QUICK_FIRST[: share(12, least=3)]))
def test_no_random_case_visits_what_is_proved_of_a_random_model(number: int) -> None:
    model = model_with_plans(RunPlans.DRAWN, random_model(number))
    closing = Closer(model, _FEW).close()
    for _, certificate in closing.certificates:
        assert check_certificate(certificate, model) == ()
    tester = Tester(model)
    for made in closing.cases:
        assert tester.execute(made.case).digest == made.execution.digest
    proved = sum(closing.bit(d.obligation) for d in closing.decided if d.certificate is not None)
    for case in RandomCases(model, network=None).first(15, seed=number):
        assert not tester.execute(case).visited_freely & proved
