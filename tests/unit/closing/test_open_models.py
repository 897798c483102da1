"""Closing of models in which the environment acts by transitions, resources are shared, and some values never come."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Aspect
from scbm.closing import Closer, Decision
from scbm.closing.certificate_files import assumed_by
from scbm.files import digest_of, load_model, read_case, read_model, write_case
from scbm.model import BehaviorModel, Outcome
from scbm.proofcheck import check_certificate
from scbm.testing import RandomCases, Tester
from support.enumeration import enumerate_runs
from support.shared_closings import shared_closing
from support.wording import Wording

EXAMPLE = Path(__file__).parents[3] / "examples" / "robot_in_the_air"

CELL = """
behavior_model: cell
variables:
  stop: {domain: [released, pressed], initial: released, source: input}
  door: {domain: [closed, open], initial: closed, source: input}
  item: {domain: [none, box, tube], initial: none}
  done: {domain: bool, initial: false}
resources:
  scanner: {measures: [item]}
operations:
  scan:
    deadline: 5 s
    pre: {g: done == false && scanner_req_state == initial, a: [scanner_req_trigger <- true]}
    post:
      g: true
      gr: scanner_req_state == succeeded
      a: [done <- true, scanner_req_trigger <- false, scanner_req_state <- initial]
    timedout: [scanner_req_trigger <- false]
automatic_transitions:
  stopped: {g: stop == pressed && plan.state == executing, a: [plan.state <- aborted]}
  tube_seen: {g: item == tube, a: [item <- none]}
  occupied:
    g: [scanner_req_state == executing, scanner_req_trigger == false, current.name == none, door == closed]
    a: [door <- open]
goals: {done: done == true}
requirements_off: {non_blocking: the stop stays pressed}
"""


def cell(*replacements: tuple[str, str], environment: str = "") -> BehaviorModel:
    text = CELL
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return read_model(text + (f"environment:\n{environment}" if environment else ""))


NEVER = "  press: {guard: door == open, actions: [stop <- pressed]}\n  shut: {guard: true, actions: [door <- closed]}\n"
OPENS = NEVER + "  open: {guard: true, actions: [door <- open]}\n"
NARROW = ("measures: [item]", "measures: {item: [none, box]}")
SHARED = ("{measures: [item]}", "{measures: [item], shared: true}")


@pytest.mark.parametrize(
    ("model", "obligation", "is_possible"),
    [
        (cell(), "automatic/stopped", True),
        (cell(environment=NEVER), "automatic/stopped", False),
        (cell(environment=OPENS), "automatic/stopped", True),
        (cell(), "automatic/tube_seen", True),
        (cell(NARROW), "automatic/tube_seen", False),
        (cell(), "automatic/occupied", False),
        (cell(SHARED), "automatic/occupied", True),
    ],
    ids=range(7),
)
def test_what_can_happen_outside_decides(model: BehaviorModel, obligation: str, *, is_possible: bool) -> None:
    closing = shared_closing(model)
    claimed = [claim for _, certificate in closing.certificates for claim in certificate.claims]
    assert enumerate_runs(model, is_open=True).visits(obligation) is is_possible
    assert not (is_possible and obligation in claimed)
    for _, certificate in closing.certificates:
        assert check_certificate(certificate, model) == ()
    for each in closing.cases:
        assert each.execution.verdict.failures == ()


def test_the_checker_refuses_a_proof_that_needs_values_which_are_never_sent() -> None:
    narrow, wide = cell(NARROW), cell()
    certificates = [
        certificate
        for _, certificate in shared_closing(narrow).certificates
        if any(claim == "automatic/tube_seen" for claim in certificate.claims)
    ]
    assert certificates
    for certificate in certificates:
        assert check_certificate(replace(certificate, digest=digest_of(wide)), wide) != ()


def test_assumptions_name_transitions_shared_resources_and_values_that_never_come(wording: Wording) -> None:
    model = cell(("{measures: [item]}", "{measures: {item: [none, box]}, shared: true}"), environment=NEVER)
    certificates = [certificate for _, certificate in shared_closing(model).certificates]
    found = "\n".join(assumed_by(certificates, model))
    wording(found)
    assert "Inputs change" not in found
    assert "Only the model" not in found


def shared_example(name: str) -> BehaviorModel:
    model = load_model(EXAMPLE / name)
    return replace(model, resources=tuple(replace(resource, shared=True) for resource in model.resources))


def test_the_shared_example_differs_in_nothing_else() -> None:
    assert load_model(EXAMPLE / "shared.yaml") == shared_example("before.yaml")


@pytest.mark.slow
def test_in_the_example_another_user_of_the_gripper_makes_the_robot_unmount_it() -> None:
    model = load_model(EXAMPLE / "shared.yaml")
    closing = shared_closing(model)
    claimed = {claim for _, certificate in closing.certificates for claim in certificate.claims}
    assert {name.partition("/")[0] for name in claimed} == {"robot_move_to_home"}
    assert closing.after.figure.visited == 81
    (decided,) = [d for d in closing.decided if str(d.obligation) == "robot_unmount_gripper/executing"]
    (made,) = [each for each in closing.cases if each.case.name == decided.case]
    assert [(each.resource, each.assign) for each in made.case.injections] == [("gripper", ())]
    assert Outcome.FAIL in [rule.outcome for rule in made.case.outcomes]
    assert made.execution.forced_by is None
    for _, certificate in closing.certificates:
        assert check_certificate(certificate, model) == ()


@pytest.mark.longer
def test_random_cases_of_the_example_do_not_depend_on_whether_resources_are_shared() -> None:
    for name in ("before.yaml", "after.yaml"):
        model, shared = load_model(EXAMPLE / name), shared_example(name)
        testers = Tester(shared), Tester(model)
        for case in RandomCases(model).first(10, 1):
            assert len({tester.execute(case).digest for tester in testers}) == 1


SAFETY_CELL = """
behavior_model: safety_cell
variables:
  estop: {domain: [released, pressed], initial: released}
  curtain: {domain: [free, broken], initial: free}
  at: {domain: [home, box], initial: home}
