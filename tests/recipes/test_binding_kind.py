"""A kind of binding, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import asyncio
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.files import load_model, read_model, write_model
from scbm.nodes.buses.loopback import LoopbackHub
from scbm.nodes.links import bound_link
from scbm.nodes.links.link import Correlation, LinkContext, Reply
from scbm.testing.transports import TRANSPORTS, Transport
from support.recipe_page import followed
from support.wording import Wording

TITLE = "A kind of binding"


def test_a_new_binding_is_read_written_and_reached_by_a_controller(
    scbm: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    function = "support.other_transports:connect_for_a_moment"
    monkeypatch.setitem(TRANSPORTS, "moment", Transport(function, "a moment", joins_processes=True))
    with followed(TITLE, tmp_path) as recipe:
        check, serve = (recipe.in_directory(command, tmp_path) for command in recipe.commands)
        ran = scbm(*check)
        assert (ran.code, "lamp" in ran.out) == (0, True)
        model = load_model(tmp_path / "lamp.yaml")
        assert read_model(write_model(model)) == model
        served = scbm(*serve, "--transport", "moment")
        assert served.code == 0
        wording(re.sub(r"[0-9a-f]{8,}|\b[0-9]{3,}\b", "N", served.out))
    unknown = scbm(*check)
    assert (unknown.code, "error[unknown-key]" in unknown.err, "`timer`" in unknown.err) == (2, True, True)


class Heard:
    """Keeps replies."""

    def __init__(self) -> None:
        self.replies: list[tuple[str, Reply]] = []
        self.is_there = asyncio.Event()

    def on_reply(self, resource: str, reply: Reply) -> None:
        self.replies.append((resource, reply))
        self.is_there.set()

    def on_values(self, resource: str, measurement: object) -> None:
        raise AssertionError(resource, measurement)

    def on_presence(self, resource: str, *, is_there: bool) -> None:
        raise AssertionError(resource, is_there)


def test_requests_go_by_the_new_link_and_a_kind_without_one_is_refused(tmp_path: Path) -> None:
    async def scenario() -> list[tuple[str, Reply]]:
        heard, bus = Heard(), LoopbackHub().join("controller")
        link = bound_link.BoundLink(LinkContext(bus, model.resources[0], heard, print, lambda: 7))
        assert link.is_there
        link.send(Correlation("run", 1), ())
        await heard.is_there.wait()
        return heard.replies

    with followed(TITLE, tmp_path):
        model = load_model(tmp_path / "lamp.yaml")
        reply = Reply(Correlation("run", 1), succeeded=True, measured=(), stamp_ns=1_000_007)
        assert asyncio.run(scenario()) == [("bulb", reply)]
        bound_link.LINKS.popitem()
        with pytest.raises(TypeError, match=r"TimedSuccess.* LINKS"):
            asyncio.run(scenario())
