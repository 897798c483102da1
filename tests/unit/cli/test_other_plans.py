"""`scbm close --requirements` shows what only other plans than those of the planner violate, and writes the cases."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Ran
from scbm.files import load_model, read_case
from support.wording import Wording

TWO_LAMPS = """\
behavior_model: two_lamps
variables:
  lamp: {domain: [off, left, right], initial: off}
resources:
  relay: {simulation: {latency: 1 s}}
operations:
  left: {request: relay, deadline: 5 s, guard: lamp == off, effects: [lamp <- left]}
  right: {request: relay, deadline: 5 s, guard: lamp == off, effects: [lamp <- right]}
goals:
  lit: {goal: lamp == left || lamp == right, may_end: [unsolvable, time_limit]}
requirements:
  never_right: never lamp == right
"""
NAME = "never_right-other-plans-1"

Scbm = Callable[..., Ran]

pytestmark = pytest.mark.usefixtures("shared_closings")


@pytest.fixture
def lamps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "two_lamps.yaml"
    path.write_text(TWO_LAMPS, encoding="utf-8")
    return path


def test_the_case_lies_apart_from_the_suite_and_fails_when_it_is_run(scbm: Scbm, lamps: Path, wording: Wording) -> None:
    ran = scbm("close", lamps, "--requirements", "--out", "closed")
    assert ran.code == 0, "the requirement holds under the plans of the planner"
    wording(ran.out[ran.out.index("\nRequirements") :])
    path = Path("closed/other_plans") / f"{NAME}.yaml"
    assert [plan.plan for plan in read_case(path.read_text(encoding="utf-8"), load_model(lamps)).plans] == [("right",)]
    assert scbm("test", lamps, "closed/cases").code == 0
    failed = scbm("test", lamps, "closed/other_plans", "--json", "--failures", "small")
    assert failed.code == 1
    (finding,) = json.loads(failed.out)["findings"]
    assert finding["subject"] == "never_right"
    small = next(Path("small").glob("*.yaml"))
    assert [plan.plan for plan in read_case(small.read_text(encoding="utf-8"), load_model(lamps)).plans] == [("right",)]
    assert scbm("replay", small).code == 1, "the small case needs these plans"


def test_json_and_explain_name_the_case(scbm: Scbm, lamps: Path) -> None:
    found = json.loads(scbm("close", lamps, "--requirements", "--json").out)
    (decided,) = (each for each in found["requirements"]["decided"] if each["name"] == "never_right")
    assert (decided["status"], decided["other_plans"]["case"]) == ("holds_canonical", NAME)
    assert [each["name"] for each in found["requirements"]["other_plans"]] == [NAME]
    assert found["failed"] == []
    explained = scbm("explain", lamps, "never_right")
    assert explained.code == 0
    assert "plans:\n  - [right]\n" in explained.out
    assert f"with other plans violated by {NAME}" in re.sub(r"\s+", " ", explained.out)


def test_reports_of_a_store_name_the_case(scbm: Scbm, lamps: Path) -> None:
    scbm("close", lamps, "--requirements", "--store", "s.db", "--out", "closed")
    scbm("test", lamps, "--cases", "3", "--store", "s.db")
    kinds = ("html", "markdown", "junit", "sarif")
    ran = scbm("report", "s.db", "--json", *(part for kind in kinds for part in (f"--{kind}", f"s.{kind}")))
    texts = [ran.out, *(Path(f"s.{kind}").read_text(encoding="utf-8").replace("\\", "") for kind in kinds)]
    words = f"with other plans violated by {NAME} (closed/other_plans/{NAME}.yaml)"
    assert all(words in text for text in texts)


def test_a_later_closing_removes_a_case_that_nothing_needs_any_more(scbm: Scbm, lamps: Path) -> None:
    scbm("close", lamps, "--requirements", "--out", "closed")
    lamps.write_text(TWO_LAMPS.partition("requirements:")[0], encoding="utf-8")
    scbm("close", lamps, "--requirements", "--out", "closed")
    assert list(Path("closed/other_plans").iterdir()) == []
