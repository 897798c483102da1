"""Sphinx configuration of the documentation site: `sphinx-build -W -b html docs build/docs`."""

from __future__ import annotations

import ast
import re
import sys
import typing
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from sphinx.pycode import ModuleAnalyzer

if TYPE_CHECKING:
    from sphinx.application import Sphinx

sys.path[:0] = [str(Path(__file__).parents[1] / "src"), str(Path(__file__).parent)]

from page_parts import complete_page, link_rules  # noqa: E402 - it is in this folder

project = "scbm"
author = "The scbm developers"
html_title = "scbm"

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx_copybutton"]
exclude_patterns = ["build"]
html_search_scorer = str(Path(__file__).with_name("search_scorer.js"))
nitpicky = False  # types of other packages, such as `pytest.Item`, have no pages here
html_theme = "furo"
html_static_path: list[str] = []
html_show_copyright = False
html_show_sourcelink = False
html_copy_source = False
pygments_style = "default"

myst_heading_anchors = 4  # links name headings as GitHub does, so that pages work on both
suppress_warnings = ["misc.highlighting_failure"]  # a `yaml` block may be a part of a file

copybutton_prompt_text = "$ "  # copies the commands of a console block without their output
copybutton_here_doc_delimiter = "EOF"

autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
autodoc_preserve_defaults = True
napoleon_use_ivar = True
napoleon_numpy_docstring = False
default_role = "code"  # docstrings put names between single backticks


def _import_documented() -> None:
    """Import the documented packages with all that they export."""
    pages = Path(__file__).parent.glob("reference/api/*.md")
    for name in re.findall(r"automodule:: (\S+)", "".join(page.read_text(encoding="utf-8") for page in sorted(pages))):
        package = import_module(name)
        for exported in getattr(package, "__all__", []):
            getattr(package, exported)


def _import_annotations() -> None:
    """Import them again with the names that type checkers see: the signatures of structs evaluate annotations."""
    _import_documented()  # with the libraries, some of which cannot be imported as type checkers see them
    for name in [name for name in sys.modules if name.partition(".")[0] == "scbm"]:
        del sys.modules[name]
    vars(typing)["TYPE_CHECKING"] = True
    _import_documented()
    vars(typing)["TYPE_CHECKING"] = False


_import_annotations()


def _escape_markup(_app: object, _what: str, _name: str, _obj: object, _options: object, lines: list[str]) -> None:
    """Escape characters in `lines` that docstrings use as plain text and reStructuredText reads as markup."""
    for index, line in enumerate(lines):
        parts = re.split(r"(`+[^`]*`+|:\w+:`[^`]*`)", line)
        parts[::2] = [re.sub(r"([*|])|(?<=\w)_(?=\W|$)", lambda found: "\\" + found[0], part) for part in parts[::2]]
        lines[index] = "".join(parts)


def _rejoin_property(_app: object, what: str, _name: str, _obj: object, _options: object, lines: list[str]) -> None:
    """Undo that napoleon reads "How many failed: …" of a property or a constant as a type and a description."""
    types = [line for line in lines if line.startswith(":type: ")]
    if what in ("property", "data") and types:
        lines.remove(types[0])
        lines[0] = f"{types[0].removeprefix(':type: ')}: {lines[0]}"


def _document_constants(_app: object) -> None:
    """Give constants and type aliases that packages import the docstrings that they have where they are defined.

    Sphinx reads docstrings of data in the source of one module only, and leaves out data without.
    """
    for page in (Path(__file__).parent / "reference" / "api").glob("*.md"):
        for package in re.findall(r"automodule:: (\S+)", page.read_text(encoding="utf-8")):
            known = ModuleAnalyzer.for_module(package)
            docstrings = known.find_attr_docs()
            for node in ast.walk(ast.parse(known.code)):
                if isinstance(node, ast.ImportFrom) and node.module is not None and node.module.startswith("scbm."):
                    defined = ModuleAnalyzer.for_module(node.module).find_attr_docs()
                    keys = [("", alias.name) for alias in node.names]
                    docstrings.update({key: defined[key] for key in keys if key in defined})


def _complete_page(_app: object, _page: str, source: list[str]) -> None:
    """Replace the marks of a page by what is generated, and let numbers of rules lead to the rules."""
    source[0] = link_rules(complete_page(source[0]))


def setup(app: Sphinx) -> None:
    """Register the hooks; those for docstrings run before and after napoleon, which has priority 500."""
    app.connect("source-read", _complete_page)
    app.connect("builder-inited", _document_constants)
    app.connect("autodoc-process-docstring", _escape_markup, priority=400)
    app.connect("autodoc-process-docstring", _rejoin_property, priority=600)
