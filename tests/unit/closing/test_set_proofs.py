"""Proofs by a set of situations: what they say, what ends their search, and when closing looks for them."""

from __future__ import annotations

import re

import pytest

from scbm.cases.coverage import Aspect, Obligation, Obligations
from scbm.closing import CloseLimits, Closer, Decision
from scbm.closing.decisions import Stage
from scbm.closing.symbolic import decision_diagrams, reached_sets
from scbm.closing.symbolic.reached_sets import DEFAULT_LIMITS, NoSetError, SetLimits
from scbm.closing.symbolic.set_proofs import SetProofs
from scbm.files import read_model
from scbm.proofcheck import certificate_text, check_certificate, read_certificate
from support.wording import Wording

CELL = """
behavior_model: cell
variables:
  at: {domain: 0..40, initial: 0}
  lamp: {domain: [dark, lit], initial: dark, source: state}
operations:
  move: {pre: {g: at < 40, a: [at += 1]}, post: {g: true}}
  back: {pre: {g: at > 0, gr: lamp == lit && at < 40, a: [at -= 1]}, post: {g: true}, deadline: 5 s}
  wait: {pre: {g: at == 7}, post: {g: true, gr: lamp == lit && at < 7}, failed: {g: lamp == lit}, deadline: 5 s}
  idle: {pre: {g: at == 40 && lamp == lit}, post: {g: true}}
automatic_transitions:
  light: {g: lamp == lit && at == 3, a: [lamp <- dark]}
  shadowed: {g: at == 9 && current.name == wait, a: [lamp <- dark]}
goals:
  end: at == 40
"""

WALK = """
behavior_model: walk
variables: {at: {domain: 0..9, initial: 0}}
resources: {motor: {}}
operations:
  step: {request: motor, deadline: 5 s, guard: at < 9, effects: [at += 1]}
goals: {end: at == 9}
"""


def test_each_proof_has_a_reason(wording: Wording) -> None:
    model = read_model(CELL)
    sets = SetProofs.of(model, -1, lambda _: None)
    proved = [each for each in Obligations.of(model) if sets.proves(each)]
    assert {"move/disabled", "wait/completed", "wait/failed", "idle/queued"} <= {str(each) for each in proved}
    assert sets.never == sum(Obligations.of(model).bit(each) for each in proved)
    for each in proved:
        wording(f"{each}: {sets.reason(each)}")


def test_the_search_is_over_when_nothing_is_left_to_prove() -> None:
    """What the rest of the set would prove is not known then."""
    model = read_model(CELL)
    executing = Obligations.of(model).bit_of("move", Aspect.EXECUTING)
    sets = SetProofs.of(model, executing, lambda _: None)
    assert sets.surely & executing
    assert (sets.never, sets.proves(Obligation("idle", Aspect.QUEUED))) == (0, False)


@pytest.mark.parametrize("limits", [SetLimits(nodes=10), SetLimits(work=100)])
def test_a_limit_of_nodes_ends_the_search(limits: SetLimits, wording: Wording) -> None:
    wording(why_none(CELL, limits))


def test_without_an_engine_there_is_no_set(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setattr(decision_diagrams, "ENGINES", {"none": "no_such_module"})
    wording(why_none(CELL))


def test_large_domains_in_one_comparison_end_the_search(wording: Wording) -> None:
    text = CELL.replace("domain: 0..40", "domain: 0..400").replace("at < 40", "at + other < 40")
    wording(why_none(text.replace("  lamp:", "  other: {domain: 0..400, initial: 0, source: state}\n  lamp:", 1)))


def why_none(text: str, limits: SetLimits = DEFAULT_LIMITS) -> str:
    """Return why no set of a model is found."""
    with pytest.raises(NoSetError) as caught:
        SetProofs.of(read_model(text), -1, lambda _: None, limits)
    return str(caught.value)


def test_closing_uses_a_set_where_situations_are_too_many() -> None:
    model = read_model(CELL)
    closing = Closer(model, CloseLimits(situations=20, random=5, changes=5, beyond=10)).close()
    by_set = {str(d.obligation) for d in closing.decided if d.certificate == "sets"}
    assert {"move/disabled", "wait/queued"} & by_set
    assert all(d.decision is Decision.UNCOVERABLE for d in closing.decided if d.certificate == "sets")
    assert closing.engines["sets"] == sum(d.certificate == "sets" and d.obligation.counts for d in closing.decided)
    certificate = dict(closing.certificates)["sets"]
    assert by_set == set(certificate.claims)
    assert check_certificate(certificate, model) == ()


ROADS = """
behavior_model: roads
variables: {at: {domain: [home, hall, yard, work], initial: home}}
operations:
  walk: {pre: {g: at == home}, post: {g: true, a: [at <- hall]}}
  ride: {pre: {g: at == home}, post: {g: true, a: [at <- yard]}}
  enter: {pre: {g: at == hall}, post: {g: true, a: [at <- work]}}
  arrive: {pre: {g: at == yard}, post: {g: true, a: [at <- work]}}
goals: {worked: at == work}
runs: {goals: single}
"""

FEW = CloseLimits(situations=0, random=5, changes=5, beyond=10)


def test_closing_excludes_by_a_set_what_no_canonical_plan_has() -> None:
    model = read_model(ROADS)
    closing = Closer(model, FEW).close()
    excluded = {str(each.obligation) for each in closing.decided if each.decision is Decision.EXCLUDED}
    assert excluded == {
        f"{name}/{state}" for name in ("ride", "arrive") for state in ("executing", "completed", "queued")
    }
    assert closing.counts[Decision.UNDECIDED] == 0
    certificate = dict(closing.certificates)["sets-canonical"]
    assert set(certificate.claims) == excluded
    assert certificate_text(certificate).count('"layers": [') == 1
    assert read_certificate(certificate_text(certificate)) == certificate
    assert check_certificate(certificate, model) == ()


def test_no_set_excludes_anything_where_plans_are_drawn() -> None:
    model = read_model(ROADS.replace("goals: single", "goals: single, plans: drawn"))
    assert Closer(model, FEW).close().counts[Decision.EXCLUDED] == 0


def test_no_set_is_about_canonical_plans_that_its_check_refuses(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(reached_sets, "MAX_CHANGES", 2)
    with pytest.raises(NoSetError) as caught:
        SetProofs.of(read_model(ROADS), -1, lambda _: None).canonical(-1)
    wording(str(caught.value))


def test_a_set_about_canonical_plans_has_limits_of_its_own() -> None:
    sets = SetProofs.of(read_model(ROADS), -1, lambda _: None, SetLimits(work=1_500))
    assert sets.canonical(-1).never


def test_closing_says_why_there_is_no_set_where_something_is_undecided(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decision_diagrams, "ENGINES", {"none": "no_such_module"})
    few = CloseLimits(situations=3, random=5, changes=5, beyond=10)
    assert Stage.SETS in {end.stage for end in Closer(read_model(WALK), few).close().ended}
    assert Stage.SETS not in {end.stage for end in Closer(read_model(WALK)).close().ended}


def test_each_activity_says_how_many_obligations_are_open() -> None:
    shown: list[str] = []
    Closer(read_model(CELL), progress=shown.append).close()
    opened = [re.match(r"(\d+) of (\d+) open; ", text) for text in shown]
    assert all(opened)
    counts = [int(each[1]) for each in opened if each is not None]
    assert counts[0] > counts[-1] == 0
