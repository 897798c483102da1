"""MCAP files, read by the reader of the format's own project, message by message against schema and trace."""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from io import BytesIO
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from mcap.reader import make_reader
from mcap.records import Header
from mcap.stream_reader import StreamReader

import scbm
from scbm.cases.trace import RecordSeverity, RequestSent, RunEnded, state_after
from scbm.files import read_model
from scbm.model import BehaviorModel, Value
from scbm.model.variables import CURRENT_NAME, CURRENT_STATE, PLAN_STATE
from scbm.reports.run.event_lines import event_lines
from scbm.reports.run.mcap_trace import write_mcap
from support.profiles import slow_where
from support.runs import LONG, runs
from support.wording import Wording

WAITING = read_model("""\
behavior_model: waiting
variables:
  lamp: {domain: [off, on], initial: off}
  count: {domain: -2..3, initial: 0}
  ready: {domain: bool, initial: false}
resources:
  arm: {}
operations:
  go: {pre: {g: ready == true, a: [arm_req_trigger <- true]}, post: {g: true, gr: arm_req_state == succeeded}}
automatic_transitions:
  toggle_on: {g: lamp == off && count == 3, a: [lamp <- on]}
goals: {goes: lamp == on && count == 0}
requirements: {dark: never lamp == on, ready_soon: count == -2 leads to ready == true within 1 s}
""")
INJECTED = """\
case: injected
goal: goes
injections:
  - {name: held, at: 0 s, set: {count: -2, ready: true}, hold: 2 s}
  - {name: stays, at: 3 s, set: {count: 3}}
  - {name: broken, at: 1 s, resource: arm, becomes: dead, hold: 1 s}
requirements: {two: always count != 2}
"""


RUNS = {name: (model, execution) for name, model, execution in runs(WAITING, INJECTED)}


@dataclass(frozen=True)
class Read:
    """A message as the reader gives it."""

    topic: str
    at_ns: int
    record: int
    content: Any


def written(name: str) -> bytes:
    stream = BytesIO()
    write_mcap(*RUNS[name], stream)
    return stream.getvalue()


@cache
def messages(name: str) -> list[Read]:
    """All messages, in the order in which a reader gives them: by time, and of one time as they were written."""
    reader = make_reader(BytesIO(written(name)), validate_crcs=True)
    return [
        Read(channel.topic, message.log_time, message.sequence, json.loads(message.data))
        for _, channel, message in reader.iter_messages()
    ]


def of(name: str, topic: str) -> list[Read]:
    return [message for message in messages(name) if message.topic == topic]


def valuation(model: BehaviorModel, last: dict[str, Any]) -> dict[str, Value]:
    """The value of every variable, from the last message of each topic of states."""
    plan = last["/plan"]
    state: dict[str, Value] = {
        CURRENT_NAME: plan["current"],
        CURRENT_STATE: plan["current_state"],
        PLAN_STATE: plan["state"],
    }
    state |= {variable.name: last[f"/variables/{variable.name}"]["value"] for variable in model.variables}
    state |= {f"{each.name}.state": last[f"/operations/{each.name}"]["state"] for each in model.operations}
    state |= {each.request_state: last[f"/resources/{each.name}"]["state"] for each in model.resources}
    return state | {each.trigger: last[f"/resources/{each.name}"]["trigger"] for each in model.resources}


@pytest.mark.parametrize("name", slow_where(LONG.__contains__, RUNS))
def test_each_message_is_as_its_schema_says(name: str) -> None:
    reader = make_reader(BytesIO(written(name)), validate_crcs=True)
    summary = reader.get_summary()
    assert summary is not None
    validators = {}
    for schema in summary.schemas.values():
        assert schema.encoding == "jsonschema"
        Draft202012Validator.check_schema(json.loads(schema.data))
        validators[schema.id] = Draft202012Validator(json.loads(schema.data))
    count = 0
    for _, channel, message in reader.iter_messages():
        assert channel.message_encoding == "json"
        validators[channel.schema_id].validate(json.loads(message.data))
        count += 1
    assert count == write_mcap(*RUNS[name], BytesIO())


@pytest.mark.parametrize("name", RUNS)
def test_every_record_can_be_read_from_the_start_and_is_whole(name: str) -> None:
    records = list(StreamReader(BytesIO(written(name)), validate_crcs=True).records)
    header = records[0]
    assert header == Header(profile="", library=f"scbm {scbm.__version__}")


@pytest.mark.parametrize("name", slow_where(LONG.__contains__, RUNS))
def test_the_states_of_the_channels_are_those_of_the_trace_behind_every_record(name: str) -> None:
    model, execution = RUNS[name]
    by_record: dict[int, list[Read]] = {}
    for message in messages(name):
        by_record.setdefault(message.record, []).append(message)
    last: dict[str, Any] = {}
    for number in range(len(execution.trace.records)):
        last |= {message.topic: message.content for message in by_record.get(number, [])}
        expected = state_after(execution.trace.records[: number + 1])
        if expected:
            assert valuation(model, last) == expected


