"""`scbm show`: the size of a model, and the model written out."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from scbm.files import digest_of, load_model, read_model
from support.profiles import longer_but_one_in

if TYPE_CHECKING:
    from collections.abc import Callable

    from conftest import Ran

    Scbm = Callable[..., Ran]

ROOT = Path(__file__).parents[3]
MODELS = [*sorted((ROOT / "tests/models/valid").glob("*.yaml")), *sorted((ROOT / "examples").glob("*/*.yaml"))]
SHORT = "examples/robot_in_the_air/handshakes.yaml"


@pytest.mark.parametrize("path", longer_but_one_in(3, MODELS), ids=lambda path: path.stem)
def test_an_expanded_model_loads_to_the_same_model(scbm: Scbm, path: Path) -> None:
    model = load_model(path)
    shown = scbm("show", str(path), "--expanded")
    assert (shown.code, shown.err) == (0, "")
    again = read_model(shown.out, str(path))  # beside its interfaces
    assert again == model
    assert digest_of(again) == digest_of(model)
    assert not any(key in shown.out for key in ("with:", "effects:", "on_timeout:"))


def test_the_size_is_that_of_the_file_and_that_of_the_model(scbm: Scbm) -> None:
    shown = json.loads(scbm("show", SHORT, "--json").out)
    model = load_model(SHORT)
    assert shown["digest"] == digest_of(model)
    assert shown["obligations"] == 86
    assert shown["sections"]["automatic_transitions"] == {"written": 2, "expanded": 6}
    assert shown["sections"]["operations"] == {"written": 16, "expanded": 16}
    assert shown["lines"]["written"] == len(Path(SHORT).read_text(encoding="utf-8").splitlines())
    assert shown["lines"]["expanded"] == len(scbm("show", SHORT, "--expanded").out.splitlines())
    assert "text" not in shown
    text = json.loads(scbm("show", SHORT, "--json", "--expanded").out)["text"]
    assert text == scbm("show", SHORT, "--expanded").out


def test_what_is_written_includes_parts_and_included_files_once(scbm: Scbm, tmp_path: Path) -> None:
    part = "part: {}\nvariables:\n  {}: {{domain: bool, initial: false}}\n"
    (tmp_path / "lamp.yaml").write_text(part.format("lamp", "lit"), encoding="utf-8")
    (tmp_path / "signals.yaml").write_text(part.format("signals", "go"), encoding="utf-8")
    model = (
        "behavior_model: cell\ninclude: [signals.yaml]\nparts: {a: {use: lamp.yaml}, b: {use: lamp.yaml}}\n"
        "variables: {}\noperations: {}\ngoals: {}\n"
    )
    (tmp_path / "cell.yaml").write_text(model, encoding="utf-8")
    shown = json.loads(scbm("show", tmp_path / "cell.yaml", "--json").out)
    assert shown["files"] == 3
    assert shown["lines"]["written"] == 6 + 3 + 3
    assert shown["sections"]["variables"] == {"written": 2, "expanded": 3}


def test_sections_without_entries_are_left_out(scbm: Scbm) -> None:
    lines = scbm("show", SHORT).out.splitlines()
    assert ["automatic", "transitions", "2", "6"] in [line.split() for line in lines]
    assert not any("environment" in line for line in lines)


def test_a_wrong_model_is_refused(scbm: Scbm) -> None:
    ran = scbm("show", "tests/models/rejected/missing-key_handshakes.yaml", "--expanded")
    assert (ran.code, ran.out) == (2, "")
    assert "error[missing-key]" in ran.err
