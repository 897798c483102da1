"""Links between the pages, and to files of the repository, lead somewhere."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import pytest
from page_parts import complete_page

ROOT = Path(__file__).parents[2]
PAGES = tuple(page for page in (*sorted(ROOT.glob("*.md")), *sorted((ROOT / "docs").rglob("*.md"))) if page.is_file())
LINK = re.compile(r"\[[^]]*\]\(([^()\s]+)\)")


def without_blocks(page: Path) -> str:
    """A page with its generated parts, without blocks of code."""
    text = complete_page(page.read_text(encoding="utf-8"))
    return re.sub(r"^ *```.*?^ *```$", "", text, flags=re.MULTILINE | re.DOTALL)


def prose(page: Path) -> str:
    """A page without its code."""
    text = without_blocks(page)
    return re.sub(r"`[^`\n]*`", "`code`", text)


@cache
def anchors(page: Path) -> set[str]:
    """The anchors of the headings of a page, made as GitHub makes them."""
    text = without_blocks(page)
    headings = re.findall(r"^#+ (.+)$", text, flags=re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def leads_nowhere(page: Path, target: str) -> bool:
    path, _, anchor = target.partition("#")
    linked = (page.parent / path).resolve() if path else page
    is_there = linked.exists() and linked.is_relative_to(ROOT)
    return not is_there or bool(anchor and anchor not in anchors(linked))


@pytest.mark.parametrize("folder", sorted({page.parent for page in PAGES}), ids=lambda folder: folder.name)
def test_links_lead_somewhere(folder: Path) -> None:
    links = [(page, target) for page in PAGES if page.parent == folder for target in LINK.findall(prose(page))]
    links = [(page, target) for page, target in links if not re.match(r"[a-z]+:", target)]
    assert [f"{page}: {target}" for page, target in links if leads_nowhere(page, target)] == []


INDEXES = sorted((ROOT / "docs").rglob("index.md"))
TOCTREE = re.compile(r"^```\{toctree\}\n((?::[^\n]*\n)*)(.*?)^```", re.DOTALL | re.MULTILINE)


def toctree_pages(index: Path) -> list[str]:
    """Return the pages in the tables of contents of a page, without suffix, relative to its folder."""
    entries = [
        (":glob:" in options, entry)
        for options, text in TOCTREE.findall(index.read_text(encoding="utf-8"))
        for entry in text.split()
    ]
    pages = []
    for is_glob, entry in entries:
        found = sorted(index.parent.glob(f"{entry}.md")) if is_glob else [index.parent / f"{entry}.md"]
        pages += [page.relative_to(index.parent).with_suffix("").as_posix() for page in found]
    return pages


@pytest.mark.parametrize("index", INDEXES, ids=[index.parent.name for index in INDEXES])
def test_an_index_lists_every_page_of_its_folder(index: Path) -> None:
    """In the table of contents of the site, and as a link. `docs/index.md` also lists folders without an index."""
    bare = [path for path in index.parent.iterdir() if path.is_dir() and not (path / "index.md").exists()]
    pages = [page for folder in (index.parent, *bare) for page in sorted(folder.glob("*.md")) if page != index]
    names = [page.relative_to(index.parent).with_suffix("").as_posix() for page in pages]
    contents = toctree_pages(index)
    assert len(contents) == len(set(contents))
    assert [name for name in names if name not in contents] == []
    links = {target.partition("#")[0].removesuffix(".md") for target in LINK.findall(prose(index))}
    if ":glob:" not in index.read_text(encoding="utf-8"):  # such a page shows the headings of its pages
        assert [name for name in names if name not in links] == []


def test_anchors_are_made_as_github_makes_them(tmp_path: Path) -> None:
    page = tmp_path / "page.md"
    page.write_text("# The `scbm plan --json`\n\n```yaml\n# no heading\n```\n## 1 Values, states\n", encoding="utf-8")
    assert anchors(page) == {"the-scbm-plan---json", "1-values-states"}


NAMED = [
    (path.relative_to(ROOT), page)
    for folder in ("src", "tests", "benchmarks", "examples")
    for path in sorted((ROOT / folder).rglob("*"))
    if path.suffix in {".py", ".yaml", ".c", ".rs"} and "target" not in path.parts
    for page in re.findall(r"\bdocs/[\w/-]+\.md\b", path.read_text(encoding="utf-8", errors="replace"))
]


def test_pages_that_code_and_messages_name_exist() -> None:
    assert len(NAMED) > 10
    assert [f"{path}: {page}" for path, page in NAMED if not (ROOT / page).is_file()] == []
