"""Recorded results: a run is compared with that of its case, part by part, and the difference is put in words."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.cases import Case, CaseGoal, Network, OutcomeRule, RecordedGoal, RecordedRun
from scbm.cases.trace import End
from scbm.files import Scope, Where, parse_predicate, read_case, read_model, write_case
from scbm.model import BehaviorModel, Outcome, PlannerChoice, PlannerIdentity
from scbm.testing import Execution, Failure, FailureKind, RandomCases, Shrinker, Tester
from support.nodes import Stage, run_cases
from support.two_robots import two_robots
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

SECOND_NS = 1_000_000_000

CELL = """\
behavior_model: pressing
variables:
  at: {domain: [home, box], initial: home}
  parts: {domain: 0..5, initial: 0}
resources:
  arm: {simulation: {latency: 2 s}}
operations:
  go:
    deadline: 10 s
    pre: {g: at == home && arm_req_state == initial, a: [arm_req_trigger <- true]}
    post: {g: true, gr: arm_req_state == succeeded, a: [at <- box, arm_req_trigger <- false, arm_req_state <- initial]}
    failed: {g: arm_req_state == failed, a: [arm_req_trigger <- false, arm_req_state <- initial, parts += 1]}
    timedout: [arm_req_trigger <- false]
  back:
    deadline: 10 s
    pre: {g: at == box && arm_req_state == initial, a: [arm_req_trigger <- true]}
    post: {g: true, gr: arm_req_state == succeeded, a: [at <- home, arm_req_trigger <- false, arm_req_state <- initial]}
automatic_transitions:
  give_up: {g: parts == 3, a: [plan.state <- aborted]}
goals:
  there: at == box
  home: at == home
