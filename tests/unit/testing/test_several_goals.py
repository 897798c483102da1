"""Cases with several goals: their runs, verdicts, replays, shrunk forms and views (semantics 5.7, 7.4)."""

from __future__ import annotations

import re
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import pytest
from msgspec.structs import replace

from conftest import Ran
from scbm.cases import Case, CaseGoal, CaseLimits, Expectations, Injection, OutcomeRule
from scbm.cases.coverage import visited_by
from scbm.cases.trace import End, RunEnded, RunStarted, ends_of, ranges_of_goals, read_trace, write_trace
from scbm.files import digest_of, parse_predicate, read_case, read_model, write_case
from scbm.files.language.scope import Scope, Where
from scbm.model import BehaviorModel, Outcome, Predicate
from scbm.reports.run.mcap_trace import write_mcap
from scbm.reports.run.perfetto import write_perfetto
from scbm.reports.terminal.timeline import timeline
from scbm.running import Program
from scbm.store import Replays, read_history, write_store, written_recipe
from scbm.testing import Excuse, Execution, Shrinker, Tester
from scbm.testing.event_logs.event_log import read_event_log, rerun, write_event_log
from support.nodes import Stage, run_cases
from support.stores import a_run
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording, paragraphs

SECOND_NS = 1_000_000_000

CELL = """\
behavior_model: stopping
variables:
  at: {domain: [home, box], initial: home}
  estop: {domain: [released, pressed], initial: released, source: input}
resources:
  arm: {simulation: {latency: 2 s}}
operations:
  go:
    deadline: 10 s
    pre: {g: at == home, gr: estop == released, a: [arm_req_trigger <- true]}
    post: {g: true, gr: arm_req_state == succeeded, a: [at <- box, arm_req_trigger <- false, arm_req_state <- initial]}
    timedout: [arm_req_trigger <- false]
  back:
    deadline: 10 s
    pre: {g: at == box, gr: estop == released, a: [arm_req_trigger <- true]}
    post: {g: true, gr: arm_req_state == succeeded, a: [at <- home, arm_req_trigger <- false, arm_req_state <- initial]}
    timedout: [arm_req_trigger <- false]
automatic_transitions:
  stop: {g: estop == pressed && current.state == executing, a: [plan.state <- aborted]}
goals:
  there: at == box
  home: at == home
"""
MODEL = read_model(CELL)


def predicate(text: str, model: BehaviorModel = MODEL) -> Predicate:
    return parse_predicate(text, Scope.of(model), Where.GUARD)


def goal(name: str, when: str | None = None, *may_end: End, **expected: object) -> CaseGoal:
    wanted = MODEL.goal(name)
    assert wanted is not None
    expect = Expectations(**expected)  # type: ignore[arg-type]  # the fields of it
    return CaseGoal(name, wanted, None if when is None else predicate(when), expect, may_end)


def case_of(*goals: CaseGoal, injections: tuple[Injection, ...] = (), limits: CaseLimits = CaseLimits()) -> Case:  # noqa: B008 - an immutable value
    first, *_ = goals
    case = Case("case", first.name, first.predicate, MODEL.nominal_state, injections=injections, limits=limits)
    return case.with_goals(goals)


def run(*goals: CaseGoal, **parts: object) -> Execution:
    return Tester(MODEL).execute(case_of(*goals, **parts))  # type: ignore[arg-type]  # as of `case_of`


def ends(execution: Execution) -> list[tuple[str, str, float]]:
    return [(end.goal, end.end, end.at_ns / SECOND_NS) for end in ends_of(execution.trace.records)]


PRESS = Injection("press", (("estop", "pressed"),), predicate("go.state == executing"), after_ns=SECOND_NS)
RELEASE = Injection("release", (("estop", "released"),), predicate("estop == pressed"), after_ns=5 * SECOND_NS)


# runs


def test_the_next_goal_begins_as_soon_as_the_run_before_has_ended() -> None:
    execution = run(goal("there"), goal("home"), goal("there"))
    assert ends(execution) == [("there", "reached", 2), ("home", "reached", 4), ("there", "reached", 6)]
    assert execution.verdict.passed
    assert execution.ended_ns == 6 * SECOND_NS
    starts = [record for record in execution.trace.records if isinstance(record, RunStarted)]
    assert [record.at_ns for record in starts] == [0, 2 * SECOND_NS, 4 * SECOND_NS]


