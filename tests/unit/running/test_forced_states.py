"""From which moment on a run shows what no cell could have done."""

from __future__ import annotations

import pytest

from scbm.cases.coverage import Obligations
from scbm.files import read_case, read_model
from scbm.model import BehaviorModel
from scbm.testing import Campaign, Execution, Tester
from support.models import scan_cell

STOP = """
behavior_model: stop
variables:
  done: {domain: bool, initial: false}
  stop: {domain: [released, pressed], initial: released}
  key: {domain: [on, off], initial: on}
resources:
  arm: {simulation: {latency: 2 s}}
operations:
  work:
    deadline: 10 s
    pre:
      g: arm_req_state == initial && arm_req_trigger == false && done == false
      gr: key == on
      a: [arm_req_trigger <- true]
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [arm_req_state <- initial, arm_req_trigger <- false, done <- true]
    timedout: [arm_req_trigger <- false]
automatic_transitions:
  stopped:
    g: stop == pressed && key == on && plan.state == executing
    a: [plan.state <- aborted]
goals:
  done: done == true
"""

FAILS = """  failed:
    g: arm_req_state == failed && current.state == executing
    a: [current.state <- failed, arm_req_state <- initial, arm_req_trigger <- false]
goals:"""


def run(model: BehaviorModel, injections: str) -> Execution:
    text = f"case: one\ngoal: {model.goals[0][0]}\ninjections:\n{injections}"
    return Tester(model).execute(read_case(text, model))


def stop() -> BehaviorModel:
    return read_model(STOP)


@pytest.mark.parametrize(
    "injection",
    [
        "{name: one, at: 1 s, set: {stop: pressed}}",
        "{name: one, when: arm_req_state == executing, set: {stop: pressed}}",
        "{name: one, at: 1 s, set: {stop: pressed, key: off}}",
        "{name: one, set: {key: off}, hold: 1 s}",
        "{name: one, at: 1 s, resource: arm, becomes: failing}",
        "{name: one, at: 1 s, set: {stop: released}}",
        "{name: one, at: 1 s, set: {arm_req_trigger: true}}",
    ],
)
def test_inputs_that_change_at_settled_moments_force_nothing(injection: str) -> None:
    execution = run(stop(), f"  - {injection}\n")
    assert execution.forced_by is None
    assert execution.forced == 0


@pytest.mark.parametrize(
    "injection",
    [
        "{name: one, at: 1 s, set: {done: true}}",
        "{name: one, at: 1 s, set: {arm_req_state: failed}}",
        "{name: one, at: 1 s, set: {stop: pressed, done: true}}",
        "{name: one, when: current.name == work, set: {key: off}}",
        "{name: one, when: plan.state == planning, set: {key: off}, hold: 1 s}",
        "{name: one, when: current.state == executing, set: {stop: pressed}}",
        "{name: one, at: 1 s, set: {current.state: failed}}",
    ],
)
def test_what_no_source_changes_at_that_moment_is_forced(injection: str) -> None:
    execution = run(stop(), f"  - {injection}\n")
    assert execution.forced_by is not None
    assert execution.trace.records[execution.forced_by].injection == "one"  # type: ignore[union-attr] # the forcing one


def test_what_a_run_visits_before_is_not_forced() -> None:
    execution = run(stop(), "  - {name: one, at: 1 s, set: {current.state: failed}}\n")
    names = Obligations.of(stop()).names
    assert names(execution.visited_freely) == ("work/executing", "work/queued")
    assert names(execution.forced) == ("work/failed",)


def test_an_input_can_change_while_a_later_plan_is_awaited() -> None:
    """The first request fails, so a second plan is asked for."""
    more = (
        "  - {name: one, at: 1 s, when: plan.state == planning, set: {key: off}, hold: 1 s}\noutcomes: {arm: [fail]}\n"
    )
    model = read_model(f"{STOP}\n".replace("goals:", FAILS))
    execution = run(model, more)
    assert "work/disabled" in Obligations.of(model).names(execution.visited)
    assert execution.forced_by is None


def test_a_change_that_is_put_back_at_an_unsettled_moment_is_forced_from_then_on() -> None:
    """The key is put back at the moment of the reply, before the operation can complete."""
    execution = run(stop(), "  - {name: one, at: 1 s, set: {key: off}, hold: 1 s}\n")
    assert execution.forced_by is not None
    assert execution.trace.records[execution.forced_by].kind == "put_back"
    assert Obligations.of(stop()).names(execution.forced) == ("work/completed",)


def test_measured_values_come_with_replies_alone() -> None:
    slow = ("measures: [temperature]", "measures: [temperature]\n    simulation: {latency: 1 s}")
    published = ("measures: [temperature]", "publishes: [temperature]\n    simulation: {latency: 1 s}")
    injection = "  - {name: one, at: 50 ms, set: {temperature: 7}}\n"
    assert run(scan_cell(slow), injection).forced_by is not None
    assert run(scan_cell(published, is_open=True), injection).forced_by is None


@pytest.mark.parametrize(
    ("state", "is_shared", "is_forced"),
    [("executing", True, False), ("executing", False, True), ("succeeded", True, True), ("failed", True, True)],
)
def test_other_users_occupy_and_leave_shared_resources_alone(state: str, is_shared: bool, is_forced: bool) -> None:  # noqa: FBT001 - parameters of the test
    """The operation is disabled, so no request is in flight. The resource is put back to `initial` after 1 s."""
    text = STOP.replace("[on, off], initial: on", "[on, off], initial: off, source: input")
    model = read_model(text.replace("  arm: {", "  arm: {shared: true, ") if is_shared else text)
    injections = [
        f"  - {{name: one, at: 1 s, set: {{arm_req_state: {state}}}, hold: 1 s}}\n",
        "  - {name: two, at: 3 s, set: {key: on}}\n",
    ]
    execution = run(model, "".join(injections))
    assert (execution.forced_by is not None) == is_forced
    assert "work/completed" in Obligations.of(model).names(execution.visited)


@pytest.mark.parametrize("position", [1, 2, 3])
def test_results_of_campaigns_have_what_was_forced(position: int) -> None:
    injections = [
        "  - {name: one, at: 1 s, set: {stop: pressed}}\n",
        "  - {name: one, at: 1 s, set: {current.state: failed}}\n",
        "  - {name: one, at: 9 s, set: {current.state: failed}}\n",
    ]
    executions = [run(stop(), injection) for injection in injections]
    campaign = Campaign.of(stop(), [execution.result for execution in executions])
    assert campaign.results[position - 1].forced == executions[position - 1].forced
