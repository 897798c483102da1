"""The parts of the library: each alone in a model is free of doubts, and can be tested and closed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import scbm
from conftest import Ran
from scbm.cases.trace import End, state_after
from scbm.files import read_case, read_model
from scbm.testing import Execution, RandomCases, Tester

GOALS = {
    "conveyor": "p.item == exit",
    "door": "p.bolt == locked",
    "emergency_stop": "done == true",
    "gripper": "p.jaws == closed",
    "light_curtain": "done == true",
    "packml": "p.mode_state == complete",
}
"""What can be reached with each part."""


def model_with(part: str) -> str:
    return f"""\
behavior_model: cell
parts: {{p: {{use: "scbm:{part}"}}}}
variables: {{done: {{domain: bool, initial: false}}}}
operations: {{finish: {{pre: {{g: done == false}}, post: {{g: true, a: [done <- true]}}}}}}
goals: {{reached: "{GOALS[part]}", finished: done == true}}
may_end: [aborted]
"""


def test_the_list_is_that_of_the_library() -> None:
    folder = Path(scbm.__file__).parent / "files" / "parts"
    assert sorted(path.stem for path in folder.glob("*.yaml")) == sorted(GOALS)


@pytest.mark.parametrize("part", GOALS)
def test_random_cases_with_a_part_pass(part: str) -> None:
    model = read_model(model_with(part))
    tester = Tester(model)
    verdicts = [tester.execute(case).verdict for case in RandomCases(model).first(20, 1)]
    assert all(verdict.passed for verdict in verdicts), verdicts


# two copies of one part

TWICE = {
    "conveyor": ("{0}.item == exit", "{0}.item: none"),
    "door": ("{0}.bolt == locked", "{0}.leaf: closed"),
    "emergency_stop": ("done == true", "{0}.circuit: pressed"),
    "gripper": ("{0}.jaws == closed", "{0}.jaws: open"),
    "light_curtain": ("done == true", "{0}.beam: broken"),
    "packml": ("{0}.mode_state == complete", "{0}.stop_button: pressed"),
}
"""What both copies of a part shall reach, and what a change from outside does to both at one moment."""

MOMENTS = {
    "idle": "plan.state == idle",
    "planning": "plan.state == planning",
    "executing": "plan.state == executing",
    "after the end": "plan.state == completed",
}
"""When the change comes."""


def both(text: str, between: str) -> str:
    return between.join(text.format(copy) for copy in ("left", "right"))


def model_with_two(part: str) -> str:
    goal, _ = TWICE[part]
    return f"""\
behavior_model: line
parts: {{left: {{use: "scbm:{part}"}}, right: {{use: "scbm:{part}"}}}}
variables: {{done: {{domain: bool, initial: false}}}}
operations: {{finish: {{pre: {{g: done == false}}, post: {{g: true, a: [done <- true]}}}}}}
goals: {{reached: "{both(goal, " && ")}", finished: done == true}}
may_end: [aborted]
"""


def run_two(part: str, goals: str, *injections: str) -> Execution:
    model = read_model(model_with_two(part))
    text = f"case: two\n{goals}\ninjections:\n" + "".join(f"  - {{{each}}}\n" for each in injections)
    return Tester(model).execute(read_case(text, model))


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("part", TWICE)
def test_two_copies_take_one_change_at_any_moment(part: str, moment: str) -> None:
    change = f"name: change, when: {MOMENTS[moment]}, set: {{{both(TWICE[part][1], ', ')}}}"
    arrival = "name: arrival, at: 30 s, set: {left.item: entry, right.item: entry}"
    injections = [change, arrival] if part == "conveyor" else [change]
    execution = run_two(part, "goals: [{goal: finished}, {goal: reached}]", *injections)
    assert execution.verdict.passed, execution.verdict


@pytest.mark.parametrize("part", TWICE)
def test_random_cases_with_two_copies_of_a_part_pass(part: str) -> None:
    model = read_model(model_with_two(part))
    tester = Tester(model)
    verdicts = [tester.execute(case).verdict for case in RandomCases(model).first(20, 1)]
    assert all(verdict.passed for verdict in verdicts), verdicts


@pytest.mark.parametrize("moment", ["idle", "planning", "executing"])
def test_an_emergency_stop_of_one_copy_ends_the_plan_that_runs_or_begins(moment: str) -> None:
    press = f"name: press, when: {MOMENTS[moment]}, set: {{right.circuit: pressed}}"
    assert run_two("emergency_stop", "goal: finished", press).verdict.end is End.ABORTED


# the commands stop, hold and suspend of the PackML machine

STOPS = "left.stop_button: pressed, right.stop_button: pressed"


def begins(state: str) -> str:
    return f"name: begin, when: plan.state == idle, set: {{{both(f'{{0}}.mode_state: {state}', ', ')}}}"


def states(execution: Execution) -> tuple[object, object]:
    """Return the states of both machines at the end of a run."""
    final = state_after(execution.trace.records)
    return final["left.mode_state"], final["right.mode_state"]


@pytest.mark.parametrize("moment", MOMENTS)
@pytest.mark.parametrize("state", ["idle", "execute", "held", "suspended", "complete"])
def test_a_stop_is_obeyed_whether_a_plan_runs_or_not(state: str, moment: str) -> None:
    stop = f"name: stop, when: {MOMENTS[moment]}, set: {{{STOPS}}}"
    execution = run_two("packml", "goal: finished", begins(state), stop)
    assert states(execution) == ("stopped", "stopped")
    assert execution.verdict.passed, execution.verdict


COMMANDS = {"reset": "stopped", "start": "idle", "produce": "execute", "unhold": "held", "unsuspend": "suspended"}
"""The commands that a stop interrupts, and the state in which each is given."""


@pytest.mark.parametrize("command", COMMANDS)
def test_a_stop_interrupts_a_command_and_its_plan_at_once(command: str) -> None:
    stop = f"name: stop, when: left.{command}.state == executing, after: 1 s, set: {{{STOPS}}}"
    execution = run_two("packml", "goal: reached", begins(COMMANDS[command]), stop)
    assert execution.verdict.end is End.ABORTED
    assert execution.ended_ns == 1_000_000_000
    assert states(execution) == ("stopped", "stopped")


def test_a_stop_does_not_interrupt_clear_as_the_machine_is_aborted() -> None:
    stop = f"name: stop, when: left.clear.state == executing, after: 1 s, set: {{{STOPS}}}"
    release = "name: release, at: 1 min, set: {left.stop_button: released, right.stop_button: released}"
    execution = run_two("packml", "goal: reached", begins("aborted"), stop, release)
    assert execution.verdict.end is End.REACHED


@pytest.mark.parametrize(
    ("change", "state"), [("hold_button: pressed", "held"), ("material: missing", "suspended")], ids=["hold", "suspend"]
)
@pytest.mark.parametrize("moment", [*MOMENTS.values(), "left.produce.state == executing"])
def test_hold_and_suspend_act_in_execute_with_or_without_production(change: str, state: str, moment: str) -> None:
    injection = f"name: change, when: {moment}, set: {{{both('{0}.' + change, ', ')}}}"
    goal = "reached" if "produce" in moment else "finished"
    execution = run_two("packml", f"goal: {goal}", begins("execute"), injection)
    assert states(execution) == (state, state)


@pytest.mark.slow
@pytest.mark.parametrize("part", GOALS)
def test_every_obligation_of_a_part_is_decided(part: str, scbm: Callable[..., Ran], tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(model_with(part), encoding="utf-8")
    assert scbm("close", tmp_path / "cell.yaml", "--out", tmp_path / "closed").code == 0