def test_a_stop_a_reset_and_a_resume_are_one_case(wording: Wording) -> None:
    execution = run(goal("there"), goal("there", "estop == released"), injections=(PRESS, RELEASE))
    assert ends(execution) == [("there", "aborted", 1), ("there", "reached", 8)]
    assert execution.verdict.passed
    assert execution.verdict.excuses == (Excuse.FAULT,)
    wording(execution.verdict.end_in_words)


def test_goals_that_hold_already_are_reached_at_once() -> None:
    assert ends(run(goal("home"), goal("home"))) == [("home", "reached", 0), ("home", "reached", 0)]


def test_a_goal_whose_predicate_never_holds_does_not_begin_and_fails_the_case(wording: Wording) -> None:
    execution = run(goal("there"), goal("home", "estop == pressed"), goal("home"))
    assert ends(execution) == [("there", "reached", 2), ("home", "not_started", 2), ("home", "reached", 4)]
    (failure,) = execution.verdict.failures
    assert execution.verdict.end is End.REACHED
    wording((failure, execution.verdict.end_in_words))


def test_a_fault_does_not_excuse_a_goal_that_does_not_begin_but_may_end_and_an_expectation_do() -> None:
    late = Injection("late", (("estop", "pressed"),), predicate("at == box && plan.state == executing"))
    waits = "estop == released"
    assert not run(goal("there"), goal("home", waits), injections=(late,)).verdict.passed
    listed = run(goal("there"), goal("home", waits, End.NOT_STARTED), injections=(late,)).verdict
    assert (listed.passed, listed.excuses) == (True, (Excuse.MAY_END,))
    assert run(goal("there"), goal("home", waits, verdict=End.NOT_STARTED), injections=(late,)).verdict.passed


def test_a_goal_waits_for_its_predicate_no_longer_than_the_time_limit() -> None:
    later = Injection("press", (("estop", "pressed"),), at_ns=100 * SECOND_NS)
    waiting = goal("home", "estop == pressed")
    limits = CaseLimits(time_ns=20 * SECOND_NS)
    assert ends(run(goal("there"), waiting, injections=(later,), limits=limits))[1] == ("home", "not_started", 22)
    begun = run(goal("there"), waiting, injections=(later,))
    starts = [record.at_ns for record in begun.trace.records if isinstance(record, RunStarted)]
    assert starts == [0, 100 * SECOND_NS]


def test_the_limits_count_for_each_goal() -> None:
    limits = CaseLimits(time_ns=3 * SECOND_NS, plans=1)
    assert run(goal("there"), goal("home"), goal("there"), limits=limits).verdict.passed


def test_after_a_livelock_the_next_goal_begins() -> None:
    ring = "  blink: {g: estop == pressed && current.state == executing && at == home, a: [at <- box]}\n"
    back = "  unblink: {g: estop == pressed && current.state == executing && at == box, a: [at <- home]}\n"
    text = CELL.replace("automatic_transitions:\n", f"automatic_transitions:\n{ring}{back}")
    model = read_model(text)
    case = read_case("case: c\ngoals: [{goal: there}, {goal: home}]\n", model)
    press = Injection("press", (("estop", "pressed"),), predicate("go.state == executing", model))
    execution = Tester(model).execute(replace(case, injections=(press,)))
    found = [record.end for record in ends_of(execution.trace.records)]
    assert found[0] == "livelock"
    assert len(found) == 2


# expectations and excuses


def test_each_goal_has_expectations_of_its_own() -> None:
    met = run(
        goal("there", None, plan=("go",), order=("go",), final=(predicate("at == box"),)),
        goal("home", None, plan=("back",), order=("back",), final=(predicate("at == home"),)),
    )
    assert met.verdict.passed
    missed = run(goal("there", None, order=("back",)), goal("home", None, plan=("go",), verdict=End.ABORTED))
    assert [str(failure).split(":")[0] for failure in missed.verdict.failures] == [
        "goal 1, there",
        "goal 2, home",
        "goal 2, home",
    ]


def test_visits_of_one_goal_do_not_count_for_another() -> None:
    tester = Tester(MODEL)
    go = next(obligation for obligation in tester.obligations if str(obligation) == "go/completed")
    assert run(goal("there", None, visits=(go,)), goal("home")).verdict.passed
    assert not run(goal("there"), goal("home", None, visits=(go,))).verdict.passed


