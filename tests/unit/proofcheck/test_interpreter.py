"""Steps of the interpreter that random models seldom take. That it does what the runner does is a property test."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from scbm.files import read_model
from scbm.model import BehaviorModel, GoalOrder, Role, Value
from scbm.proofcheck import Awaits, Situation, checked_run
from scbm.proofcheck.checked_run import CheckedStep, DeadlineEvent, GivingUp, OutsideEvent, PlannerAnswer, ReplyEvent
from scbm.proofcheck.interpreter import Interpreter
from scbm.running import RunnerOptions
from support.models import as_closed
from support.wording import Wording

LAMP = """
behavior_model: lamp
variables:
  lamp: {domain: [dark, lit], initial: dark}
  seen: {domain: 0..2, initial: 0}
resources:
  eye: {measures: [seen]}
operations:
  light:
    deadline: 5 s
    pre: {g: lamp == dark && seen == 1}
    post: {g: true, a: [lamp <- lit]}
goals:
  lit: lamp == lit
automatic_transitions:
"""
LOOKS = "  looks: {g: plan.state == planning && eye_req_state == initial, a: [eye_req_trigger <- true]}\n"


BLINKS = """\
  on: {g: plan.state != idle && lamp == dark && seen == 2, a: [lamp <- lit]}
  off: {g: lamp == lit, a: [lamp <- dark]}
