"""The page of all modules has the first sentence of each docstring; the architecture page names existing modules."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "scbm"
ARCHITECTURE = ROOT / "docs" / "explanation" / "architecture.md"
PAGE = ROOT / "docs" / "explanation" / "modules.md"
BEGIN, END = "<!-- module table -->\n", "<!-- end of module table -->\n"
BEGINNING = re.compile(r'"""[^"\\]*"""\n')
"""A docstring that a module begins with."""

PATHS = sorted(set(re.findall(r"`([a-z_]+/[a-z_/]*(?:\.py)?)`", ARCHITECTURE.read_text(encoding="utf-8"))))


def summary(path: Path) -> str:
    """Return the first sentence of the docstring of a module, as text for a cell of a table."""
    text = path.read_text(encoding="utf-8")
    docstring = BEGINNING.match(text)  # parsing all of the module takes far longer
    paragraph = (ast.get_docstring(ast.parse(text if docstring is None else docstring[0])) or "").partition("\n\n")[0]
    sentence = re.split(r"(?<=[.?!])\s+(?=[A-Z`])", " ".join(paragraph.split()), maxsplit=1)[0]
    return sentence.removesuffix(".").replace("|", "\\|").replace("<", "\\<")


def packages() -> list[Path]:
    """Return the packages of the project as directories, each followed by those inside it."""
    found = sorted(path.parent.relative_to(SOURCE) for path in SOURCE.rglob("__init__.py"))
    return [SOURCE / path for path in found if path.parts]


def module_table() -> str:
    """Return the table: for each package its summary, and a row for each of its modules."""
    lines = []
    for package in packages():
        name = package.relative_to(SOURCE).as_posix()
        lines += [f"## `{name}`", "", f"{summary(package / '__init__.py')}.", ""]
        modules = [path for path in sorted(package.glob("*.py")) if path.name != "__init__.py"]
        if modules:
            rows = [f"| `{path.stem}` | {summary(path)} |" for path in modules]
            lines += ["| module | contents |", "| --- | --- |", *rows, ""]
    return "\n".join(["", *lines])


def test_the_table_on_the_page_is_that_of_the_source(request: pytest.FixtureRequest) -> None:
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(BEGIN)
    table, _, after = rest.partition(END)
    if request.config.getoption("--update-golden"):
        PAGE.write_text(f"{before}{BEGIN}{module_table()}{END}{after}", encoding="utf-8")
    else:
        assert table == module_table()


@pytest.mark.parametrize("path", sorted(SOURCE.rglob("*.py")), ids=lambda path: path.relative_to(SOURCE).as_posix())
def test_every_module_has_a_summary(path: Path) -> None:
    assert summary(path)


@pytest.mark.parametrize("name", PATHS)
def test_every_path_that_the_architecture_names_exists(name: str) -> None:
    assert (SOURCE / name).exists()


def test_the_architecture_names_each_module_that_follows_plans() -> None:
    (row,) = (line for line in ARCHITECTURE.read_text(encoding="utf-8").splitlines() if "(`next_in_plan`)" in line)
    calls = [path for path in sorted(SOURCE.rglob("*.py")) if "next_in_plan(" in path.read_text(encoding="utf-8")]
    assert sorted(re.findall(r"`([a-z_/]+\.py)`", row)) == [path.relative_to(SOURCE).as_posix() for path in calls]
