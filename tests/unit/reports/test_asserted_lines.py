"""The lines about asserted obligations: long names and long lists fit the terminal."""

from __future__ import annotations

import pytest

from scbm.cases.coverage import (
    STATE_ASPECTS,
    Aspect,
    AssertedObligation,
    AssertedObligations,
    AssertionEvidence,
    Obligation,
)
from scbm.reports.status_lines import MAX_LISTED, asserted_line, unasserted_lines
from support.wording import Wording


def evidence(*names: str) -> AssertionEvidence:
    """Operations of which cases visit all states, and nothing is asserted; and one transition."""
    states = [Obligation(name, aspect) for name in names for aspect in STATE_ASPECTS]
    entries = (AssertedObligation(each, unnoticed=1) for each in (*states, Obligation("warns", Aspect.TAKEN)))
    return AssertionEvidence(AssertedObligations(tuple(entries)))


@pytest.mark.parametrize("columns", [60, 80])
def test_lines_fit_the_width(columns: int, wording: Wording) -> None:
    found = evidence("open_door", "robot_move_to_toolbox_gripper_with_item_of_the_second_shelf")
    lines = [line.plain for line in (*asserted_line(found, columns), *unasserted_lines(found, columns))]
    assert max(map(len, lines)) <= max(columns, 70)
    wording(lines)


def test_long_lists_end_with_a_number(wording: Wording) -> None:
    names = [f"open_{number}" for number in range(MAX_LISTED + 4)]
    lines = [line.plain for line in unasserted_lines(evidence(*names))]
    wording(lines[-1])
    assert len(lines) == 2 + MAX_LISTED + 1


def test_without_results_the_reason_stands_there(wording: Wording) -> None:
    none = AssertionEvidence(None, "the store has no results of `scbm mutate`")
    wording(line.plain for line in asserted_line(none))
    assert list(unasserted_lines(none, 80, "scbm mutate m.yaml")) == []  # the reason names the verb
    others = AssertionEvidence(None, "the results of `scbm mutate` in the store are not about exactly these cases")
    assert [line.plain for line in unasserted_lines(others, 80, "scbm mutate m.yaml")][1].startswith("  scbm mutate")
