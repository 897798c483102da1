"""`scbm draw`: forms, selections, colours of stores and certificates, and wrong input."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from scbm.drawing import layered_layout
from support.wording import diagnostic_heads

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Ran
    from support.wording import Wording

    Scbm = Callable[..., Ran]

pytest.importorskip("quickjs", reason="the extra `draw` is not installed")

AIR = "examples/robot_in_the_air/before.yaml"
LAMP = """
behavior_model: lamp
variables: {on: {domain: bool, initial: false}}
operations:
  switch: {pre: {g: on == false}, post: {g: true, a: [on <- true]}}
goals: {lit: on == true}
"""


@pytest.fixture
def lamp(tmp_path: Path) -> Path:
    path = tmp_path / "lamp.yaml"
    path.write_text(LAMP, encoding="utf-8")
    return path


def test_the_default_form_is_svg(scbm: Scbm) -> None:
    ran = scbm("draw", AIR)
    assert (ran.code, ran.err) == (0, "")
    assert ran.out.startswith("<svg ")
    assert ran.out == scbm("draw", AIR, "--svg").out


def test_a_page_has_no_script_and_asks_for_nothing(scbm: Scbm) -> None:
    page = scbm("draw", AIR, "--html").out
    assert "default-src 'none'" in page
    assert "<script" not in page
    assert "src=" not in page.replace("default-src", "").replace("style-src", "")


def test_mermaid_has_a_diagram_for_each_variable(scbm: Scbm) -> None:
    out = scbm("draw", AIR, "--mermaid").out
    assert out.count("stateDiagram-v2") == out.count("\n### ") + 1 == 7


def test_a_plan_is_drawn_instead_of_automata(scbm: Scbm, lamp: Path) -> None:
    assert "switch" in scbm("draw", lamp, "--goal", "lit").out
    assert scbm("draw", lamp, "--goal", "on == true", "--mermaid").out.count("flowchart LR") == 1


def test_without_a_plan_there_is_no_picture(scbm: Scbm, lamp: Path, wording: Wording) -> None:
    text = LAMP.replace("initial: false", "initial: true").replace("lit: on == true", "dark: on == false")
    lamp.write_text(text, encoding="utf-8")
    ran = scbm("draw", lamp, "--goal", "dark")
    assert (ran.code, ran.out) == (1, "")
    wording(ran.err)


@pytest.mark.parametrize(
    "wrong",
    [
        ("robot_att", "scan", "robot_req_state"),
        ("--svg", "--html"),
        ("robot_at", "--goal", "item_a_scanned"),
        ("robott", "--store", "nothing.db"),
        ("--goal", "item_b_scanned"),
    ],
    ids=" ".join,
)
def test_wrong_words_are_errors_with_places(scbm: Scbm, wording: Wording, wrong: tuple[str, ...]) -> None:
    ran = scbm("draw", AIR, *wrong)
    assert (ran.code, ran.out) == (2, "")
    wording(ran.err)


def test_a_model_with_errors_has_those_of_check(scbm: Scbm, lamp: Path) -> None:
    lamp.write_text(LAMP.replace("on <- true", "on <- 3, off <- true"), encoding="utf-8")
    assert scbm("draw", lamp, "on").err == scbm("check", lamp).err != ""


def test_a_store_colours_what_its_cases_visited(scbm: Scbm, lamp: Path, tmp_path: Path) -> None:
    store = tmp_path / "lamp.db"
    scbm("test", lamp, "--cases", "1", "--store", store)
    svg = scbm("draw", lamp, "--store", store).out
    assert "var(--visited)" in svg
    assert "switch: covered: 1 case" in svg


def test_a_store_of_another_model_is_refused(scbm: Scbm, lamp: Path, tmp_path: Path) -> None:
    store = tmp_path / "lamp.db"
    scbm("test", lamp, "--cases", "1", "--store", store)
    lamp.write_text(LAMP.replace("g: on == false", "g: true"), encoding="utf-8")
    ran = scbm("draw", lamp, "--store", store)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{store}: error[store-other-model]"])


def test_certificates_paint_what_they_prove_and_wrong_ones_nothing(scbm: Scbm, lamp: Path, tmp_path: Path) -> None:
    timed = LAMP.replace("post: {", "deadline: 1 s, timedout: [on <- true], post: {")
    lamp.write_text(timed, encoding="utf-8")
    scbm("close", lamp, "--out", tmp_path / "closed", "--max-states", "1000")
    folder = tmp_path / "closed/certificates"
    assert "var(--uncoverable)" in scbm("draw", lamp, "--certificates", folder).out
    for path in folder.glob("*.json"):
        certificate = json.loads(path.read_text(encoding="utf-8"))
        if "claims" in certificate:
            path.write_text(json.dumps({**certificate, "model": "0" * 64}, indent=2), encoding="utf-8")
    ran = scbm("draw", lamp, "--certificates", folder)
    assert "var(--uncoverable)" not in ran.out.partition("</style>")[2]
    assert ran.err


def test_without_the_extra_a_sentence_names_it(
    scbm: Scbm, lamp: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setitem(sys.modules, "quickjs", None)
    ran = scbm("draw", lamp)
    assert (ran.code, ran.out) == (2, "")
    wording(ran.err)
    assert scbm("draw", lamp, "--mermaid").code == 0


def test_an_automaton_that_is_too_large_for_a_picture_is_reported(
    scbm: Scbm, lamp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scbm.drawing.layered_layout._MAX_MEMORY", 100_000)
    layered_layout._context.cache_clear()
    try:
        ran = scbm("draw", lamp)
    finally:
        layered_layout._context.cache_clear()
    assert (ran.code, ran.out) == (2, "")
    assert diagnostic_heads(ran.err) == ["scbm draw: error[picture-too-large]"]
