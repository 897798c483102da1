"""A fault of the network, added as docs/how-to/recipes.md says."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import find

from scbm.cases import Network
from scbm.files import load_model
from scbm.plugins.hypothesis import networks
from scbm.testing import RandomCases
from support.recipe_page import ROOT, Recipe, followed
from support.wording import diagnostic_heads

MODEL = load_model(ROOT / "examples/robot_in_the_air/before.yaml")
MS = 1_000_000


@pytest.fixture
def recipe(tmp_path: Path) -> Iterator[Recipe]:
    with followed("A fault of the network", tmp_path) as recipe:
        yield recipe


@pytest.fixture
def commands(recipe: Recipe, tmp_path: Path) -> dict[str, tuple[str, ...]]:
    return {command[0]: recipe.in_directory(command, tmp_path) for command in recipe.commands}


def test_a_case_file_has_a_new_fault(
    commands: dict[str, tuple[str, ...]], scbm: Callable[..., Any], tmp_path: Path
) -> None:
    late = json.loads(scbm(*commands["replay"], "--json").out)
    case = tmp_path / "late_replies.yaml"
    text = case.read_text(encoding="utf-8")
    case.write_text(text.replace("700 ms", "0 s"), "utf-8")
    in_time = json.loads(scbm(*commands["replay"], "--json").out)
    assert late["simulated_seconds"] >= in_time["simulated_seconds"] + 0.7
    case.write_text(text.replace("700 ms", "often"), "utf-8")
    assert diagnostic_heads(scbm(*commands["replay"]).err) == [f"{case}:4:24: error[bad-duration]"]
    case.write_text(text.replace("reply_delay", "reply_dlay"), "utf-8")
    assert "`reply_delay`" in scbm(*commands["replay"]).err


def test_the_option_and_the_schema_have_a_new_fault(
    commands: dict[str, tuple[str, ...]], scbm: Callable[..., Any]
) -> None:
    late, in_time = scbm(*commands["run"]), scbm(*commands["run"][:-2])
    assert (late.code, in_time.code, late.out == in_time.out) == (0, 0, False)
    network = json.loads(scbm(*commands["schema"]).out)["$defs"]["NetworkFile"]["properties"]
    assert list(network)[-1] == "reply_delay"
    assert network["reply_delay"]["description"] == "How much longer replies travel than requests."


def test_a_new_fault_is_drawn_and_recorded(
    commands: dict[str, tuple[str, ...]], scbm: Callable[..., Any], tmp_path: Path
) -> None:
    drawn = [case.network.reply_delay_ns for case in RandomCases(MODEL, network=None).first(30, 1)]
    assert {bool(delay_ns) for delay_ns in drawn} == {True, False}
    assert all(delay_ns % MS == 0 and delay_ns <= 500 * MS for delay_ns in drawn)
    failures = tmp_path / "failures"
    assert scbm(*commands["test"], "--failures", failures).code == 1
    saved = sorted(failures.glob("*.yaml"))
    assert saved
    for file in saved:
        assert "reply_delay" not in file.read_text(encoding="utf-8")
        assert "error[" not in scbm("replay", str(file)).err


@pytest.mark.slow
@pytest.mark.usefixtures("recipe")
def test_a_new_fault_is_shrunk() -> None:
    assert find(networks(MODEL), lambda network: network.reply_delay_ns > 0) == Network(reply_delay_ns=MS)


def test_without_the_recipe_the_fault_is_unknown(scbm: Callable[..., Any], tmp_path: Path) -> None:
    with followed("A fault of the network", tmp_path):
        pass
    case = tmp_path / "late_replies.yaml"
    replayed = scbm("replay", str(case), "--model", "examples/robot_in_the_air/before.yaml")
    assert (replayed.code, diagnostic_heads(replayed.err)) == (2, [f"{case}:4:11: error[unknown-key]"])