"""


def interpreter(text: str, goals: GoalOrder = GoalOrder.SINGLE) -> tuple[Interpreter, BehaviorModel]:
    model = as_closed(read_model(text))
    variables = [variable.name for variable in model.running_space if variable.role is not Role.OPERATION_STATE]
    return Interpreter(model, model.goals[0][1], variables, goals), model


def first_step(steps: Interpreter, state: Mapping[str, Value]) -> CheckedStep:
    """The step in which the goal is given to a runner that has settled."""
    (rest,) = steps.start(state).rests
    return steps.begin(rest)


def begun(automatic: str, **state: Value) -> tuple[Interpreter, Situation | None, tuple[str, ...]]:
    steps, model = interpreter(LAMP + automatic)
    step = first_step(steps, {**model.nominal_state, **state})
    return steps, step.situation, step.visited


def test_a_reply_can_come_while_a_plan_is_awaited(wording: Wording) -> None:
    steps, asked, visited = begun(LOOKS)
    assert asked == Situation(
        ("dark", 0, True, "executing", "none", "initial", "planning"), None, ("eye",), Awaits.UNSOLVABLE
    )
    assert visited == ("automatic/looks",)
    replies = [ReplyEvent("eye", ok, measured=(("seen", value),)) for value in (0, 1, 2) for ok in (True, False)]
    assert list(steps.events(asked)) == [*replies, PlannerAnswer()]
    wording(steps.events(asked))


def test_an_answer_from_another_state_is_asked_for_again_at_once() -> None:
    """The reply is the last thing in flight. The planner still says that there is no plan, and is asked once more."""
    steps, asked, _ = begun(LOOKS)
    assert asked is not None
    step = steps.after(asked, ReplyEvent("eye", succeeded=True, measured=(("seen", 1),)))
    assert step.situation is None  # it finds one now, and all is done at this moment
    assert step.visited == ("light/queued", "light/executing", "light/completed")


def test_while_requests_are_in_flight_a_run_waits_for_another_state() -> None:
    steps, asked, _ = begun(LOOKS)
    assert asked is not None
    waiting = steps.after(asked, PlannerAnswer()).situation
    assert waiting is not None
    assert waiting.awaits is Awaits.CHANGE
    assert steps.after(waiting, ReplyEvent("eye", succeeded=False)).values["plan.state"] == "unsolvable"
    assert steps.after(waiting, ReplyEvent("eye", succeeded=True, measured=(("seen", 1),))).visited[0] == "light/queued"


def test_a_run_that_waits_for_another_state_does_not_ask_again_in_the_same_one() -> None:
    again = "  again: {g: eye_req_state == failed, a: [eye_req_state <- initial]}\n"
    steps, asked, _ = begun(LOOKS + again)
    assert asked is not None
    waiting = steps.after(asked, PlannerAnswer()).situation
    assert waiting is not None
    assert waiting.awaits is Awaits.CHANGE
    assert steps.after(waiting, ReplyEvent("eye", succeeded=False)).situation == waiting


def test_the_rest_of_a_plan_is_given_up_when_an_operation_times_out() -> None:
    text = LAMP.replace(
        "a: [lamp <- lit]}", "gr: eye_req_state == succeeded, a: [lamp <- lit]}\n    timedout: [seen <- 2]"
    )
    paint = "  paint: {pre: {g: lamp == lit}, post: {g: true, a: [seen <- 0]}}\n"
    text = text.replace(
        "goals:\n  lit: lamp == lit\nautomatic_transitions:\n", f"{paint}goals:\n  done: seen == 0 && lamp == lit\n"
    )
    steps, model = interpreter(text)
    step = first_step(steps, {**model.nominal_state, "seen": 1})
    assert step.situation is not None
    assert step.situation.queue == ("paint",)
    ended = steps.after(step.situation, DeadlineEvent())  # there is no plan from where `seen` is 2
    assert ended.visited == ("light/timedout",)
    assert ended.values["plan.state"] == "unsolvable"


def test_the_answer_to_a_question_asked_before_something_changed_is_stale() -> None:
    again = "  again: {g: eye_req_state == failed, a: [eye_req_state <- initial, seen <- 2]}\n"
    steps, asked, _ = begun(LOOKS + again)
    assert asked is not None
    stale = steps.after(asked, ReplyEvent("eye", succeeded=False)).situation
    assert stale == Situation(
        ("dark", 2, True, "executing", "none", "initial", "planning"), None, ("eye",), Awaits.STALE
    )
    assert PlannerAnswer() in list(steps.events(stale))
    asked_again = steps.after(stale, PlannerAnswer()).situation
    assert asked_again == Situation(stale.values, None, ("eye",), Awaits.UNSOLVABLE)
    assert steps.after(asked_again, ReplyEvent("eye", succeeded=False)).situation == asked_again  # nothing changed


def test_replans_that_lead_nowhere_go_round_and_end_for_all_that_can_be_visited() -> None:
    burns_out = "  burns_out: {g: lamp == lit, a: [lamp <- dark]}\n"
    _, situation, visited = begun(burns_out, seen=1)
    assert situation is None
    assert visited == ("light/queued", "light/executing", "light/completed", "automatic/burns_out")


def test_automatic_transitions_without_end_are_a_livelock() -> None:
    steps, model = interpreter(LAMP.replace("lit: lamp == lit", "lit: lamp == lit && seen == 1") + BLINKS)
    step = first_step(steps, {**model.nominal_state, "seen": 2})
    assert step.situation is None
    assert step.values["plan.state"] == "aborted"
    assert step.visited == ("automatic/on", "automatic/off")


def test_automatic_transitions_follow_the_end_by_a_livelock() -> None:
    ends = "  ends: {g: plan.state == aborted && seen == 2, a: [seen <- 0]}\n"
    _, _, visited = begun(ends + BLINKS, seen=2)
    assert visited == ("automatic/on", "automatic/off", "automatic/ends")


def test_timedout_actions_that_do_not_fit_are_a_model_error() -> None:
    text = LAMP.replace("a: [lamp <- lit]}", "gr: lamp == lit, a: [lamp <- lit]}\n    timedout: [seen += 2]")
    steps, model = interpreter(text.replace("automatic_transitions:\n", ""))
    step = first_step(steps, {**model.nominal_state, "seen": 1})
    assert step.situation is not None
    assert list(steps.events(step.situation)) == [DeadlineEvent()]
    ended = steps.after(step.situation, DeadlineEvent())
    assert ended.situation is None
    assert ended.visited == ()
    assert ended.values["plan.state"] == "aborted"


def test_the_rest_of_a_plan_is_given_up_at_the_disabled_deadline() -> None:
    text = LAMP.replace("deadline: 5 s", "disabled_deadline: 2 s").replace(
        "seen == 1}", "seen == 1, gr: eye_req_state == succeeded}"
    )
    paint = "  paint: {pre: {g: lamp == lit}, post: {g: true, a: [seen <- 0]}}\n"
    text = text.replace(
        "goals:\n  lit: lamp == lit\nautomatic_transitions:\n", f"{paint}goals:\n  done: seen == 0 && lamp == lit\n"
    )
    steps, model = interpreter(text)
    situation = first_step(steps, {**model.nominal_state, "seen": 1}).situation
    assert situation is not None
    assert situation.queue == ("paint",)
    step = steps.after(situation, DeadlineEvent())
    assert step.visited == ("light/queued", "paint/queued", "light/disabled")
    assert step.situation == situation


def test_changes_from_outside_after_the_end_belong_to_the_run() -> None:
    """The goal holds, so the run ends at once. The key turns twice before both transitions have been taken."""
    text = LAMP.replace("resources:", "  key: {domain: [off, on, far], initial: off, source: input}\nresources:")
    burns_out = "  burns_out: {g: plan.state == completed && key == on && seen == 0, a: [seen <- 1]}\n"
    breaks = "  breaks: {g: plan.state == completed && key == far && seen == 1, a: [seen <- 2]}\n"
    steps, model = interpreter(text + burns_out + breaks)
    step = first_step(steps, {**model.nominal_state, "lamp": "lit"})
    assert step.situation is None
    assert step.visited == ("automatic/burns_out", "automatic/breaks")


def test_a_run_can_end_as_unsolvable_though_something_may_change_from_outside() -> None:
    text = LAMP.replace("resources:", "  key: {domain: [off, on], initial: off, source: input}\nresources:")
    steps, model = interpreter(text + "  regrets: {g: plan.state == unsolvable && key == off, a: [seen <- 2]}\n")
    asked = first_step(steps, model.nominal_state).situation
    assert asked is not None
    assert asked.awaits is Awaits.UNSOLVABLE
    assert GivingUp() not in list(steps.events(asked))
    waiting = steps.after(asked, PlannerAnswer()).situation
    assert waiting is not None
    assert waiting.awaits is Awaits.CHANGE
    assert GivingUp() in list(steps.events(waiting))
    ended = steps.after(waiting, GivingUp())
    assert ended.situation is None
    assert ended.values["plan.state"] == "unsolvable"
    assert ended.visited == ("automatic/regrets",)


def test_a_change_that_the_planner_does_not_read_leads_to_no_new_question() -> None:
    """The planner reads `seen`, not `key`."""
    text = LAMP.replace("resources:", "  key: {domain: [off, on], initial: off, source: input}\nresources:")
    steps, model = interpreter(text + "  sees: {g: key == on && seen == 0 && lamp == lit, a: [seen <- 1]}\n")
    asked = first_step(steps, model.nominal_state).situation
    assert asked is not None
    turned = steps.after(asked, OutsideEvent((("key", "on"),))).situation
    assert turned is not None
    assert turned.awaits is Awaits.UNSOLVABLE
    waiting = steps.after(turned, PlannerAnswer()).situation
    assert waiting is not None
    assert waiting.awaits is Awaits.CHANGE
    turned_back = steps.after(waiting, OutsideEvent((("key", "off"),))).situation
    assert turned_back is not None
    assert turned_back.awaits is Awaits.CHANGE


def test_nothing_is_sent_after_the_end_of_a_run() -> None:
    """The goal holds, so the run ends at once. Then the key turns, and triggers a request."""
    text = LAMP.replace("resources:", "  key: {domain: [off, on], initial: off, source: input}\nresources:")
    looks_again = "  looks_again: {g: plan.state == completed && key == on, a: [eye_req_trigger <- true]}\n"
    is_sent = "  is_sent: {g: plan.state == completed && eye_req_state == executing, a: [seen <- 2]}\n"
    steps, model = interpreter(text + looks_again + is_sent)
    step = first_step(steps, {**model.nominal_state, "lamp": "lit"})
    assert step.visited == ("automatic/looks_again",)


def test_automatic_transitions_are_counted_anew_after_each_event(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two of them come before the answer of the planner, and two after it. Nothing else happens, so it is one step."""
    monkeypatch.setattr("scbm.proofcheck.checked_run.MAX_AUTOMATIC", 3)
    before = [
        "plan.state == planning && seen == 0, a: [seen <- 1]",
        "plan.state == planning && lamp == lit, a: [lamp <- dark]",
    ]
    after = ["lamp == lit && seen == 1, a: [seen <- 2]", "lamp == lit && seen == 2, a: [seen <- 0]"]
    text = "".join(
        f"  t{n}: {{g: {guard}}}\n"
        for n, guard in enumerate((*before, *(f"light.state == completed && {g}" for g in after)))
    )
    _, situation, visited = begun(text, lamp="lit")
    assert situation is None
    assert visited == (
        "automatic/t0",
        "automatic/t1",
        "light/queued",
        "light/executing",
        "light/completed",
        "automatic/t2",
        "automatic/t3",
    )


