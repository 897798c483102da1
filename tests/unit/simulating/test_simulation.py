"""Runs in virtual time."""

from __future__ import annotations

from scbm.model import Constant, Equal, Outcome, Reference
from scbm.running import End, Injection, RunnerOptions
from scbm.simulating import Reaction, RecordedChoices, Simulator
from scbm.trace import OperationStepped, ReplyDropped, ReplyReceived
from support.models import scan_cell

S = 1_000_000_000
GOAL = ("scanned", Equal(Reference("box_is_scanned"), Constant(True)))


def _reactions(*outcomes: tuple[Outcome, float]) -> RecordedChoices:
    return RecordedChoices([Reaction("scan", outcome, round(seconds * S)) for outcome, seconds in outcomes])


def test_time_jumps_from_event_to_event() -> None:
    model = scan_cell()
    chooser = _reactions((Outcome.TIMEOUT, 0), (Outcome.FAIL, 3), (Outcome.SUCCEED, 4))
    run = Simulator(model).run(model.nominal_state, GOAL, chooser)
    assert (run.end, run.ended_ns) == (End.REACHED, 17 * S)
    ends = [(r.at_ns, r.target.value) for r in run.records if isinstance(r, OperationStepped) and r.target != "initial"]
    assert ends == [
        (0, "executing"),
        (10 * S, "timedout"),
        (10 * S, "executing"),
        (13 * S, "executing"),
        (17 * S, "completed"),
    ]


def test_a_cancelled_request_is_not_answered() -> None:
    model = scan_cell()
    run = Simulator(model).run(model.nominal_state, GOAL, _reactions((Outcome.SUCCEED, 11), (Outcome.SUCCEED, 5)))
    assert run.ended_ns == 15 * S
    assert not any(isinstance(record, ReplyDropped) for record in run.records)
    assert [record.request for record in run.records if isinstance(record, ReplyReceived)] == [2]


def test_a_reply_at_the_deadline_is_in_time() -> None:
    model = scan_cell()
    run = Simulator(model).run(model.nominal_state, GOAL, _reactions((Outcome.SUCCEED, 10)))
    assert (run.end, run.ended_ns) == (End.REACHED, 10 * S)


def test_a_goal_that_nothing_brings_about_ends_at_the_time_limit() -> None:
    model = scan_cell(("    deadline: 10 seconds\n", ""), ("    timedout: [scan_req_trigger <- false]\n", ""))
    options = RunnerOptions(time_limit_ns=30 * S)
    run = Simulator(model, options).run(model.nominal_state, GOAL, _reactions((Outcome.TIMEOUT, 0)))
    assert (run.end, run.ended_ns) == (End.TIME_LIMIT, 30 * S)


def test_injections_act_at_their_time() -> None:
    model = scan_cell()
    red = Injection("red", (("light", "red"),), hold_ns=2 * S)
    run = Simulator(model).run(model.nominal_state, GOAL, _reactions((Outcome.SUCCEED, 1)), [red])
    states = [(r.at_ns, r.target.value) for r in run.records if isinstance(r, OperationStepped)]
    assert states[:2] == [(0, "disabled"), (2 * S, "executing")]
