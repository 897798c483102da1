"""The documentation lists the forms of requirements as they are; `--update-golden` writes the tables anew."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from scbm.model import FORMS
from scbm.model.requirements import spellings
from scbm.testing.built_in_requirements import BUILT_INS

DOCS = Path(__file__).parents[2] / "docs"
TABLE = re.compile(r"(?<=\| form \| violated \|\n\| --- \| --- \|\n)(\|.*\n)*")
ROW = re.compile(r"^\| requirement \| .* \| (?=\[semantics\])", re.MULTILINE)


def as_form_table(text: str) -> str:
    """Return a page with the table that says when each form is violated."""
    rows = (
        f"| `{spelling}` | {violated} |\n"
        for form in FORMS.values()
        for spelling, violated in zip(spellings(form.pattern), form.violated, strict=True)
    )
    return TABLE.sub("".join(rows).replace("\\", r"\\"), text)


def as_text_row(text: str) -> str:
    """Return a page with the row that lists all ways to write a requirement."""
    listed = ", ".join(f"`{spelling}`" for form in FORMS.values() for spelling in spellings(form.pattern))
    return ROW.sub(f"| requirement | {listed} | ", text)


@pytest.mark.parametrize(
    ("page", "generated"),
    [("reference/semantics.md", as_form_table), ("reference/formats.md", as_text_row)],
    ids=["semantics", "formats"],
)
def test_the_tables_list_all_forms(page: str, generated: Callable[[str], str], request: pytest.FixtureRequest) -> None:
    path = DOCS / page
    text = path.read_text(encoding="utf-8")
    if request.config.getoption("--update-golden"):
        path.write_text(generated(text), encoding="utf-8")
    text = path.read_text(encoding="utf-8")
    assert generated(text) == text
    assert all(f"`{spelling}`" in text for form in FORMS.values() for spelling in spellings(form.pattern))


def test_each_form_has_a_section() -> None:
    page = (DOCS / "how-to/write-requirements.md").read_text(encoding="utf-8")
    chapter = page.partition("\n## Choose a form\n")[2].partition("\n## ")[0]
    headings = [", ".join(f"`{spelling}`" for spelling in spellings(form.pattern)) for form in FORMS.values()]
    assert re.findall(r"^### (.*)$", chapter, re.MULTILINE) == headings


def test_the_table_lists_the_built_in_requirements() -> None:
    page = (DOCS / "reference/semantics.md").read_text(encoding="utf-8")
    rows = re.findall(r"\| name \| violated if \|\n\| --- \| --- \|\n((?:\|.*\n)*)", page)
    assert rows == ["".join(f"| `{name}` | {each.violated} |\n" for name, each in BUILT_INS.items())]