TURNS = """
behavior_model: turns
variables:
  at: {domain: 0..3, initial: 0}
  copy: {domain: 0..3, initial: 0}
  marks: {domain: 0..3, initial: 0}
  light: {domain: [off, on, far, seen], initial: off}
operations:
  slip:
    pre: {g: at == 0}
    post: {g: true, gr: at == 3, a: [at <- 1]}
    failed: {g: true, a: [at <- 1]}
  go: {pre: {g: at == 1}, post: {g: true, a: [at <- 2]}}
  arrive: {pre: {g: at == 2}, post: {g: true, a: [at <- 3]}}
automatic_transitions:
  follow: {g: copy < at, a: [copy += 1]}
  mark: {g: marks < copy, a: [marks += 1]}
  on: {g: plan.state == planning && at == 1 && light == off, a: [light <- on]}
  far: {g: light == on, a: [light <- far]}
  again: {g: plan.state == executing && light == far, a: [light <- seen]}
goals: {there: at == 3}
"""
"""`slip` fails. Two automatic transitions follow it, two the request for the next plan, one its answer, and two each of
its operations."""


@pytest.mark.parametrize(("bound", "end"), [(2, "completed"), (1, "aborted")])
def test_automatic_transitions_are_counted_anew_for_each_operation_and_each_plan(
    monkeypatch: pytest.MonkeyPatch, bound: int, end: str
) -> None:
    monkeypatch.setattr("scbm.proofcheck.checked_run.MAX_AUTOMATIC", bound)
    steps, model = interpreter(TURNS)
    assert first_step(steps, model.nominal_state).values["plan.state"] == end


