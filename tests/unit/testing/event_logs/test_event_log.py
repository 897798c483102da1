"""Logs of events: the same events give the same records; what is no log of the model is reported with its line."""

from __future__ import annotations

import json
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec import structs, to_builtins
from msgspec.structs import replace

from scbm.cases import Case, Condition, ConditionKind, Injection, OutcomeRule, Reaction
from scbm.cases.trace import End, MessageDisturbed, Record, ResourceChanged, RunnerStarted
from scbm.files import read_network
from scbm.model import BehaviorModel, InputError, Outcome, PlannerIdentity, Slug, State
from scbm.model.json_reader import read_record
from scbm.planning import PlanLimits
from scbm.running import (
    Event,
    GoalGiven,
    InjectionGiven,
    Measured,
    PlanAnswered,
    PlanStatus,
    Program,
    ReplyArrived,
    RunnerOptions,
    TimePassed,
)
from scbm.testing import RandomCases
from scbm.testing.event_logs.event_log import (
    EventLog,
    LogStep,
    open_event_log,
    read_event_log,
    replay,
    rerun,
    write_event_log,
)
from scbm.testing.event_logs.event_records import Note, ReactionRecord, event_record
from support.capturing import DIGEST, captured
from support.case_strategies import cases
from support.event_records import as_text, event_json, read_event, read_note
from support.models import scan_cell
from support.profiles import examples, share, slow_beyond
from support.random_models import random_model
from support.runs import AFTER
from support.strategies import SECOND_NS, running_models
from support.strings import CHARACTERS
from support.wording import Wording

OPTIONS = RunnerOptions(time_limit_ns=200 * SECOND_NS, plan_limit=30, livelock_bound=60, instant_bound=200)
LIMITS = PlanLimits(length=60, expansions=2_000)
CELL = scan_cell()


def _check_whole(log: EventLog, records: tuple[Record, ...], model: BehaviorModel) -> None:
    text = write_event_log(log, model)
    again = read_event_log(text, model, DIGEST)
    assert replay(again, Program(model)) == records
    assert write_event_log(again, model) == text
    assert again.steps == log.steps
    assert again.reactions == log.reactions


# a log is the run


@pytest.mark.slow
@given(st.data())
@examples(120)
def test_a_log_of_whatever_a_case_says_is_its_run(data: st.DataObject) -> None:
    model = data.draw(running_models())
    case = data.draw(cases(model).filter(lambda case: case.origin is not None or not case.network.draws))
    limits = replace(case.limits, plans=data.draw(st.integers(1, 10)))
    case = replace(case, environment=None, limits=limits)  # the capture makes no changes from outside
    log, records = captured(model, case, OPTIONS, LIMITS)
    assert replay(log, Program(model)) == records
    _check_whole(log, records, model)


@pytest.mark.parametrize("number", slow_beyond(share(40, usual=3), range(1, 41)))
def test_a_log_of_a_random_model_on_a_bad_network_is_its_run(number: int) -> None:
    model = random_model(number)
    for case in RandomCases(model, network=None).first(4, seed=number):
        _check_whole(*captured(model, case, OPTIONS, LIMITS), model)


@pytest.mark.slow
def test_logs_of_the_example_have_notes_within_the_records_of_an_event() -> None:
    network = read_network("loss: 20 %, duplication: 20 %, latency: 10 ms", AFTER)
    places = []
    for case in RandomCases(AFTER, network=network).first(20, seed=3):
        log, records = captured(AFTER, case)
        _check_whole(log, records, AFTER)
        places += [step.after for step in log.steps if isinstance(step.event, MessageDisturbed)]
    assert {place for place in places if place} != {None}


def test_measured_values_that_do_not_fit_are_in_the_log_as_they_came() -> None:
    refused = ReplyArrived(
        1, succeeded=True, measured=(("temperature", "warm"), ("nonsense\u2028", -3), ("light", True))
    )
    log, records = _with(refused)
    assert sum(record.kind == "measurement_refused" for record in records) == 3
    _check_whole(log, records, CELL)


