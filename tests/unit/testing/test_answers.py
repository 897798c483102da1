"""How a resource answered what it was asked."""

from __future__ import annotations

from functools import reduce

import pytest

from scbm.cases.trace import OperationStepped, Record, ReplyReceived, RequestCancelled, RequestSent
from scbm.files import read_case, read_model
from scbm.model import OperationState
from scbm.testing import Answers, Tester
from support.models import SCAN_CELL

MODEL = read_model(SCAN_CELL)


def counts(outcomes: str, more: str = "") -> Answers:
    text = f"case: scans\ngoal: scanned\noutcomes: {{scan: {outcomes}}}\n{more}"
    execution = Tester(MODEL).execute(read_case(text, MODEL))
    return Answers("scan").after(execution.trace.records)


@pytest.mark.parametrize(
    ("outcomes", "expected"),
    [
        ("[succeed]", Answers("scan", 1, 1)),
        ("[fail, fail, succeed]", Answers("scan", 3, 1, 2)),
        ("[timeout, fail, succeed]", Answers("scan", 3, 1, 1, 1)),
    ],
)
def test_each_request_of_a_run_is_counted_by_what_came_of_it(outcomes: str, expected: Answers) -> None:
    assert counts(outcomes) == expected
    assert not expected.is_silent


def test_a_request_that_was_never_due_speaks_against_nobody() -> None:
    still_in_flight = counts("[{outcome: succeed, after: 9 s}]", "limits: {time: 5 s}\n")
    assert still_in_flight == Answers("scan", 1)
    assert (still_in_flight.given_up, still_in_flight.is_silent) == (1, False)


def stepped(target: OperationState) -> Record:
    return OperationStepped(0, "scan_box", OperationState.INITIAL, target, None, ())


BEGINS, FAILS, TIMES_OUT = (
    stepped(target) for target in (OperationState.EXECUTING, OperationState.FAILED, OperationState.TIMEDOUT)
)
SENT, CANCELLED = RequestSent(0, 1, "robot", (), ()), RequestCancelled(9, 1, "robot", ())
REPLIED, REFUSED = ReplyReceived(5, 1, "robot", True, ()), ReplyReceived(5, 1, "robot", False, ())


@pytest.mark.parametrize(
    ("records", "expected"),
    [
        ([BEGINS, SENT, TIMES_OUT, CANCELLED], Answers("robot", 1, timed_out=1)),
        ([BEGINS, SENT, TIMES_OUT], Answers("robot", 1, timed_out=1)),
        ([BEGINS, SENT, FAILS, CANCELLED], Answers("robot", 1)),
        ([BEGINS, SENT, CANCELLED, TIMES_OUT], Answers("robot", 1)),
        ([BEGINS, SENT, REFUSED, TIMES_OUT], Answers("robot", 1, failed=1)),
        ([BEGINS, SENT, TIMES_OUT, REPLIED], Answers("robot", 1, succeeded=1)),
        ([BEGINS, SENT, FAILS, BEGINS, TIMES_OUT], Answers("robot", 1)),
        ([BEGINS, SENT, TIMES_OUT, CANCELLED, BEGINS, SENT, FAILS, CANCELLED], Answers("robot", 2, timed_out=1)),
        ([BEGINS, TIMES_OUT], Answers("robot")),
    ],
)
def test_a_request_is_late_if_the_operation_that_sent_it_times_out_meanwhile(
    records: list[Record], expected: Answers
) -> None:
    assert Answers("robot").after(records) == expected


def test_runs_add_up_and_each_resource_has_its_own_counts() -> None:
    runs: list[list[Record]] = [
        [BEGINS, SENT, REPLIED],
        [BEGINS, SENT, TIMES_OUT, CANCELLED],
        [BEGINS, SENT, CANCELLED],
        [BEGINS, RequestSent(0, 1, "gripper", (), ()), ReplyReceived(5, 1, "gripper", False, ())],
        [BEGINS, RequestSent(0, 1, "gripper", (), ()), RequestCancelled(5, 1, "gripper", ())],
    ]
    counted = [reduce(Answers.after, runs, Answers(name)) for name in ("gripper", "robot", "idle")]
    assert counted == [Answers("gripper", 2, 0, 1), Answers("robot", 3, 1, 0, 1), Answers("idle")]
    assert [answers.given_up for answers in counted] == [1, 1, 0]


@pytest.mark.parametrize(
    ("answers", "is_silent"),
    [
        (Answers("idle"), False),
        (Answers("asked", 2), False),
        (Answers("refuses", 2, failed=1), True),
        (Answers("dead", 2, timed_out=1), True),
        (Answers("slow", 9, succeeded=1, failed=4, timed_out=4), False),
    ],
)
def test_silent_is_who_had_to_do_something_and_did_nothing(answers: Answers, *, is_silent: bool) -> None:
    assert answers.is_silent is is_silent
