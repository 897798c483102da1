"""`scbm close --requirements --store` keeps decisions, and all reports about the same model print them."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from conftest import Ran
from scbm.model.requirements import BUILT_IN_NAMES

LAMP = """\
behavior_model: lamp
variables:
  lamp: {domain: [off, on], initial: off}
resources:
  relay: {simulation: {latency: 1 s}}
operations:
  switch: {request: relay, deadline: 5 s, guard: lamp == off, effects: [lamp <- on]}
goals:
  lit: {goal: lamp == on, may_end: [aborted, unsolvable, time_limit, replan_limit]}
requirements_off: {recovers: the lamp may stay off}
requirements:
  asked_first: switch.state == executing before lamp == on
  soon: switch.state == executing leads to lamp == on within 60 s
"""
WRONG = "  never_on: never lamp == on\n"

Scbm = Callable[..., Ran]

pytestmark = pytest.mark.usefixtures("shared_closings")


@pytest.fixture
def lamp(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "lamp.yaml"
    path.write_text(LAMP, encoding="utf-8")
    return path


def words(text: str) -> dict[str, str]:
    """What a report has beside each requirement about cases and closing, by name."""
    return dict(re.findall(r"^ {4}(\w+) +checked in \d+ cases; (.*)$", text, re.MULTILINE))


def test_within_is_left_to_cases_and_counted_and_the_exit_code_does_not_depend_on_it(scbm: Scbm, lamp: Path) -> None:
    ran = scbm("close", lamp, "--requirements", "--json")
    found = json.loads(ran.out)["requirements"]
    statuses = {each["name"]: each["status"] for each in found["decided"]}
    assert (statuses["asked_first"], statuses["soon"], found["cases_only"], ran.code) == ("holds", "cases_only", 1, 0)


def test_the_last_closing_of_the_same_model_counts(scbm: Scbm, lamp: Path) -> None:
    arguments = ("test", lamp, "--cases", "3", "--seed", "1", "--store", "s.db", "--no-shrink")
    assert words(scbm(*arguments).out)["asked_first"] == "not decided"
    assert scbm("close", lamp, "--requirements", "--store", "s.db").code == 0
    for report in (scbm(*arguments), scbm("report", "s.db")):
        found = words(report.out)
        assert found["asked_first"] == "holds"
        assert found["soon"].startswith("judged")
        assert found["no_orphan"] == "holds"
        assert "recovers" not in found
    scbm("combine", "s.db", "-o", "united.db")
    assert words(scbm("report", "united.db").out)["asked_first"] == "holds"


def rows(text: str) -> dict[str, dict[str, Any]]:
    """What JSON has about each requirement, by name."""
    return {each["name"]: each for each in json.loads(text)["requirements"]}


def test_a_requirement_of_the_command_line_is_a_row_by_its_sentence(scbm: Scbm, lamp: Path) -> None:
    sentence, long = "never lamp == on", "always relay_req_state == executing -> lamp == off"
    scbm("close", lamp, "--require", "never   lamp==on", "--require", long, "--store", "s.db", "--out", "closed")
    arguments = ("test", lamp, "--cases", "3", "--store", "s.db", "--no-shrink", "--require", sentence, "--json")
    tested = rows(scbm(*arguments, "--require", "never relay_req_state == failed").out)
    reported = rows(scbm("report", "s.db", "--json").out)
    for found in (tested, reported):
        assert (found[sentence]["asked"], found[sentence]["cases"]) == (True, 3)
        assert found[sentence]["decision"]["words"] == "violated by required_1-1 (closed/cases/required_1-1.yaml)"
        assert found["never relay_req_state == failed"]["decision"] is None
        assert not found["asked_first"]["asked"]
    assert long not in tested, "the command has not asked for it"
    assert (reported[long]["cases"], reported[long]["decision"]["status"]) == (0, "holds")
    kinds = ("html", "markdown", "junit", "sarif")
    text = scbm("report", "s.db", *(part for kind in kinds for part in (f"--{kind}", f"s.{kind}"))).out
    assert f"    {long}\n" in text, "a long sentence has a line of its own"
    assert re.search(r"^    never lamp == on +checked in 3 cases", text, re.MULTILINE)
    texts = [Path(f"s.{kind}").read_text(encoding="utf-8").replace("\\", "") for kind in kinds]
    assert all("violated by required_1-1" in each for each in texts)
    scbm("combine", "s.db", "-o", "united.db")
    assert rows(scbm("report", "united.db", "--json").out)[long]["decision"]["status"] == "holds"


def test_a_row_says_where_the_case_is_that_the_store_lacks(scbm: Scbm, lamp: Path) -> None:
    lamp.write_text(LAMP + WRONG, encoding="utf-8")
    scbm("close", lamp, "--requirements", "--store", "s.db")
    test = ("test", lamp, "--store", "s.db", "--no-shrink", "--json")
    found = rows(scbm(*test, "--cases", "1").out)["never_on"]["decision"]
    assert (found["is_kept"], found["file"]) == (False, "")
    assert "--out" in found["words"]
    scbm("close", lamp, "--requirements", "--store", "s.db", "--out", "closed")
    words = rows(scbm("report", "s.db", "--json").out)["never_on"]["decision"]["words"]
    assert words == "violated by never_on-1 (closed/cases/never_on-1.yaml)"
    found = rows(scbm(*test, "closed").out)["never_on"]["decision"]
    assert (found["words"], found["is_kept"]) == ("violated by never_on-1", True)


def test_decisions_of_another_model_do_not_count(scbm: Scbm, lamp: Path) -> None:
    scbm("test", lamp, "--cases", "1", "--store", "s.db")
    lamp.write_text(LAMP + WRONG, encoding="utf-8")
    refused = scbm("close", lamp, "--requirements", "--store", "s.db", "--out", "closed")
    assert (refused.code, refused.out) == (2, "")
    assert not Path("closed").exists(), "refused before anything is computed"
    assert scbm("close", lamp, "--store", "t.db").code == 2


@pytest.mark.parametrize("other", ["{goals: single}", "{plans: drawn}"])
def test_decisions_about_other_runs_do_not_count(scbm: Scbm, lamp: Path, other: str) -> None:
    arguments = ("test", lamp, "--cases", "3", "--seed", "1", "--store", "s.db", "--no-shrink")
    scbm("close", lamp, "--requirements", "--store", "s.db")
    for runs, answer in ((LAMP, "holds"), (f"{LAMP}runs: {other}\n", "not decided"), (LAMP, "holds")):
        lamp.write_text(runs, encoding="utf-8")
        for report in (scbm(*arguments), scbm("report", "s.db")):
            assert words(report.out)["asked_first"] == answer, report.out


def test_decisions_count_for_the_planner_of_the_model(scbm: Scbm, lamp: Path) -> None:
    other = "  blink: {request: relay, deadline: 5 s, guard: lamp == off, effects: [lamp <- on]}\ngoals:"
    lamp.write_text(f"{LAMP.replace('goals:', other)}planner: greedy\n", encoding="utf-8")
    scbm("close", lamp, "--requirements", "--store", "s.db")
    for report in (("test", lamp, "--cases", "3", "--store", "s.db"), ("report", "s.db")):
        decision = rows(scbm(*report, "--json").out)["asked_first"]["decision"]
        assert (decision["status"], decision["other_plans"]["case"]) == ("holds_planner", "asked_first-other-plans-1")


def test_a_requirement_that_is_switched_on_is_one_of_them(scbm: Scbm, lamp: Path) -> None:
    lamp.write_text(f"{LAMP}requirements_on: [one_request_at_a_time]\n", encoding="utf-8")
    scbm("close", lamp, "--requirements", "--store", "s.db")
    for report in (scbm("test", lamp, "--cases", "3", "--store", "s.db"), scbm("report", "s.db")):
        assert words(report.out)["one_request_at_a_time"].startswith("judged by cases")
    ran = scbm("explain", lamp, "one_request_at_a_time")
    assert (ran.code, "judged by cases" in ran.out) == (0, True)


def test_every_format_has_it_beside_the_requirement(scbm: Scbm, lamp: Path) -> None:
    lamp.write_text(LAMP + WRONG, encoding="utf-8")
    assert scbm("close", lamp, "--requirements", "--store", "s.db", "--out", "closed").code == 1
    assert scbm("report", "s.db").code == 2  # there are no cases yet
    assert scbm("test", lamp, "closed", "--store", "s.db", "--no-shrink").code == 1
    kinds = ("html", "markdown", "junit", "sarif")
    ran = scbm("report", "s.db", "--json", *(part for kind in kinds for part in (f"--{kind}", f"s.{kind}")))
    texts = {"json": ran.out} | {kind: Path(f"s.{kind}").read_text(encoding="utf-8") for kind in kinds}
    assert not [kind for kind, text in texts.items() if "violated by never_on-1" not in text.replace("\\", "")]
    decided = {
        each["name"]: each["decision"]["status"]
        for each in json.loads(texts["json"])["requirements"]
        if each["decision"]
    }
    assert (decided["never_on"], decided["asked_first"], decided["stops"]) == ("violated", "holds", "holds")
    (run,) = json.loads(texts["sarif"])["runs"]
    lines = {
        result["message"]["text"].split()[0]: result["locations"][0]["physicalLocation"]["region"]["startLine"]
        for result in run["results"]
        if result["ruleId"] == "requirement_in_all_runs"
    }
    assert lines["never_on"] == LAMP.count("\n") + 1
    assert all(run["tool"]["driver"]["rules"][each["ruleIndex"]]["id"] == each["ruleId"] for each in run["results"])


STUCK = """\
behavior_model: stuck
variables:
  lamp: {domain: [off, on], initial: off}
  button: {domain: [up, down], initial: up}
  latch: {domain: [free, set], initial: free}
