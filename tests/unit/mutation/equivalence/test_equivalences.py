"""Mutants of a small cell: those that no run can distinguish are proved equivalent, the others get a witness."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import TypeAlias

import pytest
from msgspec.structs import replace

from scbm.cases.trace import AutomaticTaken, OperationStepped, RequestSent, RunnerStarted
from scbm.closing import CloseLimits
from scbm.files import read_case, read_model, write_case
from scbm.model import BehaviorModel
from scbm.model.predicates import FALSE
from scbm.mutation.equivalence.equivalences import Equivalences
from scbm.mutation.equivalence.mutant_decisions import (
    DifferentMutant,
    EquivalentMutant,
    MutantDecision,
    UndecidedMutant,
)
from scbm.testing import Tester
from support.two_robots import two_robots
from support.wording import Wording

WitnessOf: TypeAlias = Callable[[str, str], tuple[BehaviorModel, DifferentMutant]]

WANDER = """  wander:
    pre: {g: robot_at == box && scanned == true}
    post: {g: true, a: [scanned <- false]}
"""
GIVE_UP = "  give_up: {g: tries == 3, a: [plan.state <- aborted, tries <- 0]}\n"
CALM = "  calm: {g: tries == 2 && scanned == true, a: [tries <- 0]}\n"
CELL = (
    """
behavior_model: cell
variables:
  robot_at: {domain: [home, box], initial: home, source: state}
  job: {domain: [none, drive, look], initial: none}
  scanned: {domain: bool, initial: false, source: state}
  tries: {domain: 0..3, initial: 0}
  door: {domain: [open, closed], initial: closed, source: input}
resources:
  robot: {request: [job], simulation: {latency: 1 s, outcomes: {succeed: 1, fail: 0, timeout: 0}}}
operations:
  drive:
    deadline: 10 s
    pre: {g: robot_at == home && robot_req_state == initial, gr: door == closed,
      a: [robot_req_trigger <- true, job <- drive]}
    post: {g: true, gr: robot_req_state == succeeded,
           a: [robot_req_trigger <- false, robot_req_state <- initial, robot_at <- box]}
    failed: {g: robot_req_state == failed, a: [robot_req_trigger <- false, robot_req_state <- initial, tries += 1]}
    timedout: [robot_req_trigger <- false, tries += 1]
  look:
    pre: {g: robot_at == box && scanned == false}
    post: {g: true, a: [scanned <- true]}
"""
    + WANDER
    + "automatic_transitions:\n"
    + GIVE_UP
    + CALM
    + """goals: {scanned: scanned == true}
requirements:
  robot_stays_away: never robot_at == box && scanned == true && tries == 2
