"""The JSON Schema for editors: it takes what the loader takes, and refuses the mistakes that a schema can see."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from ruamel.yaml import YAML

from scbm.files import case_schema, model_schema
from support.profiles import longer_but_one_in

ROOT = Path(__file__).parent.parent.parent.parent
EXAMPLES = sorted((ROOT / "examples").glob("*/*.yaml"))
VALID = sorted((ROOT / "tests" / "models" / "valid").glob("*.yaml"))
FAILS_AT_RUN = sorted((ROOT / "tests" / "models" / "fails_at_run").glob("*.yaml"))

RIGHT = """
behavior_model: cell
variables:
  robot_at: {domain: [home, agv], initial: home, random: any}
  scanned: {domain: bool, initial: false, random: [true, false]}
  scans: {domain: 0..5, initial: 0}
resources:
  scanner:
    request: [robot_at]
    measures: [scans]
    simulation:
      latency: {uniform: [200 ms, 1.5 s]}
      outcomes: {succeed: 0.9, fail: 0.1}
      measured: {scans: [0, 1]}
      failed: {scans: {0: 0.5, 1: 2}}
operations:
  scan:
    deadline: 10 seconds
    pre: {g: scanned == false, a: [scanner_req_trigger <- true]}
    post: {name: done, g: true, gr: [scanner_req_state == succeeded], a: [scanned <- true]}
    failed: {g: scans == 5}
    timedout: [scans += 1]
    disabled_deadline: 5 s
automatic_transitions:
  clear: {g: scans == 5, a: [scans <- 0]}
initial_states: [scanned == false]
goals: {done: scanned == true}
requirements: {safe: always robot_at == home}
"""

WRONG: list[tuple[str, str, str]] = [
    ("a missing section", "behavior_model: cell\n", ""),
    ("an unknown section", "goals:", "goal:"),
    ("an unknown key of a variable", "initial: home", "inital: home"),
    ("a variable without a domain", "scans: {domain: 0..5, initial: 0}", "scans: {initial: 0}"),
    ("a domain that is no domain", "domain: bool", "domain: boolean"),
    ("a negative weight", "{0: 0.5, 1: 2}", "{0: -0.5, 1: 2}"),
    ("a weight that is no number", "{0: 0.5, 1: 2}", "{0: half, 1: 2}"),
    ("no weights", "{0: 0.5, 1: 2}", "{}"),
    ("an empty domain", "domain: [home, agv]", "domain: []"),
    ("a domain with a value twice", "domain: [home, agv]", "domain: [home, home]"),
    ("random values that are no list", "random: any", "random: home"),
    ("a list of names that is none", "request: [robot_at]", "request: robot_at"),
    ("a bare duration", "deadline: 10 seconds", "deadline: 10"),
    ("a duration with an unknown unit", "disabled_deadline: 5 s", "disabled_deadline: 5 parsecs"),
    ("a distribution of no shape", "latency: {uniform: [200 ms, 1.5 s]}", "latency: {}"),
    (
        "a distribution of two shapes",
        "latency: {uniform: [200 ms, 1.5 s]}",
        "latency: {fixed: 1 s, uniform: [1 s, 2 s]}",
    ),
    ("a distribution with too few points", "uniform: [200 ms, 1.5 s]", "uniform: [1 s]"),
    ("an unknown distribution", "uniform: [200 ms, 1.5 s]", "normal: [1 s, 2 s]"),
    ("a probability above one", "succeed: 0.9", "succeed: 1.1"),
    ("an unknown outcome", "fail: 0.1", "explode: 0.1"),
    ("an operation without a precondition", "pre: {g: scanned == false, a: [scanner_req_trigger <- true]}", ""),
    ("a transition without a guard", "failed: {g: scans == 5}", "failed: {a: [scans <- 0]}"),
    ("a guard that is a mapping", "g: scanned == false", "g: {scanned: false}"),
    ("a guard that is a number", "g: scanned == false", "g: 5"),
    ("actions that are no list", "timedout: [scans += 1]", "timedout: scans += 1"),
    ("a named automatic transition", "clear: {g: scans == 5", "clear: {name: reset, g: scans == 5"),
    ("nothing where something belongs", "failed: {g: scans == 5}", "failed:"),
    ("a requirement that is a list", "safe: always robot_at == home", "safe: [always robot_at == home]"),
]


def data_of(text: str) -> Any:  # noqa: ANN401 - whatever YAML is about
    yaml = YAML(typ="safe", pure=True)
    yaml.constructor.add_constructor("tag:yaml.org,2002:timestamp", lambda _, node: node.value)  # as editors do
    return yaml.load(text)


MODEL_VALIDATOR, CASE_VALIDATOR = Draft202012Validator(model_schema()), Draft202012Validator(case_schema())


def faults_of(text: str) -> list[str]:
    return [fault.message for fault in MODEL_VALIDATOR.iter_errors(data_of(text))]


def test_the_schema_is_one() -> None:
    schema = model_schema()
    Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == Draft202012Validator.META_SCHEMA["$schema"]
    assert list(schema["properties"]) == [
        "behavior_model",
        "types",
        "tables",
        "variables",
        "resources",
        "operations",
        "automatic_transitions",
        "environment",
        "initial_states",
        "goals",
        "may_end",
        "requirements",
        "requirements_off",
        "requirements_on",
        "reachable_again",
        "planner",
        "waivers",
        "runs",
        "interfaces",
        "include",
        "parts",
    ]


SCHEMAS = pytest.mark.parametrize("schema", [model_schema, case_schema])


@SCHEMAS
def test_the_schema_is_made_afresh_so_that_nobody_can_spoil_it(schema: Callable[[], dict[str, Any]]) -> None:
    schema().clear()
    assert schema()


@SCHEMAS
def test_the_schema_offers_no_default_that_the_loader_refuses(schema: Callable[[], dict[str, Any]]) -> None:
    assert "null" not in json.dumps(schema())


@SCHEMAS
def test_the_schema_knows_no_key_without_saying_something_about_it(schema: Callable[[], dict[str, Any]]) -> None:
    for name, kind in schema()["$defs"].items():
        assert kind["additionalProperties"] is False, name
        assert kind["description"], name


@pytest.mark.parametrize("path", longer_but_one_in(3, [*EXAMPLES, *FAILS_AT_RUN, *VALID]), ids=lambda path: path.stem)
def test_a_model_that_loads_satisfies_the_schema(path: Path) -> None:
    assert faults_of(path.read_text(encoding="utf-8-sig")) == []


def test_there_are_models_to_try() -> None:
    assert len(EXAMPLES) >= 2
    assert len(VALID) >= 10


def test_the_model_that_the_mistakes_are_made_in_satisfies_the_schema() -> None:
    assert faults_of(RIGHT) == []


@pytest.mark.parametrize(("mistake", "right", "wrong"), WRONG, ids=[mistake for mistake, _, _ in WRONG])
def test_a_typical_mistake_does_not_satisfy_the_schema(mistake: str, right: str, wrong: str) -> None:
    assert RIGHT.count(right) == 1, mistake
    assert faults_of(RIGHT.replace(right, wrong)), mistake


RIGHT_CASE = """
case: first
goal: [scanned == true]
initial: {scans: 1, robot_at: home}
outcomes:
  arm: fail
  scanner: [any, {outcome: timeout, times: 2}, {after: 2 s, request: lost, reply: [1 ms, 2 ms], from: 7}]
  scale: {measured: {weight: 3}}
