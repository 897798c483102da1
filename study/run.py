"""Runs the study by its protocol: `python study/run.py [--smoke] [-j PROCESSES] [--out DIRECTORY]`.

Writes the kill matrix of each model into `study/results/`, and there `report.md` with all tables, and the plots. A
model whose kill matrix is there already is not run again. So the report of the results in the repository is made again
in about a minute, without running any case. If the text that `scbm` writes for a model has changed since, the name of
the model is printed.
"""

from __future__ import annotations

import argparse
import sys
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "study")]

from effects import RESAMPLES  # noqa: E402 - found by the path above
from kill_matrix import Counts, KillMatrix, digest_of, kill_matrix, operator_weights  # noqa: E402
from matrix_files import path_of, read_matrix, write_matrix  # noqa: E402
from model_figures import ModelFigures, model_figures  # noqa: E402
from plots import write_plots  # noqa: E402
from study_report import StudyResults, report  # noqa: E402
from subjects import Subject, subjects  # noqa: E402

if TYPE_CHECKING:
    from scbm.model import BehaviorModel

SMOKE = ("nav2_recovery", "packml_machine", "espresso_machine", "generated-1", "generated-2", "generated-3", "flags-3")
"""The models of `--smoke`."""


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--smoke", action="store_true", help="a few models with small counts, in less than two minutes")
    parser.add_argument("-j", "--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, help="by default study/results; with --smoke, build/study")
    parser.add_argument("--only", nargs="*", help="names of models; by default all")
    asked = parser.parse_args()
    out = asked.out or (ROOT / "build" / "study" if asked.smoke else ROOT / "study" / "results")
    names = SMOKE if asked.smoke else tuple(subject.name for subject in subjects())
    names = tuple(name for name in names if not asked.only or name in asked.only)
    results = run(names, out, asked.processes, smoke=asked.smoke)
    print(f"{len(results.models)} models, {len(results.left)} left the study: {out / 'report.md'}")


def run(names: tuple[str, ...], out: Path, processes: int, *, smoke: bool = False) -> StudyResults:
    """Return the results for some models, and write kill matrices, the report and the plots."""
    out.mkdir(parents=True, exist_ok=True)
    counts = Counts(40, 25) if smoke else Counts()
    suites, resamples = (20, 1_000) if smoke else (100, RESAMPLES)
    with ProcessPoolExecutor(processes) as workers:
        found = list(workers.map(partial(_figures, counts=counts, suites=suites, out=out), names))
    models = tuple(each for each in found if isinstance(each, ModelFigures))
    left = tuple(each for each in found if isinstance(each, KillMatrix))
    results = StudyResults(models, left, suites, resamples)
    (out / "report.md").write_text(report(results), encoding="utf-8")
    write_plots(results.tested, resamples, out)
    return results


def _figures(name: str, counts: Counts, suites: int, out: Path) -> ModelFigures | KillMatrix:
    """Return the figures of a model, or its kill matrix if it leaves the study."""
    subject = next(subject for subject in subjects() if subject.name == name)
    model = subject.model()
    matrix = _matrix(subject, model, counts, path_of(name, out))
    if matrix.left:
        return matrix
    is_same = matrix.digest == digest_of(model)
    if not is_same:
        print(f"{name}: the text that scbm writes has changed; remove its kill matrix to run it again", flush=True)
    weights = operator_weights(model, counts.mutants, matrix)
    return model_figures(matrix, suites, subject.file_digest() if is_same else "", weights)


def _matrix(subject: Subject, model: BehaviorModel, counts: Counts, path: Path) -> KillMatrix:
    if path.exists():
        return read_matrix(path)
    matrix = kill_matrix(subject.name, subject.group, model, counts)
    write_matrix(matrix, path)
    print(f"{subject.name}: {len(matrix.mutants)} mutants, {len(matrix.cases)} cases, {matrix.cpu_s:.1f} s", flush=True)
    return matrix


if __name__ == "__main__":
    main()
