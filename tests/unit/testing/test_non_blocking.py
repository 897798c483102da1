"""`non_blocking` in cases and in all runs (semantics 7.12): what runs leave reachable for the runs after them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Case, CaseGoal, CaseLimits, EnvironmentChange
from scbm.cases.trace import End, state_after
from scbm.closing import CloseLimits, Closer
from scbm.closing.decisions import DecidedRequirement, RequirementStatus
from scbm.closing.requirements.requirement_closer import RequirementCloser
from scbm.files import load_model, read_model
from scbm.model import And, BehaviorModel, GoalOrder, RunPlans, RunsDeclaration, Value
from scbm.model.requirements import BUILT_IN_NAMES
from scbm.testing import Campaign, Execution, RandomCases, Tester
from scbm.testing.continuations.reachable_goals import LostGoals, ReachableGoals, UnknownReachabilityError
from support.closings import closing_of
from support.models import STOPPED
from support.random_models import small_random_model
from support.wording import Wording

LATCH = """
behavior_model: seed
variables:
  stop_button: {domain: [up, pressed], initial: up}
  latch: {domain: [none, stopped], initial: none, source: state}
operations: {}
automatic_transitions:
  trip: {g: stop_button == pressed && latch == none, a: [latch <- stopped]}
environment:
  press: {guard: stop_button == up, actions: [stop_button <- pressed], every: {exponential: 10 s}}
  pull: {guard: stop_button == pressed, actions: [stop_button <- up], after: 1 s}
goals:
  free: latch == none
