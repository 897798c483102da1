"""The picture of a model in one of the forms of `scbm draw`: SVG, HTML, or Markdown with diagrams for Mermaid."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import Aspect, Obligation
from scbm.drawing.drawing_page import drawing_page
from scbm.drawing.drawn_automata import drawn_automata
from scbm.drawing.edge_statuses import few
from scbm.drawing.mermaid_text import automaton_text, fenced, plan_text
from scbm.drawing.model_svg import PictureFrame, model_svg
from scbm.drawing.picture_parts import PictureLinks
from scbm.drawing.plan_lanes import plan_steps, plan_svg
from scbm.model.visible_text import counted

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.drawing.automata import Automaton, ModelAutomata
    from scbm.drawing.edge_statuses import EdgeStatuses


class Picture(Struct, frozen=True):
    """A picture in all forms.

    Attributes:
        title: its title.
        statuses: what the tests did.
        obligations: the obligations that it shows.
        draw: returns it as `<svg>`, from the statuses and where clicks lead.
        mermaid: it as Markdown with diagrams for Mermaid.
    """

    title: str
    statuses: EdgeStatuses
    obligations: Sequence[Obligation]
    draw: Callable[..., str]
    mermaid: str

    def svg(self) -> str:
        """Return the picture as a file of its own."""
        return self.draw(PictureLinks(self.statuses, lambda _: ""), is_alone=True)

    def html(self) -> str:
        """Return the picture as a page, with a row for each obligation."""
        rows = {each: f"o{number}" for number, each in enumerate(dict.fromkeys(self.obligations), start=1)}
        svg = self.draw(PictureLinks(self.statuses, lambda each: f"#{rows[each]}"))
        return drawing_page(self.title, svg, rows, self.statuses)


def automata_picture(automata: ModelAutomata, chosen: Sequence[Automaton], statuses: EdgeStatuses) -> Picture:
    """Return the picture of some automata of a model."""
    title, drawn = f"Automata of {automata.model.name}", drawn_automata(automata, chosen, statuses)
    lines = [line for each in drawn for arrow in each.arrows for line in arrow.lines]
    mermaid = "\n".join(fenced(each.title, automaton_text(each)) for each in drawn)

    draw = partial(model_svg, drawn, PictureFrame(title, caption(automata, chosen, statuses)))
    return Picture(title, statuses, [each for line in lines for each in line.obligations], draw, mermaid)


def plan_picture(automata: ModelAutomata, goal: str, plan: Sequence[str], statuses: EdgeStatuses) -> Picture:
    """Return the picture of the plan to a goal from the nominal state."""
    title, steps = f"Plan to {goal}", plan_steps(automata.model, plan, automata.carried)
    completed = [Obligation(name, Aspect.COMPLETED) for name in plan]

    return Picture(title, statuses, completed, partial(plan_svg, goal, steps), fenced(title, plan_text(steps)))


def caption(automata: ModelAutomata, chosen: Sequence[Automaton], statuses: EdgeStatuses) -> tuple[str, ...]:
    """Return sentences below a picture: what is drawn, what is not, and what colours mean."""
    changes = sum(len(each.edges) for each in chosen)
    found = [f"{counted(len(chosen), 'variable')} with {counted(changes, 'change')}"]
    if tuple(chosen) == automata.drawn:
        left_out = {"that only requests need": automata.carried, "that nothing changes": automata.unchanged}
        for why, names in left_out.items():
            found += [f"Not drawn: {counted(len(names), 'variable')} {why}: {few(names)}"] if names else []
    if statuses.known:
        found.append("Marks and colors: operation started, completed, failed or timed out, or transition taken")
    return tuple(found)
