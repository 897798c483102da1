"""Hypothesis strategies draw what a case file may say, and shrink towards what is plain."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import HealthCheck, find, given, settings
from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.cases import Case, Network
from scbm.cases.trace import End, ends_of
from scbm.files import load_model, read_case, write_case
from scbm.model import BehaviorModel, InitialStates, InputError, Outcome, Slug
from scbm.planning import PlanLimits
from scbm.plugins.hypothesis import cases, goals, initial_states, injections, networks, outcomes
from scbm.running import RunnerOptions
from scbm.testing import Tester
from support.models import scan_cell
from support.profiles import examples
from support.strategies import SECOND_NS, running_models
from support.wording import Wording

BEFORE = load_model(Path(__file__).parents[4] / "examples" / "robot_in_the_air" / "before.yaml")
HOME = {"robot_is_home": "always gantry_req_state == executing -> robot_at == home"}

OPTIONS = RunnerOptions(time_limit_ns=100 * SECOND_NS, plan_limit=12, livelock_bound=60)
LIMITS = PlanLimits(length=50, expansions=5_000)
MANY = settings(examples(150), suppress_health_check=list(HealthCheck))
FEW = settings(deadline=None, max_examples=500, derandomize=True, database=None)


def _any_case(data: st.DataObject, model: BehaviorModel) -> Case:
    return data.draw(cases(model, injections=True, network=True, max_goals=3))


@pytest.mark.slow
@given(running_models(), st.data())
@MANY
def test_a_drawn_case_always_runs_to_an_end(model: BehaviorModel, data: st.DataObject) -> None:
    case = _any_case(data, model)
    execution = Tester(model, OPTIONS, LIMITS).execute(case)
    assert execution.verdict.end in End
    assert len(ends_of(execution.trace.records)) == len(case.goals) <= 3
    assert execution.ended_ns <= OPTIONS.time_limit_ns * len(case.goals)


@pytest.mark.slow
def test_cases_have_one_goal_unless_more_are_asked_for() -> None:
    model = scan_cell()
    several = find(cases(model, max_goals=2), lambda case: bool(case.later), settings=FEW)
    first = model.goals[0][0]
    assert [goal.name for goal in several.goals] == [first, first]
    assert all(goal.when is None for goal in several.goals)


@pytest.mark.slow
@given(running_models(), st.data())
@MANY
def test_a_drawn_case_is_one_that_a_file_can_say(model: BehaviorModel, data: st.DataObject) -> None:
    case = _any_case(data, model)
    assert model.initial_states.holds(case.initial)
    assert (case.origin is not None) is case.network.draws
    read = read_case(write_case(case, model, None), model)
    tester = Tester(model, OPTIONS, LIMITS)
    assert tester.execute(read).trace == tester.execute(case).trace


@pytest.mark.slow
@pytest.mark.parametrize("network", [True, False])
def test_the_plainest_case_says_nothing(*, network: bool) -> None:
    plainest = find(cases(BEFORE, injections=True, network=network), lambda _: True, settings=FEW)
    name, predicate = BEFORE.goals[0]
    assert plainest == Case("found", name, predicate, BEFORE.nominal_state)


@pytest.mark.slow
def test_parts_shrink_towards_what_is_plain() -> None:
    assert find(goals(BEFORE), lambda _: True, settings=FEW) == BEFORE.goals[0]
    assert find(initial_states(BEFORE), lambda _: True, settings=FEW) == BEFORE.nominal_state
    assert find(injections(BEFORE), lambda _: True, settings=FEW) == ()
    assert find(networks(BEFORE), lambda _: True, settings=FEW) == Network()
    (rule,) = find(outcomes(BEFORE), lambda rules: any(r.outcome is Outcome.TIMEOUT for r in rules), settings=FEW)
    assert (rule.first, rule.last, rule.latency_ns) == (1, 1, None)
    state = find(initial_states(BEFORE), lambda state: state["gantry_at"] == "box_a", settings=FEW)
    assert state == BEFORE.nominal_state.replace({"gantry_at": "box_a"})


def test_initial_states_are_those_that_the_model_allows() -> None:
    model = scan_cell(
        ("initial: green}", "initial: green, random: any}"),
        ("initial: 5}", "initial: 5, random: any}"),
        more="initial_states: light != green && temperature != 5\n",
    )
    found = dict.fromkeys(state for state in InitialStates(model).allowed(100))
    drawn: dict[object, None] = {}

    @given(initial_states(model))
    @settings(max_examples=100, derandomize=True, database=None)
    def draw(state: object) -> None:
        drawn[state] = None

    draw()
    assert list(found)
    assert all(state in found for state in drawn)
    assert len(drawn) == len(found) == 18


@pytest.mark.slow
def test_many_initial_states_are_not_listed() -> None:
    variables = "".join(f"  v{n}: {{domain: 0..9, initial: 0, random: any}}\n" for n in range(8))
    more = "initial_states: v0 != 0 && v7 != 0\n"
    model = scan_cell(("variables:\n", f"variables:\n{variables}"), more=more)
    state = find(initial_states(model), lambda state: state["v3"] == 7, settings=FEW)
    assert model.initial_states.holds(state)
    assert state["v3"] == 7


def test_a_model_without_goals_or_initial_states_is_refused() -> None:
    model = scan_cell(more="initial_states: light == red && light == green\n")
    with pytest.raises(InputError) as raised:
        cases(model)
    assert [error.slug for error in raised.value.diagnostics] == [Slug.NO_INITIAL_STATE]
    with pytest.raises(InputError) as raised:
        goals(replace(model, goals=()))
    assert [error.slug for error in raised.value.diagnostics] == [Slug.NO_GOALS]


def test_requirements_are_read_as_those_of_a_file() -> None:
    with pytest.raises(InputError) as raised:
        cases(BEFORE, requirements={"late": "never robt_at == home"})
    (error,) = raised.value.diagnostics
    assert (error.slug, error.place.file) == (Slug.UNKNOWN_VARIABLE, "requirement late")
    assert (error.place.line, error.place.column) == (1, 7)


def test_own_strategies_take_the_places_of_drawn_ones() -> None:
    nominal = BEFORE.nominal_state
    strategy = cases(
        BEFORE,
        goal=st.just(BEFORE.goals[2]),
        initial=st.just(nominal),
        outcomes=st.just(()),
        network=st.just(Network(latency_ns=7)),
    )
    expected = Case("found", *BEFORE.goals[2], nominal, network=Network(latency_ns=7))
    assert find(strategy, lambda _: True, settings=FEW) == expected


@pytest.mark.slow
def test_the_violation_of_the_example_is_found_and_made_small() -> None:
    tester = Tester(BEFORE)
    case = find(
        cases(BEFORE, requirements=HOME),
        lambda case: bool(tester.execute(case).violations),
        settings=settings(FEW, max_examples=100),
    )
    assert replace(case, requirements=()) == Case("found", *BEFORE.goals[0], BEFORE.nominal_state)


def test_without_hypothesis_one_sentence_says_what_to_install(wording: Wording) -> None:
    code = "import sys; sys.modules['hypothesis'] = None; import scbm.plugins.hypothesis"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    wording(done.stderr.splitlines()[-1])
    assert "ModuleNotFoundError" not in done.stderr
