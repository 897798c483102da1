"""The clicks: what each writes into a case, and what cannot be clicked."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import pytest

from scbm.web.case_edits import CASE_EDITS
from scbm.web.outcome_rules import changed_rules
from support.consoles import CELL, COMMENTED, ConsoleClient, near_console

if TYPE_CHECKING:
    from pathlib import Path

    from support.wording import Wording

TEXT = "case: a\ngoal: gripped\n"


@pytest.fixture
def client(tmp_path: Path) -> ConsoleClient:
    (tmp_path / "cell.yaml").write_text(CELL, encoding="utf-8")
    return near_console(tmp_path / "cell.yaml", tmp_path / "cases")


def click(client: ConsoleClient, text: str, edit: str, target: str, values: dict[str, str]) -> dict[str, Any]:
    return client.ask("edit", text=text, edit=edit, target=target, record=5, values=values)


CLICKS: dict[str, tuple[str, dict[str, str]]] = {
    "succeed": ("1", {}),
    "fail": ("1", {}),
    "time_out": ("1", {}),
    "late": ("1", {"by": "2 s"}),
    "lose": ("1", {"message": "reply"}),
    "double": ("1", {"message": "request"}),
    "set": ("door", {"value": "open"}),
    "hold": ("door", {"value": "open", "hold": "2 s"}),
    "become": ("gripper", {"condition": "slower", "factor": "2"}),
    "restart": ("gripper", {"for": "1 s"}),
    "happen": ("arrive:", {}),
    "goal": ("released", {}),
    "begin": ("belt", {"value": "part"}),
}


def test_each_click_is_a_line_of_the_case(client: ConsoleClient, wording: Wording) -> None:
    assert CLICKS.keys() == CASE_EDITS.keys()
    answers = {name: click(client, TEXT, name, target, values) for name, (target, values) in CLICKS.items()}
    assert all("run" in answer for answer in answers.values())
    wording(f"{name}: {answer['run']['end']}\n{answer['text'][len('case: a') :]}" for name, answer in answers.items())


def test_clicks_add_up_in_a_commented_case(client: ConsoleClient, wording: Wording) -> None:
    text = COMMENTED
    for name, (target, values) in CLICKS.items():
        text = click(client, text, name, target, values)["text"]
    wording(text)


@pytest.mark.parametrize(
    ("edit", "target", "values"),
    [
        ("explode", "1", {}),
        ("fail", "99", {}),
        ("fail", "gripper", {}),
        ("late", "1", {"by": "soon"}),
        ("lose", "1", {"message": "letter"}),
        ("set", "nothing", {"value": "open"}),
        ("set", "door", {"value": "ajar"}),
        ("become", "gripper", {"condition": "tired"}),
        ("become", "gripper", {"condition": "slower", "factor": "much"}),
    ],
)
def test_what_cannot_be_clicked_is_refused(
    client: ConsoleClient, edit: str, target: str, values: dict[str, str], wording: Wording
) -> None:
    wording(click(client, TEXT, edit, target, values)["refused"])


def test_a_record_that_the_run_does_not_have_is_refused(client: ConsoleClient) -> None:
    assert "refused" in client.ask("edit", text=TEXT, edit="fail", target="1", record=1_000)


def test_a_second_value_at_one_moment_replaces_the_first(client: ConsoleClient) -> None:
    once = click(client, TEXT, "set", "belt", {"value": "part"})["text"]
    assert once.count("belt") == 1
    assert click(client, once, "hold", "belt", {"value": "part", "hold": "1 s"})["text"].count("belt") == 1


@pytest.mark.parametrize(
    ("rules", "number", "changed"),
    [
        (None, 1, ["new"]),
        (None, 3, ["any", "any", "new"]),
        ("fail", 2, ["fail", "new", {"outcome": "fail", "from": 3}]),
        (["fail"], 1, ["new"]),
        (["fail"], 3, ["fail", "any", "new"]),
        ([{"outcome": "fail", "times": 9}], 2, ["fail", "new", {"outcome": "fail", "times": 7}]),
        ([{"outcome": "fail", "from": 2}], 4, ["any", "fail", "fail", "new", {"outcome": "fail", "from": 5}]),
        ({"outcome": "fail", "from": 3}, 1, ["new", "any", {"outcome": "fail", "from": 3}]),
    ],
)
def test_rules_of_other_requests_stay(rules: object, number: int, changed: list[object]) -> None:
    assert changed_rules(rules, number, lambda rule: rule.update(outcome="new")) == changed


def test_a_rule_keeps_what_the_click_does_not_say() -> None:
    rules = [{"outcome": "succeed", "after": "9 s"}]
    assert changed_rules(rules, 1, lambda rule: rule.update(reply="lost")) == [
        {"outcome": "succeed", "after": "9 s", "reply": "lost"}
    ]
