"""The automaton of one variable with its value at a moment, for a page that shows a run."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.drawing.automata import ModelAutomata
from scbm.drawing.drawn_automata import drawn_automata
from scbm.drawing.edge_statuses import EdgeStatuses
from scbm.drawing.model_svg import PictureFrame, model_svg
from scbm.drawing.picture_parts import PictureLinks
from scbm.model import format_value

if TYPE_CHECKING:
    from scbm.model import BehaviorModel

_automata = lru_cache(2)(ModelAutomata.of)


def marked_automaton(model: BehaviorModel, variable: str, value: str) -> str:
    """Return the automaton of a variable as an SVG file, with the box of a value filled; empty if nothing changes it.

    Raises:
        InputError: the extra `draw` is not installed.
    """
    chosen = [each for each in _automata(model).automata if each.variable.name == variable and each.edges]
    if not chosen:
        return ""
    drawn = drawn_automata(_automata(model), chosen, EdgeStatuses())[0]
    present = (value in map(format_value, group.values) for group in chosen[0].groups)
    nodes = tuple(replace(node, is_present=is_here) for node, is_here in zip(drawn.nodes, present, strict=True))
    links = PictureLinks(EdgeStatuses(), lambda _: "")
    frame = PictureFrame(f"{variable} = {value}", None)
    return model_svg([replace(drawn, nodes=nodes)], frame, links, is_alone=True)
