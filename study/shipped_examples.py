"""How many mutants of the example cells their cases notice: `python study/shipped_examples.py [EXAMPLE...]`.

Counts the mutants for which some of 100 random cases does something else than on the original, and how many of those
are found: by these random cases with the requirements of the model alone, with built-in requirements, and with recorded
results; and by the cases in the directory of the example. Prints the table of `docs/how-to/mutate-models.md`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(ROOT / "study")]

from kill_matrix import ORACLES, OriginalRuns, mutant_row  # noqa: E402 - found by the path above

from scbm.files import load_model, open_case  # noqa: E402 - likewise
from scbm.mutation import MutationRuns, mutants_of  # noqa: E402 - likewise
from scbm.testing import RandomCases, Tester  # noqa: E402 - likewise
from scbm.testing.written_cases import find_case_files  # noqa: E402 - likewise

EXAMPLES = {
    "robot_in_the_air/after": "the paper's example",
    "agv_line/cell": "AGV line",
    "gripper/cell": "gripper",
    "sorting_belt/cell": "sorting belt",
    "packml/cell": "PackML machine",
    "dual_cnc/cell": "cell with two CNC machines",
    "delivery/cell": "imported delivery",
}
"""The examples with cases: the path of the model under `examples`, and its name in the table."""

CASES = 100


class ExampleCounts(NamedTuple):
    """How many mutants of one example its cases notice.

    Attributes:
        mutants: all mutants.
        differing: those for which some random case has another trace than on the original.
        required: of those, how many random cases find with requirements alone.
        built_in: likewise, with built-in requirements.
        recorded: likewise, with recorded results.
        written: likewise, how many the written cases find.
    """

    mutants: int
    differing: int
    required: int
    built_in: int
    recorded: int
    written: int


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("examples", nargs="*", metavar="EXAMPLE", help=f"by default all: {', '.join(EXAMPLES)}")
    asked = parser.parse_args().examples or EXAMPLES
    print("| model | mutants | differ | requirements | with built-ins | recorded results | written cases |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    for name in asked:
        counts = example_counts(ROOT / "examples" / f"{name}.yaml")
        print(row(EXAMPLES[name], counts), flush=True)


def row(name: str, counts: ExampleCounts) -> str:
    """Return the line of the table for one example."""
    shares = (f"{found / counts.differing:.0%}".replace("%", " %") for found in counts[2:])
    return f"| {name} | {counts.mutants} | {counts.differing} | {' | '.join(shares)} |"


def example_counts(path: Path, cases: int = CASES) -> ExampleCounts:
    """Return how many mutants of the model in a file its cases notice."""
    model = load_model(path)
    tester = Tester(model)
    pool = list(RandomCases(model).first(cases, seed=1))
    written = [open_case(file).read(model) for file in find_case_files([path.parent / "cases"])]
    runs = MutationRuns(tester, [*pool, *written])
    drawn = {case.name for case in pool}
    of_pool = sum(1 << number for number, case in enumerate(runs.cases) if case.name in drawn)
    originals = OriginalRuns(runs.cases, tester)
    rows = [mutant_row(runs, mutant, originals).found for mutant in mutants_of(model)]
    differing = [found for found in rows if found[ORACLES.index("each difference")] & of_pool]
    required, built_in, recorded = (sum(bool(found[index] & of_pool) for found in differing) for index in (1, 2, 3))
    by_written = sum(bool(found[ORACLES.index("recorded")] & ~of_pool) for found in differing)
    return ExampleCounts(len(rows), len(differing), required, built_in, recorded, by_written)


if __name__ == "__main__":
    main()
