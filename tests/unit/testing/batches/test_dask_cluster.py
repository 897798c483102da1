"""A Dask cluster on loopback: the same results as in one process, whatever happens to workers and scheduler."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import pytest

from support.wording import Wording, diagnostic_heads

ROOT = Path(__file__).parents[4]
MODEL = "examples/robot_in_the_air/after.yaml"

pytestmark = [
    pytest.mark.peer,
    pytest.mark.skipif(
        find_spec("distributed") is None and os.environ.get("SCBM_ALL_TOOLS") != "1",
        reason="not installed: distributed",
    ),
]

CAMPAIGN = """
from scbm.cli import main
from scbm.cli.output import progress
progress._INTERVAL_S = 1e-9  # a line after each batch
main()
"""


@contextmanager
def process(*words: str, **variables: str) -> Iterator[subprocess.Popen[str]]:
    """A process of Dask with these variables of the environment, killed at the end."""
    command = [sys.executable, "-m", *words]
    running = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, env=os.environ | variables)
    try:
        yield running
    finally:
        running.kill()
        running.communicate()


class Cluster:
    """A scheduler, and the workers that a test starts."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        options = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        self.scheduler = stack.enter_context(process("distributed.cli.dask_scheduler", *options))
        assert self.scheduler.stderr is not None
        found = (re.search(r"Scheduler at:\s+(tcp://\S+)", line) for line in self.scheduler.stderr)
        self.address = next(match[1] for match in found if match)

    def worker(self, **variables: str) -> subprocess.Popen[str]:
        """Start a worker; return it once it has joined."""
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard")
        worker = self._stack.enter_context(process("distributed.cli.dask_worker", self.address, *options, **variables))
        assert worker.stderr is not None
        assert any("Registered to:" in line for line in worker.stderr)
        return worker


@pytest.fixture
def cluster() -> Iterator[Cluster]:
    with ExitStack() as stack:
        yield Cluster(stack)


def started(*words: object) -> subprocess.Popen[str]:
    """Start `scbm test` with a line of progress after each batch; return it once the first batch has finished."""
    command = [sys.executable, "-c", CAMPAIGN, "test", MODEL, *map(str, words)]
    running = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    assert running.stderr is not None
    assert " failed, " in running.stderr.readline()
    return running


def test_a_cluster_gives_the_same_bytes_though_workers_are_killed_and_join(
    scbm: Callable[..., Any], cluster: Cluster, tmp_path: Path
) -> None:
    options = ("--cases", 3_000, "--seed", 3, "--network", "drawn", "--no-shrink", "--failures", tmp_path, "--json")
    workers = [cluster.worker(), cluster.worker()]
    running = started(*options, "--cluster", cluster.address)
    for worker in workers:
        worker.kill()
        cluster.worker()
    out, _ = running.communicate()
    expected = scbm("test", MODEL, *options, "-j", 1)
    assert (running.returncode, json.loads(out)) == (expected.code, json.loads(expected.out))
    assert out == expected.out


def test_a_scheduler_that_vanishes_is_an_error_and_what_was_joined_is_reported(
    cluster: Cluster, tmp_path: Path, wording: Wording
) -> None:
    cluster.worker()
    running = started("--cases", 1_000_000, "--failures", tmp_path, "--cluster", cluster.address)
    cluster.scheduler.kill()
    out, err = running.communicate()
    assert running.returncode == 2
    assert "Ended by an error" in out
    assert "--cluster: error[cluster-unusable]" in diagnostic_heads(err)
    wording(line for line in err.splitlines() if "error[" in line)
    assert "Traceback" not in err


def test_an_interrupted_campaign_leaves_the_cluster_to_others(
    scbm: Callable[..., Any], cluster: Cluster, tmp_path: Path
) -> None:
    cluster.worker()
    running = started("--cases", 1_000_000, "--failures", tmp_path, "--cluster", cluster.address)
    os.kill(running.pid, signal.SIGINT)
    out, err = running.communicate()
    assert running.returncode == 130
    assert "Interrupted after " in out
    assert "Traceback" not in err
    again = subprocess.run(
        [sys.executable, "-m", "scbm", "test", MODEL, "--cases", "5", "--cluster", cluster.address],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    assert again.stdout == scbm("test", MODEL, "--cases", 5).out


def test_a_worker_without_scbm_is_an_error(
    cluster: Cluster, scbm: Callable[..., Any], tmp_path: Path, wording: Wording
) -> None:
    package = tmp_path / "scbm"
    package.mkdir()
    (package / "__init__.py").write_text("raise ModuleNotFoundError(\"No module named 'scbm'\")\n", encoding="utf-8")
    cluster.worker(PYTHONPATH=str(tmp_path))
    ran = scbm("test", MODEL, "--cases", 10, "--cluster", cluster.address)
    assert ran.code == 2
    assert diagnostic_heads(ran.err) == ["--cluster: error[cluster-unusable]"]
    wording(ran.err)


def test_a_cluster_that_is_not_there_is_an_error(wording: Wording) -> None:
    for address in ("tcp://127.0.0.1:1", "nothing at all"):
        command = [sys.executable, "-m", "scbm", "test", MODEL, "--cluster", address]
        ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        assert (ran.returncode, ran.stdout) == (2, "")
        assert diagnostic_heads(ran.stderr) == ["--cluster: error[cluster-unusable]"]
        wording(ran.stderr.split(": ")[:3])  # without what Dask adds
        assert "Traceback" not in ran.stderr


def test_workers_of_a_cluster_and_of_this_machine_exclude_each_other(scbm: Callable[..., Any]) -> None:
    ran = scbm("test", MODEL, "--cluster", "tcp://127.0.0.1:1", "-j", 2)
    assert (ran.code, "-j: error[bad-option]" in ran.err) == (2, True)
