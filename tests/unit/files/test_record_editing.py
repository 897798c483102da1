"""The recorded run is replaced in the text of a case, and nothing else changes: neither what it says nor how."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import RecordedGoal, RecordedRun
from scbm.files import load_model, read_case
from scbm.files.record_editing import with_record
from scbm.model import InputError, PlannerIdentity, Slug
from support.wording import Wording

MODELS = Path(__file__).parents[2] / "models"
CELL = load_model(MODELS / "cell.yaml")
TEXTS = {path.name: path.read_text(encoding="utf-8") for path in sorted((MODELS / "valid_cases").glob("*.yaml"))}

RUN = RecordedRun(
    "reached",
    planner=PlannerIdentity("greedy", "1"),
    goals=(RecordedGoal("reached", ("move/executing", "move/completed"), ("move",), (("robot_at", "box_a"),), 0),),
)
LINES = """\
recorded:
  end: reached
  planner: greedy 1
  time: 0 s
  visits:
    move: [executing, completed]
  order: [move]
  final: {robot_at: box_a}"""
FLOW = (
    "recorded: {end: reached, planner: greedy 1, time: 0 s, visits: {move: [executing, completed]}, order: [move], "
    "final: {robot_at: box_a}}"
)
HEAD = "# why\ncase: one   # its name\nmodel: ../cell.yaml\n\ngoal: at_box\n"


def edited(text: str, run: RecordedRun = RUN) -> str:
    """The edited text, which says the same but for the record, and stays as it is if it is edited again."""
    new = with_record(text, "one.yaml", run, CELL)
    assert read_case(new, CELL) == replace(read_case(text, CELL), recorded=run)
    assert with_record(new, "one.yaml", run, CELL) == new
    return new


def test_a_record_is_added_at_the_end() -> None:
    assert edited(HEAD) == f"{HEAD}{LINES}\n"


def test_comments_at_the_end_stay_before_it() -> None:
    assert edited(f"{HEAD}# the end\n\n") == f"{HEAD}# the end\n{LINES}\n\n"


def test_a_text_without_a_last_line_end_gets_none() -> None:
    assert edited(HEAD.rstrip("\n")) == f"{HEAD}{LINES}"


@pytest.mark.parametrize(
    "old",
    [
        "recorded: {end: aborted}",
        "recorded:\n  end: aborted\n  # inside\n  trace: " + "a" * 64,
        "recorded:\n  end: aborted\n  visits: {}\n  order:\n    - scan\n    - scan",
        '"recorded": {end: aborted,\n  order: [scan]}',
        "recorded: &a {end: aborted}",
    ],
)
def test_an_old_record_is_replaced_where_it_stands(old: str) -> None:
    rest = "   # compared\n\n# then\nlimits: {plans: 3}\n"
    assert edited(f"{HEAD}{old}{rest}") == f"{HEAD}{LINES}{rest}"


def test_line_ends_the_byte_order_mark_and_indentation_stay() -> None:
    windows = HEAD.replace("\n", "\r\n")
    assert edited(f"\N{BYTE ORDER MARK}{windows}") == f"\N{BYTE ORDER MARK}{windows}{LINES}\n".replace(
        "\r\n", "\n"
    ).replace("\n", "\r\n")
    assert (
        edited("  case: one\n  goal: at_box\n")
        == "  case: one\n  goal: at_box\n  " + LINES.replace("\n", "\n  ") + "\n"
    )


def test_the_marks_of_a_document_stay_around_it() -> None:
    assert edited(f"---\n{HEAD}...\n") == f"---\n{HEAD}{LINES}\n...\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{case: one, goal: at_box}\n", f"{{case: one, goal: at_box, {FLOW}}}\n"),
        ("{case: one, goal: at_box,\n}  # end\n", f"{{case: one, goal: at_box, {FLOW},\n}}  # end\n"),
        ("{case: one, recorded: {end: aborted}, goal: at_box}", f"{{case: one, {FLOW}, goal: at_box}}"),
    ],
)
def test_a_case_in_braces_keeps_its_braces(text: str, expected: str) -> None:
    assert edited(text) == expected


@pytest.mark.parametrize(
    "text",
    [
        f"{HEAD}? recorded\n: {{end: aborted}}\n",
        "case: one\ngoal: at_box\nrecorded: {end: aborted, order: &names [move]}\nexpect: {order: *names}\n",
    ],
)
def test_a_layout_that_does_not_allow_the_edit_is_an_error(text: str, wording: Wording) -> None:
    with pytest.raises(InputError) as raised:
        with_record(text, "one.yaml", RUN, CELL)
    (diagnostic,) = raised.value.diagnostics
    assert diagnostic.slug is Slug.WRONG_SHAPE
    wording(diagnostic.message)
    assert diagnostic.source_line is not None
    assert "recorded" in diagnostic.source_line


def test_what_is_no_case_is_an_error_of_the_case() -> None:
    with pytest.raises(InputError) as raised:
        with_record("case: one\ngoal: nowhere\n", "one.yaml", RUN, CELL)
    assert [diagnostic.slug for diagnostic in raised.value.diagnostics] == [Slug.UNKNOWN_GOAL]


@pytest.mark.parametrize("name", TEXTS)
def test_every_valid_case_can_get_a_record(name: str) -> None:
    edited(TEXTS[name])