def _with(*events: Event) -> tuple[EventLog, tuple[Record, ...]]:
    """A run of the cell, with events put in a second after the beginning, and what the runner makes of them."""
    log, _ = captured(CELL, _case())
    begin = [step for step in log.steps if step.at_ns == 0]
    wall = max(step.at_ns for step in begin) + SECOND_NS
    more = tuple(LogStep(wall, event) for event in events)
    log = replace(log, steps=(*begin, *more))
    return log, replay(log, Program(CELL))


def _case() -> Case:
    """The scanner fails, and then succeeds, each time after two seconds."""
    rules = [
        OutcomeRule("scan", number, number, outcome, 2 * SECOND_NS)
        for number, outcome in ((1, Outcome.FAIL), (2, Outcome.SUCCEED))
    ]
    return Case("scans", *CELL.goals[0], CELL.nominal_state, tuple(rules))


def test_a_note_has_the_time_of_its_step(wording: Wording) -> None:
    log, _ = _with()
    note = LogStep(2 * SECOND_NS, ResourceChanged(2 * SECOND_NS, "network", "scan", "down"))
    log = replace(log, steps=(*log.steps, note))
    assert read_event_log(write_event_log(log, CELL), CELL, DIGEST).steps[-1] == note
    assert replay(log, Program(CELL))[-1] == note.event
    with wording.raises(ValueError):
        write_event_log(replace(log, steps=(structs.replace(note, at_ns=3 * SECOND_NS),)), CELL)


def test_a_note_behind_more_records_than_there_are_is_refused(wording: Wording) -> None:
    log, records = _with()
    steps = (*log.steps, LogStep(SECOND_NS, MessageDisturbed(SECOND_NS, 1, "scan", "reply", 0), len(records) + 1))
    with wording.raises(ValueError):
        replay(replace(log, steps=steps), Program(CELL))


def test_a_log_of_a_lost_run_ends_at_the_loss() -> None:
    log, records = _with()
    lost = replace(log, steps=log.steps[:1], end=End.LOST)
    assert read_event_log(write_event_log(lost, CELL), CELL, DIGEST) == lost
    run = rerun(lost, Program(CELL))
    assert (run.end, run.ended_ns) == (End.LOST, lost.steps[-1].at_ns)
    assert run.records == records[: len(run.records)]
    assert len(run.records) < len(records)


# events on the wire

EVENTS: list[Event | Note] = [
    GoalGiven("scanned", CELL.goals[0][1]),
    ReplyArrived(7, succeeded=False),
    ReplyArrived(0, succeeded=True, measured=(("temperature", 21), ("x", "ü"), ("y", False))),
    Measured((("temperature", 20),)),
    InjectionGiven(Injection("stop", (("plan.state", "aborted"), ("light", "red")), CELL.goals[0][1], 0, SECOND_NS)),
    InjectionGiven(Injection("slow", resource="scan", condition=Condition(ConditionKind.SLOWER, Fraction(5, 2)))),
    InjectionGiven(Injection("dead", at_ns=3, resource="scan", condition=Condition(ConditionKind.DEAD))),
    PlanAnswered(3, PlanStatus.SOLVED, ("scan_box",)),
    PlanAnswered(3, PlanStatus.UNSOLVABLE),
    PlanAnswered(4, PlanStatus.LIMIT_REACHED),
    PlanAnswered(5, PlanStatus.NO_PLAN_FOUND),
    TimePassed(),
    MessageDisturbed(5, 2, "scan", "cancel", 0),
    MessageDisturbed(5, 2, "scan", "reply", 3),
    ResourceChanged(5, "network", "scan", "down"),
]


