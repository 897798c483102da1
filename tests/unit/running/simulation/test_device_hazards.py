"""Hazards at devices (semantics 7.14): what simulated devices do and their controller does not know."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.cases import Case, Network, Restart
from scbm.files import read_case, read_model
from scbm.model import BehaviorModel
from scbm.running.simulation.device_hazards import Hazard, HazardKind
from scbm.testing import RandomCases, Tester
from support.models import DRIVE
from support.wording import Wording

S = 1_000_000_000
CHANGES_ITS_MIND = """
environment:
  ask: {guard: cancel == none, actions: [cancel <- wanted], every: {exponential: 10 s}}
  forget: {guard: cancel == wanted, actions: [cancel <- none], after: 2 s}
"""
MODEL = read_model(DRIVE)
ONE_AT_A_TIME = read_model(f"{DRIVE}requirements_on: [one_request_at_a_time]\n")
CANCELS = """
case: stopped
model: drive.yaml
goals: [{goal: arrived, may_end: [aborted]}, {goal: arrived, when: cancel == none}]
environment:
  - {at: 5 s, set: {cancel: wanted}}
  - {at: 7 s, set: {cancel: none}}
outcomes:
  controller: [FIRST, succeed]
"""
ONCE = """
case: once
model: drive.yaml
goals: [{goal: arrived, may_end: [aborted]}]
outcomes:
  controller: [FIRST, succeed]
"""
STOPPED_ONCE = ONCE.replace("outcomes", "environment: [{at: 5 s, set: {cancel: wanted}}]\noutcomes")
UNAWAITED, OVERLAP = HazardKind.UNAWAITED, HazardKind.OVERLAP


def case_of(first: str, text: str = CANCELS, model: BehaviorModel = MODEL) -> Case:
    return read_case(text.replace("FIRST", first), model)


def hazards(
    first: str, text: str = CANCELS, model: BehaviorModel = MODEL
) -> list[tuple[HazardKind, int, int, int | None]]:
    """Return kind, request, begin and end in seconds."""
    run = Tester(model).execute(case_of(first, text, model))
    ends = [None if each.end_ns is None else each.end_ns // S for each in run.hazards]
    return [(each.kind, each.request, each.begin_ns // S, end) for each, end in zip(run.hazards, ends, strict=True)]


def test_work_after_a_lost_cancellation_goes_on_unawaited_and_is_overtaken(wording: Wording) -> None:
    assert hazards("{cancel: lost}") == [(UNAWAITED, 1, 5, 20), (OVERLAP, 2, 7, 20)]
    wording(list(map(str, Tester(MODEL).execute(case_of("{cancel: lost}")).hazards)))


def test_unawaited_work_counts_though_the_run_is_over_before_it_ends() -> None:
    assert hazards("{cancel: lost}", STOPPED_ONCE) == [(UNAWAITED, 1, 5, 20)]


def test_a_cancellation_on_its_way_is_no_hazard() -> None:
    assert hazards("succeed") == hazards("succeed", STOPPED_ONCE) == []
    assert hazards("{cancel: 1 s}") == hazards("{cancel: 1 min}", STOPPED_ONCE) == []
    assert hazards("{cancel: 4 s}") == [(OVERLAP, 2, 7, 9)]


def test_a_request_without_reply_works_until_it_is_cancelled() -> None:
    assert hazards("timeout") == []
    assert hazards("{outcome: timeout, cancel: lost}", STOPPED_ONCE) == []
    assert hazards("{outcome: timeout, cancel: lost}") == [(UNAWAITED, 1, 5, None), (OVERLAP, 2, 7, 27)]


RETRIES = """
behavior_model: retries
variables: {placed: {domain: bool, initial: false}}
resources: {arm: {simulation: {latency: 4 s}}}
operations: {place: {request: arm, deadline: 5 s, guard: placed == false, effects: [placed <- true], on_timeout: []}}
goals: {placed: placed == true}
"""


def test_work_that_a_retry_at_the_instant_of_the_timeout_overtakes_is_unawaited() -> None:
    case = "case: at_once\ngoal: placed\noutcomes: {arm: [FIRST, succeed]}\n"
    found = hazards("{outcome: timeout, cancel: lost}", case, read_model(RETRIES))
    assert found == [(UNAWAITED, 1, 5, None), (OVERLAP, 2, 5, 9)]
    assert hazards("timeout", case, read_model(RETRIES)) == []


def test_a_request_that_its_cancellation_overtakes_is_carried_out_unawaited() -> None:
    assert hazards("{request: 10 s}", STOPPED_ONCE) == []
    assert hazards("{request: 10 s}") == [(UNAWAITED, 1, 10, 30), (OVERLAP, 1, 10, 27)]


def test_copies_of_one_request_count_once() -> None:
    assert hazards("{request: [0 s, 1 s]}", ONCE) == [(UNAWAITED, 1, 20, 21)]
    assert hazards("{request: [0 s, 0 s]}", ONCE) == []
    assert hazards("{request: [0 s, 1 s], cancel: lost}") == [(UNAWAITED, 1, 5, 21), (OVERLAP, 2, 7, 21)]


def test_a_device_that_forgets_its_work_ends_the_hazard() -> None:
    restart = Network(restarts=(Restart("controller", 6 * S, S // 2),))
    assert not Tester(MODEL).execute(replace(case_of("{cancel: lost}"), network=restart)).hazards


def test_a_parallel_device_may_work_at_several_requests() -> None:
    parallel = read_model(DRIVE.replace("controller: {", "controller: {parallel: true, "))
    assert hazards("{cancel: lost}", model=parallel) == [(UNAWAITED, 1, 5, 20)]


@pytest.mark.parametrize("first", ["succeed", "fail", "timeout", "{after: 0 s}"])
def test_a_perfect_network_has_no_hazards(first: str) -> None:
    assert hazards(first) == []


def test_the_requirement_fails_the_case_that_shows_two_requests_at_once(wording: Wording) -> None:
    run = Tester(ONE_AT_A_TIME).execute(case_of("{cancel: lost}", model=ONE_AT_A_TIME))
    (violation,) = run.violations
    assert (violation.requirement, violation.at_ns, violation.is_built_in) == ("one_request_at_a_time", 7 * S, True)
    wording(violation)
    assert Tester(ONE_AT_A_TIME).execute(case_of("succeed", model=ONE_AT_A_TIME)).verdict.passed
    assert Tester(MODEL).execute(case_of("{cancel: lost}")).verdict.passed


def test_a_hazard_after_force_fails_no_case() -> None:
    injections = "injections: [{at: 2 s, set: {controller_req_trigger: false}}]"
    forced = CANCELS.replace("outcomes:", f"{injections}\noutcomes:")
    run = Tester(ONE_AT_A_TIME).execute(case_of("{cancel: lost}", forced, ONE_AT_A_TIME))
    assert run.hazards
    assert run.verdict.passed


def test_a_network_that_is_drawn_shows_hazards_in_random_cases() -> None:
    random = RandomCases(read_model(f"{DRIVE}{CHANGES_ITS_MIND}"), network=None, goals=3)
    tester = Tester(random.model)
    found = [hazard for number in range(1, 31) for hazard in tester.execute(random.case(1, number)).hazards]
    assert {each.kind for each in found} == {UNAWAITED, OVERLAP}
    perfect = RandomCases(random.model, goals=3)
    assert not [each for number in range(1, 31) for each in tester.execute(perfect.case(1, number)).hazards]


def test_hazards_are_values() -> None:
    assert Hazard(OVERLAP, "arm", 2, S, 2 * S, 1) == Hazard(OVERLAP, "arm", 2, S, 2 * S, 1)