"""
EXAMPLES = Path(__file__).parents[3] / "examples"
FAR_AWAY = EnvironmentChange(7_200 * 1_000_000_000, (("stop", "down"),), "press")
FORGETS = ("environment:", "  forget: {g: stop == up && preempt == asked, a: [preempt <- none]}\nenvironment:")


def model_of(*replacements: tuple[str, str]) -> BehaviorModel:
    text = STOPPED
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return read_model(text)


def with_latch(model: BehaviorModel) -> BehaviorModel:
    """Return the model with a latch that a stop sets, that nothing resets, and that no operation starts under."""
    seed = read_model(LATCH)
    free = seed.goals[0][1]
    return replace(
        model,
        variables=(*model.variables, *seed.variables),
        operations=tuple(replace(each, pre=replace(each.pre, g=And((each.pre.g, free)))) for each in model.operations),
        automatic_transitions=(*model.automatic_transitions, *seed.automatic_transitions),
        environment=(*model.environment, *seed.environment),
    )


def failing(model: BehaviorModel, count: int = 20) -> list[Execution]:
    tester, random = Tester(model), RandomCases(model)
    runs = [tester.execute(random.case(1, number)) for number in range(1, count + 1)]
    return [run for run in runs if "non_blocking" in [each.requirement for each in run.violations]]


def decided(model: BehaviorModel) -> DecidedRequirement:
    closer = RequirementCloser(model, CloseLimits(), lambda _: None)
    found = closer.decide(Campaign.of(model, ()), closing_of(model)).decided
    return next(each for each in found if each.name == "non_blocking")


def test_a_stop_that_nothing_resets_is_found_with_its_latch(wording: Wording) -> None:
    model = model_of()
    run = failing(model)[0]
    wording(str(run.verdict.failures[0]))
    found = decided(model)
    assert found.status is RequirementStatus.VIOLATED
    assert found.execution is not None
    case = found.execution.case
    assert ([change.by for change in case.environment or ()], len(case.goals)) == (["press"], 1)


def test_of_equally_small_latches_the_one_that_no_transition_resets_is_named() -> None:
    arm = ("variables:\n", "variables:\n  arm_at: {domain: [ready, stopped], initial: ready}\n")
    stops = ("[preempt <- asked]", "[preempt <- asked, arm_at <- stopped]")
    needs = ("guard: item ==", "guard: arm_at == ready && item ==")
    home = (
        "operations:\n",
        "operations:\n  home: {pre: {g: preempt == none}, post: {g: true, a: [arm_at <- ready]}}\n",
    )
    leaves = ("leave: {g: preempt == asked", "leave: {g: arm_at == stopped && home.state == initial")
    model = model_of(arm, stops, needs, home, leaves)
    violation = next(each for each in failing(model)[0].violations if each.requirement == "non_blocking")
    assert "preempt == asked: let a transition reset preempt" in violation.reason


def test_a_latch_of_four_variables_is_named_without_what_is_not_needed() -> None:
    names = ("a", "b", "c", "d", "e")
    variables = "".join(f"  {each}: {{domain: bool, initial: false, source: state}}\n" for each in names)
    sets = "".join(f", {each} <- true" for each in names)
    needs = "".join(f" && {each} == false" for each in names if each != "c")
    model = model_of(
        ("variables:\n", f"variables:\n{variables}"),
        ("[preempt <- asked]", f"[preempt <- asked{sets}]"),
        ("guard: item ==", f"guard: (c == true || c == false){needs} && item =="),
        FORGETS,
    )
    violation = next(each for each in failing(model)[0].violations if each.requirement == "non_blocking")
    assert [name for name, _ in violation.values] == ["a", "b", "d", "e"]


@pytest.mark.parametrize("name", [pytest.param("dual_cnc", marks=pytest.mark.longer), "gripper", "packml", "delivery"])
def test_a_latch_seeded_in_an_example_is_found_with_the_smallest_history(name: str) -> None:
    model = with_latch(load_model(EXAMPLES / name / "cell.yaml"))
    off = tuple((each, "is not asked for") for each in BUILT_IN_NAMES if each != "non_blocking")
    found = decided(replace(model, requirements=(), requirements_on=(), requirements_off=off))
    assert found.status is RequirementStatus.VIOLATED
    assert found.execution is not None
    case = found.execution.case
    assert ([change.by for change in case.environment or ()], len(case.goals)) == (["press"], 1)
    latch = next(each.values for each in found.execution.violations)
    assert latch == (("latch", "stopped"),)


def test_a_stop_that_is_forgotten_is_none() -> None:
    model = model_of(FORGETS)
    assert not failing(model)
    assert decided(model).holds


def test_what_plain_runs_close_may_be_closed_unless_it_has_to_be_reachable_again() -> None:
    shelf = ("goals:\n", "goals:\n  back: item == shelf\n")
    assert not failing(model_of(FORGETS, shelf))
    strict = model_of(FORGETS, shelf, ("goals:\n", "reachable_again: [back]\ngoals:\n"))
    assert failing(strict)
    assert decided(strict).status is RequirementStatus.VIOLATED


def test_it_is_not_judged_after_a_limit_with_single_goals_or_drawn_plans() -> None:
    model = model_of()
    run = failing(model)[0]
    limited = replace(run.closed_case, origin=None, limits=CaseLimits(time_ns=1))
    assert not Tester(model).execute(limited).violations
    assert not failing(replace(model, runs=RunsDeclaration(GoalOrder.SINGLE)))
    assert not failing(replace(model, runs=RunsDeclaration(plans=RunPlans.DRAWN)))


def test_with_drawn_plans_closing_says_that_no_case_can_show_a_violation() -> None:
    model = replace(model_of(), runs=RunsDeclaration(plans=RunPlans.DRAWN))
    cases = Closer(model).close(Campaign.of(model, ())).cases
    assert cases
    assert not [made for made in cases if made.execution.violations]
    found = decided(model)
    assert found.status is RequirementStatus.UNDECIDED
    assert "drawn plans" in found.reason


def test_a_goal_of_the_case_alone_is_none_of_the_model() -> None:
    model = model_of()
    case = failing(model)[0].closed_case
    other = replace(case, goal="other", origin=None)
    assert isinstance(other, Case)
    assert "non_blocking" not in [each.requirement for each in Tester(model).execute(other).violations]


def last_states(model: BehaviorModel, count: int = 6) -> list[Mapping[str, Value]]:
    tester, random = Tester(model), RandomCases(model)
    return [state_after(tester.execute(random.case(1, number)).trace.records) for number in range(1, count + 1)]


def answers(goals: Sequence[ReachableGoals], states: Sequence[Mapping[str, Value]]) -> list[LostGoals | str | None]:
    found: list[LostGoals | str | None] = []
    for each, state in zip(goals, states, strict=True):
        try:
            found.append(each.lost_after(state))
        except UnknownReachabilityError:
            found.append("unknown")
    return found


def test_what_is_unknown_does_not_depend_on_earlier_cases() -> None:
    sequence = RunsDeclaration(GoalOrder.SEQUENCE)
    models = [model_of(), *(replace(small_random_model(number), runs=sequence) for number in range(6))]
    unknown = known = 0
    for model in models:
        states = last_states(model)
        for most in (3, 10, 30, 100):
            alone = answers([ReachableGoals(model, most=most) for _ in states], states)
            for order in (states, states[::-1]):
                shared = answers([ReachableGoals(model, most=most)] * len(states), order)
                assert (shared if order is states else shared[::-1]) == alone
            unknown += alone.count("unknown")
            known += len(alone) - alone.count("unknown")
    assert unknown > 20
    assert known > 20


def test_a_run_that_a_limit_ends_is_no_history_and_what_came_before_it_is_one() -> None:
    """The button is pressed again after two hours, so the run for the second goal waits until the time limit."""
    waiting = ("guard: item == shelf", "guard: item == shelf && preempt == none")
    model = model_of(waiting)
    run = next(each for each in failing(model) if each.verdict.end is End.ABORTED)
    waits = replace(run.closed_case, later=(CaseGoal("placed", model.goals[0][1], may_end=(End.TIME_LIMIT,)),))
    waits = replace(waits, environment=(*(waits.environment or ()), FAR_AWAY))
    done = Tester(model).execute(waits)
    assert done.verdict.end is End.TIME_LIMIT
    (violation,) = done.violations
    assert (violation.requirement, violation.at_ns) == ("non_blocking", run.violations[0].at_ns)
    alone = Tester(model_of(waiting, FORGETS)).execute(waits)
    assert not alone.violations


def test_the_latch_of_a_pressed_button_is_named_though_it_would_be_set_at_once() -> None:
    at_once = (
        "ask: {g: stop == down && preempt == none && current.state == executing",
        "ask: {g: stop == down && preempt == none",
    )
    run = failing(model_of(at_once))[0]
    assert [each.values for each in run.violations] == [(("preempt", "asked"),)]
