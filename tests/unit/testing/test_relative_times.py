"""Changes of a case that belong to events of its run instead of times."""

from __future__ import annotations

from dataclasses import replace

import pytest

from scbm.cases import Case
from scbm.cases.trace import MeasurementReceived
from scbm.files import read_case, read_model
from scbm.testing import Execution, Tester
from scbm.testing.shrinking.relative_times import with_relative_times

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


def test_a_change_keeps_its_time_where_nothing_tells_its_moment() -> None:
    case = case_of("{when: door == closed, by: opens}", "{at: 2 s, by: closes}")
    assert with_relative_times(case, run(case).trace.records, MODEL) == case
