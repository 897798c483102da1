"""Requirements of the user where runs are too many for a graph: a set of situations decides some of them."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.closing import CloseLimits
from scbm.closing.decisions import DecidedRequirement, RequirementDecisions, RequirementStatus
from scbm.closing.requirements import sentence_decisions
from scbm.closing.requirements.requirement_closer import RequirementCloser
from scbm.closing.symbolic import decision_diagrams
from scbm.files import read_model
from scbm.model import BehaviorModel, PlannerChoice
from scbm.proofcheck import check_certificate
from scbm.testing import Campaign
from support.closings import closing_of
from support.wording import Wording

ROADS = """
behavior_model: roads
variables:
  at: {domain: [home, hall, yard, work], initial: home}
  rain: {domain: bool, initial: false, source: input}
resources:
  guide: {}
operations:
  walk: {pre: {g: at == home}, post: {g: true, a: [at <- hall]}}
  ride: {pre: {g: at == home}, post: {g: true, a: [at <- yard]}}
  enter:
    request: guide
    guard: at == hall
    effects: [at <- work]
  arrive: {pre: {g: at == yard}, post: {g: true, a: [at <- work]}}
goals:
  worked: at == work
requirements:
  asks_at_work: never at == work && guide_req_trigger == true
  walks: never ride.state == executing
  hall_first: walk.state == executing before at == hall
  no_rain: always rain == false
runs: {goals: single}
"""
"""The canonical plan walks; other plans ride."""

FEW = CloseLimits(situations=2, candidates=5)
HOLDS, UNDECIDED = RequirementStatus.HOLDS, RequirementStatus.UNDECIDED
HOLDS_CANONICAL = RequirementStatus.HOLDS_CANONICAL


def decide(model: BehaviorModel, limits: CloseLimits) -> RequirementDecisions:
    return RequirementCloser(model, limits, lambda _: None).decide(Campaign.of(model, ()), closing_of(model))


def of_the_user(decisions: RequirementDecisions) -> dict[str, DecidedRequirement]:
    return {each.name: each for each in decisions.decided if not each.is_built_in}


def test_a_set_decides_what_a_graph_of_few_situations_leaves_open(wording: Wording) -> None:
    model = read_model(ROADS)
    decisions = decide(model, FEW)
    found = of_the_user(decisions)
    assert {name: (each.status, each.certificate) for name, each in found.items()} == {
        "asks_at_work": (HOLDS, "requirement_sets"),
        "walks": (HOLDS_CANONICAL, "requirement_sets-canonical"),
        "hall_first": (HOLDS, "requirement_sets"),
        "no_rain": (RequirementStatus.VIOLATED, None),
    }
    assert [flaw for _, each in decisions.certificates for flaw in check_certificate(each, model)] == []
    wording("\n".join(f"{name} {found[name].status.value} {found[name].reason}" for name in ("asks_at_work", "walks")))


def test_a_set_says_what_holds_with_any_plans_where_these_runs_are_too_many(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sentence_decisions, "_SHARE_OF_ANY_PLANS", 1_000_000)
    found = of_the_user(decide(read_model(ROADS), CloseLimits()))
    assert [(name, each.status) for name, each in found.items() if each.holds] == [
        ("asks_at_work", HOLDS),
        ("walks", HOLDS_CANONICAL),
        ("hall_first", HOLDS),
    ]
    assert found["hall_first"].other_plans is None
    assert found["walks"].other_plans is not None


def test_of_another_planner_a_set_says_what_holds_for_any_plans() -> None:
    model = replace(read_model(ROADS), planner=PlannerChoice("greedy"))
    found = of_the_user(decide(model, FEW))
    assert [found[name].status for name in ("asks_at_work", "walks")] == [HOLDS, UNDECIDED]


def test_without_a_library_requirements_stay_open_and_say_why(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(decision_diagrams, "ENGINES", {})
    found = of_the_user(decide(read_model(ROADS), FEW))
    assert found["walks"].status is UNDECIDED
    wording(found["walks"].reason)
