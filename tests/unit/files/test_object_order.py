"""The order of ground entries is that of the objects, whatever conditions choose them, and in each process."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from scbm.files import read_model

ROOT = Path(__file__).parents[3]

HEAD = """behavior_model: ordered
types: {zone: [a, b, c, d, e, f]}
tables:
  quiet: {of: [zone], rows: [[e], [c], [b], [a]]}
  way: {of: [zone, zone], rows: [[f, e], [f, b], [d, e], [f, a], [d, c], [d, a]]}
variables:
  at: {domain: zone, initial: f}
operations:
"""


def choices_of(parameters: str, where: str, guard: str) -> list[str]:
    entry = f"  go[{parameters}]: {{where: '{where}', pre: {{g: '{guard}'}}, post: {{g: true, a: [at <- y]}}}}\n"
    return [operation.name.removeprefix("go.") for operation in read_model(HEAD + entry).operations]


ONE = {
    "quiet(y)": "a b c e",
    "quiet(y) || y == d": "a b c d e",
    "y == e || quiet(y) || y == a": "a b c e",
    "y in {e, b, a}": "a b e",
    "y == e || y == b": "b e",
    "(y == e || y in {d, a})": "a d e",
    "!(y in {e, b, a})": "c d f",
    "!quiet(y) || y == b": "b d f",
    "way(f, y)": "a b e",
    "way(f, y) || way(d, y)": "a b c e",
}


@pytest.mark.parametrize("condition", ONE)
@pytest.mark.parametrize("stands_in", ["where", "guard"])
def test_choices_of_one_parameter_are_in_the_order_of_its_objects(condition: str, stands_in: str) -> None:
    where, guard = (condition, "true") if stands_in == "where" else ("true", condition)
    assert choices_of("y in zone", where, guard) == ONE[condition].split()


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ("quiet(y) && y in {e, b, a} && x in {f, d}", "d.a d.b d.e f.a f.b f.e"),
        ("quiet(y) && quiet(x) && x in {e, b} && y != c", "b.a b.b b.e e.a e.b e.e"),
        ("way(x, y)", "d.a d.c d.e f.a f.b f.e"),
        ("way(y, x)", "a.d a.f b.f c.d e.d e.f"),
        ("way(x, y) || x == a && y in {c, b}", "a.b a.c d.a d.c d.e f.a f.b f.e"),
    ],
)
def test_choices_of_two_parameters_are_ordered_with_the_last_one_fastest(condition: str, expected: str) -> None:
    assert choices_of("x in zone, y in zone", condition, "true") == expected.split()


def test_parameters_are_joined_along_tables_with_several_columns() -> None:
    """Each of three steps in one direction has few rows; all choices of objects would be 90 million."""
    names = [f"z{x}_{y}" for x in range(17) for y in range(17)]
    east = [(f"z{x}_{y}", f"z{x + 1}_{y}", "east") for x in range(16) for y in range(17)]
    south = [(f"z{x}_{y}", f"z{x}_{y + 1}", "south") for x in range(17) for y in range(16)]
    rows = ", ".join(f"[{', '.join(row)}]" for row in (*east, *south))
    text = f"""behavior_model: grid
types: {{zone: [{", ".join(names)}], way: [east, south]}}
tables: {{next: {{of: [zone, zone, way], rows: [{rows}]}}}}
variables: {{at: {{domain: zone, initial: z0_0}}}}
operations:
  jump[a in zone, b in zone, c in zone, w in way, d in zone, v in way]:
    where: "next(a, b, w) && next(b, c, w) && next(c, d, v) && v != w"
    pre: {{g: at == a}}
    post: {{g: true, a: [at <- d]}}
"""
    assert len(read_model(text).operations) == 2 * 15 * 16


@pytest.mark.slow
def test_a_model_is_the_same_under_every_hash_seed() -> None:
    entries = [
        f"  go{number}[x in zone, y in zone]: {{where: '{where}', pre: {{g: true}}, post: {{g: true, a: [at <- y]}}}}\n"
        for number, where in enumerate((*ONE, "quiet(y) && quiet(x)", "way(x, y)"))
    ]
    script = (
        "import sys\n"
        "from scbm.files import digest_of, read_model\n"
        "model = read_model(sys.stdin.read())\n"
        "print(digest_of(model), [operation.name for operation in model.operations])\n"
    )
    outputs = {
        subprocess.run(
            [sys.executable, "-c", script],
            input="".join((HEAD, *entries)).encode(),
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(ROOT / "src")},
            capture_output=True,
            check=True,
        ).stdout
        for seed in ("1", "2", "3")
    }
    assert len(outputs) == 1
