"""The models of the study: each passes the strict check, names its source, and is in the table of its folder."""

from __future__ import annotations

import re
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from support.profiles import longer_but_one_in

if TYPE_CHECKING:
    from collections.abc import Callable

FOLDER = Path(__file__).parents[2] / "study" / "models"
MODELS = sorted(FOLDER.glob("*.yaml"))
ROW = re.compile(r"^\| \[(\w+\.yaml)\]\(\1\) \| \S[^|]* \| \S.* \|$", re.MULTILINE)


@pytest.mark.parametrize("path", longer_but_one_in(3, MODELS), ids=[path.stem for path in MODELS])
def test_a_model_passes_the_strict_check(path: Path, scbm: Callable[..., Any]) -> None:
    ran = scbm("check", "--strict", path)
    assert (ran.code, ran.err) == (0, "")


@pytest.mark.parametrize("path", MODELS, ids=[path.stem for path in MODELS])
def test_a_model_says_its_source_and_what_was_left_out(path: Path) -> None:
    header, _, model = path.read_text(encoding="utf-8").partition("behavior_model: ")
    assert re.search(r"^# Source: https?://\S+", header, re.MULTILINE)
    assert re.search(r"^# Kept: ", header, re.MULTILINE)
    assert re.search(r"^# Left out: ", header, re.MULTILINE)
    assert header.endswith("# Written by hand for this study.\n\n")
    assert model.startswith(f"{path.stem}\n")


def test_the_table_has_each_model() -> None:
    assert ROW.findall((FOLDER / "README.md").read_text(encoding="utf-8")) == [path.name for path in MODELS]


def test_the_report_is_about_the_models_as_they_are() -> None:
    report = (FOLDER.parent / "results" / "report.md").read_text(encoding="utf-8")
    written = dict(re.findall(r"^\| (\w+) \| written \|.*\| `\w+` \| `(\w+)` \|$", report, re.MULTILINE))
    assert written == {path.stem: sha256(path.read_bytes()).hexdigest() for path in MODELS}
