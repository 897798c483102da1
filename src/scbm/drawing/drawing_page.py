"""A picture as one HTML file without scripts: a click on a maker leads to what is known about its obligation."""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

from markupsafe import Markup

from scbm.drawing.edge_statuses import NO_PAINT, PAINTS
from scbm.model.visible_text import escaped
from scbm.reports.html.page import page_environment, verbatim

if TYPE_CHECKING:
    from collections.abc import Mapping

    from scbm.cases.coverage import Obligation
    from scbm.drawing.edge_statuses import EdgeStatuses


def drawing_page(title: str, svg: str, rows: Mapping[Obligation, str], statuses: EdgeStatuses) -> str:
    """Return the complete HTML file as text.

    Args:
        title: its title.
        svg: the picture.
        rows: the obligations to list, each with the identifier of its row.
        statuses: what is known about them.
    """
    environment = page_environment()
    template = environment.from_string(files(__package__).joinpath("drawing.html.j2").read_text("utf-8"))
    page = template.render(
        title=title,
        svg=Markup(svg),  # noqa: S704 - our own SVG, in which names are escaped
        rows=rows,
        statuses=statuses,
        marks={name: paint.mark for name, paint in {"": NO_PAINT, **PAINTS}.items()},
        style=verbatim(environment, "page.css"),
    )
    return escaped(page)
