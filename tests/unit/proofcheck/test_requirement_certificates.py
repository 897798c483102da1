"""Certificates about requirements (semantics 7.12): true ones are accepted, and each way to be false is refused."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.closing import CloseLimits
from scbm.closing.requirements.violating_cases import RequirementKey
from scbm.files import read_model
from scbm.model import BehaviorModel
from scbm.proofcheck import (
    Certificate,
    ContinuationsArgument,
    GoalContinuations,
    RequirementsArgument,
    check_certificate,
)
from support.forged_certificates import claimed, continued, watched_runs
from support.models import STOPPED, scan_cell
from support.wording import Wording

REFUTED = "which is claimed to hold"
FORGET = "  forget: {g: stop == up && preempt == asked, a: [preempt <- none]}\n"
REQUIREMENTS = """\
requirements:
  never_lost: always item == shelf || item == gripped || item == placed
  not_placed: always item == shelf || item == gripped
  no_loss: never item == shelf && item == placed
  no_gripping: never item == gripped
  grip_first: item == gripped before item == placed
  place_first: item == placed before item == gripped
  no_return: after item == gripped always item != shelf until item == placed
  stays_up: after item == gripped always stop == up until item == placed
  no_placing: after item == gripped always item != placed until stop == down
  stop_stays: after item == shelf && stop == down always item != gripped until item == placed
"""
LATCH = STOPPED.replace("environment:\n", f"{FORGET}environment:\n") + REQUIREMENTS


def latch(*replacements: tuple[str, str]) -> BehaviorModel:
    text = LATCH
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return read_model(text)


def claim_of(name: str, model: BehaviorModel, *, is_built_in: bool = False) -> Certificate:
    return claimed(model, watched_runs(model, CloseLimits()), RequirementKey(name, is_built_in=is_built_in))


def reasons(certificate: Certificate, model: BehaviorModel) -> str:
    return "; ".join(str(flaw) for flaw in check_certificate(certificate, model))


@pytest.mark.parametrize("name", ["never_lost", "no_loss", "grip_first", "no_return"])
def test_a_sentence_that_holds_is_certified(name: str) -> None:
    assert reasons(claim_of(name, latch()), latch()) == ""


@pytest.mark.parametrize("name", ["not_placed", "no_gripping", "place_first", "stays_up", "no_placing", "stop_stays"])
def test_a_sentence_that_a_run_violates_is_not_certified(name: str, wording: Wording) -> None:
    found = reasons(claim_of(name, latch()), latch())
    assert REFUTED in found
    wording(found)


def test_each_situation_has_to_be_listed(wording: Wording) -> None:
    model = latch()
    certificate = claim_of("never_lost", model)
    argument = certificate.argument
    assert isinstance(argument, RequirementsArgument)
    (runs,) = argument.runs
    found = []
    for number in range(0, len(runs.situations), 5):
        fewer = replace(runs, situations=(*runs.situations[:number], *runs.situations[number + 1 :]))
        found.append(reasons(replace(certificate, argument=replace(argument, runs=(fewer,))), model))
    assert all(found)
    wording(found)


NO_CLEAN_UP = ("    timedout: [scan_req_trigger <- false]\n", "")
STAYS_FAILED = ("<- failed, scan_req_state <- initial, scan_req_trigger", "<- failed, scan_req_trigger")


@pytest.mark.parametrize(("fault", "name"), [(NO_CLEAN_UP, "no_orphan"), (STAYS_FAILED, "ready_again")])
def test_a_seeded_fault_of_requests_is_not_certified(fault: tuple[str, str], name: str) -> None:
    correct, wrong = scan_cell(), scan_cell(fault)
    assert reasons(claim_of(name, correct, is_built_in=True), correct) == ""
    assert REFUTED in reasons(claim_of(name, wrong, is_built_in=True), wrong)


# non_blocking

SHELF = ("goals:\n", "goals:\n  back: {goal: item == shelf, may_end: [aborted]}\n")
AGAIN = ("goals:\n", "reachable_again: [back]\ngoals:\n")


def continued_of(model: BehaviorModel) -> Certificate:
    return continued(model, watched_runs(model, CloseLimits()))


def answers_of(certificate: Certificate) -> tuple[GoalContinuations, ...]:
    assert isinstance(certificate.argument, ContinuationsArgument)
    return certificate.argument.answers


def answered(certificate: Certificate, *answers: GoalContinuations) -> Certificate:
    assert isinstance(certificate.argument, ContinuationsArgument)
    return replace(certificate, argument=replace(certificate.argument, answers=answers))


def test_a_goal_that_plain_runs_make_unreachable_need_not_stay_reachable() -> None:
    model, strict = latch(SHELF), latch(SHELF, AGAIN)
    certificate = continued_of(model)
    assert reasons(certificate, model) == ""
    assert "`reachable_again` asks for it" in reasons(certificate, strict)


def test_a_latch_that_nothing_resets_blocks_a_goal(wording: Wording) -> None:
    wording(reasons(continued_of(latch((FORGET, ""))), latch((FORGET, ""))))


def test_distances_are_those_of_shortest_continuations(wording: Wording) -> None:
    model = latch()
    certificate = continued_of(model)
    (answer,) = answers_of(certificate)
    further = replace(answer, distances=tuple(each + 1 if each > 0 else each for each in answer.distances))
    wording(reasons(answered(certificate, further), model))


def test_a_closed_set_is_left_by_no_continuation_and_has_the_end_of_the_history(wording: Wording) -> None:
    model = latch(SHELF)
    certificate = continued_of(model)
    back, placed = answers_of(certificate)
    end = back.history[-1]
    other = tuple(node for node in back.closed if node != end)
    wording(reasons(answered(certificate, replace(back, closed=other), placed), model))
    first = replace(back, history=back.history[:1], closed=tuple(range(len(placed.distances))))
    wording(reasons(answered(certificate, first, placed), model))


def test_continuations_need_no_request_that_fails() -> None:
    broken = ("placed], initial", "placed, broken], initial")
    breaks = (FORGET, f"{FORGET}  breaks: {{g: arm_req_state == failed && item != broken, a: [item <- broken]}}\n")
    model = latch(broken, breaks, ("goals:\n", "goals:\n  broken: {goal: item == broken, may_end: [aborted]}\n"))
    certificate = continued_of(model)
    assert not answers_of(certificate)[0].distances
    assert "broken is not reachable" not in reasons(certificate, model)


@pytest.mark.parametrize("light", ["red", "green"])
def test_a_run_may_end_in_each_state_of_a_livelock(light: str) -> None:
    lights = ("  stop: {", "  light: {domain: [dark, red, green], initial: dark, source: state}\n  stop: {")
    red = "  red: {g: current.state == executing && light != red, a: [light <- red]}\n"
    green = "  green: {g: current.state == executing && light == red, a: [light <- green]}\n"
    never = ("requirements:\n", f"requirements:\n  ends: never plan.state == aborted && light == {light}\n")
    dark = "  dark: {g: current.state == initial && light != dark, a: [light <- dark]}\n"
    first = "automatic_transitions:\n"  # so each livelock begins with dark, and its last light is the same one
    model = latch(lights, (first, f"{first}{red}{green}{dark}"), never)
    assert REFUTED in reasons(claim_of("ends", model), model)