resources:
  arm: {simulation: {latency: 1 s}}
  safety: {measures: [curtain, estop]}
operations:
  move:
    deadline: 5 s
    pre: {g: at == home, gr: curtain == free, a: [arm_req_trigger <- true]}
    post: {g: true, gr: arm_req_state == succeeded, a: [arm_req_trigger <- false, arm_req_state <- initial, at <- box]}
    timedout: [arm_req_trigger <- false]
automatic_transitions:
  emergency_stop: {g: estop == pressed && plan.state == executing, a: [plan.state <- aborted]}
  arm_failed:
    g: arm_req_state == failed && current.state == executing
    a: [current.state <- failed, arm_req_state <- initial, arm_req_trigger <- false]
@STAND_IN@
goals: {at_box: at == box}
requirements:
  not_in_use: never arm_req_state == executing && current.state == disabled
"""
STAND_IN = "  step_back: {g: curtain == broken && current.state == disabled, a: [curtain <- free]}"


@pytest.mark.parametrize("stand_in", ["", STAND_IN], ids=["alone", "with a transition that clears the curtain"])
def test_what_a_safety_controller_sends_unasked_is_covered_and_not_proved_away(stand_in: str) -> None:
    model = read_model(SAFETY_CELL.replace("@STAND_IN@", stand_in))
    closing = shared_closing(model)
    assert {each.decision for each in closing.decided} == {Decision.COVERED}
    assert closing.after.figure.percent == 100
    assert [made.case.name for made in closing.cases if not made.execution.verdict.passed] == []


CAUSES = """
behavior_model: nav
variables:
  cause: {domain: [none, blocked], initial: none}
  there: {domain: bool, initial: false}
  seen: {domain: bool, initial: false, source: state}