def test_a_run_ends_as_a_livelock_where_the_runner_ends_it() -> None:
    assert RunnerOptions().livelock_bound == checked_run.MAX_AUTOMATIC


# the order of micro-steps, and what fails an operation


def test_the_rest_of_a_plan_is_given_up_when_an_operation_fails() -> None:
    text = LAMP.replace("seen == 1}", "seen == 1, a: [eye_req_trigger <- true]}").replace(
        "a: [lamp <- lit]}",
        "gr: eye_req_state == succeeded, a: [lamp <- lit]}\n    failed: {g: eye_req_state == failed, a: [seen <- 2]}",
    )
    paint = "  paint: {pre: {g: lamp == lit}, post: {g: true, a: [seen <- 0]}}\n"
    text = text.replace(
        "goals:\n  lit: lamp == lit\nautomatic_transitions:\n", f"{paint}goals:\n  done: seen == 0 && lamp == lit\n"
    )
    steps, model = interpreter(text)
    situation = first_step(steps, {**model.nominal_state, "seen": 1}).situation
    assert situation is not None
    assert situation.queue == ("paint",)
    assert steps.after(situation, ReplyEvent("eye", succeeded=False)).visited == ("light/failed",)


def test_nothing_fails_an_operation_that_does_not_execute() -> None:
    for state in ("current.state", "light.state"):
        _, _, visited = begun(f"  breaks: {{g: seen == 2, a: [{state} <- failed]}}\n", seen=2)
        assert visited == ()


@pytest.mark.parametrize("state", ["current.state", "light.state"])
def test_an_automatic_transition_that_only_fails_the_operation_is_taken(state: str) -> None:
    _, _, visited = begun(f"  breaks: {{g: lamp == dark, a: [{state} <- failed]}}\n", seen=1)
    assert visited == ("light/queued", "light/executing", "automatic/breaks", "light/failed")


def test_an_automatic_transition_comes_before_the_end_of_an_aborted_run() -> None:
    stops = "  stops: {g: light.state == executing, a: [plan.state <- aborted]}\n"
    tidies = "  tidies: {g: plan.state == aborted && current.name == light, a: [seen <- 0]}\n"
    _, situation, visited = begun(stops + tidies, seen=1)
    assert situation is None
    assert visited == ("light/queued", "light/executing", "automatic/stops", "automatic/tidies")


def test_each_request_in_flight_can_get_a_reply() -> None:
    text = LAMP.replace("  eye: {measures: [seen]}\n", "  eye: {}\n  arm: {}\n")
    looks = "  looks: {g: eye_req_trigger == false, a: [eye_req_trigger <- true, arm_req_trigger <- true]}\n"
    steps, model = interpreter(text + looks)
    asked = first_step(steps, model.nominal_state).situation
    assert asked is not None
    assert asked.in_flight == ("eye", "arm")
    replies = [ReplyEvent(name, succeeded=ok) for name in asked.in_flight for ok in (True, False)]
    assert list(steps.events(asked)) == [*replies, PlannerAnswer()]


SHARED_EYE = LAMP.replace("{measures: [seen]}", "{shared: true}")