def test_a_missed_goal_says_which_one_it_is(wording: Wording) -> None:
    text = CELL.replace("deadline: 10 s\n    pre: {g: at == box", "deadline: 1 s\n    pre: {g: at == box")
    model = read_model(text)
    case = read_case("case: c\ngoals: [{goal: there}, {goal: home}]\nlimits: {plans: 1}\n", model)
    (failure,) = Tester(model).execute(case).verdict.failures
    assert "goal 2, home" in str(failure)
    wording(failure)


def test_a_fault_excuses_the_goals_from_its_own_on() -> None:
    text = CELL.replace("deadline: 10 s\n    pre: {g: at == home", "deadline: 1 s\n    pre: {g: at == home")
    model = read_model(text)
    case = read_case("case: c\ngoals: [{goal: there}, {goal: home}]\nlimits: {plans: 1}\n", model)
    late = Injection("nothing", (("estop", "released"),), predicate("plan.state == completed", model))
    execution = Tester(model).execute(replace(case, injections=(late,)))
    assert [failure.subject for failure in execution.verdict.failures] == ["replan_limit"]


@pytest.mark.parametrize(
    ("of_case", "of_goal", "of_model", "excuse"),
    [
        ("", "", "", None),
        ("may_end: [aborted]\n", "", "", Excuse.MAY_END),
        ("may_end: [unsolvable]\n", "", "", None),
        ("", "may_end: [time_limit, aborted]", "", Excuse.MAY_END),
        ("", "", "may_end: [aborted]\n", Excuse.MAY_END),
    ],
)
def test_may_end_of_case_goal_and_model_excuses(
    of_case: str, of_goal: str, of_model: str, excuse: Excuse | None
) -> None:
    text = CELL.replace("estop == pressed && current", "at == home && current").replace(
        "  there: at == box\n", f"  there: {{goal: at == box, {of_goal}}}\n"
    )
    model = read_model(text + of_model)
    verdict = Tester(model).execute(read_case(f"case: c\ngoal: there\n{of_case}", model)).verdict
    assert verdict.end is End.ABORTED
    assert verdict.excuses == (() if excuse is None else (excuse,))
    assert verdict.passed == (excuse is not None)


@pytest.mark.parametrize("source", ["input", "published"])
def test_a_value_that_comes_unasked_excuses_if_it_is_away_from_nominal(source: str) -> None:
    published = CELL.replace(", source: input", "").replace(
        "resources:\n", "resources:\n  safety: {publishes: [estop]}\n"
    )
    model = MODEL if source == "input" else read_model(published)
    case = read_case("case: c\ngoal: there\n", model)
    pressed = replace(case, initial=model.nominal_state.replace({"estop": "pressed"}), limits=CaseLimits(SECOND_NS))
    verdict = Tester(model).execute(pressed).verdict
    assert (verdict.end, verdict.excuses) == (End.TIME_LIMIT, (Excuse.INPUT,))


def test_an_injection_that_never_acts_excuses_nothing(wording: Wording) -> None:
    never = Injection("never", (("estop", "pressed"),), predicate("plan.state == unsolvable"))
    execution = run(goal("there"), injections=(never,), limits=CaseLimits(SECOND_NS))
    assert execution.verdict.excuses == ()
    (failure,) = execution.verdict.failures
    wording(failure)


# files, replay, shrinking, views


def stopped() -> Execution:
    fails = (OutcomeRule("arm", 1, 1, Outcome.FAIL),)
    case = case_of(goal("there"), goal("home", "estop == released"), goal("there"), injections=(PRESS, RELEASE))
    return Tester(MODEL).execute(replace(case, outcomes=fails))


def test_a_replay_gives_the_same_trace_byte_for_byte() -> None:
    first = stopped()
    again = read_case(write_case(first.recorded_case, MODEL, None), MODEL)
    assert again.recorded is not None
    assert again.goals == first.case.goals
    replayed = Tester(MODEL).execute(again)
    assert write_trace(replayed.trace) == write_trace(first.trace)
    assert replayed.digest == again.recorded.trace
    assert read_trace(write_trace(first.trace)).records == first.trace.records


def test_ranges_of_goals_are_the_whole_trace() -> None:
    records = stopped().trace.records
    ranges = ranges_of_goals(records)
    assert [index for each in ranges for index in each] == list(range(len(records)))
    assert [sum(isinstance(records[i], RunEnded) for i in each) for each in ranges] == [1, 1, 1]


