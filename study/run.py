"""Runs the study by its protocol: `python study/run.py [--smoke] [-j PROCESSES] [--out DIRECTORY]`.

Writes the kill matrix of each model as JSON into `study/results/`, and `study/results/report.md` with all tables. A
model whose matrix is there already is not run again.
"""

from __future__ import annotations

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "benchmarks"), str(ROOT / "study")]

from kill_matrix import CaseFacts, Counts, KillMatrix, MutantRow, kill_matrix  # noqa: E402 - found by the path above
from study_report import report  # noqa: E402
from subjects import subjects  # noqa: E402

SMOKE = ("nav2_recovery", "packml_machine", "espresso_machine", "generated-1", "generated-2", "generated-3", "flags-3")
"""The models of `--smoke`."""


def main() -> None:
    """Run the study."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--smoke", action="store_true", help="a few models with small counts, in less than two minutes")
    parser.add_argument("-j", "--processes", type=int, default=2)
    parser.add_argument("--out", type=Path, default=ROOT / "study" / "results")
    parser.add_argument("--only", nargs="*", help="names of models; by default all")
    asked = parser.parse_args()
    counts = Counts(40, 25) if asked.smoke else Counts()
    names = SMOKE if asked.smoke else [subject.name for subject in subjects()]
    names = [name for name in names if not asked.only or name in asked.only]
    asked.out.mkdir(parents=True, exist_ok=True)
    with ProcessPoolExecutor(asked.processes) as processes:
        jobs = {name: processes.submit(_matrix, name, counts, asked.out) for name in names}
        matrices = [job.result() for job in jobs.values()]
    (asked.out / "report.md").write_text(report(matrices, suites=20 if asked.smoke else 100), encoding="utf-8")
    print(f"{len(matrices)} models, {sum(matrix.cpu_s for matrix in matrices):.0f} s of CPU: {asked.out / 'report.md'}")


def _matrix(name: str, counts: Counts, out: Path) -> KillMatrix:
    path = out / f"{name}.json"
    if path.exists():
        return read_matrix(path)
    subject = next(subject for subject in subjects() if subject.name == name)
    matrix = kill_matrix(name, subject.group, subject.model(), counts)
    path.write_text(json.dumps(_plain(matrix.data())) + "\n", encoding="utf-8")
    print(f"{name}: {len(matrix.mutants)} mutants, {len(matrix.cases)} cases, {matrix.cpu_s:.1f} s", flush=True)
    return matrix


def _plain(value: Any) -> Any:  # noqa: ANN401 - JSON
    """Return data with large whole numbers, which are sets, as hexadecimal texts."""
    if isinstance(value, dict):
        return {key: _plain(part) for key, part in value.items() if key != "edges"} | (
            {"edges": hex(value["edges"])} if "edges" in value else {}
        )
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return hex(value) if isinstance(value, int) and value.bit_length() > _WORD else value


_WORD = 53
"""Bits of whole numbers that each reader of JSON keeps."""


def read_matrix(path: Path) -> KillMatrix:
    """Return the kill matrix that an earlier run wrote."""
    data = json.loads(path.read_text(encoding="utf-8"))
    data["obligations"] = tuple(data["obligations"])
    for key in ("cases", "closed"):
        data[key] = tuple(CaseFacts(**{name: _number(part) for name, part in each.items()}) for each in data[key])
    data["mutants"] = tuple(
        MutantRow(each["name"], each["operator"], tuple(_number(found) for found in each["found"]))
        for each in data["mutants"]
    )
    return KillMatrix(**data)


def _number(value: int | str) -> int:
    return value if isinstance(value, int) else int(value, 16)


if __name__ == "__main__":
    main()
