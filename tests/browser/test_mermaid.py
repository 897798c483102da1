"""Diagrams for Mermaid, parsed and drawn by Mermaid itself; the package from npm is for this test alone."""

from __future__ import annotations

import re
import shutil
import subprocess
import tarfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from scbm.drawing.automata import ModelAutomata
from scbm.drawing.edge_statuses import EdgeStatuses
from scbm.drawing.model_picture import automata_picture, plan_picture
from scbm.files import load_model
from scbm.model import BehaviorModel
from support.histories import EXAMPLE, history_of
from support.hostile_names import HOSTILE, hostile_model
from support.loops import GUARD_S

if TYPE_CHECKING:
    from collections.abc import Iterator

    from playwright.sync_api import Browser, Page

pytestmark = pytest.mark.browser

MERMAID = "mermaid@11.17.2"
"""The version from npm that the tests use."""

ROOT = Path(__file__).parents[2]
MODELS = [EXAMPLE / "before.yaml", ROOT / "examples/dual_cnc/lifted.yaml", ROOT / "examples/packml/cell.yaml"]
DIAGRAM = re.compile(r"```mermaid\n(.*?)```", re.DOTALL)

DRAW = """async texts => {
  mermaid.initialize({startOnLoad: false});
  const drawn = [];
  for (const text of texts) {
    await mermaid.parse(text);
    drawn.push((await mermaid.render("d" + drawn.length, text)).svg);
  }
  return drawn;
}"""


@pytest.fixture(scope="module")
def mermaid(browser: Browser, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Page]:
    """A page with the script of Mermaid from npm; without npm or its registry the tests are skipped."""
    folder = tmp_path_factory.mktemp("mermaid")
    command = [shutil.which("npm") or "", "pack", "--silent", MERMAID]
    if not command[0] or subprocess.run(command, cwd=folder, check=False, capture_output=True).returncode:
        pytest.skip("npm is not installed, or its registry has no Mermaid")
    with tarfile.open(next(folder.glob("*.tgz"))) as package:
        package.extract("package/dist/mermaid.min.js", folder, filter="data")
    page = browser.new_page()
    page.set_default_timeout(GUARD_S * 1_000)
    page.set_content("<!doctype html><body></body>")
    page.add_script_tag(path=folder / "package/dist/mermaid.min.js")
    yield page
    page.close()


def drawn(mermaid: Page, texts: list[str]) -> list[str]:
    """Return the pictures that Mermaid draws. Raise an error for a text that it cannot parse."""
    found: list[str] = mermaid.evaluate(DRAW, texts)
    return found


def diagrams(model: BehaviorModel, statuses: EdgeStatuses) -> list[str]:
    automata = ModelAutomata.of(model)
    return DIAGRAM.findall(automata_picture(automata, automata.drawn, statuses).mermaid)


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.parent.name)
def test_mermaid_draws_each_automaton(mermaid: Page, path: Path) -> None:
    model = load_model(path)
    texts = diagrams(model, EdgeStatuses.of_store(history_of(path, 3)))
    pictures = drawn(mermaid, texts)
    assert len(pictures) == len(texts) > 0
    assert all("<svg" in picture and "Syntax error" not in picture for picture in pictures)


def test_mermaid_draws_a_plan(mermaid: Page) -> None:
    model = load_model(EXAMPLE / "before.yaml")
    plan = [operation.name for operation in model.operations[:1]]
    text = plan_picture(ModelAutomata.of(model), "goal", plan, EdgeStatuses()).mermaid
    (picture,) = drawn(mermaid, DIAGRAM.findall(text))
    assert plan[0] in picture


def test_mermaid_shows_hostile_names_as_they_are(browser: Browser, mermaid: Page) -> None:
    pictures = drawn(mermaid, diagrams(hostile_model(), EdgeStatuses()))
    page: Any = browser.new_page()
    page.set_content(pictures[0])
    shown = " ".join(page.locator("svg").all_text_contents())
    page.close()
    assert all(name in shown for name in HOSTILE[:-1])
    assert "<script" not in pictures[0]
