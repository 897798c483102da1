"""What was packed for the browser is the trace: every record, and every state."""

import json
import os
import re
import subprocess
import sys
import weakref
from base64 import b64decode
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any, get_args
from zlib import decompress

import pytest

from scbm.cases.trace import Record, RunnerStarted, state_after
from scbm.files import load_model, read_case
from scbm.model import BehaviorModel, format_value
from scbm.reports.html.timelines import pack_timelines
from scbm.testing import Execution, RandomCases, Tester, load_suite
from support.histories import EXAMPLE

MODELS = Path(__file__).parents[3] / "models"
BEFORE = load_model(EXAMPLE / "before.yaml")
TESTER = Tester(BEFORE)
DISTURBED = """\
case: disturbed
goal: item_a_delivered
requirements:
  home: always gantry_req_state == executing -> robot_at == home
  soon: robot_at == box_a leads to scanned_a == true within 300 ms
injections:
  - {name: first, set: {gripper_act: closed}}
  - {name: busy, at: 2 s, resource: robot, becomes: occupied, hold: 3 s}
  - {name: pushed, when: current.name == scanner_scan_item_a, set: {scanner_req_state: executing}, hold: 2 s}
  - {name: never, at: 1 h, set: {gripper_act: open}}
"""


@dataclass(frozen=True)
class Unpacked:
    """One record as the browser has it; `state` is that behind it."""

    at_ns: int
    kind: str
    lane: tuple[str, str, str]
    sentence: str
    changes: dict[str, str]
    state: dict[str, str]


def _opened(compressed: str) -> Any:  # noqa: ANN401 - whatever JSON can say
    return json.loads(decompress(b64decode(compressed)))


def _cases(packed: dict[str, Any]) -> list[Any]:
    """All cases, each with the steps of its block."""
    blocks = [_opened(block) for block in packed["blocks"]]
    return [None if case is None else {**case, "table": block["steps"]} for block in blocks for case in block["cases"]]


def _records(packed: dict[str, Any], case: dict[str, Any]) -> Iterator[Unpacked]:
    """The records of a case, as the script of the page reads them."""
    shared = _opened(packed["shared"])
    texts, variables = shared["texts"], shared["variables"]
    at_ns = number = 0
    state: dict[str, str] = {}
    for step, after_ns, more in zip(case["steps"], case["after_ns"], case["numbers"], strict=True):
        at_ns, number = at_ns + after_ns, number + more
        kind, *lane, sentence = case["table"][step][:5]
        flat = case["table"][step][5:]
        changes = {texts[variables[v][0]]: texts[t] for v, t in zip(flat[::2], flat[1::2], strict=True)}
        if shared["kinds"][kind] == "runner_started":
            state = {texts[name]: texts[value] for name, value, _ in variables}
        state = {**state, **changes} if state else {}
        shown = texts[sentence].replace("{}", str(number), 1)
        first, second, third = (texts[text] for text in lane)
        yield Unpacked(at_ns, shared["kinds"][kind], (first, second, third), shown, changes, state)


def _written(values: Iterable[tuple[str, Any]]) -> dict[str, str]:
    return {name: format_value(value) for name, value in values}


def _must_be_alike(model: BehaviorModel, executions: Sequence[Execution]) -> None:
    packed = pack_timelines(model, executions)
    assert packed["cases"] == len(executions)
    for execution, case in zip(executions, _cases(packed), strict=True):
        shown = list(_records(packed, case))
        records = execution.trace.records
        assert [record.at_ns for record in shown] == [record.at_ns for record in records]
        assert [record.kind for record in shown] == [record.kind for record in records]
        for index, (unpacked, record) in enumerate(zip(shown, records, strict=True)):
            assert unpacked.state == _written(state_after(records[: index + 1]).items())
            if not isinstance(record, RunnerStarted):
                assert unpacked.changes == _written(record.changes)
            assert _names(record) <= {*unpacked.sentence.replace(":", " ").replace(",", " ").split()}
        assert case["ended_ns"] == execution.ended_ns


