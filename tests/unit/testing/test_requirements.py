"""What a violation reports: the moment, the operation, the values, and the stretch of the trace that shows it."""

from __future__ import annotations

import pytest

from scbm.cases import Case, OutcomeRule
from scbm.cases.trace import (
    AutomaticTaken,
    OperationStepped,
    Record,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    RunEnded,
)
from scbm.files import Scope, parse_requirement
from scbm.model import BehaviorModel, Outcome, Requirement
from scbm.testing import Execution, Tester, Violation
from support.models import scan_cell
from support.wording import Wording

MODEL = scan_cell()
S = 1_000_000_000


def _broken(sentence: str, model: BehaviorModel = MODEL, *outcomes: Outcome) -> tuple[Violation, Execution]:
    """The one violation of a sentence by a run in which a scan takes two seconds."""
    requirement = Requirement("asked", parse_requirement(sentence, Scope.of(model)))
    given = outcomes or (Outcome.SUCCEED,)
    forced = tuple(
        OutcomeRule("scan", n, n, o, None if o is Outcome.TIMEOUT else 2 * S) for n, o in enumerate(given, 1)
    )
    case = Case("case", *model.goals[0], model.nominal_state, forced, requirements=(requirement,))
    execution = Tester(model).execute(case)
    (violation,) = (each for each in execution.violations if not each.is_built_in)
    return violation, execution


def _at(violation: Violation, execution: Execution) -> tuple[Record, Record]:
    """The records with which the stretch begins and ends."""
    records = execution.trace.records
    return records[violation.begins], records[violation.record]


def test_an_invariant_is_shown_by_the_record_that_breaks_it(wording: Wording) -> None:
    violation, execution = _broken("never scan_req_state == executing")
    begin, end = _at(violation, execution)
    assert begin is end
    assert isinstance(end, RequestSent)
    assert (violation.at_ns, violation.operation) == (0, "scan_box")
    assert violation.values == (("scan_req_state", "executing"),)
    wording(violation)


def test_before_is_shown_by_the_record_that_comes_too_early() -> None:
    violation, execution = _broken("count == 1 before box_is_scanned == true")
    begin, end = _at(violation, execution)
    assert begin is end
    assert isinstance(end, OperationStepped)
    assert violation.at_ns == 2 * S


def test_after_always_is_shown_from_where_it_binds() -> None:
    violation, execution = _broken(
        "after scan_req_state == executing always box_is_scanned == false until light == red"
    )
    begin, end = _at(violation, execution)
    assert isinstance(begin, RequestSent)
    assert isinstance(end, OperationStepped)


def test_what_is_owed_at_the_end_is_shown_from_where_it_is_owed() -> None:
    violation, execution = _broken("scan_req_state == executing leads to light == red")
    begin, end = _at(violation, execution)
    assert isinstance(begin, RequestSent)
    assert isinstance(end, RunEnded)


def test_what_a_limit_cancels_and_drops_satisfies_nothing(wording: Wording) -> None:
    endless = scan_cell(("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    for sentence in (
        "scan_req_state == executing leads to scan_req_state == initial",
        "scan_box.state == executing leads to scan_box.state != executing",
    ):
        violation, execution = _broken(sentence, endless, Outcome.TIMEOUT)
        begin, end = _at(violation, execution)
        assert isinstance(begin, (RequestSent, OperationStepped))
        assert isinstance(end, RequestCancelled), "the first record of the limit"
        wording(violation)


def test_what_is_owed_within_some_time_is_reported_as_it_was_then() -> None:
    sentence = "scan_req_state == executing leads to scan_req_state == succeeded within 500 ms"
    violation, execution = _broken(sentence)
    begin, end = _at(violation, execution)
    assert isinstance(begin, RequestSent)
    assert begin is end, "nothing happened since then"
    assert violation.at_ns == S // 2
    assert violation.values == (("scan_req_state", "executing"),)
    assert violation.operation == "scan_box"


def test_a_second_debt_begins_where_the_first_was_paid() -> None:
    sentence = "scan_req_state == executing leads to scan_req_state == failed"
    violation, execution = _broken(sentence, MODEL, Outcome.FAIL, Outcome.SUCCEED)
    begin, _ = _at(violation, execution)
    assert isinstance(begin, RequestSent)
    assert begin.request == 2


@pytest.mark.parametrize(
    ("sentence", "record"),
    [("never scan_box.state == failed", AutomaticTaken), ("never scan_req_state == failed", ReplyReceived)],
)
def test_states_between_two_micro_steps_count(sentence: str, record: type[Record]) -> None:
    violation, execution = _broken(sentence, MODEL, Outcome.FAIL)
    assert isinstance(_at(violation, execution)[1], record)


def test_a_state_before_the_run_is_reported_as_it_was() -> None:
    violation, _ = _broken("never plan.state == idle")
    assert violation.values == (("plan.state", "idle"),)