operations:
  switch: {pre: {g: lamp == off && latch == free}, post: {g: true, a: [lamp <- on]}}
  dim: {pre: {g: lamp == on && latch == free}, post: {g: true, a: [lamp <- off]}}
automatic_transitions:
  trip: {g: button == down && latch == free, a: [latch <- set]}
environment:
  press: {guard: button == up, actions: [button <- down], after: 5 s}
  pull: {guard: button == down, actions: [button <- up], after: 5 s}
goals: {lit: {goal: lamp == on, may_end: [time_limit]}, dark: lamp == off}
"""


def test_every_report_says_that_an_answer_rests_on_a_variable_without_a_source(scbm: Scbm, lamp: Path) -> None:
    lamp.write_text(STUCK, encoding="utf-8")
    kinds = ("html", "markdown", "junit", "sarif")
    closed = scbm("close", lamp, "--requirements", "--store", "s.db")
    texts = {"close": closed.out, "test": scbm("test", lamp, "--cases", "3", "--store", "s.db").out}
    texts |= {"report": scbm("report", "s.db").out, "explain": scbm("explain", lamp, "non_blocking").out}
    ran = scbm("report", "s.db", "--json", *(part for kind in kinds for part in (f"--{kind}", f"s.{kind}")))
    texts |= {kind: Path(f"s.{kind}").read_text(encoding="utf-8") for kind in kinds}
    plain = {kind: re.sub(r"[`\\]|</?code>|\s+", " ", text) for kind, text in texts.items()}
    condition = re.compile(r"holds[: \w]*, if +latch +can be changed from outside: it has no +source")
    assert not [kind for kind, text in plain.items() if not condition.search(text)], plain
    undecided = re.compile(r"as if `latch` could\s+be changed")
    assert undecided.search(scbm("test", lamp, "--cases", "1").out)
    found = {each["name"]: each["decision"] for each in json.loads(ran.out)["requirements"] if each["decision"]}
    assert (found["non_blocking"]["status"], found["non_blocking"]["undeclared"]) == ("holds", ["latch"])
    closing = json.loads(scbm("close", lamp, "--requirements", "--json").out)["requirements"]["decided"]
    assert {each["name"]: each["undeclared"] for each in closing}["non_blocking"] == ["latch"]


PLAIN = "case: plain\ngoal: lit\n"
CASES = {
    "other_goals": "case: other\ngoal: latch == free && lamp == on\n",
    "force": "case: forced\ngoal: lit\ninjections:\n  - {name: jump, at: 0 s, set: {lamp: on}}\n",
    "limit": "case: slow\ngoal: lit\nplanning: 2 h\n",
    "no_run": "case: never\ngoal: lit\nplanning: 5 s\nenvironment: [{at: 1 s, by: pull}]\n",
}


@pytest.mark.parametrize(
    ("runs", "why"), [("", ""), ("goals: single", "single_goals"), ("plans: drawn", "drawn_plans")]
)
def test_cases_that_do_not_judge_a_requirement_are_counted_by_the_reason(
    scbm: Scbm, lamp: Path, runs: str, why: str
) -> None:
    lamp.write_text(STUCK + (f"runs: {{{runs}}}\n" if runs else ""), encoding="utf-8")
    Path("cases").mkdir()
    for name, text in {"plain": PLAIN, **CASES}.items():
        Path(f"cases/{name}.yaml").write_text(text, encoding="utf-8")
    tested = scbm("test", lamp, "cases", "--cases", "0", "--no-shrink", "--store", "s.db")
    reported = scbm("report", "s.db")
    expected = {"no_run": 1, why: 4} if why else dict.fromkeys(CASES, 1)
    for ran in (scbm("test", lamp, "cases", "--cases", "0", "--json"), scbm("report", "s.db", "--json")):
        (found,) = (each for each in json.loads(ran.out)["requirements"] if each["name"] == "non_blocking")
        assert (found["cases"], found["unjudged"]) == (0 if why else 1, expected)
    for text in (tested.out, reported.out):
        assert ("not judged, as" if why == "single_goals" else f"checked in {0 if why else 1} case") in text


def test_every_report_says_which_requirement_is_off_and_why(scbm: Scbm, lamp: Path) -> None:
    scbm("test", lamp, "--cases", "1", "--store", "s.db")
    kinds = ("html", "markdown", "junit", "sarif")
    texts = {"report": scbm("report", "s.db", *(part for kind in kinds for part in (f"--{kind}", f"s.{kind}"))).out}
    texts |= {kind: Path(f"s.{kind}").read_text(encoding="utf-8") for kind in kinds}
    says = "off: the lamp may stay off"
    assert not [kind for kind, text in texts.items() if says not in text]


def test_a_requirement_is_explained_by_what_closing_says_of_it(scbm: Scbm, lamp: Path) -> None:
    lamp.write_text(LAMP + WRONG + "  free: never lamp == on && relay_req_trigger == true\n", encoding="utf-8")
    violated = scbm("explain", lamp, "never_on")
    assert violated.code == 1
    assert "scbm replay never_on-1.yaml" in violated.out
    until = violated.out.partition("The run until then:\n")[2].partition("\n\n")[0]
    assert "request 1 → relay" in until
    assert until.endswith("✗ never_on: lamp == on holds")
    held = json.loads(scbm("explain", lamp, "free", "--json").out)
    assert held["requirement"]["status"] == "holds"
    assert held["requirement"]["certificate"] == "requirements"
    assert "relay_req_trigger" in held["nearest"]
    assert "did you mean `never_on`?" in scbm("explain", lamp, "nevr_on").err
    assert "did you mean `non_blocking`?" in scbm("explain", lamp, "non_bloking").err
    built_in = json.loads(scbm("explain", lamp, "no_orphan", "--json").out)
    assert (built_in["requirement"]["built_in"], bool(built_in["assumptions"])) == (True, True)


def test_explain_says_what_close_says_where_only_cases_for_obligations_show_a_violation(scbm: Scbm, lamp: Path) -> None:
    lamp.write_text(LAMP.replace("within 60 s", "within 2 s"), encoding="utf-8")
    decided = json.loads(scbm("close", lamp, "--requirements", "--json").out)["requirements"]["decided"]
    explained = scbm("explain", lamp, "soon", "--json")
    assert explained.code == 1
    requirement = json.loads(explained.out)["requirement"]
    assert requirement == next(each for each in decided if each["name"] == "soon")
    assert requirement["status"] == "violated"


BEFORE = "plan.state == planning before relay_req_state == executing"
AFTER = "after switch.state == completed always lamp == on until switch.state == executing"


@pytest.mark.parametrize("sentence", [BEFORE, AFTER])
def test_the_nearest_miss_depends_on_what_was_before(
    scbm: Scbm, lamp: Path, sentence: str, wording: Callable[[str], None]
) -> None:
    lamp.write_text(f"{LAMP}  ordered: {sentence}\n", encoding="utf-8")
    found = json.loads(scbm("explain", lamp, "ordered", "--json").out)
    assert found["requirement"]["status"] == "holds"
    wording(found["nearest"])


def test_instances_a_family_and_requirements_that_are_called_alike_are_explained(scbm: Scbm, lamp: Path) -> None:
    doors = "types: {side: [left, right]}\nvariables:\n  door[side]: {domain: bool, initial: false}"
    text = LAMP.replace("variables:", doors)
    shut = "  shut[s in side]: never door[s] == true\n  pair[s in side, t in side]: never door[s] != door[t]\n"
    lamp.write_text(f"{text}{shut}  no_orphan: never lamp == on\n", encoding="utf-8")

    def explained(name: str) -> list[tuple[str, bool]]:
        found = json.loads(scbm("explain", lamp, name, "--json").out)
        about = [each["requirement"] for each in found.get("requirements", [found])]
        return [(each["name"], each["built_in"]) for each in about]

    assert explained("shut[left]") == explained("shut.left") == [("shut.left", False)]
    assert explained("pair[left, right]") == [("pair.left.right", False)]
    assert explained("shut") == [("shut.left", False), ("shut.right", False)]
    assert explained("no_orphan") == [("no_orphan", False), ("no_orphan", True)]
    both = scbm("explain", lamp, "no_orphan")
    assert both.code == 1
    heads = [line.partition(":")[2] for line in both.out.splitlines() if line.startswith("no_orphan:")]
    assert heads == [" never lamp == on", f" {BUILT_IN_NAMES['no_orphan']}"]


def test_close_decides_the_requirements_of_the_command_line(scbm: Scbm, lamp: Path) -> None:
    dark, free = "never lamp == on", "never lamp == on && relay_req_trigger == true"
    asked = ("--require", dark, "--require", free)
    ran = scbm("close", lamp, *asked, "--store", "s.db", "--out", "closed", "--json")
    closing = json.loads(ran.out)
    decided = {each["name"]: each for each in closing["requirements"]["decided"]}
    assert (decided["required_1"]["status"], decided["required_1"]["case"], ran.code) == (
        *("violated", "required_1-1"),
        1,
    )
    assert (decided["required_2"]["status"], decided["required_2"]["certificate"]) == ("holds", None)
    assert not [name for each in closing["certificates"] for name in each["requirements"] if "required" in name]
    assert "--require 'never lamp == on'" in scbm("close", lamp, *asked).out
    assert scbm("test", lamp, "closed/cases/required_1-1.yaml", "--store", "s.db", "--no-shrink").code == 1
    assert "required" not in " ".join(words(scbm("report", "s.db").out))


def test_a_suite_of_close_is_checked_by_the_requirements_of_the_command_line(scbm: Scbm, lamp: Path) -> None:
    case = "case: lit\nmodel: lamp.yaml\ngoal: lit\nrequirements: {required_1: never lamp == off}\n"
    Path("lit.yaml").write_text(case, encoding="utf-8")
    for sentence, status in (("never lamp == on", "violated"), ("always lamp == off || lamp == on", "holds")):
        ran = scbm("close", lamp, "--suite", "lit.yaml", "--require", sentence, "--json")
        found = {each["name"]: each for each in json.loads(ran.out)["requirements"]["decided"]}["required_1"]
        assert (found["status"], found.get("case")) == (status, "lit" if status == "violated" else None)


def test_errors_of_close_about_requirements_are_located_with_those_of_other_options(scbm: Scbm, lamp: Path) -> None:
    ran = scbm("close", lamp, "--require", "never lamp == onn", "--require", "lamp = on", "--planner", "none")
    assert ran.code == 2
    assert re.findall(r"^(\S+): error\[(.*?)\]", ran.err, re.MULTILINE) == [
        ("--planner:1:1", "unknown-planner"),
        ("--require:1:15", "value-outside-domain"),
        ("--require:1:6", "requirement-syntax"),
    ]
