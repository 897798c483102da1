"""Which obligations a mutant belongs to, and which of these notice it (decision 52)."""

from __future__ import annotations

import pytest

from scbm.cases import Case
from scbm.cases.coverage import MutantStatus, Obligations
from scbm.files import read_case, read_model
from scbm.mutation import MutantResult, MutationRuns, mutants_of
from scbm.mutation.mutant_obligations import MutantObligations
from scbm.testing import Tester

MODEL = read_model(
    """behavior_model: gate
variables:
  door: {domain: [open, closed], initial: closed, source: state}
  count: {domain: 0..9, initial: 0, source: state}
  noted: {domain: bool, initial: false, source: state}
resources:
  motor: {simulation: {latency: 1 s}}
operations:
  open_door:
    deadline: 10 s
    pre: {g: door == closed && motor_req_state == initial, a: [motor_req_trigger <- true]}
    post:
      g: true
      gr: motor_req_state == succeeded
      a: [motor_req_trigger <- false, motor_req_state <- initial, door <- open]
    timedout: [motor_req_trigger <- false, count += 1]
automatic_transitions:
  motor_failed:
    g: motor_req_state == failed && current.state == executing
    a: [current.state <- failed, motor_req_trigger <- false, motor_req_state <- initial]
  notes: {g: open_door.state == timedout && noted == false, a: [noted <- true]}
goals: {opened: door == open}
""",
    "gate.yaml",
)
OBLIGATIONS = Obligations.of(MODEL)


def case(name: str, *outcomes: str, expect: str = "{}") -> Case:
    listed = ", ".join(outcomes)
    text = f"case: {name}\ngoal: opened\noutcomes: {{motor: [{listed}]}}\nexpect: {expect}\n"
    return read_case(text, MODEL, f"{name}.yaml")


def results(*cases: Case) -> dict[str, MutantResult]:
    runs = MutationRuns(Tester(MODEL), cases, finds_visitors=True)
    return {result.mutant.name: result for result in runs.results(mutants_of(MODEL))}


@pytest.fixture(scope="module")
def late() -> dict[str, MutantResult]:
    return results(case("well", "succeed"), case("late", "timeout"))


@pytest.mark.parametrize(
    ("mutant", "names"),
    [
        ("open_door/pre.g/drop:door == closed", ("open_door/disabled", "open_door/executing")),
        ("open_door/pre.a/drop:motor_req_trigger <- true", ("open_door/executing",)),
        ("open_door/post.a/drop:door <- open", ("open_door/completed",)),
        ("open_door/deadline/none", ("open_door/timedout",)),
        ("open_door/timedout/drop:motor_req_trigger <- false", ("open_door/timedout",)),
        ("automatic/motor_failed/drop", ("open_door/failed", "automatic/motor_failed")),
        ("automatic/notes/drop", ("automatic/notes",)),
        ("automatic/notes/a/value:noted <- false", ("automatic/notes",)),
        ("variable/door/initial/open", ()),
    ],
)
def test_a_mutant_belongs_to_the_obligations_whose_transition_it_changes(
    late: dict[str, MutantResult], mutant: str, names: tuple[str, ...]
) -> None:
    assert set(OBLIGATIONS.names(late[mutant].belongs)) == set(names)


def test_the_case_that_kills_has_to_visit() -> None:
    """A shorter deadline fails a case that never times out otherwise; that says nothing about *timedout*."""
    well = case("well", "{outcome: succeed, after: 5 s}", expect="{final: [door == open]}")
    late = case("late", "timeout", "{outcome: succeed, after: 500 ms}")
    slow = case("slow", "{outcome: succeed, after: 5 s}", expect="{final: [count == 0]}")
    found = results(well, late, slow)["open_door/deadline/1 s"]
    assert (found.status, found.case) == (MutantStatus.KILLED, "slow")
    assert found.noticed == 0


@pytest.mark.longer
def test_cases_after_the_first_that_kills_are_run_until_one_visits() -> None:
    """The first case that kills does not time out; a later one does."""
    slow = case("slow", "{outcome: succeed, after: 5 s}", expect="{final: [count == 0]}")
    late = case("late", "timeout", "{outcome: succeed, after: 5 s}", expect="{final: [count == 1]}")
    alone, both = results(slow), results(slow, late)
    name = "open_door/deadline/none"
    assert (alone[name].status, both[name].case) == (MutantStatus.UNDECIDED, "late")
    assert OBLIGATIONS.names(both[name].noticed) == ("open_door/timedout",)
    shorter = both["open_door/deadline/1 s"]
    assert (shorter.case, shorter.runs) == ("slow", 1)  # the report is the same


@pytest.mark.longer
def test_a_run_without_the_search_is_the_same_but_for_what_is_noticed() -> None:
    cases = (case("well", "succeed"), case("late", "timeout"))
    plain = {r.mutant.name: r for r in MutationRuns(Tester(MODEL), cases).results(mutants_of(MODEL))}
    for name, found in results(*cases).items():
        assert (found.status, found.case, found.runs) == (plain[name].status, plain[name].case, plain[name].runs)
        assert plain[name].noticed == 0


@pytest.mark.longer
def test_what_is_noticed_is_what_all_runs_of_all_cases_say() -> None:
    """The search leaves out runs; the reference runs each case on each mutant."""
    cases = (
        case("well", "succeed"),
        case("late", "timeout", "{outcome: succeed, after: 5 s}", expect="{final: [count == 1]}"),
        case("fails", "fail", "timeout", expect="{final: [noted == true]}"),
    )
    runs = MutationRuns(Tester(MODEL), cases, finds_visitors=True)
    visited = [Tester(MODEL).execute(each).result.visited for each in cases]
    for mutant in mutants_of(MODEL):
        found = runs.result(mutant)
        under_test = runs.under_test(mutant)
        kills = [under_test.failure(each) is not None for each in cases]
        assert (found.status is MutantStatus.KILLED) is any(kills)
        expected = 0
        for obligation in MutantObligations(MODEL, OBLIGATIONS).of(mutant):
            if any(kill and obligation.visits & ~seen == 0 for kill, seen in zip(kills, visited, strict=True)):
                expected |= obligation.bit
        assert OBLIGATIONS.names(found.noticed) == OBLIGATIONS.names(expected), mutant.name
