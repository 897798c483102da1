"""The automata in reports: on the page *Model*, beside each operation, and as diagrams in the summary in Markdown."""

from __future__ import annotations

from itertools import accumulate
from typing import TYPE_CHECKING
from urllib.parse import quote

from msgspec.structs import replace

from scbm.cases.coverage import Aspect
from scbm.drawing.automata import ModelAutomata
from scbm.drawing.drawn_automata import drawn_automata
from scbm.drawing.edge_statuses import EdgeStatuses
from scbm.drawing.mermaid_text import folded
from scbm.drawing.model_picture import caption
from scbm.drawing.model_svg import PictureFrame, model_svg
from scbm.drawing.named_parts import automata_of_operation
from scbm.drawing.picture_parts import PictureLinks
from scbm.model import InputError, Slug
from scbm.reports.pictures import ReportPictures

if TYPE_CHECKING:
    from scbm.cases.coverage import Obligation
    from scbm.store import History

_MAX_DIAGRAMS, _MAX_BYTES = 20, 60_000
"""Maximum number and size of the diagrams of a summary: GitHub draws each in a frame of its own."""


def automata_pictures(history: History) -> ReportPictures:
    """Return the picture of the model, and one of what each operation changes; a note if there can be none."""
    try:
        return _pictures(history)
    except InputError as error:
        why = error.diagnostics[0]
        missing = "Pictures need the extra `draw`: `pip install 'scbm[draw]'`"
        return ReportPictures(note=missing if why.slug is Slug.DRAWING_MISSING else f"No pictures: {why.message}")


def _pictures(history: History) -> ReportPictures:
    automata, statuses = ModelAutomata.of(history.model), EdgeStatuses.of_store(history)
    links = PictureLinks(statuses, lambda each: _address(each, history))
    around = PictureFrame("Automata of the model", caption(automata, automata.drawn, statuses))
    drawn = drawn_automata(automata, automata.drawn, statuses)
    model = model_svg(drawn, around, links) if drawn else ""
    found: dict[str, str] = {}
    beside = links._replace(statuses=replace(statuses, missed={}))  # the page of an operation says why it is missing
    for number, operation in enumerate(history.model.operations):
        drawn = drawn_automata(automata, automata_of_operation(automata, operation.name), statuses)
        frame = PictureFrame(f"What {operation.name} changes", None, f"changes-{number}")
        found |= {operation.name: model_svg(drawn, frame, beside)} if drawn else {}
    return ReportPictures(model, found)


def _address(obligation: Obligation, history: History) -> str:
    """Return the page of the cases that visit an obligation, or that of its operation if no case does."""
    if history.visits[obligation] or obligation.aspect is Aspect.TAKEN:
        return f"#/cases?visits={quote(str(obligation), safe='')}"
    return f"#/operation/{quote(obligation.subject, safe='')}"


def missing_diagrams(history: History) -> list[str]:
    """Return a folded diagram for each variable with a missing edge, at most 20 and 60 kB, and how many others are."""
    automata, statuses = ModelAutomata.of(history.model), EdgeStatuses.of_store(history)
    drawn = drawn_automata(automata, automata.drawn, statuses)
    blocks = [folded(each) for each in drawn if any(arrow.paint == "missed" for arrow in each.arrows)]
    sizes = accumulate(len(block.encode()) for block in blocks[:_MAX_DIAGRAMS])
    kept = [block for block, size in zip(blocks, sizes, strict=False) if size <= _MAX_BYTES]
    more = len(blocks) - len(kept)
    return [*kept, f"{more} more with missing edges: `scbm draw` shows all\n"] if more else kept