def test_coverage_is_that_of_all_goals() -> None:
    tester = Tester(MODEL)
    execution = run(goal("there"), goal("home"))
    apart = [tester.execute(case_of(goal("there"))).visited, execution.visited]
    assert apart[0] & apart[1] == apart[0]
    assert "back/completed" in tester.obligations.names(execution.visited)
    assert visited_by(execution.trace.records, tester.obligations) == execution.visited


def test_shrinking_leaves_out_goals_that_do_not_matter() -> None:
    model = read_model(CELL.replace("  stop: {g: estop == pressed", "  stop: {g: at == box"))
    case = read_case(
        "case: c\ngoals: [{goal: there}, {goal: home}, {goal: there}, {goal: home, when: estop == released}]\n", model
    )
    tester = Tester(model)
    execution = tester.execute(case)
    failure = execution.verdict.failures[0]
    shrunk = Shrinker(tester).shrink(execution, failure)
    assert len(shrunk.execution.case.goals) < len(case.goals)
    assert all(goal.when is None for goal in shrunk.execution.case.goals)


def test_every_view_shows_all_goals(wording: Wording) -> None:
    execution = stopped()
    lines = "\n".join(str(line) for line in timeline(MODEL, execution, every=False))
    assert lines.count("● goal") == 3
    assert lines.count("■ ") == 3
    perfetto, mcap = BytesIO(), BytesIO()
    assert write_perfetto(MODEL, execution, perfetto)
    wording(re.findall(r'"goal":"(.*?)"', perfetto.getvalue().decode(errors="replace")))
    assert write_mcap(MODEL, execution, mcap)


# nodes


def over_nodes(case: Case) -> Execution:
    async def course(loop: VirtualLoop) -> Execution:
        (execution,) = await run_cases(Stage.virtual(MODEL, loop), [case])
        return execution

    return run_virtually(course)


def test_nodes_run_all_goals_and_their_log_gives_the_same_trace() -> None:
    execution = over_nodes(stopped().case)
    assert write_trace(execution.trace) == write_trace(stopped().trace)
    assert execution.verdict == stopped().verdict
    assert execution.log is not None
    text = write_event_log(execution.log, MODEL)
    log = read_event_log(text, MODEL, digest_of(MODEL))
    assert log == execution.log
    assert rerun(log, Program(MODEL)).records == execution.trace.records


def test_nodes_give_up_a_goal_that_never_begins() -> None:
    case = case_of(goal("there"), goal("home", "estop == pressed"))
    execution = over_nodes(case)
    assert ends(execution) == [("there", "reached", 2), ("home", "not_started", 2)]
    assert write_trace(execution.trace) == write_trace(run(*case.goals).trace)


def test_a_log_without_the_last_goal_does_not_end_the_run() -> None:
    log = over_nodes(stopped().case).log
    assert log is not None
    with pytest.raises(ValueError, match="does not end"):
        rerun(replace(log, steps=log.steps[:-1]), Program(MODEL))


def test_a_store_gives_the_runs_of_such_cases_again(tmp_path: Path, wording: Wording) -> None:
    execution = stopped()
    with write_store(tmp_path / "cov.db", MODEL, a_run(1, MODEL)) as writer:
        writer.add(1, written_recipe(execution.case, MODEL, "case.yaml"), execution.result)
    history = read_history(tmp_path / "cov.db")
    (stored,) = history.cases
    wording(stored.goal)
    again = Replays(history).execute(stored)
    assert again is not None
    assert write_trace(again.trace) == write_trace(execution.trace)


def test_the_report_of_a_campaign_does_not_count_such_a_case_as_reached(
    scbm: Callable[..., Ran], tmp_path: Path, wording: Wording
) -> None:
    (tmp_path / "cell.yaml").write_text(CELL, encoding="utf-8")
    injection = "injections: [{name: press, set: {estop: pressed}, when: go.state == executing}]\n"
    goals = "goals: [{goal: there, may_end: [aborted]}, {goal: home}]\n"
    (tmp_path / "case.yaml").write_text(f"case: stopped\nmodel: cell.yaml\n{goals}{injection}", encoding="utf-8")
    out = scbm("test", tmp_path / "cell.yaml", tmp_path / "case.yaml").out
    wording(paragraphs(out, "earlier goal", "short of"))
