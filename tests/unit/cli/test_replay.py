"""`scbm replay` of logs: the run is shown and judged as it was, with an error for each contradiction."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import pytest
from msgspec.structs import replace

from scbm.cases import Expectations, OutcomeRule
from scbm.cases.trace import End, Trace, read_trace, trace_digest
from scbm.files import digest_of, load_model, read_case, read_model, write_case
from scbm.model import Outcome
from scbm.running import Measured, Program
from scbm.testing import RandomCases
from scbm.testing.event_logs.event_log import EventLog, LogStep, replay, write_event_log
from support.capturing import captured
from support.models import SCAN_CELL
from support.profiles import share
from support.wording import Wording, diagnostic_heads

ROOT = Path(__file__).parents[3]
AFTER = ROOT / "examples/robot_in_the_air/after.yaml"
BEFORE = ROOT / "examples/robot_in_the_air/before.yaml"
MODEL = load_model(AFTER)


class Ran(Protocol):
    code: int
    out: str
    err: str


Scbm = Callable[..., Ran]


def _log(number: int = 3) -> EventLog:
    """A run in which something is lost on the way."""
    case = RandomCases(MODEL, network=None).case(7, number)
    log, _ = captured(MODEL, case)
    return replace(log, digest=digest_of(MODEL), model_file=str(AFTER))


def _save(log: EventLog, path: Path) -> Path:
    path.write_text(write_event_log(log, MODEL), encoding="utf-8", newline="")
    return path


@pytest.mark.longer
@pytest.mark.parametrize("number", range(1, 1 + share(8, least=1)))
def test_a_log_shows_what_its_case_shows_in_simulation(scbm: Scbm, tmp_path: Path, number: int) -> None:
    log = _log(number)
    path = _save(log, tmp_path / "run.jsonl")
    case = tmp_path / "case.yaml"
    case.write_text(write_case(log.case, MODEL, str(AFTER)), encoding="utf-8")
    for options in ((), ("--all",), ("--require", "never robot_at == home")):
        replayed, simulated = scbm("replay", path, *options), scbm("replay", case, *options)
        assert (replayed.code, replayed.err) == (simulated.code, "")
        known = [line for line in simulated.out.splitlines() if not line.startswith("HAZARD")]  # not what devices do
        assert [*filter(None, replayed.out.splitlines())] == [*filter(None, known)]
    traces = [tmp_path / "replayed", tmp_path / "simulated"]
    report = json.loads(scbm("replay", path, "--json", "--trace", traces[0]).out)
    assert (report.pop("is_recorded_run"), report.pop("excluded_values")) == (True, [])
    expected = json.loads(scbm("replay", case, "--json", "--trace", traces[1]).out)
    assert expected.pop("is_recorded_run") is None
    assert report.pop("hazards") == []
    del expected["hazards"]
    assert report == expected
    assert traces[0].read_bytes() == traces[1].read_bytes()
    assert read_trace(traces[0].read_text(encoding="utf-8")).records


def test_what_a_driver_sent_and_the_model_excludes_is_shown(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    model = read_model(SCAN_CELL)
    log, _ = captured(model, read_case("case: scans\ngoal: scanned\n", model))
    *first, last = log.steps
    sent = [LogStep(last.at_ns, Measured((("temperature", value),))) for value in (7, 8)]
    log = replace(log, steps=(*first, *sent, last), digest=digest_of(model), model_file="cell.yaml")
    trace = trace_digest(Trace(model.name, "scans", replay(log, Program(model))))
    (tmp_path / "cell.yaml").write_text(SCAN_CELL, encoding="utf-8")
    path = tmp_path / "run.log"
    path.write_text(write_event_log(replace(log, trace=trace), model), encoding="utf-8")
    ran = scbm("replay", path)
    assert (ran.code, ran.err) == (0, "")
    lines = ran.out.splitlines()
    begin = next(n for n, line in enumerate(lines) if line.startswith("EXCLUDED"))
    wording([line.strip() for line in lines if "sent" in line] + lines[begin:])
    excluded = json.loads(scbm("replay", path, "--json").out)["excluded_values"]
    assert [(each["variable"], each["value"]) for each in excluded] == [("temperature", 7), ("temperature", 8)]


def test_a_log_is_judged_by_its_case(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    log = _log()
    expecting = replace(log.case, expect=Expectations(End.PLANNER_LIMIT))
    ran = scbm("replay", _save(replace(log, case=expecting), tmp_path / "run.jsonl"))
    assert (ran.code, ran.err) == (1, "")
    wording(line for line in ran.out.splitlines() if "FAILED" in line)


@pytest.mark.slow
def test_requests_of_a_log_without_reply_excuse_that_the_goal_is_not_reached(scbm: Scbm, tmp_path: Path) -> None:
    goal = MODEL.goals[0]
    case = RandomCases(MODEL).case(1, 1)
    everything = [OutcomeRule(r.name, 1, None, Outcome.TIMEOUT) for r in MODEL.resources]
    log, _ = captured(MODEL, replace(case, goal=goal[0], predicate=goal[1], outcomes=tuple(everything), origin=None))
    log = replace(log, digest=digest_of(MODEL), model_file=str(AFTER))
    assert log.end is not End.REACHED
    assert scbm("replay", _save(log, tmp_path / "run.jsonl")).code == 0


def test_another_trace_than_the_recorded_one_is_reported(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    path = _save(replace(_log(), trace="0" * 64), tmp_path / "run.jsonl")
    ran = scbm("replay", path)
    assert ran.code == 1
    assert "error[replay-differs]" in ran.err
    wording(ran.err)
    assert "●" in ran.out
    assert json.loads(scbm("replay", path, "--json").out)["is_recorded_run"] is False


def test_a_log_has_the_time_limit_of_its_run(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    ran = scbm("replay", _save(_log(), tmp_path / "run.jsonl"), "--time-limit", "1 h")
    assert ran.code == 2
    assert "error[bad-option]" in ran.err
    wording(ran.err)


@pytest.mark.slow
def test_the_model_of_a_log_is_seen_from_where_the_log_is(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    (tmp_path / "models").mkdir()
    (tmp_path / "logs").mkdir()
    (tmp_path / "models/cell.yaml").write_bytes(AFTER.read_bytes())
    path = _save(replace(_log(), model_file="../models/cell.yaml"), tmp_path / "logs/run.jsonl")
    assert scbm("replay", path).code == 0
    nowhere = _save(replace(_log(), model_file=None), tmp_path / "logs/run.jsonl")
    ran = scbm("replay", nowhere)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{nowhere}: error[model-missing]"])
    wording(ran.err)
    assert scbm("replay", nowhere, "--model", AFTER).code == 0
    lost = _save(replace(_log(), model_file="gone.yaml"), tmp_path / "logs/run.jsonl")
    ran = scbm("replay", lost)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{lost}:1: error[file-missing]"])
    assert f"`{lost.parent / 'gone.yaml'}`" in ran.err
    wording(ran.err)
    assert scbm("replay", lost, "--model", AFTER).code == 0


def test_a_log_of_another_version_of_the_model_is_refused(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    ran = scbm("replay", _save(_log(), tmp_path / "run.jsonl"), "--model", BEFORE)
    assert ran.code == 2
    assert "error[log-other-model]" in ran.err
    wording(ran.err)


def test_a_log_is_written_for_other_tools_as_its_case_is(scbm: Scbm, tmp_path: Path) -> None:
    log = _log()
    path, case = _save(log, tmp_path / "run.log"), tmp_path / "case.yaml"
    case.write_text(write_case(log.case, MODEL, str(AFTER)), encoding="utf-8")
    written = [tmp_path / "log.json", tmp_path / "case.json"]
    real = scbm("trace", path, "--perfetto", written[0], "--require", "never robot_at == home")
    simulated = scbm("trace", case, "--perfetto", written[1], "--require", "never robot_at == home")
    assert (real.code, real.err) == (0, "")
    assert written[0].read_bytes() == written[1].read_bytes()
    (head, *_), (of_case, *_) = real.out.splitlines(), simulated.out.splitlines()
    assert head == of_case.replace(" s", " s, over nodes", 1)
    report = json.loads(scbm("trace", path, "--mcap", tmp_path / "run.mcap", "--json").out)
    assert (report["is_real_run"], report["case"]) == (True, log.case.name)
    ran = scbm("trace", path, "--perfetto", path)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["--perfetto: error[bad-option]"])
    ran = scbm("trace", path, "--perfetto", "y", "--seed", 1)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["--seed: error[bad-option]"])


@pytest.mark.parametrize(
    "command", [("test", AFTER), ("check",), ("check", AFTER, "--bindings")], ids=["case", "model", "bindings"]
)
def test_a_log_where_a_file_is_needed_that_a_run_is_made_of_is_reported_to_be_one(
    scbm: Scbm, tmp_path: Path, command: tuple[object, ...], wording: Wording
) -> None:
    path, trace = _save(_log(), tmp_path / "the run.log"), tmp_path / "trace.jsonl"
    ran = scbm(*command, path)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{path}:1: error[wrong-shape]"])
    assert f"`scbm replay '{path}'`" in ran.err
    wording(ran.err)
    scbm("replay", path, "--trace", trace)
    ran = scbm(*command, trace)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{trace}:1: error[wrong-shape]"])
    wording(ran.err)


def test_events_that_do_not_end_the_run_are_refused(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    log = _log()
    ran = scbm("replay", _save(replace(log, steps=log.steps[:2]), tmp_path / "run.jsonl"))
    assert (ran.code, ran.out) == (2, "")
    assert "error[bad-log]" in ran.err
    wording(ran.err)


def test_a_trace_is_reported_to_be_one(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "run.jsonl"
    scbm("replay", _save(_log(), tmp_path / "log.jsonl"), "--trace", path)
    ran = scbm("replay", path)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, [f"{path}:1: error[bad-log]"])
    wording(ran.err)


@pytest.mark.longer
@pytest.mark.parametrize("name", ["run.yaml", "run", "case.jsonl"])
def test_names_do_not_matter(scbm: Scbm, tmp_path: Path, name: str) -> None:
    log = _log()
    assert scbm("replay", _save(log, tmp_path / name)).code == 0
    (tmp_path / name).write_text(write_case(log.case, MODEL, str(AFTER)), encoding="utf-8")
    assert scbm("replay", tmp_path / name).code == 0


def test_the_trace_replaces_nothing_that_is_read(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    path = _save(_log(), tmp_path / "run.jsonl")
    before = path.read_bytes()
    ran = scbm("replay", path, "--trace", path)
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["--trace: error[bad-option]"])
    wording(ran.err)
    assert path.read_bytes() == before


def test_what_cannot_be_read_is_reported_once(scbm: Scbm, tmp_path: Path) -> None:
    for path in (tmp_path, tmp_path / "missing"):
        ran = scbm("replay", path)
        assert (ran.code, ran.err.count("error[")) == (2, 1)
