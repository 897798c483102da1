"""Cases as files: how they look, and that what cannot be read is not written."""

from __future__ import annotations

from pathlib import Path

from msgspec.structs import replace

from scbm.cases import OutcomeRule
from scbm.files import load_model, read_case, write_case
from scbm.model import Outcome

CELL = load_model(Path(__file__).parent.parent.parent / "models" / "cell.yaml")
CASE = read_case("case: first\ngoal: scanned\n", CELL)
FAIL, SUCCEED, TIMEOUT = Outcome.FAIL, Outcome.SUCCEED, Outcome.TIMEOUT


def outcomes(*rules: OutcomeRule) -> str:
    """What stands under `outcomes`."""
    written = write_case(replace(CASE, outcomes=rules), CELL, None)
    assert write_case(read_case(written, CELL), CELL, None) == written
    return written.partition("outcomes:\n")[2]


def test_a_plain_case_is_short() -> None:
    assert write_case(CASE, CELL, "../cell.yaml") == "case: first\nmodel: ../cell.yaml\ngoal: scanned\n"


def test_comments_stand_above() -> None:
    written = write_case(CASE, CELL, None, ["what it is\nabout", "", "a\x07b"])
    assert written == "# what it is\n# about\n#\n# a\\x07b\ncase: first\ngoal: scanned\n"
    assert read_case(written, CELL) == CASE


def test_a_goal_that_is_not_that_of_the_model_is_written_as_a_predicate() -> None:
    other = read_case("case: first\ngoal: scans == 2\n", CELL)
    assert "goal: scans == 2\n" in write_case(other, CELL, None)
    assert "goal: scans == 2\n" in write_case(replace(other, goal="scanned"), CELL, None)


def test_a_few_equal_outcomes_are_words_and_more_are_counted() -> None:
    assert outcomes(*(OutcomeRule("arm", n, n, FAIL) for n in (1, 2))) == "  arm: [fail, fail]\n"
    assert outcomes(*(OutcomeRule("arm", n, n, FAIL) for n in (1, 2, 3))) == "  arm:\n    - {outcome: fail, times: 3}\n"
    assert outcomes(OutcomeRule("arm", 1, 2, FAIL)) == "  arm:\n    - {outcome: fail, times: 2}\n"


def test_gaps_are_any() -> None:
    assert (
        outcomes(OutcomeRule("arm", 2, 2, FAIL), OutcomeRule("arm", 5, 5, TIMEOUT))
        == "  arm: [any, fail, any, any, timeout]\n"
    )
    assert outcomes(OutcomeRule("arm", 4, 4, FAIL)) == "  arm:\n    - {outcome: any, times: 3}\n    - fail\n"


def test_very_long_rows_are_written_in_parts() -> None:
    written = outcomes(OutcomeRule("arm", 1, 20_001, FAIL))
    assert written.count("times: 10000") == 2
    assert written.endswith("    - fail\n")


def test_a_rule_for_ever_stands_alone_or_at_the_end() -> None:
    assert outcomes(OutcomeRule("arm", 1, None, FAIL)) == "  arm: fail\n"
    assert outcomes(OutcomeRule("arm", 3, None, FAIL)) == "  arm: {outcome: fail, from: 3}\n"
    both = OutcomeRule("arm", 1, 1, TIMEOUT), OutcomeRule("arm", 9, None, FAIL, 1_500_000)
    assert outcomes(*both) == "  arm:\n    - timeout\n    - {outcome: fail, after: 1.5 ms, from: 9}\n"


def test_of_rules_for_one_request_the_first_is_written() -> None:
    written = outcomes(OutcomeRule("arm", 2, 2, TIMEOUT), OutcomeRule("arm", 1, None, FAIL))
    assert written == "  arm:\n    - fail\n    - timeout\n    - {outcome: fail, from: 3}\n"


def test_what_cannot_come_of_a_request_is_left_out() -> None:
    rule = OutcomeRule("scanner", 1, 1, TIMEOUT, 5, (("temperature", 20),), (), (7,), (0, 8))
    assert outcomes(rule) == "  scanner:\n    - {outcome: timeout, request: lost, cancel: [0 s, 8 ns]}\n"
    assert "measured: {temperature: 20}" in outcomes(replace(rule, outcome=FAIL))  # the cause of a failure
    assert "measured: {temperature: 20}, request: lost, reply: 7 ns" in outcomes(replace(rule, outcome=SUCCEED))


def test_a_rule_that_says_nothing_is_not_written() -> None:
    assert (
        write_case(replace(CASE, outcomes=(OutcomeRule("arm", 1, None),)), CELL, None) == "case: first\ngoal: scanned\n"
    )


def test_long_lists_are_written_line_by_line() -> None:
    plan = ("move", "scan") * 12
    case = replace(CASE, expect=replace(CASE.expect, plan=plan))
    written = write_case(case, CELL, None)
    assert "  plan:\n    - move\n    - scan\n" in written
    assert read_case(written, CELL) == case