may_end: [aborted]
requirements_off: {non_blocking: a full counter ends the work}
"""
MODEL = read_model(CELL)


def case_of(model: BehaviorModel = MODEL, outcomes: tuple[OutcomeRule, ...] = (), later: tuple[str, ...] = ()) -> Case:
    """A case with the goal `there`, and perhaps others after it."""
    goals = [CaseGoal(name, dict(model.goals)[name]) for name in ("there", *later)]
    return Case("one", "", goals[0].predicate, model.nominal_state, outcomes).with_goals(goals)


def recorded(case: Case, model: BehaviorModel = MODEL) -> Case:
    """The case with the result of its run, as a file gives it."""
    execution = Tester(model).execute(case)
    assert execution.verdict.passed, execution.verdict
    return read_case(write_case(replace(case, recorded=execution.recorded), model, None), model)


def differences(case: Case, model: BehaviorModel) -> list[tuple[str, str]]:
    """What the run of a case is found to differ in."""
    failures = Tester(model).execute(case).verdict.failures
    assert all(failure.kind is FailureKind.EXPECTATION for failure in failures), failures
    return [(failure.subject, str(failure)) for failure in failures]


def changed(old: str, new: str) -> BehaviorModel:
    assert old in CELL
    return read_model(CELL.replace(old, new))


FAILS = (OutcomeRule("arm", 1, 1, Outcome.FAIL),)


def test_a_record_has_the_end_the_visits_the_order_and_the_declared_variables() -> None:
    (goal,) = Tester(MODEL).execute(case_of(outcomes=FAILS)).recorded.goals
    visits = ("go/executing", "go/failed", "go/completed", "go/queued")
    assert goal == RecordedGoal("reached", visits, ("go",), (("at", "box"), ("parts", "1")), 4 * SECOND_NS)


def test_a_record_of_several_goals_has_the_run_for_each() -> None:
    first, second = Tester(MODEL).execute(case_of(later=("home",))).recorded.goals
    assert (first.order, second.order) == (("go",), ("back",))
    assert (first.final, second.final) == ((("at", "box"), ("parts", "0")), (("at", "home"), ("parts", "0")))
    assert second.visits == ("back/executing", "back/completed", "back/queued")


def test_a_case_that_fails_records_its_end_and_its_trace_alone() -> None:
    missed = replace(case_of(), goal="there", predicate=parse_predicate("parts == 5", Scope.of(MODEL), Where.GUARD))
    execution = Tester(MODEL).execute(missed)
    assert not execution.verdict.passed
    assert execution.recorded == RecordedRun("unsolvable", execution.digest)


def test_a_case_passes_on_the_model_that_it_was_recorded_on() -> None:
    for case in (case_of(), case_of(outcomes=FAILS), case_of(later=("home",))):
        assert differences(recorded(case), MODEL) == []


CHANGES = [
    ("parts += 1]", "parts += 2]", ["final"]),
    ("{g: parts == 3,", "{g: parts == 1,", ["end", "time", "visits", "order", "final"]),
]


def worded(found: list[tuple[str, str]]) -> list[str]:
    """Return the differences as lines, each with its subject."""
    return [f"{subject}: {words}" for subject, words in found]


@pytest.mark.parametrize(("old", "new", "parts"), CHANGES)
def test_each_part_that_differs_is_a_failure_of_its_own(old: str, new: str, parts: list[str], wording: Wording) -> None:
    found = differences(recorded(case_of(outcomes=FAILS)), changed(old, new))
    assert sorted(subject for subject, _ in found) == sorted(f"recorded {part}" for part in parts)
    wording(worded(found))


def test_a_longer_deadline_that_passes_is_noticed(wording: Wording) -> None:
    case = recorded(case_of(outcomes=(OutcomeRule("arm", 1, 1, Outcome.TIMEOUT),)))
    found = differences(case, read_model(CELL.replace("deadline: 10 s", "deadline: 100 s")))
    assert [subject for subject, _ in found] == ["recorded time"]
    wording(worded(found))


def test_the_goal_is_named_where_there_are_several(wording: Wording) -> None:
    case = recorded(case_of(later=("home",)))
    found = differences(case, changed("[at <- home,", "[at <- home, parts += 1,"))
    assert [subject for subject, _ in found] == ["recorded final"]
    wording(worded(found))


def test_another_number_of_goals_is_a_difference(wording: Wording) -> None:
    longer = replace(recorded(case_of()), later=case_of(later=("home",)).later)
    found = differences(longer, MODEL)
    assert [subject for subject, _ in found] == ["recorded goals"]
    wording(worded(found))


def test_names_that_the_model_lost_or_gained_are_differences_and_no_errors(wording: Wording) -> None:
    text = CELL.replace("parts:", "pieces:").replace("parts ", "pieces ").replace("  go:", "  move:")
    model = read_model(text)
    case = read_case(write_case(recorded(case_of()), MODEL, None), model)
    found = differences(case, model)
    assert [subject for subject, _ in found] == ["recorded visits", "recorded order", "recorded final"]
    wording(worded(found))


def test_long_differences_are_shortened(wording: Wording) -> None:
    case = recorded(case_of())
    run = case.recorded
    assert run is not None
    names = tuple(f"no_{number}" for number in range(20))
    goal = RecordedGoal("reached", tuple(f"{name}/executing" for name in names), (*names, "go"), ())
    found = differences(replace(case, recorded=replace(run, goals=(goal,))), MODEL)
    assert {"recorded order", "recorded visits"} <= {subject for subject, _ in found}
    wording(worded(found))


def test_equal_operations_at_both_ends_of_the_order_are_left_out(wording: Wording) -> None:
    case = recorded(case_of(later=("home",)))
    run = case.recorded
    assert run is not None
    first, second = run.goals
    record = replace(run, goals=(replace(first, order=("go", "back", "go")), second))
    found = differences(replace(case, recorded=record), MODEL)
    assert [subject for subject, _ in found] == ["recorded order"]
    wording(worded(found))


def test_a_part_that_was_removed_from_the_file_is_not_compared() -> None:
    case = recorded(case_of(outcomes=FAILS))
    run = case.recorded
    assert run is not None
    goals = (replace(run.goals[0], visits=None, order=None, final=None),)
    assert differences(replace(case, recorded=replace(run, goals=goals)), changed("parts += 1]", "parts += 2]")) == []


def test_an_empty_part_says_that_there_was_nothing_and_is_compared() -> None:
    text = write_case(recorded(case_of()), MODEL, None)
    assert "  order: [go]\n" in text
    before, _, after = text.partition("  visits:\n    go: [executing, completed, queued]\n  order: [go]\n")
    empty = read_case(f"{before}  visits: {{}}\n  order: []\n{after}", MODEL)
    assert empty.recorded is not None
    assert [(goal.visits, goal.order) for goal in empty.recorded.goals] == [((), ())]
    assert [subject for subject, _ in differences(empty, MODEL)] == ["recorded visits", "recorded order"]
    assert read_case(write_case(empty, MODEL, None), MODEL).recorded == empty.recorded


def test_a_record_of_an_earlier_version_is_not_compared() -> None:
    case = replace(case_of(), recorded=RecordedRun("aborted", "0" * 64))
    assert differences(case, MODEL) == []


def test_a_run_with_plans_of_another_planner_is_not_compared_and_says_so(wording: Wording) -> None:
    case = recorded(case_of(outcomes=FAILS))
    model = replace(changed("parts += 1]", "parts += 2]"), planner=PlannerChoice("greedy"))
    execution = Tester(model).execute(case)
    assert execution.verdict.passed
    (unused,) = execution.unused
    wording(unused)


def test_other_limits_of_the_same_planner_are_compared() -> None:
    case = recorded(case_of(outcomes=FAILS))
    model = replace(changed("parts += 1]", "parts += 2]"), planner=PlannerChoice("canonical", max_length=50))
    assert [subject for subject, _ in differences(case, model)] == ["recorded final"]


def test_a_case_that_has_its_plans_is_compared_whichever_planner_made_them() -> None:
    model = two_robots()
    for case in RandomCases(model).first(5, 0):
        saved = Tester(model).execute(case).recorded_case
        assert saved.recorded is not None
        assert saved.recorded.planner == PlannerIdentity("drawn", "1")
        (goal,) = saved.recorded.goals
        assert goal.order is not None
        wrong = replace(saved.recorded, goals=(replace(goal, order=(*goal.order, "pick_1")),))
        assert Tester(model).execute(saved).verdict.passed
        assert [s for s, _ in differences(replace(saved, recorded=wrong), model)] == ["recorded order"]


def test_a_run_over_nodes_is_not_compared_and_records_its_end_alone() -> None:
    case = recorded(case_of())
    assert case.recorded is not None
    wrong = replace(case, recorded=replace(case.recorded, goals=(RecordedGoal("aborted", (), (), ()),)))

    async def course(loop: VirtualLoop) -> list[Execution]:
        return await run_cases(Stage.virtual(MODEL, loop), [wrong])

    (execution,) = run_virtually(course)
    assert execution.verdict.passed
    assert execution.recorded.goals == ()


def test_what_differs_cannot_be_shrunk() -> None:
    failure = Failure(FailureKind.EXPECTATION, "recorded visits", "")
    assert not Shrinker.can_shrink(failure)


@pytest.mark.parametrize("moves_inputs", [False, True])
def test_random_cases_are_recorded_with_their_draws(moves_inputs: bool) -> None:  # noqa: FBT001 - pytest gives it by name
    network = Network(jitter_ns=SECOND_NS)
    model = changed(
        "simulation: {latency: 2 s}", "simulation: {latency: 2 s, outcomes: {succeed: 0.5, fail: 0.3, timeout: 0.2}}"
    )
    tester = Tester(model)
    for case in RandomCases(model, network=network, moves_inputs=moves_inputs).first(20, 3):
        execution = tester.execute(case)
        saved = read_case(write_case(execution.recorded_case, model, None), model)
        assert saved.recorded is not None
        assert bool(saved.recorded.goals) is execution.verdict.passed
        again = tester.execute(replace(saved, origin=None))
        assert (again.verdict, again.recorded) == (execution.verdict, execution.recorded)
        drawn = tester.execute(replace(case, recorded=saved.recorded))
        assert case.origin is not None
        assert drawn.verdict == execution.verdict


def test_the_end_is_among_the_ends_of_runs() -> None:
    (goal,) = Tester(MODEL).execute(case_of()).recorded.goals
    assert End(goal.end) is End.REACHED
