"""Why cases of a store failed: what is alike is one cause."""

from __future__ import annotations

import json
from pathlib import Path

from msgspec.structs import replace

from scbm.cases.trace import End
from scbm.reports.ci.sarif import sarif_log
from scbm.reports.stored_cases import causes_of
from scbm.store import Drawn, History
from scbm.testing import Failure, FailureKind, Verdict
from support.histories import EXAMPLE, history_of

FAILS = Path(__file__).parents[2] / "models/fails_at_run"


def failing(*cases: tuple[Failure, ...]) -> History:
    history = history_of(EXAMPLE / "before.yaml", len(cases))
    pairs = zip(history.cases, cases, strict=True)
    return replace(
        history, cases=tuple(replace(case, verdict=Verdict(End.REACHED, failures)) for case, failures in pairs)
    )


def shown_causes(history: History) -> list[tuple[str, list[str]]]:
    return [(cause.failure.message, list(cause.labels)) for cause in causes_of(history)]


def test_nothing_failed() -> None:
    assert causes_of(history_of(EXAMPLE / "before.yaml", 3)) == ()


def test_cases_that_fail_for_one_reason_are_one_cause_with_the_words_of_the_first() -> None:
    history = history_of(FAILS / "requirement.yaml", 3)
    (cause,) = causes_of(history)
    assert cause.failure == history.cases[0].verdict.failures[0]
    assert cause.case == history.cases[0]
    assert cause.labels == history.labels


def test_kind_and_subject_distinguish_causes() -> None:
    one = Failure(FailureKind.REQUIREMENT, "one", "one at 1 s")
    later = Failure(FailureKind.REQUIREMENT, "one", "one at 2 s")
    two = Failure(FailureKind.REQUIREMENT, "two", "two")
    cycle = Failure(FailureKind.LIVELOCK, "one", "round")
    assert shown_causes(failing((one, two), (later,), (cycle, two), ())) == [
        ("one at 1 s", ["seed-1-case-1", "seed-1-case-2"]),
        ("two", ["seed-1-case-1", "seed-1-case-3"]),
        ("round", ["seed-1-case-3"]),
    ]


def test_what_a_case_expects_is_its_own() -> None:
    final = Failure(FailureKind.EXPECTATION, "final", "expected")
    assert shown_causes(failing((final,), (final, final))) == [
        ("expected", ["seed-1-case-1"]),
        ("expected", ["seed-1-case-2"]),
    ]


def test_a_requirement_of_another_command_is_another_cause() -> None:
    """Each command line names its first requirement `required_1`."""
    history = failing(*[(Failure(FailureKind.REQUIREMENT, "required_1", f"broken {n}"),) for n in range(3)])
    sentences = ("never scanned_a == true", "never scanned_a == false", "never scanned_a == true")
    cases = tuple(
        replace(case, recipe=Drawn(1, number, requirements=(("required_1", sentence),)))
        for number, (case, sentence) in enumerate(zip(history.cases, sentences, strict=True), start=1)
    )
    history = replace(history, cases=cases)
    assert shown_causes(history) == [("broken 0", ["seed-1-case-1", "seed-1-case-3"]), ("broken 1", ["seed-1-case-2"])]
    one, two = json.loads(sarif_log(history))["runs"][0]["results"]
    assert one["partialFingerprints"] != two["partialFingerprints"]


def test_a_goal_that_was_not_reached_is_another_cause_than_another_goal() -> None:
    history = failing(*[(Failure(FailureKind.NOT_REACHED, "unsolvable", f"no plan {n}"),) for n in range(3)])
    cases = zip(history.cases, ("one", "two", "one"), strict=True)
    history = replace(history, cases=tuple(replace(case, goal=goal) for case, goal in cases))
    assert shown_causes(history) == [
        ("no plan 0", ["seed-1-case-1", "seed-1-case-3"]),
        ("no plan 1", ["seed-1-case-2"]),
    ]


def test_a_goal_only_distinguishes_what_is_not_reached() -> None:
    history = failing(*[(Failure(FailureKind.LIVELOCK, "round", f"round {n}"),) for n in range(2)])
    cases = zip(history.cases, ("one", "two"), strict=True)
    history = replace(history, cases=tuple(replace(case, goal=goal) for case, goal in cases))
    assert shown_causes(history) == [("round 0", ["seed-1-case-1", "seed-1-case-2"])]
