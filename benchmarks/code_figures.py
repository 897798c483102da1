"""Figures of the source: lines of code, modules, packages, and circles of files. `--source FOLDER` takes another one.

Lines of code are those of statements, without blank lines, comments, docstrings and imports. A circle is a group of
files that import each other, directly or by way of others of the group; imports for type checks and imports inside
functions count, too. A file of a package imports the `__init__.py` only if it imports a name from there.
"""

from __future__ import annotations

import argparse
import ast
import io
import tokenize
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

SOURCE = Path(__file__).parents[1] / "src" / "scbm"
BESIDE_THE_CORE = ("drawing", "mutation", "nodes", "pddl", "web")
"""Folders whose modules are no part of the core."""

_NO_CODE = (
    tokenize.COMMENT,
    tokenize.NL,
    tokenize.NEWLINE,
    tokenize.INDENT,
    tokenize.DEDENT,
    tokenize.ENCODING,
    tokenize.ENDMARKER,
)


def read_texts(source: Path) -> dict[str, str]:
    """Return the text of each module below a package, by its path from there."""
    return {path.relative_to(source).as_posix(): path.read_text("utf-8") for path in sorted(source.rglob("*.py"))}


def lines_of_code(text: str) -> int:
    """Return the number of lines of a module that have code other than docstrings and imports."""
    left_out: dict[int, None] = {}
    for node in ast.walk(ast.parse(text)):
        is_text = (
            isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)
        )
        if isinstance(node, ast.stmt) and (is_text or isinstance(node, ast.Import | ast.ImportFrom)):
            left_out |= dict.fromkeys(range(node.lineno, (node.end_lineno or node.lineno) + 1))
    found: dict[int, None] = {}
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        if token.type not in _NO_CODE:
            found |= dict.fromkeys(range(token.start[0], token.end[0] + 1))
    return sum(line not in left_out for line in found)


def imported_files(path: str, text: str, files: Mapping[str, object], package: str) -> list[str]:
    """Return the files that a module imports, each once.

    Args:
        path: the path of the module from the package.
        text: its text.
        files: the paths of all modules.
        package: the name of the package, with a dot behind it.
    """
    found: dict[str, None] = {}
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom) and not node.level:
            names = [f"{node.module}.{alias.name}" for alias in node.names]
        else:
            continue
        inside = (name.removeprefix(package).split(".") for name in names if name.startswith(package))
        found |= {file: None for parts in inside if (file := _file_of(parts, files)) is not None}
    return [file for file in found if file != path]


def _file_of(parts: Sequence[str], files: Mapping[str, object]) -> str | None:
    """Return the file that a name with dots stands for: a module, or the one that has the name."""
    for length in range(len(parts), 0, -1):
        stem = "/".join(parts[:length])
        for file in (f"{stem}.py", f"{stem}/__init__.py"):
            if file in files:
                return file
    return None


def circles_of_files(texts: Mapping[str, str], package: str = "scbm.") -> list[list[str]]:
    """Return the groups of files that import each other, the largest first, each with its files in order."""
    graph = {path: imported_files(path, text, texts, package) for path, text in texts.items()}
    reached = {path: _reached(path, graph) for path in graph}
    circles: dict[str, list[str]] = {}
    for path in sorted(graph):
        circle = [other for other in sorted(reached[path]) if path in reached[other]]
        if circle:
            circles.setdefault(circle[0], circle)
    return sorted(circles.values(), key=lambda circle: (-len(circle), circle))


def _reached(path: str, graph: Mapping[str, Sequence[str]]) -> dict[str, None]:
    """Return the files that a file imports, directly or by way of others."""
    found: dict[str, None] = {}
    todo = [path]
    while todo:
        for other in graph[todo.pop()]:
            if other not in found:
                found[other] = None
                todo.append(other)
    return found


def figures(texts: Mapping[str, str]) -> Iterator[str]:
    """Yield the figures, one a line."""
    lines = {path: lines_of_code(text) for path, text in texts.items()}
    core = [path for path in texts if not set(PurePosixPath(path).parts) & set(BESIDE_THE_CORE)]
    packages = [PurePosixPath(path).parent for path in texts if PurePosixPath(path).name == "__init__.py"]
    circles = circles_of_files(texts)
    yield f"{sum(lines.values()):,} lines of code"
    yield f"{sum(lines[path] for path in core):,} of them in the core, without {', '.join(BESIDE_THE_CORE)}"
    yield f"{len(texts):,} modules"
    yield f"{sum(len(each.parts) == 1 for each in packages):,} packages, {len(packages) - 1:,} with those inside others"
    yield f"{len(circles):,} circles of files"
    for circle in circles:
        yield f"  {len(circle)}: {', '.join(circle)}"


def main() -> None:
    """Print the figures."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--source", type=Path, default=SOURCE, help="the folder of the package")
    for line in figures(read_texts(parser.parse_args().source)):
        print(line)


if __name__ == "__main__":
    main()