def test_no_other_user_leaves_a_resource_that_has_a_request_in_flight() -> None:
    steps, model = interpreter(SHARED_EYE + LOOKS)
    asked = first_step(steps, model.nominal_state).situation
    assert asked is not None
    assert asked.in_flight == ("eye",)
    assert [each for each in steps.events(asked) if isinstance(each, OutsideEvent)] == []


def test_the_end_of_a_run_does_not_free_a_resource_that_another_user_occupies() -> None:
    steps, model = interpreter(SHARED_EYE.replace("automatic_transitions:\n", ""))
    (rest,) = steps.start({**model.nominal_state, "lamp": "lit"}).rests
    (occupied,) = steps.at_rest(rest)
    assert occupied.values["eye_req_state"] == "executing"
    ended = steps.begin(occupied.values)
    assert ended.situation is None
    assert (ended.values["plan.state"], ended.values["eye_req_state"]) == ("completed", "executing")


def test_a_goal_is_not_reached_while_an_operation_executes() -> None:
    text = LAMP.replace("a: [lamp <- lit]}", "gr: seen == 2, a: [lamp <- lit]}")
    steps, model = interpreter(text + "  early: {g: light.state == executing, a: [lamp <- lit]}\n")
    step = first_step(steps, {**model.nominal_state, "seen": 1})
    assert step.visited == ("light/queued", "light/executing", "automatic/early")
    assert step.situation is not None
    assert list(steps.events(step.situation)) == [DeadlineEvent()]


def test_an_operation_that_could_complete_and_fail_completes() -> None:
    text = LAMP.replace("    post:", "    failed: {g: true}\n    post:").replace("automatic_transitions:\n", "")
    steps, model = interpreter(text)
    step = first_step(steps, {**model.nominal_state, "seen": 1})
    assert step.visited == ("light/queued", "light/executing", "light/completed")


def test_a_request_that_is_sent_anew_cancels_the_one_in_flight() -> None:
    anew = "  anew: {g: eye_req_state == executing && seen == 0, a: [eye_req_state <- initial, seen <- 2]}\n"
    _, asked, visited = begun(LOOKS + anew)
    assert asked is not None
    assert (visited, asked.in_flight) == (("automatic/looks", "automatic/anew"), ("eye",))


def test_a_request_is_sent_before_another_one_is_cancelled() -> None:
    both = "  both: {g: eye_req_state == executing && arm_req_state == executing && seen == 2, a: [lamp <- lit]}\n"
    swaps = "  swaps: {g: seen == 2, a: [eye_req_trigger <- false, arm_req_trigger <- true]}\n"
    steps, model = interpreter(
        LAMP.replace("  eye: {measures: [seen]}\n", "  eye: {measures: [seen]}\n  arm: {}\n  see: {measures: [seen]}\n")
        + swaps + both
        + "  looks: {g: plan.state == planning && eye_req_state == initial && seen == 0,"
        " a: [eye_req_trigger <- true, see_req_trigger <- true]}\n"
    )  # fmt: skip
    asked = first_step(steps, model.nominal_state).situation
    assert asked is not None
    assert asked.in_flight == ("eye", "see")
    step = steps.after(asked, ReplyEvent("see", succeeded=True, measured=(("seen", 2),)))
    assert step.visited == ("automatic/swaps", "automatic/both")


def test_a_request_is_sent_before_the_run_reaches_its_goal() -> None:
    looks = "  looks: {g: plan.state == planning && seen == 0, a: [eye_req_trigger <- true, seen <- 1]}\n"
    is_sent = "  is_sent: {g: eye_req_state == executing, a: [seen <- 2]}\n"
    _, situation, visited = begun(looks + is_sent, lamp="lit")
    assert situation is None
    assert visited == ("automatic/looks", "automatic/is_sent")


def test_a_livelock_at_rest_has_no_rest_from_which_a_goal_could_be_given() -> None:
    steps, model = interpreter(LAMP + BLINKS.replace("plan.state != idle && ", ""))
    step = steps.start({**model.nominal_state, "seen": 2})
    assert (step.situation, step.rests, step.visited) == (None, (), ("automatic/on", "automatic/off"))


def test_no_goal_follows_a_livelock_after_the_end_of_a_run() -> None:
    blinks = BLINKS.replace("!= idle", "== completed").replace(
        "g: lamp == lit", "g: plan.state == completed && lamp == lit"
    )
    steps, model = interpreter(LAMP + blinks, GoalOrder.SEQUENCE)
    step = first_step(steps, {**model.nominal_state, "lamp": "lit", "seen": 2})
    assert (step.situation, step.rests, step.visited) == (None, (), ("automatic/off", "automatic/on"))
