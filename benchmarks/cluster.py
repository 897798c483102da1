"""Campaigns on several cores and on a Dask cluster, with peers in the same run; memory, and killed workers.

The peer of `-j 2` and of a cluster of two workers is what the machine can do at most: two processes that each run half
of the campaign and know nothing of each other. `--memory` compares the peak memory of many cases with that of a tenth
of them. `--kills` kills that many workers of a cluster during one campaign, starts new ones, and compares the bytes of
its JSON.
"""

from __future__ import annotations

import argparse
import re
import subprocess
import sys
import tempfile
import time
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

ROOT = Path(__file__).parents[1]
MODEL = "examples/robot_in_the_air/before.yaml"
SCBM = (sys.executable, "-m", "scbm", "test", MODEL)
DASK = "distributed.cli.dask_"


def command(cases: int, *options: str, failures: str) -> list[str]:
    """Return a campaign of so many cases."""
    return [*SCBM, "--cases", str(cases), "--no-shrink", "--failures", failures, "--json", *options]


def wall_s(commands: Sequence[Sequence[str]]) -> float:
    """Run commands at the same time; return the wall time until all have ended."""
    begun_s = time.perf_counter()
    running = [subprocess.Popen(words, cwd=ROOT, stdout=subprocess.DEVNULL) for words in commands]
    codes = [process.wait() for process in running]
    if any(codes):
        sys.exit(f"a campaign ended with {codes}")
    return time.perf_counter() - begun_s


@contextmanager
def dask(*words: str) -> Iterator[subprocess.Popen[str]]:
    """Run a process of Dask."""
    process = subprocess.Popen([sys.executable, "-m", *words], cwd=ROOT, stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.communicate()


class Cluster:
    """A scheduler on loopback, and its workers."""

    def __init__(self, stack: ExitStack) -> None:
        """Start the scheduler."""
        self._stack = stack
        options = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard")
        scheduler = stack.enter_context(dask(f"{DASK}scheduler", *options))
        self.address = _found(scheduler, r"Scheduler at:\s+(tcp://\S+)")

    def worker(self) -> subprocess.Popen[str]:
        """Start a worker; return it once it has joined."""
        options = ("--nthreads", "1", "--no-nanny", "--no-dashboard")
        worker = self._stack.enter_context(dask(f"{DASK}worker", self.address, *options))
        _found(worker, r"(Registered to:)")
        return worker


def _found(process: subprocess.Popen[str], pattern: str) -> str:
    """Return what a pattern finds in the log of a process, once it is there."""
    assert process.stderr is not None  # noqa: S101 - it is a pipe
    for line in process.stderr:
        match = re.search(pattern, line)
        if match:
            return match[1]
    sys.exit("a process of Dask ended")


def speed(cases: int, rounds: int, failures: str) -> None:
    """Print the speed-ups of two workers against two independent processes."""
    times: dict[str, list[float]] = {"one process": [], "two independent processes": [], "-j 2": [], "cluster of 2": []}
    with ExitStack() as stack:
        cluster = Cluster(stack)
        for _ in range(2):
            cluster.worker()
        for number in range(rounds):
            seed = ("--seed", str(number))
            one = command(cases, *seed, "-j", "1", failures=failures)
            half = command(cases // 2, *seed, "-j", "1", failures=failures)
            other = command(cases // 2, "--seed", str(number + rounds), "-j", "1", failures=failures)
            times["one process"].append(wall_s([one]))
            times["two independent processes"].append(wall_s([half, other]))
            times["-j 2"].append(wall_s([command(cases, *seed, "-j", "2", failures=failures)]))
            on_cluster = command(cases, *seed, "--cluster", cluster.address, failures=failures)
            times["cluster of 2"].append(wall_s([on_cluster]))
    best = {name: min(found) for name, found in times.items()}
    base = best["one process"]
    most = base / best["two independent processes"]
    print(f"{cases} cases of {MODEL}, best of {rounds}:")
    for name, seconds in best.items():
        print(f"  {name:<27}{seconds:7.2f} s   {base / seconds:5.2f} x   {base / seconds / most:5.2f} of the peer")


def peak_kb(words: Sequence[str]) -> int:
    """Run a command; return the largest memory of any of its processes so far, in kB."""
    code = f"import resource, subprocess; subprocess.run({list(words)!r}, stdout=subprocess.DEVNULL, check=True)"
    code += "; print(resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss)"
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    return int(ran.stdout)


def memory(cases: int, failures: str) -> None:
    """Print the peak memory of a campaign, and of a tenth of it."""
    tenth = cases // 10
    few, many = (peak_kb(command(count, "-j", "2", failures=failures)) for count in (tenth, cases))
    print(f"peak memory of {tenth} cases {few / 1024:.1f} MiB, of {cases} {many / 1024:.1f} MiB: {many / few:.2f} x")


def kills(count: int, cases: int, failures: str) -> None:
    """Kill workers of a cluster during one campaign, and compare its bytes with those of one process."""
    with ExitStack() as stack:
        cluster = Cluster(stack)
        workers = [cluster.worker() for _ in range(2)]
        words = command(cases, "--cluster", cluster.address, failures=failures)
        campaign = subprocess.Popen(words, cwd=ROOT, stdout=subprocess.PIPE)
        killed = 0
        while killed < count and campaign.poll() is None:
            workers.pop(0).kill()
            killed += 1
            workers.append(cluster.worker())
        was_running = campaign.poll() is None
        out, _ = campaign.communicate()
    alone = subprocess.run(command(cases, "-j", "2", failures=failures), cwd=ROOT, capture_output=True, check=True)
    same = "the bytes of -j 2" if out == alone.stdout else "OTHER BYTES than -j 2"
    print(f"{killed} workers killed during {cases} cases{'' if was_running else ', which then ended'}: {same}")
    if out != alone.stdout:
        sys.exit(1)


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000, help="cases of a campaign whose time is measured")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--memory", type=int, metavar="CASES", help="measure the memory of so many cases")
    parser.add_argument("--kills", type=int, metavar="WORKERS", help="kill so many workers during one campaign")
    parser.add_argument("--kill-cases", type=int, default=200_000, metavar="CASES", help="cases of that campaign")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as failures:
        if options.rounds:
            speed(options.cases, options.rounds, failures)
        if options.memory:
            memory(options.memory, failures)
        if options.kills:
            kills(options.kills, options.kill_cases, failures)


if __name__ == "__main__":
    main()