resources:
  nav: {measures: [cause], simulation: {latency: 1 s}}
operations:
  go:
    deadline: 5 s
    pre: {g: there == false, ar: [nav_req_trigger <- true]}
    post: {g: true, gr: nav_req_state == succeeded, a: [there <- true], ar: [nav_req_trigger <- false]}
    failed: {g: true, gr: nav_req_state == failed, ar: [nav_req_trigger <- false]}
    timedout: [nav_req_trigger <- false]
automatic_transitions:
  blocked: {g: cause == blocked && nav_req_state == failed && seen == false, a: [seen <- true]}
goals: {there: there == true}
"""


def test_a_written_case_keeps_what_a_failed_reply_measures() -> None:
    model = read_model(CAUSES)
    closing = shared_closing(model)
    bit = closing.after.obligations.bit(
        next(d.obligation for d in closing.decided if str(d.obligation).endswith("blocked"))
    )
    (case,) = (each.case for each in closing.cases if each.execution.visited & bit)
    assert Tester(model).execute(read_case(write_case(case, model, "nav.yaml"), model)).visited & bit


LATE = """
behavior_model: late
variables:
  level: {domain: 0..9, initial: 0}
  knob: {domain: 0..2, initial: 0, source: input}
  cnt: {domain: 0..3, initial: 0}
  x: {domain: bool, initial: false}
resources:
  r: {measures: {level: [0, 5, 7]}, publishes: {level: [0, 5, 7]}}
environment:
  bump: {guard: cnt != 3, actions: [cnt += 1]}
operations:
  f:
    deadline: 3 s
    pre: {g: x == false && r_req_trigger == false, ar: [r_req_trigger <- true]}
    post: {g: true, gr: r_req_state == succeeded, a: [x <- true], ar: [r_req_trigger <- false, r_req_state <- initial]}
automatic_transitions:
  lv7: {g: level == 7 && x == true, a: [level <- 1]}
  lv2: {g: level == 1 && knob == 2, a: [level <- 2]}
  d: {g: cnt == 1 && x == true && level == 2 && knob == 0, a: [cnt <- 0]}
goals: {x: x == true}
"""


@pytest.mark.slow
def test_changes_after_all_goals_have_ended_are_no_fault() -> None:
    model = read_model(LATE)
    wanted = [each for each in shared_closing(model).after.obligations if str(each) == "automatic/d"]
    (decided,) = Closer(model).close(wanted=wanted).decided
    assert decided.decision is not Decision.UNCOVERABLE


STOP = """
behavior_model: stop
variables:
  estop: {domain: [ok, pressed], initial: ok}
  at: {domain: [a, b], initial: a}
  beacon: {domain: [off, on], initial: off, source: state}
resources:
  safety: {publishes: [estop]}
  robot: {simulation: {latency: 2 s}}
operations:
  move:
    deadline: 5 s
    pre: {g: at == a && robot_req_trigger == false && robot_req_state == initial, a: [robot_req_trigger <- true]}
    post:
      g: true
      gr: robot_req_state == succeeded
      a: [robot_req_state <- initial, robot_req_trigger <- false, at <- b]
    timedout: [robot_req_trigger <- false]
automatic_transitions:
  stop: {g: "estop == pressed && plan.state in {planning, executing}", a: [plan.state <- aborted]}
  beacon_on: {g: estop == pressed && at == b && beacon == off, a: [beacon <- on]}
goals: {b: at == b}
"""


def test_a_stop_comes_in_mid_motion_though_another_case_takes_it_at_rest() -> None:
    model = read_model(STOP)
    closing = shared_closing(model)
    bit = closing.after.obligations.bit_of("stop", Aspect.TAKEN)
    made = next(each for each in closing.cases if each.execution.visited & bit)
    taken = [record.kind for record in made.execution.trace.records if record.kind in {"request_sent", "automatic"}]
    assert taken[:2] == ["request_sent", "automatic"]
    assert made.execution.ended_ns < 2_000_000_000
