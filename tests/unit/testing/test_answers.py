"""How resources answered what they were asked."""

from __future__ import annotations

import pytest

from scbm.notation import read_case, read_model
from scbm.testing import Answers, Tester, count_answers
from scbm.trace import Record, ReplyReceived, RequestCancelled, RequestSent
from support.models import SCAN_CELL

MODEL = read_model(SCAN_CELL)


def counts(outcomes: str, limit: str = "1 h") -> Answers:
    text = f"case: scans\ngoal: scanned\noutcomes: {{scan: {outcomes}}}\nlimits: {{time: {limit}}}\n"
    execution = Tester(MODEL).execute(read_case(text, MODEL))
    (answers,) = count_answers(["scan"], [execution.trace.records])
    return answers


@pytest.mark.parametrize(
    ("outcomes", "expected"),
    [
        ("[succeed]", Answers("scan", 1, 1, 0)),
        ("[fail, fail, succeed]", Answers("scan", 3, 1, 2)),
        ("[timeout, fail, succeed]", Answers("scan", 3, 1, 1)),
    ],
)
def test_each_request_of_a_run_is_counted_by_what_came_of_it(outcomes: str, expected: Answers) -> None:
    assert counts(outcomes) == expected
    assert not expected.is_silent


def test_a_request_that_is_still_in_flight_at_the_end_is_unanswered() -> None:
    answers = counts("[{outcome: succeed, after: 9 s}]", "5 s")
    assert (answers.sent, answers.unanswered, answers.is_silent) == (1, 1, True)


def test_runs_add_up_and_each_resource_has_its_own_counts() -> None:
    sent, replied = RequestSent(0, 1, "robot", (), ()), ReplyReceived(5, 1, "robot", True, ())
    refused = ReplyReceived(5, 1, "gripper", False, ())
    runs: list[list[Record]] = [
        [sent, replied],
        [sent, RequestCancelled(9, 1, "robot", ())],
        [RequestSent(0, 1, "gripper", (), ()), refused],
    ]
    assert count_answers(["gripper", "robot", "idle"], runs) == (
        Answers("gripper", 1, 0, 1),
        Answers("robot", 2, 1, 0),
        Answers("idle"),
    )


def test_who_was_never_asked_is_not_silent() -> None:
    assert not Answers("idle").is_silent
    assert Answers("dead", 2, 0, 1).is_silent
    assert Answers("dead", 2, 0, 1).unanswered == 1