@pytest.mark.parametrize("event", EVENTS, ids=lambda event: type(event).__name__)
def test_an_event_is_read_as_it_was_written(event: Event | Note, wording: Wording) -> None:
    written = event_json(event)
    assert read_event(written, CELL, 5) == event
    is_note = isinstance(event, (MessageDisturbed, ResourceChanged))
    if is_note:
        assert read_note(written, CELL, 5) == event
    else:
        with wording.raises(ValueError):
            read_note(written, CELL, 5)


HEATED = scan_cell(more="environment: {heats: {guard: temperature == 5, actions: [temperature <- 6]}}\n")


def test_a_change_of_the_environment_names_its_transition(wording: Wording) -> None:
    event = Measured((("temperature", 6),), "heats")
    assert read_event(event_json(event), HEATED) == event
    for by in ("cools", "", 1):
        with wording.raises(ValueError):
            read_event(event_json(event) | {"by": by}, HEATED)


@given(st.data())
@examples(100)
def test_no_field_can_be_missing_or_of_another_sort(data: st.DataObject) -> None:
    """Unless that says another event: whatever is read is written again as what was read."""
    written = event_json(data.draw(st.sampled_from(EVENTS)))
    key = data.draw(st.sampled_from(list(written)))
    other = data.draw(
        st.one_of(st.none(), st.booleans(), st.floats(), st.text(CHARACTERS, max_size=3), st.just([]), st.just({}))
    )
    for changed in ({k: v for k, v in written.items() if k != key}, written | {"more": other}):
        with pytest.raises(ValueError):  # noqa: PT011 - which words it has depends on what was drawn
            read_event(changed, CELL)
    try:
        event = read_event(written | {key: other}, CELL)
    except ValueError:
        return
    assert event_json(event) == written | {key: other}


WRONG: list[object] = [
    None,
    [],
    {"kind": ["goal"]},
    {"kind": "nothing"},
    {"kind": "time", "at": 3},
    {"kind": "goal", "name": "x", "predicate": "no_such == true"},
    {"kind": "goal", "name": "x", "predicate": "plan.state == idle"},
    {"kind": "goal", "name": "x", "predicate": "(" * 100_000},
    {"kind": "goal", "name": "\ud800", "predicate": "true"},
    {"kind": "reply", "request": True, "succeeded": True, "measured": {}},
    {"kind": "reply", "request": -1, "succeeded": True, "measured": {}},
    {"kind": "reply", "request": 1, "succeeded": 1, "measured": {}},
    {"kind": "reply", "request": 1, "succeeded": True, "measured": []},
    {"kind": "measured", "values": {"temperature": 20.5}},
    {"kind": "measured", "values": {"temperature": None}},
    {"kind": "measured", "values": {"temperature": "\udfff"}},
    {"kind": "measured", "values": {"\udfff": 1}},
    {"kind": "plan", "ask": 1, "status": "solved", "plan": ["fly"]},
    {"kind": "plan", "ask": 1, "status": "solved", "plan": "scan_box"},
    {"kind": "plan", "ask": 1, "status": "unsolvable", "plan": ["scan_box"]},
    {"kind": "plan", "ask": 1, "status": "lost", "plan": []},
    {"kind": "message", "request": 1, "resource": "other", "message": "reply", "copies": 0},
    {"kind": "message", "request": 1, "resource": "scan", "message": "letter", "copies": 0},
    {"kind": "message", "request": 1, "resource": "scan", "message": "reply", "copies": -1},
    {"kind": "resource", "resource": ["scan"], "condition": "down"},
    {"kind": "resource", "resource": "scan", "condition": "x" * 1001},
]


@pytest.mark.parametrize("data", WRONG, ids=lambda data: ascii(data)[:80])
def test_what_is_no_event_of_the_model_is_refused(data: object, wording: Wording) -> None:
    with wording.raises(ValueError):
        read_event(data, CELL)


