"""Closing random models, beside all their runs; and the examples, as whole processes.

Of each model: how long closing took (seconds of one core), what was decided, proofs that a run refutes, cases that fail
when they are run again. With `--enumerate`, all runs are enumerated by driving the real runner, which takes minutes.
With `--check`, certificates are checked. With `--open`, the environment acts, resources are shared, goals follow each
other, and plans are any: then each proof is compared with as many runs as are enumerated within limits.

With `--published` (and names, if not all): published problems, each beside 1,000 random cases under the same planner in
the same run. `--planner` names it; by default large models are closed under `canonical` and under `greedy`. All times
are CPU.

With `--figures` (and names, if not all): problems, cells and examples, each closed in its own process. Its CPU time
is also given as it would be on a machine where an empty Python takes 10 ms; under load, all processes take longer.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from msgspec.structs import replace
from published import PROBLEMS

from scbm.closing import CloseLimits, Closer, Decision
from scbm.files import load_model
from scbm.model import PlannerChoice, PlanSet
from scbm.proofcheck import RunsArgument
from scbm.testing import RandomCases, Tester

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.closing import Closing
    from scbm.model import BehaviorModel

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT / "tests"))

from property.test_closing import (  # noqa: E402 - they live with the tests
    failing_replays,
    flaws,
    impossible_cases,
    incomplete,
    overlooked,
    wrong_exclusions,
    wrong_proofs,
)
from support.enumeration import enumerate_runs  # noqa: E402
from support.opened_models import opened  # noqa: E402
from support.random_models import random_model, small_random_model  # noqa: E402

LARGE = ("blocks-8-0", "logistics-8-0", "rovers-05", "factory-157", "independent-10x10")
"""Models whose runs or plans are too many to explore them all; some of them are decided nevertheless."""

SMALL = ("agv-5x5", "gripper-6", "blocks-6-0")
"""Models that are fully decided under the planner `canonical`."""

RANDOM_CASES = 1_000
IN_TIME_S = 10
MAX_REPORTED = 5


@dataclass(frozen=True)
class Result:
    """What closing one model came to.

    Attributes:
        seconds: how long it took.
        situations: how many there are, if that is known.
        counts: how many obligations of the figure ended in each decision.
        wrong: proofs that a run refutes; `None` if runs were not enumerated.
        complete: whether all runs were enumerated.
        complaints: whatever else is wrong.
    """

    number: int
    seconds: float
    situations: int
    counts: Counter[Decision]
    wrong: list[str] | None
    complete: bool
    complaints: list[str]

    @property
    def obligations(self) -> int:
        """How many obligations the figure has."""
        return self.counts.total()

    @property
    def decided_in_time(self) -> int:
        """How many of them are decided, if that did not take too long."""
        return self.obligations - self.counts[Decision.UNDECIDED] if self.seconds <= IN_TIME_S else 0

    def __str__(self) -> str:
        decisions = " ".join(f"{self.counts[decision]:>4}" for decision in Decision)
        enumerated = "" if self.wrong is None else "  all runs" if self.complete else "  some runs"
        wrong = "?" if self.wrong is None else len(self.wrong)
        line = f"{self.number:>5} {self.seconds:>7.2f} s {self.situations:>8} {decisions} {wrong:>6} wrong{enumerated}"
        return "\n".join((line, *(f"      {text}" for text in (*(self.wrong or ()), *self.complaints)[:MAX_REPORTED])))


MAX_OF_SEQUENCES = 3_000
"""Maximum number of situations of sequences of goals that are enumerated."""


def close(number: int, *, enumerates: bool, checks: bool) -> Result:
    """Closes one of the random models, and looks at what came of it."""
    model = random_model(number)
    begin = time.process_time()
    closing = Closer(model).close()
    seconds = time.process_time() - begin
    complaints = [*incomplete(closing), *failing_replays(closing), *(flaws(closing) if checks else ())]
    counts = Counter(decided.decision for decided in closing.decided if decided.obligation.counts)
    if not enumerates:
        return Result(number, seconds, certified(closing), counts, None, False, complaints)
    enumeration = enumerate_runs(model)
    if enumeration.complete:
        sequences = enumerate_runs(model, MAX_OF_SEQUENCES, is_open=True, is_sequence=True)
        complaints += impossible_cases(closing, enumeration, sequences)
    complaints += [f"{name} is undecided, and a simulated run visits it" for name in overlooked(closing)]
    wrong = wrong_proofs(closing, enumeration)
    return Result(number, seconds, enumeration.situations, counts, wrong, enumeration.complete, complaints)


OPEN_LIMITS = CloseLimits(situations=15_000, planning=20_000, candidates=20, beyond=2_000, random=100, changes=100)
"""Of many models few are large; what is beyond these limits is undecided."""

MAX_OF_OPEN_RUNS = 2_000
"""Maximum number of situations of runs in an open world that are enumerated, for each set of runs."""


def close_open(number: int) -> Result:
    """Closes a random model in an open world, and looks whether a run refutes a proof, or a case fails."""
    model = opened(small_random_model(number), number)
    begin = time.process_time()
    closing = Closer(model, OPEN_LIMITS).close()
    seconds = time.process_time() - begin
    complaints = [*failing_replays(closing), *flaws(closing)]
    counts = Counter(decided.decision for decided in closing.decided if decided.obligation.counts)
    single = enumerate_runs(model, MAX_OF_OPEN_RUNS, is_open=True)
    sequences = enumerate_runs(model, MAX_OF_OPEN_RUNS, is_open=True, is_sequence=True)
    any_plans = enumerate_runs(model, MAX_OF_OPEN_RUNS, is_open=True, is_sequence=True, plans=PlanSet.ANY)
    wrong = [text for runs in (single, sequences, any_plans) for text in wrong_proofs(closing, runs)]
    wrong += [text for runs in (single, sequences) for text in wrong_exclusions(closing, runs)]
    complete = single.complete and sequences.complete and any_plans.complete
    return Result(number, seconds, certified(closing), counts, wrong, complete, complaints)


def certified(closing: Closing) -> int:
    """The situations in the certificate of runs, if there is one."""
    arguments = [c.argument for _, c in closing.certificates if isinstance(c.argument, RunsArgument)]
    return sum(len(runs.situations) for argument in arguments for runs in argument.runs)


def summary(results: Sequence[Result]) -> str:
    """The figures of all models together."""
    obligations = sum(result.obligations for result in results)
    in_time = sum(result.decided_in_time for result in results)
    undecided = sum(result.counts[Decision.UNDECIDED] for result in results)
    slowest = max(results, key=lambda result: result.seconds)
    wrong = sum(len(result.wrong or ()) for result in results)
    known = sum(result.wrong is not None for result in results)
    return "\n".join(
        (
            f"{in_time / obligations:.2%} of {obligations} obligations decided within {IN_TIME_S} s each model",
            f"{undecided} undecided, {sum(result.seconds > IN_TIME_S for result in results)} models took longer",
            f"{wrong} wrong proofs in {known} models whose runs were enumerated",
            f"{sum(len(result.complaints) for result in results)} other complaints (replays, cases, certificates)",
            f"slowest: model {slowest.number}, {slowest.seconds:.2f} s; all: {sum(r.seconds for r in results):.0f} s",
        )
    )


def example(name: str) -> str:
    """What `scbm close` makes of an example, as a process."""
    path = f"examples/robot_in_the_air/{name}.yaml"
    begin = time.perf_counter()
    arguments = [sys.executable, "-m", "scbm", "close", path, "--json"]
    ran = subprocess.run(arguments, cwd=ROOT, check=False, capture_output=True, text=True)
    seconds = time.perf_counter() - begin
    result = json.loads(ran.stdout)
    figures = ", ".join(f"{result['decisions'][decision.value]} {decision.value}" for decision in Decision)
    return f"{name}.yaml: {figures}, {len(result['cases'])} cases, {seconds:.2f} s, exit code {ran.returncode}"


def published(name: str, planner: str) -> str:
    """What closing a published problem comes to, beside random cases under the same planner."""
    model = replace(PROBLEMS[name](), planner=PlannerChoice(planner))
    tester = Tester(model)
    begin = time.process_time()
    drawn = 0
    for case in RandomCases(model).first(RANDOM_CASES, 0):
        drawn |= tester.execute(case).visited
    random_s, begin = time.process_time() - begin, time.process_time()
    closing = Closer(model).close()
    seconds = time.process_time() - begin
    counts = Counter(decided.decision for decided in closing.decided if decided.obligation.counts)
    by_cases = sum(
        obligation.counts for obligation in closing.after.obligations if drawn & tester.obligations.bit(obligation)
    )
    missed = (drawn & ~closing.after.visited).bit_count()
    decisions = " ".join(f"{counts[decision]:>11}" for decision in Decision)
    return (
        f"{name:<18} {planner:<10} {decisions} {len(closing.cases):>6} {seconds:>8.1f} s "
        f"{by_cases:>8} {random_s:>8.1f} s {missed:>7}"
    )


FIGURES = (
    "agv-pallets-4",
    "agv-pallets-5",
    "elevators-3x2",
    "elevators-4x4",
    "gripper-14",
    "factory-157",
    "factory-246",
    "independent-10x10",
    "blocks-8-0",
    "weld_cell",
    "kitting_cell",
    "dual_cnc",
)
"""What `--figures` closes: published problems, cells of this folder, and an example."""

_EMPTY_S = 0.010
"""The CPU time of an empty Python to which times are scaled."""

_EMPTY_RUNS = 20


def figure_model(name: str) -> BehaviorModel:
    """The published problem, the cell or the example of a name."""
    if name in PROBLEMS:
        return PROBLEMS[name]()
    cell = ROOT / "benchmarks" / "published" / f"{name}.yaml"
    return load_model(cell if cell.exists() else ROOT / "examples" / name / "cell.yaml")


def close_figure(name: str) -> None:
    """Close one model, and print what that took and came to, as JSON."""
    model = figure_model(name)
    begin = time.process_time()
    closing = Closer(model).close()
    data = {
        "seconds": time.process_time() - begin,
        "mib": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        "counts": closing.counts,
        "engines": closing.engines,
        "ended": [f"{end.stage}: {end.why}" for end in closing.ended],
    }
    print(json.dumps(data))


def empty_python_s() -> float:
    """The CPU time of an empty Python, the mean of some."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    for _ in range(_EMPTY_RUNS):
        subprocess.run([sys.executable, "-I", "-S", "-c", ""], check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime) / _EMPTY_RUNS