injections: [{at: 1 s, resource: arm, becomes: {slower: 1.5}}, {set: {light: red}, hold: 1 s}]
network: {loss: 2 %, duplication: 0.02, partitions: [{at: 1 s, for: 2 s}]}
limits: {plans: 3}
expect: {verdict: aborted, plan: [], final: true}
drawn: {seed: 1}
"""

WRONG_CASES: list[tuple[str, str, str]] = [
    ("a case without a name", "case: first", ""),
    ("an unknown key", "outcomes:", "outcome:"),
    ("an unknown outcome", "arm: fail", "arm: fial"),
    ("an unknown outcome in a list", "[any,", "[some,"),
    ("an outcome with an unknown key", "times: 2", "time: 2"),
    ("no times", "times: 2", "times: 0"),
    ("a bare duration", "after: 2 s", "after: 2"),
    ("a list in a list", "[any,", "[[any],"),
    ("a way of a message that is none", "request: lost", "request: never"),
    ("a condition that is none", "becomes: {slower: 1.5}", "becomes: slower"),
    ("a condition that is too fast", "slower: 1.5", "slower: 0.5"),
    ("a share above all", "duplication: 0.02", "duplication: 2"),
    ("a partition without an end", "{at: 1 s, for: 2 s}", "{at: 1 s}"),
    ("an unknown verdict", "verdict: aborted", "verdict: done"),
    ("a plan that is no list", "plan: []", "plan: scan"),
    ("a seed that is no number", "seed: 1", "seed: one"),
]


def case_faults_of(text: str) -> list[str]:
    return [fault.message for fault in CASE_VALIDATOR.iter_errors(data_of(text))]


def test_the_schema_of_cases_is_one() -> None:
    Draft202012Validator.check_schema(case_schema())
    assert list(case_schema()["properties"])[:3] == ["case", "model", "goal"]


def test_the_case_that_the_mistakes_are_made_in_satisfies_the_schema() -> None:
    assert case_faults_of(RIGHT_CASE) == []


@pytest.mark.parametrize(("mistake", "right", "wrong"), WRONG_CASES, ids=[mistake for mistake, _, _ in WRONG_CASES])
def test_a_typical_mistake_in_a_case_does_not_satisfy_the_schema(mistake: str, right: str, wrong: str) -> None:
    assert RIGHT_CASE.count(right) == 1, mistake
    assert case_faults_of(RIGHT_CASE.replace(right, wrong)), mistake