@pytest.mark.parametrize(
    "changed",
    [
        {"name": ""},
        {"name": "network"},
        {"name": "sent"},
        {"set": {"no_such": 1}},
        {"set": {"light": "blue_green"}},
        {"set": {"count": True}},
        {"set": {"plan.state": "completed"}},
        {"set": {"current.name": "scan_box"}},
        {"when": "no_such == 1"},
        {"when": True},
        {"at_ns": -1},
        {"hold_ns": 1.5},
        {"resource": "other"},
        {"becomes": {"kind": "dead", "factor": "1"}},
        {"resource": "scan"},
        {"resource": "scan", "becomes": {"kind": "gone", "factor": "1"}},
        {"resource": "scan", "becomes": {"kind": "slower", "factor": "1/2"}},
        {"resource": "scan", "becomes": {"kind": "slower", "factor": "2/0"}},
        {"resource": "scan", "becomes": {"kind": "slower", "factor": 2}},
        {"resource": "scan", "becomes": "dead"},
    ],
    ids=str,
)
def test_an_injection_that_no_case_can_have_is_refused(changed: dict[str, Any], wording: Wording) -> None:
    written = event_json(InjectionGiven(Injection("stop", (("plan.state", "aborted"),))))
    read_event(written, CELL)
    with wording.raises(ValueError):
        read_event(written | changed, CELL)


def test_a_variable_with_two_values_is_not_written(wording: Wording) -> None:
    with wording.raises(ValueError):
        event_record(Measured((("temperature", 1), ("temperature", 2))))


def test_what_an_injection_does_to_a_resource_is_no_note() -> None:
    with pytest.raises(ValueError, match="`dead`"):
        event_record(ResourceChanged(0, "dead", "scan", "dead"))


def test_reactions_are_read_strictly() -> None:
    log, _ = captured(AFTER, RandomCases(AFTER, network=None).case(1, 3))
    reported = [to_builtins(ReactionRecord.of(reaction)) for reaction in log.reactions]
    assert reported
    assert tuple(_read_reaction(each) for each in reported) == log.reactions
    for key, wrong in {"resource": "x", "outcome": "any", "latency_ns": 1.0, "measured": [], "reply": [True]}.items():
        with pytest.raises(ValueError, match=f"`{key}"):
            _read_reaction(reported[0] | {key: wrong})


def _read_reaction(data: object) -> Reaction:
    record: ReactionRecord = read_record(as_text(data), ReactionRecord, "the reaction")
    return record.reaction(AFTER)


# what is no log


@pytest.fixture
def text() -> str:
    log, _ = captured(CELL, _case())
    return write_event_log(replace(log, model_file="cell.yaml"), CELL)


def _refused(text: str, digest: str = DIGEST) -> list[tuple[str, int, str]]:
    with pytest.raises(InputError) as caught:
        read_event_log(text, CELL, digest, "run.jsonl")
    assert all(diagnostic.place.file == "run.jsonl" for diagnostic in caught.value.diagnostics)
    return [(d.slug.value, d.place.line, d.message) for d in caught.value.diagnostics]


def test_a_log_that_is_cut_off_at_any_byte_is_one_error(text: str, wording: Wording) -> None:
    data = text.encode()
    assert data.isascii()
    messages: dict[str, None] = {}  # a set in the order of the bytes
    for end in range(len(data)):
        ((slug, _, message),) = _refused(data[:end].decode())
        assert slug == "bad-log"
        messages[message] = None
    wording(messages)


def test_lines_behind_the_end_are_refused(text: str, wording: Wording) -> None:
    ((slug, _, message),) = _refused(text + "{}\n")
    assert slug == "bad-log"
    wording(message)


def test_every_wrong_line_is_reported_with_its_number(text: str) -> None:
    lines = text.split("\n")
    lines[2] = "not JSON"
    lines[4] = '{"at_ns": 0, "event": {"kind": "nothing"}}'
    lines[-2] = '{"reaction": 3}'
    reported = _refused("\n".join(lines))
    assert [(slug, line) for slug, line, _ in reported] == [("bad-log", 3), ("bad-log", 5), ("bad-log", len(lines) - 1)]


