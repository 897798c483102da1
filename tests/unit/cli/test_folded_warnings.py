"""Mistakes of entries with parameters are told once, in `scbm check`, `scbm close` and `scbm explain`."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Ran
from support.wording import Wording, diagnostic_heads

Scbm = Callable[..., Ran]

MODEL = """\
behavior_model: many
types:
  robot: [r1, r2, r3]
  zone: [a, b]
variables:
  at[robot]: {domain: zone, initial: a}
  spare[robot]: {domain: bool, initial: false}
  n[robot]: {domain: 0..2, initial: 2}
resources:
  arm[robot]: {simulation: {latency: 1 s, outcomes: {succeed: 1}}}
operations:
  move[r in robot, to in zone]:
    deadline: 5 s
    pre:
      g: arm_req_state.r == initial && arm_req_trigger.r == false && at.r != to
      a: [arm_req_trigger.r <- true]
    post: {g: true, gr: arm_req_state.r == succeeded, a: [arm_req_state.r <- initial, at.r <- to]}
    timedout: [arm_req_trigger.r <- false]
  send[r in robot]:
    deadline: 5 s
    pre: {g: at.r == b, a: [arm_req_trigger.r <- true]}
    post:
      g: true
      gr: arm_req_state.r == succeeded
      a: [arm_req_state.r <- initial, arm_req_trigger.r <- false, at.r <- a]
    timedout: [arm_req_trigger.r <- false]
  rest[r in robot]: {pre: {g: n.r == 0}, post: {g: true, a: [at.r <- a]}}
  count[r in robot]: {pre: {g: n.r >= 1}, post: {g: true, a: [n.r += 1]}}
goals:
  there: at.r1 == b
  empty[r in robot]: n.r == 0
"""

SLUGS = [
    "unused-variable",
    "request-not-cleared",
    "handshake-incomplete",
    "operation-never-enabled",
    "domain-left",
    "goal-unreachable",
]


@pytest.fixture
def model(tmp_path: Path) -> Path:
    path = tmp_path / "many.yaml"
    path.write_text(MODEL, encoding="utf-8")
    return path


def test_a_mistake_of_all_instances_is_one_warning(scbm: Scbm, model: Path, wording: Wording) -> None:
    ran = scbm("check", model)
    heads = Counter(head.split("[")[-1].rstrip("]") for head in diagnostic_heads(ran.out))
    assert [heads[slug] for slug in SLUGS] == [1] * len(SLUGS)
    wording(ran.out)


def test_json_has_each_instance_with_its_entry(scbm: Scbm, model: Path) -> None:
    (report,) = json.loads(scbm("check", model, "--json").out)["models"]
    counts = Counter((each["slug"], each["origin"]) for each in report["warnings"])
    assert counts["unused-variable", "spare"] == 3
    assert counts["request-not-cleared", "move"] == 6
    assert counts["goal-unreachable", "empty"] == 3


def test_a_model_that_follows_the_remedies_has_no_doubt_about_requests(scbm: Scbm, model: Path) -> None:
    (report,) = json.loads(scbm("check", model, "--json").out)["models"]
    remedies = {each["slug"]: each["remedy"] for each in report["warnings"]}
    cleared, free = (remedies[slug].split("`")[1] for slug in ("request-not-cleared", "handshake-incomplete"))
    text = model.read_text(encoding="utf-8")
    text = text.replace("at.r <- to]", f"at.r <- to, {cleared}]").replace("g: at.r == b,", f"g: at.r == b && {free},")
    model.write_text(text, encoding="utf-8")
    (report,) = json.loads(scbm("check", model, "--json").out)["models"]
    assert not report["errors"]
    assert {each["slug"] for each in report["warnings"]}.isdisjoint(remedies.keys() & set(SLUGS[1:3]))


def test_more_objects_make_no_more_lines(scbm: Scbm, tmp_path: Path) -> None:
    lines = []
    for robots in ("r1, r2", ", ".join(f"r{number}" for number in range(60))):
        path = tmp_path / "idle.yaml"
        path.write_text(
            f"behavior_model: idle\ntypes: {{robot: [{robots}]}}\n"
            "variables:\n  spare[robot]: {domain: bool, initial: false}\n"
            "operations: {}\ngoals: {}\n",
            encoding="utf-8",
        )
        lines.append(len(scbm("check", path).out.splitlines()))
    assert lines[0] == lines[1]


@pytest.mark.slow
def test_suggestions_and_reasons_name_the_entry(scbm: Scbm, model: Path) -> None:
    explained = scbm("explain", model, "count/failed")
    assert explained.out.count("Suggested change") == 1
    assert "count.r1" not in explained.out
    closed = scbm("close", model).out
    assert "n[robot] += 1" in closed
    assert "n.r1 += 1" not in closed


def test_check_counts_the_warnings_of_a_model_once(scbm: Scbm, tmp_path: Path) -> None:
    """Those of the file and those of the exploration have one number."""
    empty = (
        "  lift[t in tray]: {pre: {g: true}, post: {g: true}}\n  drop[t in tray]: {pre: {g: true}, post: {g: true}}\n"
    )
    text = MODEL.replace("types:\n", "types:\n  tray: []\n").replace("operations:\n", f"operations:\n{empty}")
    (tmp_path / "many.yaml").write_text(text)
    lines = scbm("check", str(tmp_path / "many.yaml")).out.splitlines()
    heads = sum(" warning[" in line for line in lines)
    assert [line for line in lines if line.endswith(" warnings")] == [f"{tmp_path / 'many.yaml'}: {heads} warnings"]


def test_a_note_about_all_instances_is_one_and_is_no_warning(scbm: Scbm, wording: Wording) -> None:
    objects = Path(__file__).parents[2] / "models" / "valid" / "objects.yaml"
    ran = scbm("check", objects)
    assert [head for head in diagnostic_heads(ran.out) if "note[" in head] == [
        f"{objects}:15:5: note[reply-never-carries]"
    ]
    wording(ran.out.replace(str(objects), objects.name))
    (report,) = json.loads(scbm("check", objects, "--json").out)["models"]
    assert [(note["slug"], note["origin"]) for note in report["notes"]] == [("reply-never-carries", "drive")] * 2
    assert "reply-never-carries" not in [warning["slug"] for warning in report["warnings"]]


def test_strict_does_not_fail_for_notes(scbm: Scbm, tmp_path: Path) -> None:
    path = tmp_path / "sure.yaml"
    path.write_text(
        "behavior_model: sure\nvariables: {seen: {domain: bool, initial: false}}\n"
        "resources: {camera: {measures: [seen]}}\n"
        "operations: {look: {request: camera, deadline: 5 s, guard: seen == false, effects: [seen <- true]}}\n"
        "goals: {seen: seen == true}\n",
        encoding="utf-8",
    )
    ran = scbm("check", path, "--strict")
    assert (ran.code, f"{path}: 1 note\n" in ran.out) == (0, True)
