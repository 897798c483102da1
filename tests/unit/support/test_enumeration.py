"""The enumeration of runs: small models whose runs can be thought through, and random runs of random models."""

from __future__ import annotations

import pytest

from scbm.cases.trace import End
from scbm.model import BehaviorModel
from scbm.running import GoalGiven, PlanAnswered, PlanStatus, Program, ReplyArrived, Runner
from scbm.testing import RandomCases, Tester
from support.enumeration import Enumeration, enumerate_runs, fork, matters
from support.models import scan_cell
from support.profiles import share
from support.random_models import random_model

CUTTING_ENDS = (End.TIME_LIMIT, End.REPLAN_LIMIT, End.PLANNER_LIMIT, End.LIVELOCK)
"""A livelock is also what a run ends as in which too many things happen at one moment."""

AUTOMATIC = "automatic_transitions:\n"


def unvisited(enumeration: Enumeration) -> list[str]:
    obligations = enumeration.obligations
    return [name for name in map(str, obligations) if name not in obligations.names(enumeration.visited)]


def with_automatic(text: str, *replacements: tuple[str, str]) -> BehaviorModel:
    return scan_cell((AUTOMATIC, f"{AUTOMATIC}  more: {text}\n"), *replacements)


def test_the_scanning_cell_can_do_everything_but_wait() -> None:
    enumeration = enumerate_runs(scan_cell())
    assert unvisited(enumeration) == ["scan_box/disabled"]  # nothing makes the light red
    assert (enumeration.situations, enumeration.complete) == (2, True)  # the plan is awaited, or the scan executes


def test_initial_states_are_all_allowed_ones() -> None:
    lit = ("initial: green}", "initial: green, random: any}")
    everywhere = enumerate_runs(scan_cell(lit))
    assert unvisited(everywhere) == []
    assert everywhere.situations == 6  # for each light the plan is awaited, and the scan executes or is disabled
    not_red = enumerate_runs(scan_cell(lit, ("goals:", "initial_states: light != red\ngoals:")))
    assert unvisited(not_red) == ["scan_box/disabled"]
    assert not_red.situations == 4


def test_all_goals_are_pursued() -> None:
    one = scan_cell(("  scanned: box_is_scanned == true", "  scanned: box_is_scanned == false"))
    assert len(unvisited(enumerate_runs(one))) == 7
    two = scan_cell(
        ("  scanned: box_is_scanned == true", "  other: box_is_scanned == false\n  scanned: box_is_scanned == true")
    )
    assert unvisited(enumerate_runs(two)) == ["scan_box/disabled"]


def test_a_reply_measures_any_value_of_the_domain_or_none() -> None:
    hot = with_automatic("{g: temperature == 9 && scan_req_state == succeeded, a: [light <- red]}")
    assert unvisited(enumerate_runs(hot)) == ["scan_box/disabled"]
    as_it_was = with_automatic("{g: temperature == 5 && scan_req_state == succeeded, a: [light <- red]}")
    assert unvisited(enumerate_runs(as_it_was)) == ["scan_box/disabled"]
    failing = with_automatic("{g: temperature == 9 && scan_req_state == failed, a: [light <- red]}")
    assert "automatic/more" not in unvisited(enumerate_runs(failing))


COUNTED = ("timedout: [scan_req_trigger <- false]", "timedout: [scan_req_trigger <- false, count += 1]")


def test_timeouts_add_up() -> None:
    twice = enumerate_runs(with_automatic("{g: count == 2, a: [plan.state <- aborted, count <- 0]}", COUNTED))
    assert unvisited(twice) == ["scan_box/disabled"]
    assert twice.ways["automatic/more"] == ("scanned from nominal", *(("solved scan_box", "deadline") * 2))
    never = with_automatic("{g: count == 2 && light == blue, a: [light <- red]}", COUNTED)
    assert "automatic/more" in unvisited(enumerate_runs(never))