def _names(record: Record) -> set[str]:
    """What a sentence must not leave out: the name of what took part, and the number of a request."""
    given = {name: getattr(record, name) for name in record.__struct_fields__}
    keys = ("operation", "injection", "transition", "resource", "request", "failed", "variable", "condition")
    return {
        str(given[key]) for key in keys if given.get(key) is not None and not str(given[key]).startswith("complete")
    }


@pytest.mark.parametrize("network", ["perfect", "drawn"])
def test_random_cases_of_the_example_are_packed_record_by_record(network: str) -> None:
    cases = RandomCases(BEFORE) if network == "perfect" else RandomCases(BEFORE, network=None)
    _must_be_alike(BEFORE, [*map(TESTER.execute, cases.first(25, 3))])


def test_written_cases_of_the_example_are_packed_record_by_record() -> None:
    model = load_model(EXAMPLE / "after.yaml")
    tester = Tester(model)
    executions = [tester.execute(written.case) for written in load_suite([EXAMPLE / "cases"], model)]
    assert len(executions) == 7
    _must_be_alike(model, executions)


def test_injections_before_the_run_and_those_in_it_are_packed() -> None:
    execution = TESTER.execute(read_case(DISTURBED, BEFORE))
    kinds = [record.kind for record in execution.trace.records]
    assert kinds[:3] == ["runner_started", "injection", "run_started"]
    assert {"put_back", "resource"} <= {*kinds}
    _must_be_alike(BEFORE, [execution])
    packed = pack_timelines(BEFORE, [execution])
    _, first, *_ = _records(packed, _cases(packed)[0])
    assert first.changes == {"gripper_act": "closed"}


@pytest.mark.slow
@pytest.mark.parametrize("file", sorted((MODELS / "fails_at_run").glob("*.yaml")), ids=lambda file: file.stem)
def test_runs_that_fail_are_packed_record_by_record(file: Path) -> None:
    model = load_model(file)
    _must_be_alike(model, [*map(Tester(model).execute, RandomCases(model).first(2, 1))])


def test_violations_say_what_where_and_since_when() -> None:
    execution = TESTER.execute(read_case(DISTURBED, BEFORE))
    packed = pack_timelines(BEFORE, [execution])
    texts = _opened(packed["shared"])["texts"]
    shown = [(texts[name], *numbers, texts[why]) for name, *numbers, why in _cases(packed)[0]["violations"]]
    assert [name for name, *_ in shown] == ["home", "soon"]
    assert shown == [(v.requirement, v.begins, v.record, v.at_ns, v.reason) for v in execution.violations]


def test_what_a_case_says_in_vain_is_reported() -> None:
    execution = TESTER.execute(read_case(DISTURBED, BEFORE))
    packed = pack_timelines(BEFORE, [execution])
    texts = _opened(packed["shared"])["texts"]
    assert [texts[sentence] for sentence in _cases(packed)[0]["unused"]] == [*execution.unused]
    assert any("never" in sentence for sentence in execution.unused)


def test_lanes_report_the_subject_what_became_of_it_and_who_else_took_part() -> None:
    execution = TESTER.execute(read_case(DISTURBED, BEFORE))
    packed = pack_timelines(BEFORE, [execution])
    lanes = {(record.kind, *record.lane) for record in _records(packed, _cases(packed)[0])}
    assert ("resource", "busy", "occupied", "robot") in lanes
    assert ("put_back", "pushed", "", "") in lanes
    assert ("operation", "scanner_scan_item_a", "disabled", "") in lanes
    assert ("reply_received", "gantry", "succeeded", "") in lanes
    assert ("request_sent", "scanner", "scan_item_a", "") in lanes
    assert ("run_ended", "item_a_delivered", "reached", "") in lanes


def _spans(case: dict[str, Any], key: str, texts: list[str]) -> list[tuple[int, int, str]]:
    """First record, last record and outcome of each span, as the script of the page reads them."""
    flat = case[key]
    triples = zip(flat[::3], flat[1::3], flat[2::3], strict=True)
    return [(begin, begin + length, texts[outcome]) for begin, length, outcome in triples]


