"""The model file as a file of code in Cobertura's XML: the branch rate is SCBM-IAS (decision 21)."""

from __future__ import annotations

import posixpath
import re
from datetime import UTC, datetime, timedelta
from typing import TYPE_CHECKING
from xml.etree.ElementTree import Comment, Element, SubElement

from scbm import __version__
from scbm.cases.coverage import FORCED_NOTE, Figure
from scbm.reports.ci.marked_lines import as_code, mark_file
from scbm.reports.ci.xml_text import is_absolute, portable, xml_text
from scbm.reports.status_lines import united_in_words

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.cases.coverage import Obligation
    from scbm.reports.ci.marked_lines import MarkedFile, MarkedLine, MarkedPart
    from scbm.store import History

_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


def cobertura_xml(history: History) -> str:
    """Return a Cobertura file by `coverage-04.dtd`; its package is the directory, its class the model file.

    Raises:
        InputError: the source of the history is not a model.
    """
    marked = as_code(mark_file(history.model, history.source, history.coverage))
    base, name = _located(history.source.path)
    root = Element("coverage", _rates(marked.measured))
    lines, branches = _lines_figure(marked.measured), _branches_figure(marked.measured)
    root.set("lines-covered", str(lines.visited))
    root.set("lines-valid", str(lines.of))
    root.set("branches-covered", str(branches.visited))
    root.set("branches-valid", str(branches.of))
    root.set("version", f"scbm {__version__}")
    root.set("timestamp", str(_milliseconds(history.runs[-1].started)))
    if history.lifted is not None:
        lifted = history.lifted.figure
        united = f"; {united_in_words(history.lifted)}" if history.others else ""
        root.append(Comment(_comment(f"Lifted: {lifted}, {lifted.visited} of {lifted.of}{united}")))
    if history.statuses.assumptions:
        root.append(Comment(_comment(f"Proofs assume: {' '.join(history.statuses.assumptions)}")))
    SubElement(SubElement(root, "sources"), "source").text = base
    package = SubElement(SubElement(root, "packages"), "package", _rates(marked.measured))
    package.set("name", posixpath.dirname(name) or ".")
    file = SubElement(SubElement(package, "classes"), "class", _rates(marked.measured))
    file.set("name", posixpath.basename(name))
    file.set("filename", name)
    kinds = _kinds(history)
    _add_parts(file, marked, kinds)
    _add_lines(file, marked.measured, kinds)
    return xml_text(root)


def _comment(text: str) -> str:
    """Return a text as that of a comment, which may have no `--`."""
    return f" {re.sub('-(?=-)', '- ', text)} "


def _located(path: str) -> tuple[str, str]:
    """Return the source directory, and the name of the model file relative to it.

    A relative path starts from the working directory, which is that of the repository in CI. An absolute path is
    split: GitLab strips the path of the repository from sources, but not from file names.
    """
    name = portable(path)
    return (posixpath.dirname(name), posixpath.basename(name)) if is_absolute(name) else (".", name)


def _kinds(history: History) -> dict[Obligation, str]:
    """Return the type of the condition of each obligation: its aspect, with a status that visits alone do not show."""
    kinds = {obligation: obligation.aspect.value for obligation in history.obligations}
    for entry in history.statuses.entries:
        if not entry.is_plain:
            note = f"; {FORCED_NOTE}" if entry.is_forced else ""
            kinds[entry.obligation] = f"{entry.obligation.aspect.value}, {entry.decision.words}{note}"
    return kinds


def _add_parts(file: Element, marked: MarkedFile, kinds: Mapping[Obligation, str]) -> None:
    """Add operations and automatic transitions as the methods of the class."""
    by_number = {line.number: line for line in marked.measured}
    methods = SubElement(file, "methods")
    for part in marked.parts:
        lines = [by_number[number] for number in part.lines]
        method = SubElement(methods, "method", _rates(lines, part))
        method.set("name", part.name)
        method.set("signature", "")
        _add_lines(method, lines, kinds, part)


def _add_lines(
    owner: Element, lines: Sequence[MarkedLine], kinds: Mapping[Obligation, str], part: MarkedPart | None = None
) -> None:
    group = SubElement(owner, "lines")
    for line in lines:
        element = SubElement(group, "line", {"number": str(line.number), "hits": str(line.hits)})
        branches = _branches(line, part)
        if not branches:
            element.set("branch", "false")
            continue
        visited = sum(count > 0 for _, count in branches)
        element.set("branch", "true")
        element.set("condition-coverage", f"{100 * visited // len(branches)}% ({visited}/{len(branches)})")
        conditions = SubElement(element, "conditions")
        for number, (obligation, count) in enumerate(branches):
            coverage = "100%" if count else "0%"
            attributes = {"number": str(number), "type": kinds[obligation], "coverage": coverage}
            SubElement(conditions, "condition", attributes)


def _branches(line: MarkedLine, part: MarkedPart | None) -> list[tuple[Obligation, int]]:
    """Return the branches of a line: all, or those of one part if several parts share the line."""
    return [(o, count) for o, count in line.obligations if part is None or part.owns(o)]


def _rates(lines: Sequence[MarkedLine], part: MarkedPart | None = None) -> dict[str, str]:
    """Return the attributes with the rates, which every level of the file has."""
    branches = _branches_figure(lines, part)
    return {"line-rate": _rate(_lines_figure(lines)), "branch-rate": _rate(branches), "complexity": "0"}


def _lines_figure(lines: Sequence[MarkedLine]) -> Figure:
    return Figure(sum(bool(line.hits) for line in lines), len(lines))


def _branches_figure(lines: Sequence[MarkedLine], part: MarkedPart | None = None) -> Figure:
    counts = [count for line in lines for _, count in _branches(line, part)]
    return Figure(sum(count > 0 for count in counts), len(counts))


def _rate(figure: Figure) -> str:
    """Return a figure as a fraction with the precision of its percentage; 1 if there is nothing to measure."""
    return "1" if figure.percent is None else f"{figure.percent / 100:.4f}"


def _milliseconds(started: str) -> int:
    """Return a moment as milliseconds since 1970."""
    return (datetime.fromisoformat(started) - _EPOCH) // timedelta(milliseconds=1)