"""
)


@pytest.fixture(scope="module")
def cell() -> Equivalences:
    return Equivalences(read_model(CELL, "cell.yaml"))


def changed(before: str, after: str, text: str = CELL) -> BehaviorModel:
    assert text.count(before) == 1, before
    return read_model(text.replace(before, after), "cell.yaml")


def witness(decision: MutantDecision) -> DifferentMutant:
    assert isinstance(decision, DifferentMutant), decision
    return decision


@pytest.fixture(scope="module")
def witness_of(cell: Equivalences) -> WitnessOf:
    """Return a function that returns a changed cell and its witness, and decides each change once."""

    @cache
    def decided(before: str, after: str) -> tuple[BehaviorModel, DifferentMutant]:
        mutant = changed(before, after)
        return mutant, witness(cell.decide(mutant))

    return decided


EQUIVALENT = [
    # The request is at rest wherever a plan is needed or the operation is tried.
    ("robot_at == home && robot_req_state == initial", "robot_at == home"),
    # The runner tries `look` only where the plan has it.
    ("pre: {g: robot_at == box && scanned == false}", "pre: {g: scanned == false && robot_at == box}"),
    # No plan has the operation, whatever it does.
    ("a: [scanned <- false]", "a: [robot_at <- home]"),
    # The first transition makes the guard of the second one false, in whichever order they stand.
    (GIVE_UP + CALM, CALM + GIVE_UP),
    # An operation that no plan has can be left out.
    (WANDER, ""),
]


@pytest.mark.parametrize(("before", "after"), EQUIVALENT)
def test_a_change_that_no_run_shows_is_equivalent(cell: Equivalences, before: str, after: str) -> None:
    decision = cell.decide(changed(before, after))
    assert isinstance(decision, EquivalentMutant), decision
    assert decision.situations > 20


DIFFERENT = [
    ("deadline: 10 s", "deadline: 1 s"),
    ("deadline: 10 s", "deadline: 100 s"),
    (" gr: door == closed,", ""),
    ("tries += 1]}", "tries += 2]}"),
    ("timedout: [robot_req_trigger <- false, tries += 1]", "timedout: [tries += 1]"),
    ("give_up: {g: tries == 3", "give_up: {g: tries == 2"),
    ("calm: {g: tries == 2", "calm: {g: tries == 1"),
    ("a: [plan.state <- aborted, tries <- 0]", "a: [plan.state <- aborted]"),
    ("request: [job]", "request: [robot_at]"),
    ("job <- drive", "job <- look"),  # nothing reads `job`, but the record of the step shows it
    ("tries: {domain: 0..3, initial: 0}", "tries: {domain: 0..3, initial: 1}"),
    ("robot_at == home && robot_req_state == initial", "robot_at != box && robot_req_state != initial"),
]


@pytest.mark.parametrize(("before", "after"), DIFFERENT)
def test_another_change_has_a_witness_that_can_be_saved(
    cell: Equivalences, witness_of: WitnessOf, before: str, after: str
) -> None:
    mutant, found = witness_of(before, after)
    text = write_case(found.case, cell.model, "cell.yaml")
    on_original = Tester(cell.model).execute(read_case(text, cell.model, "witness.yaml"))
    on_mutant = Tester(mutant).execute(read_case(text, mutant, "witness.yaml"))
    assert on_original.trace.records == found.original.trace.records
    assert on_mutant.trace.records == found.mutated.trace.records
    assert on_original.trace.records != on_mutant.trace.records


@pytest.mark.parametrize("deadline", ["1 s", "9 s", "20 s", "100 s"])
def test_a_reply_between_two_deadlines_shows_which_one_it_is(cell: Equivalences, deadline: str) -> None:
    found = witness(cell.decide(changed("deadline: 10 s", f"deadline: {deadline}")))
    assert found.kills
    targets = [
        [r.target for r in run.trace.records if isinstance(r, OperationStepped) and r.operation == "drive"]
        for run in (found.original, found.mutated)
    ]
    first = next(pair for pair in zip(*targets, strict=False) if pair[0] != pair[1])
    assert sorted(first) == ["completed", "timedout"]


@pytest.mark.parametrize(("before", "after"), DIFFERENT)
def test_a_witness_that_kills_fails_once_its_result_is_recorded(
    cell: Equivalences, witness_of: WitnessOf, before: str, after: str
) -> None:
    mutant, found = witness_of(before, after)
    recorded = found.recorded("noticed")
    assert Tester(cell.model).execute(recorded).verdict.passed
    on_mutant = read_case(write_case(recorded, cell.model, None), mutant)
    assert Tester(mutant).execute(on_mutant).verdict.passed is not found.kills
    assert found.kills or "request" in before  # a record does not have what requests carry


TWO_LAMPS = """
behavior_model: two_lamps
variables:
  robot_at: {domain: [home, box], initial: home}
  red: {domain: bool, initial: false}
  green: {domain: bool, initial: false}
operations:
  drive:
    pre: {g: robot_at == home}
    post: {g: true, a: [robot_at <- box]}
automatic_transitions:
  light_red: {g: robot_at == box && red == false, a: [red <- true]}
  light_green: {g: robot_at == box && green == false, a: [green <- true]}
