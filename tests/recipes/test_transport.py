"""A transport, added as docs/how-to/recipes.md says."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.testing.transports import TRANSPORTS, Transport
from support.recipe_page import followed
from support.wording import diagnostic_heads


def test_a_new_transport_carries_the_messages_of_a_test(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed("A transport", tmp_path) as recipe:
        (command,) = recipe.commands
        ran = scbm(*command, "--failures", tmp_path / "failures")
        assert [f"the {node} joins" in ran.err for node in ("controller", "resources", "tester")] == [True] * 3
        assert "over announced loopback, 100 " in ran.out
        domain = scbm(*command, "--domain", "3")
        assert (domain.code, diagnostic_heads(domain.err)) == (2, ["--domain: error[bad-option]"])
        assert "`--transport announced`" in domain.err
        for_nodes = scbm("node", "tester", "examples/robot_in_the_air/after.yaml", "--transport", "announced")
        assert (for_nodes.code, "announced" in for_nodes.err) == (2, True)
    unknown = scbm(*command)
    assert (unknown.code, "announced" in unknown.err) == (2, True)


def test_a_middleware_that_is_missing_is_reported_by_its_name(
    scbm: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    function = "support.other_transports:connect_without_middleware"
    monkeypatch.setitem(TRANSPORTS, "zeromq", Transport(function, "ZeroMQ domain {domain}", joins_processes=True))
    model = "examples/robot_in_the_air/after.yaml"
    for command in (("test", model, "--cases", 1), ("node", "controller", model), ("node", "tester", model)):
        ran = scbm(*command, "--transport", "zeromq")
        assert (ran.code, diagnostic_heads(ran.err)) == (2, ["ZeroMQ: error[bus-unusable]"])
