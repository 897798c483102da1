"""Worker processes: the same results as in one process, whatever happens to the workers."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.cases import Case
from scbm.files import load_model
from scbm.model import InputError, Slug
from scbm.testing.batches import all_cores, worker_processes
from scbm.testing.batches.all_cores import Cores
from scbm.testing.batches.batch_summary import BatchSummary
from scbm.testing.batches.campaign_runs import Executor, InProcess, StopRule, run_steps
from scbm.testing.batches.campaign_work import CampaignWork
from scbm.testing.batches.worker_processes import WorkerPool, WorkerProcesses
from support.wording import Wording

ROOT = Path(__file__).parents[4]
MODEL = "examples/robot_in_the_air/after.yaml"
EXAMPLE = load_model(ROOT / MODEL)
FAILS = load_model(ROOT / "tests/models/fails_at_run/livelock.yaml")


def total(work: CampaignWork, executor: Executor, rule: StopRule | None = None) -> BatchSummary:
    return [step.total for step in run_steps(work, executor, rule or StopRule())][-1]


@pytest.mark.slow
def test_workers_give_the_same_results_as_one_process() -> None:
    work = CampaignWork(EXAMPLE, numbers=range(1, 61), seed=3, network=None)
    assert total(work, WorkerProcesses(2)) == total(work, InProcess())


@pytest.mark.slow
def test_a_campaign_ends_early_at_the_same_case() -> None:
    failing = CampaignWork(FAILS, numbers=range(1, 401))
    rule = StopRule(at_failure=True)
    assert total(failing, WorkerProcesses(2), rule) == total(failing, InProcess(), rule)
    dry = CampaignWork(EXAMPLE, numbers=range(1, 5_001), seed=1)
    rule = StopRule(dry=30)
    assert total(dry, WorkerProcesses(3), rule) == total(dry, InProcess(), rule)
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_a_killed_worker_changes_nothing() -> None:
    work = CampaignWork(EXAMPLE, numbers=range(1, 2_001), seed=5)
    killed, sums = 0, []
    for step in run_steps(work, WorkerProcesses(2)):
        sums.append(step.total)
        workers = multiprocessing.active_children()
        if killed < 3 and workers:
            workers[0].kill()
            killed += 1
    assert killed == 3
    assert sums[-1] == total(work, InProcess())


class Deadly(Case, frozen=True):
    """A case that ends the process that unpickles it."""

    def __reduce__(self) -> tuple[Callable[[int], Any], tuple[int]]:
        return os._exit, (1,)


@pytest.mark.slow
def test_workers_that_are_lost_again_and_again_are_an_error() -> None:
    case = CampaignWork(EXAMPLE, numbers=[1]).case(1)
    deadly = Deadly(case.name, case.goal, case.predicate, case.initial)
    with pytest.raises(InputError) as raised:
        total(CampaignWork(EXAMPLE, (deadly,)), WorkerProcesses(2))
    assert [each.slug for each in raised.value.diagnostics] == [Slug.WORKERS_LOST]


def test_a_short_campaign_starts_no_processes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(all_cores, "perf_counter", lambda: 0.0)  # it is short on a slow machine, too
    work = CampaignWork(EXAMPLE, numbers=range(1, 21))
    steps = run_steps(work, Cores())
    assert all(not multiprocessing.active_children() for _ in steps)


CAMPAIGN = """
from scbm.cli import main
from scbm.cli.output import progress
progress._INTERVAL_S = 1e-9  # a line after each batch
main()
"""


def started(tmp_path: Path) -> subprocess.Popen[str]:
    """Start a long campaign in two workers; return it once its first batches have finished."""
    words = ("test", MODEL, "--cases", "1000000", "-j", "2", "--failures", str(tmp_path / "failures"))
    process = subprocess.Popen(
        [sys.executable, "-c", CAMPAIGN, *words],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    assert process.stderr is not None
    assert " of 1000000 cases, 0 failed, " in process.stderr.readline()
    return process


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupted_campaign_reports_what_was_done_and_leaves_no_process(
    tmp_path: Path, number: signal.Signals
) -> None:
    process = started(tmp_path)
    os.killpg(process.pid, number)  # as a terminal does: every process of the group gets it
    out, err = process.communicate()  # which ends when the last worker has closed the pipes
    assert process.returncode == 130
    assert "Interrupted after " in out
    assert "Traceback" not in err
    assert [line for line in err.splitlines() if " cases, 0 failed, " not in line] == err.splitlines()[-1:]


@pytest.mark.slow
def test_workers_end_with_a_parent_that_was_killed(tmp_path: Path) -> None:
    process = started(tmp_path)
    process.kill()
    _, err = process.communicate()  # the same
    assert process.returncode == -signal.SIGKILL
    assert "Traceback" not in err


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_waits_until_a_worker_has_got_all_that_it_reads(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch
) -> None:
    started = list[bool]()

    class SignalledPool:
        def submit(self, *_: object) -> None:
            signal.raise_signal(number)
            started.append(True)

    monkeypatch.setattr(worker_processes, "ProcessPoolExecutor", lambda *_: SignalledPool())
    before = signal.signal(number, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            WorkerPool(lambda _: None, b"", 2).submit(abs, 1)
        assert started == [True]
        assert signal.getsignal(number) is signal.default_int_handler
    finally:
        signal.signal(number, before)


STARTING = """
import multiprocessing.util as util
import os
import signal
from scbm.cli import main
spawn = util.spawnv_passfds
def spawn_and_signal(path, arguments, descriptors):
    child = spawn(path, arguments, descriptors)
    if not any("resource_tracker" in str(word) for word in arguments):
        os.kill(os.getpid(), signal.SIGTERM)
    return child
util.spawnv_passfds = spawn_and_signal
main()
"""
"""A command that gets SIGTERM while its first worker waits for what it reads."""


@pytest.mark.slow
@pytest.mark.parametrize("verb", ["test", "mutate"])
def test_sigterm_while_a_worker_starts_ends_a_command_as_a_later_one_does(verb: str, wording: Wording) -> None:
    command = [sys.executable, "-c", STARTING, verb, MODEL, "--cases", "10", "-j", "2"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 130
    wording(done.stderr)
