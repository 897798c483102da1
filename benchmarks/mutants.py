"""Changes the code at places that are drawn, and looks whether the unit tests notice.

`mutants.py [--mutants N] [--from M] [--seed S]`: each mutant is a copy of the sources with one change in `running`,
`proofcheck` or `cases/coverage`: a comparison, `and` and `or`, a `not`, a condition, a number, or a statement. The unit
tests of its package run on the copy. The output names each mutant that they let live, for a person to judge: some
change nothing. `--from M` begins at mutant M, counted from 0, and so continues an earlier run of the same sources.

Left out are changes that no test can see: flags of `@dataclass` and of classes, blocks for `TYPE_CHECKING`,
`strict=` of `zip`, and `assert_never`, which type checkers judge.
"""

from __future__ import annotations

import argparse
import ast
import os
import random
import shutil
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

ROOT = Path(__file__).parents[1]
PACKAGES = {
    "running": ("tests/unit/running",),
    "proofcheck": ("tests/unit/proofcheck",),
    "cases/coverage": ("tests/unit/cases/coverage",),
}
"""The packages that are changed, each with its unit tests."""

ENDLESS_S = 120.0
"""A mutant whose tests take so long is counted as killed: it runs without end."""

_COMPARISONS: dict[type[ast.cmpop], str] = {
    ast.Eq: "!=",
    ast.NotEq: "==",
    ast.Lt: "<=",
    ast.LtE: "<",
    ast.Gt: ">=",
    ast.GtE: ">",
    ast.Is: "is not",
    ast.IsNot: "is",
    ast.In: "not in",
    ast.NotIn: "in",
}


@dataclass(frozen=True, slots=True)
class Mutant:
    """One change of a file.

    Attributes:
        package: a key of `PACKAGES`.
        path: the file below `src/scbm`.
        line: where the change is.
        begin, end: the bytes that are replaced.
        text: what replaces them.
    """

    package: str
    path: Path
    line: int
    begin: int
    end: int
    text: str

    def applied(self, source: bytes) -> bytes:
        """Return the source with the change."""
        return source[: self.begin] + self.text.encode() + source[self.end :]

    def words(self, source: bytes) -> str:
        """Return the place and the change on one line."""
        before = " ".join(source[self.begin : self.end].decode().split())
        return f"{self.path}:{self.line}: {before} -> {' '.join(self.text.split())}"


def mutants_of(package: str, path: Path) -> Iterator[Mutant]:
    """Yield all mutants of a file."""
    source = (ROOT / "src" / "scbm" / path).read_text(encoding="utf-8")
    starts = [0]
    for line in source.encode().splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    for node in visible(ast.parse(source)):
        for part, text in changes(node, source):
            if part.end_lineno is not None and part.end_col_offset is not None:
                begin = starts[part.lineno - 1] + part.col_offset
                end = starts[part.end_lineno - 1] + part.end_col_offset
                yield Mutant(package, path, part.lineno, begin, end, text)


def visible(node: ast.AST) -> Iterator[ast.AST]:
    """Yield a node and all nodes below it whose changes a test could see."""
    yield node
    for child in ast.iter_child_nodes(node):
        if not (
            _calls(child, "dataclass")
            or (isinstance(child, ast.Expr) and _calls(child.value, "assert_never"))
            or (isinstance(child, ast.If) and _names(child.test, "TYPE_CHECKING"))
            or (isinstance(child, ast.keyword) and isinstance(node, ast.ClassDef))
            or (isinstance(child, ast.keyword) and child.arg == "strict" and _calls(node, "zip"))
        ):
            yield from visible(child)


def _calls(node: ast.AST, name: str) -> bool:
    """Return whether a node is a call of a function with this name."""
    return isinstance(node, ast.Call) and _names(node.func, name)


def _names(node: ast.AST, name: str) -> bool:
    """Return whether a node is this plain name."""
    return isinstance(node, ast.Name) and node.id == name


def changes(node: ast.AST, source: str) -> Iterator[tuple[ast.expr | ast.stmt, str]]:
    """Yield the parts of a node that can be replaced, each with its replacement."""

    def text(part: ast.AST) -> str:
        return ast.get_source_segment(source, part) or "None"

    match node:
        case ast.Compare(left=left, ops=[operator], comparators=[right]) if type(operator) in _COMPARISONS:
            yield node, f"({text(left)} {_COMPARISONS[type(operator)]} {text(right)})"
        case ast.BoolOp(op=operator, values=values):
            word = " or " if isinstance(operator, ast.And) else " and "
            yield node, f"({word.join(f'({text(value)})' for value in values)})"
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            yield node, f"bool({text(operand)})"
        case ast.If(test=test) | ast.While(test=test) | ast.IfExp(test=test):
            yield test, f"(not ({text(test)}))"
        case ast.Constant(value=int(number)) if not isinstance(number, bool):
            yield node, f"({number} + 1)"
        case ast.Constant(value=bool(truth)):
            yield node, str(not truth)
        case ast.Expr(value=ast.Call()) | ast.Assign(targets=[ast.Attribute()]) | ast.AugAssign():
            yield node, "pass"
        case _:
            pass


def all_mutants() -> list[Mutant]:
    """Return all mutants of all packages, in the order of their files."""
    found: list[Mutant] = []
    for package in PACKAGES:
        for path in sorted((ROOT / "src" / "scbm" / package).rglob("*.py")):
            found += mutants_of(package, path.relative_to(ROOT / "src" / "scbm"))
    return found


def lives(mutant: Mutant, copy: Path) -> bool:
    """Return whether the unit tests of its package pass with a mutant."""
    file = copy / "scbm" / mutant.path
    source = file.read_bytes()
    file.write_bytes(mutant.applied(source))
    command = [
        sys.executable,
        "-B",
        "-m",
        "pytest",
        "-q",
        "-x",
        "-n",
        "0",
        "-p",
        "no:cacheprovider",
        *PACKAGES[mutant.package],
    ]
    environment = {**os.environ, "PYTHONPATH": str(copy), "PYTHONDONTWRITEBYTECODE": "1"}
    try:
        ran = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, check=False, timeout=ENDLESS_S)
    except subprocess.TimeoutExpired:
        return False
    finally:
        file.write_bytes(source)
    return ran.returncode == 0


def main() -> int:
    """Try the mutants, print those that live, and return 1 if there are any."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--mutants", type=int, default=300)
    parser.add_argument("--from", type=int, default=0, dest="first", metavar="M")
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    known = all_mutants()
    random_numbers = random.Random(asked.seed)  # noqa: S311 - no cryptography
    drawn = random_numbers.sample(known, min(asked.mutants, len(known)))[asked.first :]
    survivors = 0
    with tempfile.TemporaryDirectory() as directory:
        copy = Path(directory)
        shutil.copytree(ROOT / "src" / "scbm", copy / "scbm", ignore=shutil.ignore_patterns("__pycache__"))
        for mutant in drawn:
            if lives(mutant, copy):
                survivors += 1
                print(mutant.words((copy / "scbm" / mutant.path).read_bytes()), flush=True)
    print(f"{survivors} of {len(drawn)} mutants live; there are {len(known)}")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