def test_the_spans_of_a_run_are_packed_with_their_outcomes() -> None:
    executions = [*map(TESTER.execute, RandomCases(BEFORE, network=None).first(10, 2))]
    packed = pack_timelines(BEFORE, executions)
    texts = _opened(packed["shared"])["texts"]
    for execution, case in zip(executions, _cases(packed), strict=True):
        spans = execution.spans
        assert _spans(case, "operations", texts) == [
            (span.begin_record, span.end_record, "" if span.outcome is None else span.outcome.value)
            for span in spans.operations
        ]
        assert _spans(case, "requests", texts) == [
            (span.begin_record, span.end_record, span.outcome.value) for span in spans.requests
        ]
        assert _spans(case, "plans", texts) == [
            (span.begin_record, span.end_record, span.status or "") for span in spans.plans
        ]


def test_the_script_of_the_page_has_a_lane_for_every_kind_of_record() -> None:
    script = (files("scbm.reports.html") / "timeline.js").read_text(encoding="utf-8")
    places = script.partition("#place(record) {")[2].partition("default:")[0]
    assert sorted(re.findall(r'case "(\w+)":', places)) == sorted(record.kind for record in get_args(Record))


def test_a_case_that_cannot_be_run_again_keeps_its_place() -> None:
    case = RandomCases(BEFORE).case(1, 1)
    run = TESTER.execute(case)
    packed = pack_timelines(BEFORE, [None, run, None])
    assert packed["cases"] == 3
    assert [case is None for case in _cases(packed)] == [True, False, True]


def test_no_cases_are_no_blocks() -> None:
    packed = pack_timelines(BEFORE, [])
    assert packed["cases"] == 0
    assert packed["blocks"] == []


@pytest.mark.longer
def test_each_block_can_be_opened_without_the_others() -> None:
    executions = [*map(TESTER.execute, RandomCases(BEFORE).first(130, 1))]
    packed = pack_timelines(BEFORE, executions)
    per_block = packed["per_block"]
    assert len(packed["blocks"]) == -(-130 // per_block)
    block = _opened(packed["blocks"][129 // per_block])
    last = {**block["cases"][129 % per_block], "table": block["steps"]}
    assert [record.at_ns for record in _records(packed, last)] == [r.at_ns for r in executions[129].trace.records]


class _Watched(Execution, frozen=True, weakref=True):
    """An execution whose life can be watched."""


@pytest.mark.longer
def test_executions_are_not_kept() -> None:
    alive: list[weakref.ref[_Watched]] = []
    most = 0

    def runs() -> Iterator[Execution]:
        nonlocal most
        for case in RandomCases(BEFORE).first(70, 1):
            run = TESTER.execute(case)
            watched = _Watched(*(getattr(run, name) for name in run.__struct_fields__))
            alive.append(weakref.ref(watched))
            most = max(most, sum(ref() is not None for ref in alive))
            yield watched
            del watched

    pack_timelines(BEFORE, runs())
    assert most <= 2


@pytest.mark.slow
def test_ten_thousand_cases_of_the_example_would_take_less_than_two_megabytes() -> None:
    tester = Tester(BEFORE)
    packed = pack_timelines(BEFORE, (tester.execute(case) for case in RandomCases(BEFORE).first(640, 1)))
    blocks = sum(map(len, packed["blocks"]))
    assert len(packed["shared"]) + blocks * 10_000 / 640 < 2_000_000


_PRINT = """
import sys
from hashlib import sha256
from pathlib import Path
from scbm.files import load_model
from scbm.reports.html.timelines import pack_timelines
from scbm.testing import RandomCases, Tester
model = load_model(Path(sys.argv[1]))
runs = [Tester(model).execute(case) for case in RandomCases(model, network=None).first(10, 1)]
print(sha256(repr(pack_timelines(model, runs)).encode()).hexdigest())
"""


@pytest.mark.slow
def test_the_same_runs_are_packed_into_the_same_bytes_under_every_hash_seed() -> None:
    printed = [
        subprocess.run(
            [sys.executable, "-c", _PRINT, str(EXAMPLE / "before.yaml")],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("1", "2")
    ]
    assert printed[0] == printed[1]