def test_not_more_than_twenty_lines_are_reported() -> None:
    log, _ = captured(CELL, _case())
    header, *_ = write_event_log(replace(log, steps=log.steps[:1] * 40, reactions=()), CELL).split("\n")
    assert len(_refused(header + "\n" + 40 * "{}\n")) == 20


@pytest.mark.parametrize(
    "changed",
    [
        {"format": "scbm-trace"},
        {"format": "other"},
        {"planner": "greedy"},
        {"planner": 1},
        {"model": 3},
        {"model_digest": "0" * 63},
        {"model_file": 1},
        {"time_scale": "0"},
        {"time_scale": "1/0"},
        {"time_scale": 20},
        {"real": "scan"},
        {"real": [1]},
        {"real": ["lamp"]},
        {"real": ["scan", "scan"]},
        {"options": []},
        {"options": {}},
        {"end": "gone"},
        {"end": ["reached"]},
        {"trace": "x" * 64},
        {"steps": -1},
        {"steps": True},
        {"reactions": 10**6},
        {"more": 1},
    ],
    ids=str,
)
def test_a_wrong_header_is_one_error(text: str, changed: dict[str, Any], wording: Wording) -> None:
    header, rest = text.split("\n", 1)
    ((slug, _, message),) = _refused(json.dumps(json.loads(header) | changed) + "\n" + rest)
    assert slug == "bad-log"
    wording(message)


@pytest.mark.parametrize(
    ("name", "value"),
    [("plan_limit", True), ("plan_limit", -1), ("awaits_measurements", 1), ("time_limit_ns", 2**63)],
)
def test_options_are_read_strictly(text: str, name: str, value: object, wording: Wording) -> None:
    header, rest = text.split("\n", 1)
    entry = json.loads(header)
    entry["options"][name] = value
    ((slug, line, message),) = _refused(json.dumps(entry) + "\n" + rest)
    assert (slug, line, f"{name}`" in message) == ("bad-log", 1, True)
    wording(message)


def test_a_case_that_is_wrong_is_reported_as_a_case(text: str) -> None:
    header, rest = text.split("\n", 1)
    entry = json.loads(header) | {"case": "case: scans\ngoal: nothing_known\n"}
    with pytest.raises(InputError) as caught:
        read_event_log(json.dumps(entry) + "\n" + rest, CELL, DIGEST)
    (error,) = caught.value.diagnostics
    assert (error.slug, str(error.place)) == (Slug.UNKNOWN_GOAL, "log (case):2:7")


def test_time_does_not_run_backwards(text: str, wording: Wording) -> None:
    lines = text.split("\n")
    steps = json.loads(lines[0])["steps"]
    lines[1], lines[steps] = lines[steps], lines[1]
    reported = _refused("\n".join(lines))
    assert {slug for slug, _, _ in reported} == {"bad-log"}
    assert reported[0][1] == 3
    wording(message for _, _, message in reported)


@pytest.mark.parametrize(
    "line",
    [
        {"at_ns": 0.5, "event": {"kind": "time"}},
        {"at_ns": -1, "event": {"kind": "time"}},
        {"at_ns": 2**63, "event": {"kind": "time"}},
        {"at_ns": 0},
        {"at_ns": 0, "event": {"kind": "time"}, "after": 0},
        {"at_ns": 0, "event": {"kind": "resource", "resource": "scan", "condition": "down"}, "after": -1},
        {"at_ns": 0, "event": {"kind": "resource", "resource": "scan", "condition": "down"}, "after": None},
        {"at_ns": 0, "event": {"kind": "time"}, "more": 1},
        {"at_ns": 0, "event": {"kind": "goal", "name": "x" * 1024**2, "predicate": "true"}},
    ],
    ids=lambda line: str(line)[:60],
)
def test_a_step_is_read_strictly(text: str, line: dict[str, Any]) -> None:
    lines = text.split("\n")
    lines[1] = json.dumps(line)
    ((slug, number, _),) = _refused("\n".join(lines))
    assert (slug, number) == ("bad-log", 2)


