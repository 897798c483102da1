"""The tables of keys in the documentation are those of the declarations; `--update-golden` writes them anew."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from scbm.files.codec.binding_keys import BindingsKeys
from scbm.files.codec.case_keys import CaseKeys
from scbm.files.codec.lifted.part_keys import PartKeys
from scbm.files.codec.model_keys import ModelKeys
from scbm.files.codec.waiver_keys import WaiversKeys
from scbm.files.key_reference import key_table, mappings_of

DOCS = Path(__file__).parent.parent.parent / "docs"
PAGES = [path for path in sorted(DOCS.glob("**/*.md")) if "<!-- keys: " in path.read_text(encoding="utf-8")]
TABLE = re.compile(r"<!-- keys: (\w+) -->\n(.*?)<!-- end of keys -->", re.DOTALL)
MAPPINGS = {
    keys.title(): keys
    for root in (ModelKeys, PartKeys, CaseKeys, BindingsKeys, WaiversKeys)
    for keys in mappings_of(root)
}


def with_tables(text: str) -> str:
    return TABLE.sub(
        lambda match: f"<!-- keys: {match[1]} -->\n\n{key_table(MAPPINGS[match[1]])}\n<!-- end of keys -->", text
    )


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_the_tables_of_a_page_are_those_of_the_declarations(page: Path, request: pytest.FixtureRequest) -> None:
    text = page.read_text(encoding="utf-8")
    if request.config.getoption("--update-golden"):
        page.write_text(with_tables(text), encoding="utf-8")
    assert page.read_text(encoding="utf-8") == with_tables(text)


def test_every_mapping_of_a_file_has_one_table() -> None:
    found = [match[1] for page in PAGES for match in TABLE.finditer(page.read_text(encoding="utf-8"))]
    assert sorted(found) == sorted(MAPPINGS)
