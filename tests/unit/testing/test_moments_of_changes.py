"""Changes of a case whose moments belong to events of its run, or do not come."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.cases import Case
from scbm.cases.trace import End, MeasurementReceived
from scbm.files import read_case, read_model
from scbm.testing import Execution, Tester
from scbm.testing.shrinking.relative_times import with_relative_times
from scbm.testing.shrinking.shrinker import Shrinker
from support.wording import Wording

MODEL = read_model(
    """
behavior_model: press
variables:
  formed: {domain: bool, initial: false}
  door: {domain: [closed, open], initial: closed}
  light: {domain: 0..3, initial: 0}
resources: {ram: {simulation: {latency: 4 s}}}
environment:
  opens: {guard: door == closed, actions: [door <- open]}
  closes: {guard: door == open, actions: [door <- closed]}
operations:
  form: {request: ram, deadline: 9 s, pre: {g: formed == false}, post: {a: [formed <- true]}}
automatic_transitions:
  seen: {g: light == 3, a: [formed <- false]}
goals: {formed: formed == true && door == closed}
""",
    "press.yaml",
)


def case_of(*changes: str, more: str = "") -> Case:
    return read_case(f"case: x\ngoal: formed\n{more}environment: [{', '.join(changes)}]\n", MODEL)


def run(case: Case) -> Execution:
    return Tester(MODEL).execute(case)


def moments(execution: Execution) -> list[tuple[int, str]]:
    records = (record for record in execution.trace.records if isinstance(record, MeasurementReceived))
    return [(record.at_ns // 10**6, record.by) for record in records]


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        (
            ("{at: 500 ms, by: opens}", "{at: 2 s, by: closes}"),
            [("ram_req_state == executing", 500), ("door == open", 1500)],
        ),
        (
            ("{at: 1 s, by: opens}", "{at: 4500 ms, by: closes}"),
            [("ram_req_state == executing", 1000), ("ram_req_state == initial", 500)],
        ),
    ],
)
def test_a_change_comes_after_the_last_event_before_it(
    changes: tuple[str, ...], expected: list[tuple[str, int]]
) -> None:
    case = case_of(*changes)
    before = run(case)
    relative = with_relative_times(case, before.trace.records, MODEL)
    found = [(str(each.when), (each.after_ns or 0) // 10**6) for each in relative.environment or ()]
    assert [each.at_ns for each in relative.environment or ()] == [None] * len(changes)
    assert found == expected
    assert moments(run(relative)) == moments(before)


def test_a_case_whose_changes_did_not_all_come_keeps_its_times() -> None:
    case = case_of("{at: 1 s, by: opens}", "{at: 2 s, by: closes}", "{at: 50 s, by: opens}")
    assert with_relative_times(case, run(case).trace.records, MODEL) == case
    plain = replace(case, environment=None)
    assert with_relative_times(plain, run(plain).trace.records, MODEL) == plain


def test_a_change_keeps_its_time_where_no_event_precedes_it() -> None:
    case = case_of("{when: door == closed, by: opens}", "{at: 2 s, by: closes}")
    assert with_relative_times(case, run(case).trace.records, MODEL) == case


@pytest.mark.parametrize(
    ("change", "count"),
    [
        ("{at: 50 s, by: opens}", 1),
        ("{when: light == 2, by: opens}", 1),
        ("{when: light == 2, after: 2 s, set: {light: 1}}", 1),
        ("{at: 1 s, set: {light: 1}}", 0),
    ],
)
def test_a_change_whose_moment_does_not_come_is_reported(change: str, count: int, wording: Wording) -> None:
    unused = run(case_of(change)).unused
    assert len(unused) == count
    wording(unused)


def test_a_change_that_a_run_awaits_until_its_limit_has_an_effect() -> None:
    case = case_of("{at: 1 s, by: opens}", "{at: 50 s, by: closes}", more="limits: {time: 9 s}\n")
    execution = run(case)
    assert (execution.verdict.end, execution.unused) == (End.TIME_LIMIT, ())


def test_an_excused_wait_says_what_could_act(wording: Wording) -> None:
    execution = run(read_case("case: x\ngoal: formed\ninitial: {door: open, light: 1}\n", MODEL))
    assert (execution.verdict.end, execution.verdict.failures) == (End.UNSOLVABLE, ())
    wording(execution.notes)


def test_the_smallest_case_has_no_time_for_plans_that_it_does_not_need() -> None:
    rule = "requirements: {unformed: never formed == true}\nplanning: 1 s\n"
    execution = run(read_case(f"case: x\ngoal: formed\n{rule}", MODEL))
    shrunk = Shrinker(Tester(MODEL)).shrink(execution, execution.verdict.failures[0])
    assert shrunk.execution.case.planning_ns == 0
