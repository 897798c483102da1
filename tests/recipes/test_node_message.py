"""A message between nodes, added as docs/how-to/recipes.md says."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.model.json_reader import JsonError
from scbm.nodes import node_messages
from support.recipe_page import followed

SLOWED = '{"kind":"slowed","run":"run_1","node":"7","behind_ns":5}'


def test_a_new_message_comes_back_as_it_was_and_a_wrong_one_is_refused(tmp_path: Path) -> None:
    before = node_messages.VERSION
    with followed("A message between nodes", tmp_path):
        message = node_messages.decode(SLOWED)
        assert (type(message).__name__, message.kind, node_messages.encode(message)) == ("Slowed", "slowed", SLOWED)
        for wrong, field in (("-5", "behind_ns"), ('5, "more": 1', "more")):
            with pytest.raises(JsonError, match=f"`{field}`"):
                node_messages.decode(SLOWED.replace("5}", f"{wrong}}}"))
        assert before + 1 == node_messages.VERSION
    with pytest.raises(JsonError, match="slowed"):
        node_messages.decode(SLOWED)