def test_a_log_of_another_model_is_refused(text: str, wording: Wording) -> None:
    ((slug, line, message),) = _refused(text, "1" * 64)
    assert (slug, line) == ("log-other-model", 1)
    wording(message)
    with wording.raises(InputError) as caught:
        read_event_log(text, AFTER, DIGEST)
    assert caught.value.diagnostics[0].slug is Slug.LOG_OTHER_MODEL


# files


def test_a_log_in_a_file_says_where_its_model_is(tmp_path: Path, text: str, wording: Wording) -> None:
    path = tmp_path / "run.jsonl"
    path.write_text(text, encoding="utf-8", newline="")
    document = open_event_log(path)
    assert document.model_path() == tmp_path / "cell.yaml"
    assert document.read(CELL, DIGEST) == read_event_log(text, CELL, DIGEST)
    path.write_text(text.replace('"model_file":"cell.yaml"', '"model_file":null'), encoding="utf-8", newline="")
    with wording.raises(InputError):
        open_event_log(path).model_path()


def test_a_file_that_is_no_text_is_reported_with_the_line(tmp_path: Path, text: str, wording: Wording) -> None:
    path = tmp_path / "run.jsonl"
    path.write_bytes(text.encode() + b"\xff\n")
    with wording.raises(InputError) as caught:
        open_event_log(path)
    assert [(d.slug, d.place.line) for d in caught.value.diagnostics] == [(Slug.BAD_LOG, text.count("\n") + 1)]
    with wording.raises(InputError) as caught:
        open_event_log(tmp_path)
    assert [d.slug for d in caught.value.diagnostics] == [Slug.FILE_UNREADABLE]


def test_states_of_a_log_begin_where_its_case_does() -> None:
    state = State(CELL.space, {**CELL.nominal_state, "light": "red"})
    log, records = captured(CELL, replace(_case(), initial=state), OPTIONS)
    assert isinstance(records[0], RunnerStarted)
    assert dict(records[0].state)["light"] == "red"
    _check_whole(log, records, CELL)


# the page


def test_the_log_of_the_page_is_that_of_its_case() -> None:
    page = (Path(__file__).parents[4] / "docs" / "reference" / "event-logs.md").read_text(encoding="utf-8")
    shown = page.partition("```json\n")[2].partition("```")[0]
    log = read_event_log(shown, CELL, DIGEST)
    again, records = captured(CELL, log.case)
    assert write_event_log(again, CELL) == shown
    assert replay(log, Program(CELL)) == records


@pytest.mark.parametrize("event", [*EVENTS, Measured((), "heats")], ids=lambda event: type(event).__name__)
def test_the_page_has_every_kind_and_field(event: Event | Note) -> None:
    page = (Path(__file__).parents[4] / "docs" / "reference" / "event-logs.md").read_text(encoding="utf-8")
    kind, *fields = event_json(event)
    (row,) = [line for line in page.splitlines() if line.startswith(f"| `{event_json(event)[kind]}` |")]
    assert [field for field in fields if f"`{field}`" not in row] == []


def test_a_log_names_the_planner_of_its_run() -> None:
    log, _ = captured(CELL, _case())
    text = write_event_log(replace(log, planner=PlannerIdentity("greedy", "1")), CELL)
    assert read_event_log(text, CELL, DIGEST).planner == PlannerIdentity("greedy", "1")


@pytest.mark.parametrize("version", [4, 6, "5", None])
def test_a_log_of_another_version_is_refused(text: str, version: object, wording: Wording) -> None:
    header, rest = text.split("\n", 1)
    ((slug, line, message),) = _refused(json.dumps(json.loads(header) | {"version": version}) + "\n" + rest)
    assert (slug, line) == ("format-version", 1)
    wording(message)
