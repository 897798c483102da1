"""The environment in simulations, and other users of shared resources."""

from __future__ import annotations

from itertools import pairwise

import pytest
from msgspec.structs import replace

from scbm.cases import CONDITIONS, Case, CaseGoal, CaseLimits, Condition, EnvironmentChange, Injection, Origin
from scbm.cases.trace import (
    InjectionApplied,
    MeasurementReceived,
    PutBack,
    RunStarted,
    ends_of,
    sentence_of,
    write_trace,
)
from scbm.files import read_case, read_model, write_case
from scbm.model import BehaviorModel, Constant, Equal, InputError, Reference
from scbm.running.simulation import environment_moves
from scbm.testing import Execution, RandomCases, Tester
from support.driving import SECOND_NS, Hand
from support.models import scan_cell
from support.wording import Wording

PRESS = """
behavior_model: press
variables:
  stop: {domain: [released, pressed], initial: released}
  door: {domain: [closed, open], initial: closed, source: input}
  formed: {domain: bool, initial: false}
resources:
  ram: {simulation: {latency: 3 s}}
operations:
  form:
    pre: {g: stop == released && formed == false && ram_req_state == initial, a: [ram_req_trigger <- true]}
    post:
      g: true
      gr: ram_req_state == succeeded
      a: [formed <- true, ram_req_trigger <- false, ram_req_state <- initial]
    failed: {g: stop == pressed, a: [ram_req_trigger <- false]}
goals: {formed: formed == true}
environment:
"""


def press(*transitions: str) -> BehaviorModel:
    return read_model(
        PRESS
        + "".join(f"  {transition}\n" for transition in transitions)
        + "  none: {guard: 'false', actions: [stop <- pressed]}\n"
    )


def run(model: BehaviorModel, **changes: object) -> Execution:
    case = Case("case", "formed", dict(model.goals)["formed"], model.nominal_state, origin=Origin(1))
    return Tester(model).execute(replace(case, **changes))


def moves(execution: Execution) -> list[tuple[float, str, dict[str, object]]]:
    records = (record for record in execution.trace.records if isinstance(record, MeasurementReceived))
    return [(record.at_ns / SECOND_NS, record.by, dict(record.changes)) for record in records]


def test_a_transition_fires_some_time_after_its_guard_became_true_and_once() -> None:
    model = press(
        "push: {guard: stop == released && formed == false, actions: [stop <- pressed], after: 2 s}",
        "reset: {guard: stop == pressed, actions: [stop <- released], after: 1 s}",
    )
    execution = run(model, environment=None)
    assert moves(execution)[:4] == [
        (2.0, "push", {"stop": "pressed"}),
        (3.0, "reset", {"stop": "released"}),
        (5.0, "push", {"stop": "pressed"}),
        (6.0, "reset", {"stop": "released"}),
    ]


def test_the_time_of_after_restarts_when_the_guard_turns_false() -> None:
    model = press(
        "open: {guard: true, actions: [door <- open], every: 1 s}",
        "shut: {guard: door == open, actions: [door <- closed], after: 500 ms}",
        "push: {guard: door == closed, actions: [stop <- pressed], after: 1.8 s}",
    )
    assert {by for _, by, _ in moves(run(model))} == {"open", "shut"}


def test_every_draws_again_after_each_time() -> None:
    model = press("swap: {guard: door == closed, actions: [door <- open], every: {uniform: [200 ms, 1 s]}}")
    model = replace(
        model,
        environment=(
            *model.environment,
            *press("shut: {guard: true, actions: [door <- closed], every: 150 ms}").environment[:1],
        ),
    )
    times = [at for at, by, _ in moves(run(model)) if by == "swap"]
    assert len(times) > 2
    assert len({round(later - earlier, 6) for earlier, later in pairwise(times)}) > 1