def test_without_a_deadline_there_is_no_timeout() -> None:
    model = scan_cell(("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    assert "scan_box/timedout" in unvisited(enumerate_runs(model))


def test_a_request_that_is_not_cancelled_is_answered_late() -> None:
    forgotten = ("timedout: [scan_req_trigger <- false]", "timedout: [light <- blue]")
    late = with_automatic("{g: scan_req_state == succeeded && current.name == none, a: [count <- 1]}", forgotten)
    assert unvisited(enumerate_runs(late)) == ["scan_box/disabled"]
    in_time = with_automatic("{g: scan_req_state == succeeded && current.name == none, a: [count <- 1]}")
    assert "automatic/more" in unvisited(enumerate_runs(in_time))


def test_replies_come_while_a_plan_is_awaited() -> None:
    forgotten = ("timedout: [scan_req_trigger <- false]", "timedout: [light <- blue]")
    again = ("post:", "post:\n      ar: [count <- 0]")
    model = with_automatic(
        "{g: scan_req_state == succeeded && plan.state == planning, "
        "a: [scan_req_state <- initial, scan_req_trigger <- false, count <- 1]}",
        forgotten,
        again,
    )
    enumeration = enumerate_runs(model)
    assert unvisited(enumeration) == ["scan_box/disabled"]
    assert enumeration.ways["automatic/more"] == (
        "scanned from nominal",
        "solved scan_box",
        "deadline",
        "scan succeeds",
    )


LOOK = """operations:
  look:
    pre: {g: scan_req_trigger == true && box_is_scanned == false}
    post: {g: true, gr: light == red, a: [box_is_scanned <- true]}
"""


def test_a_simulation_plans_before_an_earlier_request_is_answered() -> None:
    forgotten = ("timedout: [scan_req_trigger <- false]", "timedout: [light <- blue]")
    guarded = "{g: scan_req_state == succeeded && plan.state == planning, a: [count <- 1]}"
    waits = with_automatic(guarded, forgotten)
    ways = [enumerate_runs(waits, simulated=simulated).ways["automatic/more"] for simulated in (False, True)]
    assert [way[2:] for way in ways] == [("deadline", "scan succeeds"), ("deadline", "unsolvable", "scan succeeds")]
    looks = with_automatic(guarded, forgotten, ("operations:\n", LOOK))
    assert enumerate_runs(looks).visits("automatic/more")
    assert not enumerate_runs(looks, simulated=True).visits("automatic/more")


def test_what_only_a_time_limit_brings_about_is_distinguished() -> None:
    model = with_automatic("{g: plan.state == aborted, a: [light <- red]}")
    enumeration = enumerate_runs(model)
    assert unvisited(enumeration) == ["scan_box/disabled", "automatic/more"]
    assert enumeration.obligations.names(enumeration.cut_off & ~enumeration.visited) == ("automatic/more",)
    assert enumeration.ways["automatic/more"][-1] == "time limit"


def test_a_limit_cuts_the_enumeration_off() -> None:
    cut = enumerate_runs(scan_cell(), most=1)
    assert (cut.situations, cut.complete) == (1, False)
    assert not enumerate_runs(scan_cell(("initial: green}", "initial: green, random: any}")), most=2).complete


def test_variables_that_nothing_reads_do_not_matter() -> None:
    names = matters(scan_cell())
    assert "scan_command" not in names
    assert "temperature" not in names
    assert {"light", "box_is_scanned", "scan_req_state", "current.name"} <= set(names)
    assert "scan_command" in matters(with_automatic("{g: light == red, a: [scan_command <- none]}"))


def test_a_fork_goes_on_by_itself() -> None:
    model = scan_cell()
    runner = Runner(Program(model), model.nominal_state)
    runner.handle(GoalGiven("scanned", dict(model.goals)["scanned"]), 0)
    runner.handle(PlanAnswered(1, PlanStatus.SOLVED, ("scan_box",)), 0)
    before, twin = runner.state, fork(runner)
    assert twin.state == before
    twin.handle(ReplyArrived(1, succeeded=True), 5)
    assert twin.state["box_is_scanned"]
    assert runner.state == before
    runner.handle(ReplyArrived(1, succeeded=False), 3)
    assert runner.dropped_replies == twin.dropped_replies == {"late": 0, "repeated": 0, "unknown": 0}
    assert not runner.state["box_is_scanned"]


SMALL_FIRST = sorted(range(2, 202, 8), key=lambda number: number not in {2, 106, 114})
"""Numbers of random models: a usual run takes those at the front, which are enumerated completely, and fastest."""


@pytest.mark.longer
@pytest.mark.parametrize("number", SMALL_FIRST[: share(25, least=3)])
def test_random_runs_visit_nothing_else(number: int) -> None:
    assert unexpected(random_model(number), cases=40) == []


def unexpected(model: BehaviorModel, cases: int) -> list[str]:
    """What random cases visit though the enumeration does not, if that is complete."""
    enumeration = enumerate_runs(model, most=5_000)
    if not enumeration.complete:
        return []
    tester, found = Tester(model), []
    for case in RandomCases(model).first(cases, seed=1):
        execution = tester.execute(case, most_records=100_000)
        allowed = enumeration.visited
        if execution.verdict.end in CUTTING_ENDS:
            allowed |= enumeration.cut_off
        found += [f"{case.name}: {name}" for name in enumeration.obligations.names(execution.visited & ~allowed)]
    return found
