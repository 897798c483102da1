"""A clickable fault, added as docs/how-to/recipes.md says."""

from __future__ import annotations

from pathlib import Path

from support.consoles import near_console
from support.recipe_page import ROOT, followed


def test_the_page_has_a_new_button_which_writes_a_line(tmp_path: Path) -> None:
    text = "case: a\ngoal: item_a_scanned\n"
    with followed("A clickable fault", tmp_path):
        client = near_console(ROOT / "examples/robot_in_the_air/after.yaml", tmp_path)
        (edit,) = (each for each in client.ask("facts")["edits"] if each["name"] == "cut")
        assert (edit["label"], edit["target"], edit["fields"][0]["value"]) == ("Cut off for", "resource", "2 s")
        click = {"text": text, "edit": "cut", "target": "robot", "record": 6, "values": {"for": "3 s"}}
        answer = client.ask("edit", **click)
    assert answer["run"]["end"] == "reached"
    assert answer["text"] == f"{text}network:\n  partitions: [{{resource: robot, at: 0 s, for: 3 s}}]\n"
    assert "refused" in client.ask("edit", **click)