def compare_figures(names: Sequence[str]) -> None:
    """Prints a line for each model."""
    print(f"{'model':<18} {'CPU s':>7} {'scaled':>7} {'MiB':>6}  {', '.join(Decision)}; proofs")
    for name in names or FIGURES:
        scale = _EMPTY_S / empty_python_s()
        command = [sys.executable, __file__, "--figure", name]
        ran = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        counts = " ".join(f"{ran['counts'][decision]:>4}" for decision in Decision)
        proofs = " ".join(f"{count} {engine}" for engine, count in ran["engines"].items())
        print(f"{name:<18} {ran['seconds']:>7.1f} {ran['seconds'] * scale:>7.1f} {ran['mib']:>6.0f} {counts}; {proofs}")
        for ended in ran["ended"]:
            print(f"    {ended}", flush=True)


def compare_published(names: Sequence[str], planner: str | None) -> None:
    """Prints a line for each published problem and planner."""
    print(
        f"{'model':<18} {'planner':<10} {' '.join(f'{each:>11}' for each in Decision)} {'cases':>6} {'CPU':>10} "
        f"{'random':>8} {'CPU':>10} {'missed':>7}"
    )
    for name in names or (*SMALL, *LARGE):
        both = ("canonical",) if name in SMALL else ("canonical", "greedy")
        for chosen in both if planner is None else (planner,):
            print(published(name, chosen), flush=True)