@pytest.mark.parametrize("name", RUNS)
def test_states_begin_with_the_run_and_are_reported_only_when_they_change(name: str) -> None:
    last: dict[str, Any] = {}
    for message in messages(name):
        if message.topic.startswith(("/operations", "/variables", "/resources", "/plan", "/requirements")):
            assert message.topic in last or message.at_ns == 0
            assert last.get(message.topic) != message.content
            last[message.topic] = message.content


@pytest.mark.parametrize("name", RUNS)
def test_messages_are_as_old_as_what_they_report(name: str) -> None:
    execution = RUNS[name][1]
    for message in messages(name):
        if not message.topic.startswith("/requirements"):
            assert message.at_ns == execution.trace.records[message.record].at_ns


@pytest.mark.parametrize("name", RUNS)
def test_the_log_is_the_timeline(name: str) -> None:
    model, execution = RUNS[name]
    log = of(name, "/events")
    lines = [line.text for line in event_lines(model, execution)]
    failures = [f"FAILED  {failure}" for failure in execution.verdict.failures]
    shown = [message.content["message"] for message in log]
    assert shown == [*lines, *failures]
    for message in log:
        stamp = message.content["timestamp"]
        assert stamp["sec"] * 1_000_000_000 + stamp["nsec"] == message.at_ns
        errors = ("✗", "FAILED", "■ livelock", "■ model error")
        assert (message.content["level"] == 4) == message.content["message"].startswith(errors)


def test_each_message_of_the_log_has_the_severity_of_its_record() -> None:
    lines = list(event_lines(*RUNS["odds"]))
    levels = [message.content["level"] for message in of("odds", "/events")][: len(lines)]
    assert levels == [
        {RecordSeverity.INFO: 2, RecordSeverity.WARNING: 3, RecordSeverity.ERROR: 4}[line.severity] for line in lines
    ]
    by_text = {line.text: level for line, level in zip(lines, levels, strict=True)}
    assert by_text["└ timedout"] == by_text["└ failed"] == 3
    assert by_text["■ reached"] == 2


def test_injections_are_reported_and_put_back(wording: Wording) -> None:
    shown = of("injected", "/injections")
    assert [(read.at_ns // 10**9, read.content["injection"]) for read in shown] == [
        (0, "held"),
        (1, "broken"),
        (2, "held"),
        (2, "broken"),
        (3, "stays"),
    ]
    wording(read.content["state"] for read in shown)
    conditions = [(read.at_ns // 10**9, read.content["condition"]) for read in of("injected", "/resources/arm")]
    assert conditions == [(0, "well"), (1, "dead"), (2, "well")]


def test_requirements_are_kept_until_they_are_violated() -> None:
    assert [read.content["state"] for read in of("injected", "/requirements/dark")] == ["kept", "violated"]
    assert of("injected", "/requirements/dark")[1].at_ns == 3 * 10**9
    assert [read.content["state"] for read in of("injected", "/requirements/two")] == ["kept"]


def test_faults_of_the_network_are_reported() -> None:
    fates = [read.content["fate"] for read in of("faults-6", "/network")]
    assert {"lost", "dropped: repeated"} <= {*fates}
    assert any(fate.startswith("delivered 2 ") for fate in fates)


def test_requests_are_reported_with_what_they_carry() -> None:
    model, execution = RUNS["faults-6"]
    sent = [record for record in execution.trace.records if isinstance(record, RequestSent)]
    shown = {
        (resource.name, read.content["request"]): read.content["payload"]
        for resource in model.resources
        for read in of("faults-6", f"/resources/{resource.name}")
        if read.content["request"]
    }
    assert shown == {(record.resource, record.request): dict(record.payload) for record in sent}


def test_the_file_says_what_was_run_and_how_it_ended() -> None:
    reader = make_reader(BytesIO(written("injected")))
    (metadata,) = reader.iter_metadata()
    execution = RUNS["injected"][1]
    end = execution.trace.records[-1]
    assert isinstance(end, RunEnded)
    assert metadata.name == "scbm"
    assert json.loads(metadata.metadata.pop("failures")) == [str(each) for each in execution.verdict.failures]
    assert metadata.metadata == {
        "scbm": scbm.__version__,
        "model": "waiting",
        "case": "injected",
        "goal": "goes",
        "predicate": "lamp == on && count == 0",
        "verdict": end.end,
        "passed": "false",
        "simulated_ns": str(execution.ended_ns),
    }


def test_channels_of_operations_and_variables_are_there_even_if_nothing_happens() -> None:
    summary = make_reader(BytesIO(written("nothing-to-do"))).get_summary()
    assert summary is not None
    topics = [channel.topic for channel in summary.channels.values()]
    assert topics == [
        *("/events", "/plan", "/operations/go", "/resources/arm"),
        *("/variables/lamp", "/variables/count", "/variables/ready"),
        *("/requirements/dark", "/requirements/ready_soon", "/automatic", "/injections", "/network"),
    ]


@pytest.mark.parametrize("name", RUNS)
def test_the_same_run_is_the_same_bytes(name: str) -> None:
    assert written(name) == written(name)