def test_too_many_changes_end_a_run_with_an_error_at_the_rate(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(environment_moves, "MAX_CHANGES", 10)
    push = "push: {guard: stop == released, actions: [stop <- pressed], after: 1 ms}"
    pull = "pull: {guard: stop == pressed, actions: [stop <- released], after: 1 ms}"
    model = press(push, pull)
    with pytest.raises(InputError, match="the environment made 10 changes in one run, the last of them by `") as caught:
        run(model, environment=None)
    (diagnostic,) = caught.value.diagnostics
    transition = (push, pull)[diagnostic.message.endswith("`pull`")]
    rate = (PRESS.count("\n") + (push, pull).index(transition) + 1, len("  ") + transition.index("after") + 1)
    assert (diagnostic.place.line, diagnostic.place.column) == rate
    wording(diagnostic.remedy)


def test_too_many_changes_of_an_input_without_a_rate_are_an_error_of_the_model(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(environment_moves, "MAX_CHANGES", 10)
    unreachable = PRESS.replace("formed <- true, ", "").replace("formed: {", "formed: {source: constant, ")
    model = read_model(unreachable.removesuffix("environment:\n"))
    with pytest.raises(InputError, match="the environment made 10 changes in one run") as caught:
        run(model, origin=Origin(1, moves_inputs=True), environment=None, limits=CaseLimits(time_ns=10**15))
    (diagnostic,) = caught.value.diagnostics
    assert str(diagnostic.place) == "press"
    wording(diagnostic.remedy)


def test_a_transition_without_a_rate_never_fires() -> None:
    assert moves(run(press("push: {guard: true, actions: [stop <- pressed]}"))) == []


def test_nothing_changes_in_a_plain_case() -> None:
    model = press("push: {guard: true, actions: [stop <- pressed], every: 1 s}")
    assert moves(run(model, origin=None)) == []


def test_a_run_for_which_no_plan_exists_waits_for_the_environment() -> None:
    model = press("reset: {guard: stop == pressed, actions: [stop <- released], after: 10 s}")
    pressed = model.nominal_state.replace({"stop": "pressed"})
    execution = run(model, initial=pressed)
    assert (execution.verdict.end, execution.ended_ns) == ("reached", 13 * SECOND_NS)
    forever = run(replace(model, environment=()), initial=pressed)
    assert (forever.verdict.end, forever.ended_ns) == ("unsolvable", 0)


def test_a_time_that_passes_without_an_effect_is_no_change() -> None:
    model = press("push: {guard: stop == released, actions: [stop <- pressed], every: 1 s}")
    execution = run(model, initial=model.nominal_state.replace({"stop": "pressed"}), limits=CaseLimits(4 * SECOND_NS))
    assert (execution.verdict.end, moves(execution)) == ("time_limit", [])


def test_a_wait_ends_when_no_change_is_pending() -> None:
    model = press("open: {guard: door == closed, actions: [door <- open], after: 4 s}")
    execution = run(model, initial=model.nominal_state.replace({"stop": "pressed"}))
    assert (execution.verdict.end, execution.ended_ns) == ("unsolvable", 4 * SECOND_NS)


def test_the_change_for_which_a_run_waited_until_its_end_is_recorded_and_no_other() -> None:
    model = press("reset: {guard: stop == pressed, actions: [stop <- released], after: 10 s}")
    pressed = model.nominal_state.replace({"stop": "pressed"})
    waited = run(model, initial=pressed, limits=CaseLimits(4 * SECOND_NS))
    assert waited.recorded_case.environment == (EnvironmentChange(10 * SECOND_NS, ()),)
    again = Tester(model).execute(waited.recorded_case)
    assert (waited.verdict.end, again.trace) == ("time_limit", waited.trace)
    formed = run(press("late: {guard: true, actions: [door <- open], after: 10 s}"))
    assert (formed.verdict.end, formed.recorded_case.environment) == ("reached", ())


@pytest.mark.parametrize("is_last", [False, True])
def test_a_goal_that_waited_until_its_limit_is_replayed_alike(is_last: bool) -> None:  # noqa: FBT001 - as below
    model = press("reset: {guard: stop == pressed, actions: [stop <- released], after: 10 s}")
    pressed = model.nominal_state.replace({"stop": "pressed"})
    missed, held = dict(model.goals)["formed"], Equal(Reference("stop"), Constant("pressed"))
    unsolved, easy = CaseGoal("formed", missed), CaseGoal("pressed", held)
    late = replace(unsolved, when=Equal(Reference("stop"), Constant("released")))
    goals = [easy, late] if is_last else [unsolved, easy]
    case = Case("case", "", missed, pressed, origin=Origin(1), limits=CaseLimits(4 * SECOND_NS)).with_goals(goals)
    waited = Tester(model).execute(case)
    ends = [ended.end for ended in ends_of(waited.trace.records)]
    assert ends == (["reached", "not_started"] if is_last else ["time_limit", "reached"])
    assert Tester(model).execute(waited.recorded_case).trace == waited.trace


def test_a_wait_ends_when_a_transition_has_fired_whose_guard_stays_true() -> None:
    execution = run(press("push: {guard: true, actions: [stop <- pressed], after: 1 s}"))
    assert (execution.verdict.end, execution.ended_ns) == ("unsolvable", SECOND_NS)


def test_a_wait_ends_when_the_last_clock_is_stopped() -> None:
    release = "release: {guard: stop == pressed && door == closed, actions: [door <- open], after: 1 s}"
    sticks = "sticks: {guard: door == closed, actions: [stop <- released], after: 100 s}"
    model = press(release, sticks)
    execution = run(model, initial=model.nominal_state.replace({"stop": "pressed"}))
    assert (execution.verdict.end, execution.ended_ns) == ("unsolvable", SECOND_NS)
    assert [change.by for change in execution.recorded_case.environment or ()] == ["release"]


def test_the_trace_names_the_transition_and_is_written_and_read() -> None:
    model = press("push: {guard: true, actions: [stop <- pressed], after: 1 s}")
    execution = run(model)
    (record,) = [record for record in execution.trace.records if isinstance(record, MeasurementReceived)]
    assert sentence_of(record, model.nominal_state).text == "environment push"
    assert '"by":"push"' in write_trace(execution.trace)
    assert sentence_of(MeasurementReceived(0, ()), model.nominal_state).text == "from outside: no change"


@pytest.mark.slow
@pytest.mark.parametrize("moves_inputs", [False, True])
def test_a_recorded_case_gives_the_same_trace(moves_inputs: bool) -> None:  # noqa: FBT001 - pytest gives it by name
    model = press(
        "push: {guard: stop == released, actions: [stop <- pressed], every: {exponential: 2 s}}",
        "reset: {guard: stop == pressed, actions: [stop <- released], after: 1 s}",
    )
    tester, changed = Tester(model), 0
    for case in RandomCases(model, moves_inputs=moves_inputs).first(60, 1):
        execution = tester.execute(case)
        text = write_case(execution.recorded_case, model, None)
        recorded = read_case(text, model)
        assert read_case(write_case(case, model, None), model) == case
        assert tester.execute(replace(recorded, origin=None)).digest == execution.digest, text
        changed += len(moves(execution))
    assert changed > 30


def test_drawn_inputs_move_what_no_transition_assigns() -> None:
    model = press("push: {guard: stop == released, actions: [stop <- pressed], every: {exponential: 2 min}}")
    drawn = [each for number in range(40) for each in moves(run(model, origin=Origin(1, number, moves_inputs=True)))]
    assert {name for _, by, changes in drawn if not by for name in changes} == {"door"}


def test_a_case_says_what_the_environment_does() -> None:
    model = press(
        "push: {guard: true, actions: [stop <- pressed]}", "pull: {guard: stop == pressed, actions: [stop <- released]}"
    )
    changes = (
        EnvironmentChange(SECOND_NS, (("stop", "pressed"),), "push"),
        EnvironmentChange(2 * SECOND_NS, (("stop", "released"),)),
    )
    execution = run(model, origin=None, environment=changes)
    assert moves(execution) == [(1.0, "push", {"stop": "pressed"}), (2.0, "pull", {"stop": "released"})]
    assert execution.closed_case.environment == changes
    assert (execution.forced, execution.forced_by) == (0, None)


# shared resources


OCCUPIED = Condition(CONDITIONS["occupied"])


def shared_cell() -> BehaviorModel:
    return scan_cell(("    request: [scan_command]\n", "    request: [scan_command]\n    shared: true\n"))


def test_another_user_occupies_a_shared_resource_before_the_goal_and_leaves_it() -> None:
    hand = Hand(shared_cell())
    hand.inject(Injection("other", resource="scan", condition=OCCUPIED, hold_ns=4 * SECOND_NS))
    hand.goal()
    assert hand.runner.state["scan_req_state"] == "executing"
    hand.wait(4)
    assert hand.lifecycle == ["scan_box executing"]
    assert [type(r) for r in hand.records if isinstance(r, (InjectionApplied, PutBack))] == [InjectionApplied, PutBack]
    (started,) = [record for record in hand.records if isinstance(record, RunStarted)]
    assert dict(started.state)["scan_req_state"] == "executing"


def test_another_user_waits_while_a_request_of_the_controller_is_in_flight() -> None:
    hand = Hand(shared_cell())
    hand.goal()
    hand.inject(Injection("other", at_ns=2 * SECOND_NS, resource="scan", condition=OCCUPIED))
    hand.wait(2)
    assert not [record for record in hand.records if isinstance(record, InjectionApplied)]
    hand.reply(1, 5)
    assert hand.ends == ["reached"]
    assert hand.runner.state["scan_req_state"] == "executing"


def test_another_user_acts_only_where_the_runner_is_settled() -> None:
    hand = Hand(shared_cell())
    current = Equal(Reference("current.name"), Constant("scan_box"))
    hand.inject(Injection("other", when=current, resource="scan", condition=OCCUPIED))
    hand.goal()
    assert hand.lifecycle == ["scan_box executing"]
    assert not [record for record in hand.records if isinstance(record, InjectionApplied)]


def test_a_resource_that_is_not_shared_hides_from_the_model_that_it_is_occupied() -> None:
    hand = Hand(scan_cell())
    hand.inject(Injection("other", resource="scan", condition=OCCUPIED))
    assert hand.runner.state["scan_req_state"] == "initial"


def test_an_occupied_shared_resource_forces_nothing() -> None:
    model = shared_cell()
    case = Case("case", "scanned", dict(model.goals)["scanned"], model.nominal_state)
    other = Injection("other", resource="scan", condition=OCCUPIED, hold_ns=SECOND_NS)
    execution = Tester(model).execute(replace(case, injections=(other,)))
    assert (execution.verdict.end, execution.ended_ns, execution.forced) == ("reached", SECOND_NS, 0)


@pytest.mark.parametrize(
    ("goals", "first"),
    [
        ("goal: formed", ["injection", "run_started"]),
        ("goals: [{goal: formed, when: door == open}]", ["injection", "measurement", "run_started"]),
        ("goals: [{goal: formed}, {goal: formed}]", ["injection", "run_started"]),
    ],
)
def test_a_change_that_is_due_at_once_comes_after_the_goals_are_given(goals: str, first: list[str]) -> None:
    injected = "injections: [{set: {ram_req_state: failed}}]\nenvironment: [{when: true, set: {door: open}}]\n"
    records = Tester(press()).execute(read_case(f"case: x\n{goals}\n{injected}", press())).trace.records
    kinds = [record.kind for record in records if record.kind in ("injection", "measurement", "run_started")]
    assert kinds[: len(first)] == first


def test_an_entry_that_sets_several_inputs_is_several_changes() -> None:
    model = press(
        "open: {guard: 'true', actions: [door <- open]}",
        "push: {guard: door == open, actions: [stop <- pressed]}",
        "lift: {guard: 'true', actions: [stop <- released, door <- closed]}",
    )
    listed = "[{at: 1 s, set: {door: open, stop: pressed}}, {at: 2 s, set: {door: closed, stop: released}}]"
    execution = Tester(model).execute(read_case(f"case: x\ngoal: formed\nenvironment: {listed}\n", model))
    assert moves(execution) == [
        (1.0, "open", {"door": "open"}),
        (1.0, "push", {"stop": "pressed"}),
        (2.0, "lift", {"door": "closed", "stop": "released"}),
    ]


def test_a_run_without_a_plan_ends_after_the_last_change_of_its_case() -> None:
    model = press()
    changes = tuple(
        EnvironmentChange(seconds * SECOND_NS, (("door", door),)) for seconds, door in [(2, "open"), (5, "closed")]
    )
    execution = run(model, initial=model.nominal_state.replace({"stop": "pressed"}), environment=changes)
    (ended,) = ends_of(execution.trace.records)
    assert (ended.end, ended.at_ns) == ("unsolvable", 5 * SECOND_NS)