def main() -> None:
    """Prints a line for each model, and what they come to."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--models", type=int, default=200)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--enumerate", action="store_true")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--open", action="store_true", help="with environment, sequences of goals and any plans")
    parser.add_argument("--published", nargs="*", metavar="NAME", help=f"of {', '.join((*SMALL, *LARGE))}")
    parser.add_argument("--figures", nargs="*", metavar="NAME", help=f"of {', '.join(FIGURES)}, or a published problem")
    parser.add_argument("--figure", metavar="NAME", help="one of them, in this process, as JSON")
    parser.add_argument("--planner", help="the planner of published problems")
    asked = parser.parse_args()
    if asked.figure is not None:
        close_figure(asked.figure)
        return
    if asked.figures is not None:
        compare_figures(asked.figures)
        return
    if asked.published is not None:
        compare_published(asked.published, asked.planner)
        return
    print(f"model   seconds  situations  {', '.join(Decision)}")
    results = []
    for number in range(asked.first, asked.first + asked.models):
        is_closed = not asked.open
        results.append(
            close(number, enumerates=asked.enumerate, checks=asked.check) if is_closed else close_open(number)
        )
        print(results[-1], flush=True)
    print(summary(results))
    for name in () if asked.open else ("before", "after"):
        print(example(name))


if __name__ == "__main__":
    main()
