"""The planners of `scbm` on published problems, beside Fast Downward's greedy and blind searches in the same run.

`python benchmarks/planners.py [NAME…]` prints a row for each problem. All times are CPU, so that a busy machine changes
them little. The search of `scbm` starts with a prepared model. Short searches are repeated, each with a new model, and
the shortest time counts. The memory is that of the process of the canonical search. The whole process is `scbm plan` on
a model file. Fast
Downward takes part where `up-fast-downward` is installed; it reads SAS+, so its translator is not counted.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from published import GOAL, PROBLEMS, fast_downward

from scbm.files import load_model, write_model
from scbm.planning import PLANNERS, Answer, PlanLimits, Planner, PlanProblem, Solved

LEFT_OUT = ("blocks-6-0", "blocks-8-0", "gripper-6", "agv-5x5")
"""Small problems, and one that compares counters, which SAS+ cannot state; they run if they are named."""


_MAX_REPEATS = 10


@dataclass(frozen=True)
class OwnRun:
    """Searches of `scbm` in a process of their own, with its peak memory."""

    search_s: float
    expanded: int
    length: int
    peak_mib: int


def main() -> None:
    """Prints a row for each problem."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", help=f"of {', '.join(PROBLEMS)}")
    parser.add_argument("--timeout", type=float, default=60, help="seconds for each canonical and blind search")
    parser.add_argument("--no-optimal", action="store_true", help="leave out the canonical and the blind search")
    parser.add_argument("--one", nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        print(json.dumps(_searched(Path(options.one[0]), options.one[1])))
        return
    _print_row(
        "problem", "ops", "greedy", "scbm plan", "FD greedy", "process", "ratio", "canonical", "memory", "FD blind"
    )
    with TemporaryDirectory() as directory:
        for name in options.names or [name for name in PROBLEMS if name not in LEFT_OUT]:
            _measure(name, Path(directory), options.timeout, is_optimal=not options.no_optimal)


def _measure(name: str, directory: Path, timeout_s: float, *, is_optimal: bool) -> None:
    model = PROBLEMS[name]()
    file = directory / f"{name}.yaml"
    file.write_text(write_model(model), encoding="utf-8")
    greedy, whole_s = _own(file, "greedy", timeout_s), _plan_command(file, "greedy")
    program = fast_downward.binary()
    task = fast_downward.sas_task(model)
    peer = fast_downward.run(program, task, fast_downward.GREEDY, directory, timeout_s) if program else None
    canonical = _own(file, "canonical", timeout_s) if is_optimal else None
    blind = (
        fast_downward.run(program, task, fast_downward.BLIND, directory, timeout_s) if program and is_optimal else None
    )
    ratio = f"{greedy.search_s / peer.search_s:.1f}x" if greedy and peer and peer.search_s else "-"
    _print_row(
        name,
        str(len(model.operations)),
        _shown(greedy),
        f"{whole_s:.2f} s",
        _shown(peer),
        f"{peer.whole_s:.2f} s" if peer else "-",
        ratio,
        _shown(canonical),
        f"{canonical.peak_mib} MiB" if canonical else "-",
        _shown(blind),
    )


def _shown(run: OwnRun | fast_downward.PeerRun | None) -> str:
    if run is None:
        return "-"
    return f"{1_000 * run.search_s:,.1f} ms, {run.expanded:,} st, {run.length} op"


def _print_row(*cells: str) -> None:
    widths = (-18, 5, 30, 9, 30, 8, 7, 36, 8, 36)
    row = (cell.ljust(-width) if width < 0 else cell.rjust(width) for cell, width in zip(cells, widths, strict=True))
    print(" ".join(row), flush=True)


def _own(file: Path, planner: str, timeout_s: float) -> OwnRun | None:
    """Return the figures of a search in a new process; `None` without a plan in time."""
    command = [sys.executable, __file__, "--one", str(file), planner]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, check=True, timeout=timeout_s)
    except subprocess.TimeoutExpired:
        return None
    found = json.loads(ran.stdout)
    return OwnRun(**found) if found else None


def _searched(file: Path, planner: str) -> dict[str, float] | None:
    model = load_model(file)
    goal = dict(model.goals)[GOAL]
    times: list[float] = []
    answer: Answer | None = None
    while len(times) < _MAX_REPEATS and sum(times) < 1:
        problem = Planner(model, planner).problem(goal)
        if planner == "greedy":
            _ = problem.greedy  # its rules are part of the preparation
        begin = time.process_time()
        answer = PLANNERS[planner].search(PlanProblem(problem, problem.task.pack(model.nominal_state)), PlanLimits())
        times.append(time.process_time() - begin)
    if not isinstance(answer, Solved):
        return None
    peak_mib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss >> 10
    return {"search_s": min(times), "expanded": answer.expanded, "length": len(answer.plan), "peak_mib": peak_mib}


def _plan_command(file: Path, planner: str) -> float:
    """Return the CPU of `scbm plan`, in seconds."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, "-m", "scbm", "plan", str(file), "--goal", GOAL, "--planner", planner, "--json"]
    subprocess.run(command, capture_output=True, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