goals: {at_box: robot_at == box}
"""


def test_transitions_in_another_order_do_not_kill_where_the_record_is_the_same() -> None:
    model = read_model(TWO_LAMPS, "two_lamps.yaml")
    red, green = model.automatic_transitions
    mutant = replace(model, automatic_transitions=(green, red))
    found = witness(Equivalences(model).decide(mutant))
    saved = read_case(write_case(found.recorded("saved"), model, None), model)
    assert found.original.trace.records != found.mutated.trace.records
    assert Tester(model).execute(saved).verdict.passed
    assert Tester(mutant).execute(saved).verdict.passed
    assert not found.kills


def test_a_request_that_carries_another_value_shows_in_its_record(cell: Equivalences) -> None:
    found = witness(cell.decide(changed("request: [job]", "request: [tries]")))
    payloads = [
        next(r.payload for r in run.trace.records if isinstance(r, RequestSent))
        for run in (found.original, found.mutated)
    ]
    assert payloads == [(("job", "drive"),), (("tries", 0),)]


def test_another_initial_value_shows_in_the_first_record(cell: Equivalences) -> None:
    found = witness(cell.decide(changed("tries: {domain: 0..3, initial: 0}", "tries: {domain: 0..3, initial: 1}")))
    starts = [run.trace.records[0] for run in (found.original, found.mutated)]
    assert [dict(s.state)["tries"] for s in starts if isinstance(s, RunnerStarted)] == [0, 1]


def test_a_witness_is_benign_unless_the_mutant_breaks_a_requirement(cell: Equivalences) -> None:
    never_calm = witness(cell.decide(changed("calm: {g: tries == 2 && scanned == true", "calm: {g: tries == 1")))
    taken = [r.transition for r in never_calm.mutated.trace.records if isinstance(r, AutomaticTaken)]
    assert "calm" in taken
    assert never_calm.is_benign
    harmful = changed(
        "calm: {g: tries == 2 && scanned == true, a: [tries <- 0]}",
        "calm: {g: tries == 1 && scanned == true, a: [tries <- 2]}",
    )
    assert not witness(cell.decide(harmful)).is_benign


def test_beyond_a_limit_a_mutant_is_undecided_but_for_those_with_a_witness(wording: Wording) -> None:
    few = Equivalences(read_model(CELL, "cell.yaml"), CloseLimits(situations=5, candidates=3))
    before, after = EQUIVALENT[0]
    decision = few.decide(changed(before, after))
    assert isinstance(decision, UndecidedMutant)
    assert decision.option == "--max-states"
    wording(decision.reason)
    assert isinstance(few.decide(changed("job <- drive", "job <- look")), DifferentMutant)


def test_more_than_the_comparison_can_compare_is_undecided(cell: Equivalences, wording: Wording) -> None:
    decision = cell.decide(changed("goals: {scanned: scanned == true}", "goals: {scanned: robot_at == box}"))
    assert isinstance(decision, UndecidedMutant)
    assert decision.option is None
    wording(decision.reason)


def test_operations_in_another_order_differ_where_another_canonical_plan_comes_first() -> None:
    model = two_robots("canonical")
    pick_1, place_1, pick_2, place_2 = model.operations
    decide = Equivalences(model).decide
    assert isinstance(decide(replace(model, operations=(place_1, pick_1, pick_2, place_2))), EquivalentMutant)
    assert isinstance(decide(replace(model, operations=(pick_2, place_2, pick_1, place_1))), DifferentMutant)


@pytest.mark.parametrize(("plans", "decision"), [("canonical", EquivalentMutant), ("drawn", DifferentMutant)])
def test_where_plans_are_drawn_all_shortest_plans_count(plans: str, decision: type[MutantDecision]) -> None:
    model = two_robots(plans)
    pick_2 = model.operation("pick_2")
    never = replace(pick_2, pre=replace(pick_2.pre, g=FALSE))
    mutant = replace(model, operations=tuple(never if each is pick_2 else each for each in model.operations))
    assert isinstance(Equivalences(model).decide(mutant), decision)


@pytest.mark.parametrize(
    ("source", "decision"),
    [("", UndecidedMutant), (", source: input", DifferentMutant), (", source: state", EquivalentMutant)],
)
def test_a_mutant_that_reads_what_may_change_from_outside_is_not_equivalent(
    source: str, decision: type[MutantDecision], wording: Wording
) -> None:
    text = CELL.replace("resources:", f"  stop: {{domain: bool, initial: true{source}}}\nresources:")
    found = Equivalences(read_model(text, "cell.yaml")).decide(
        changed("box && scanned == false", "box && stop == true", text)
    )
    assert isinstance(found, decision), found
    if isinstance(found, UndecidedMutant):
        wording(found.reason)


DOOR = """
environment:
  open_door: {guard: door == closed, actions: [door <- open], after: 100 ms}
  close_door: {guard: door == open, actions: [door <- closed], every: 2 s}
  slam: {guard: door == open && tries == 3, actions: [door <- closed]}
"""


@pytest.mark.parametrize(
    ("before", "after", "decision"),
    [
        ("guard: door == open,", "guard: true,", EquivalentMutant),  # it changes nothing where the door is closed
        ("actions: [door <- open]", "actions: [door <- closed]", DifferentMutant),
        ("door == open && tries == 3", "door == open && tries == 2", UndecidedMutant),
    ],
)
def test_environment_transitions_are_compared_where_they_can_fire(
    before: str, after: str, decision: type[MutantDecision], wording: Wording
) -> None:
    text = CELL + DOOR
    found = Equivalences(read_model(text, "cell.yaml")).decide(changed(before, after, text))
    assert isinstance(found, decision), found
    if isinstance(found, UndecidedMutant):
        wording(found.reason)


@pytest.mark.longer
def test_decisions_are_the_same_in_each_order(cell: Equivalences) -> None:
    mutants = [changed(*each) for each in DIFFERENT[:4]]
    other = Equivalences(read_model(CELL, "cell.yaml"))
    expected = [witness(cell.decide(mutant)).case for mutant in mutants]
    assert [witness(other.decide(mutant)).case for mutant in reversed(mutants)] == expected[::-1]
