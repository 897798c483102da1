"""Runs over nodes for tests, made without nodes: what happened is not what a simulation of the case gives."""

from __future__ import annotations

from msgspec.structs import replace

from scbm.cases import Case
from scbm.model import BehaviorModel
from scbm.running import Program
from scbm.store import History, StoredRun, digest_of, key_of
from scbm.store.packed_logs import packed_log
from scbm.testing import Execution, Tester
from scbm.testing.event_logs.event_log import EventLog, rerun, write_event_log
from support.capturing import captured

WHERE = "over DDS domain 7"


def real_run(model: BehaviorModel, case: Case, chance: int = 77) -> Execution:
    """A random case over nodes, where resources react otherwise than in simulation; `chance` decides how."""
    assert case.origin is not None
    log, _ = captured(model, replace(case, origin=replace(case.origin, number=chance)))
    log = replace(log, case=case, digest=digest_of(model))
    return Tester(model).judged(case, rerun(log, Program(model)), log.reactions, log)


def log_of(execution: Execution) -> EventLog:
    """The log of a run over nodes."""
    assert execution.log is not None
    return execution.log


def log_text(model: BehaviorModel, execution: Execution) -> str:
    """The same as text."""
    return write_event_log(log_of(execution), model)


def with_real_runs(history: History, cases: tuple[Case, ...], real: tuple[str, ...] = ()) -> History:
    """The history with a second run, over nodes, of the first of its cases, which `cases` are."""
    model = history.model
    number = len(history.runs)
    came = [real_run(model, case) for case in cases]
    added = []
    for position, (stored, execution) in enumerate(zip(history.cases, came, strict=False), start=1):
        recipe, result = replace(stored.recipe, real=real), execution.result
        case = replace(
            stored, key=key_of(recipe, digest_of(model)), recipe=recipe, run=number, position=position,
            verdict=result.verdict, ended_ns=result.ended_ns, requests=result.requests, visited=result.visited,
            log=packed_log(log_text(model, execution)),
        )  # fmt: skip
        added.append(case)
    union = 0
    for case in added:
        union |= case.visited
    command = "scbm test cell.yaml --cases 20 --transport dds --domain 7 --store cov.db"
    last = StoredRun(
        "0" * 31 + "2", "2026-11-21T13:00:00.000000Z", command, history.source, union, len(added), nodes=WHERE
    )  # fmt: skip
    return replace(history, runs=(*history.runs, last), cases=(*history.cases, *added))
