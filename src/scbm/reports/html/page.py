"""The HTML report, put together: templates filled, styles, scripts and data of the browser written into one file."""

from __future__ import annotations

from json import dumps
from typing import TYPE_CHECKING, Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from scbm.reports.figure_table import counted
from scbm.reports.html.case_data import Visitors, case_columns, case_details
from scbm.reports.html.growth_chart import growth_svg
from scbm.reports.html.timelines import pack_timelines
from scbm.reports.html.views import ReportView, breakable, fragment, prose

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.store import History, StoredCase
    from scbm.testing import Execution

_STYLES = ("page.css", "timeline.css")
_SCRIPTS = ("timeline.js", "page.js")


def html_report(
    history: History,
    replay: Callable[[StoredCase], Execution | None],
    progress: Callable[[int, int], None] | None = None,
) -> str:
    """The complete file, as text; the same for the same history.

    Args:
        history: what is shown; it has at least one run.
        replay: runs a case again, for its timeline; `None` for one that cannot be run again.
        progress: is told after each such run how many are done, and of how many.
    """
    environment = _environment()
    visitors = Visitors.of(history)
    executions = _executions(history, replay, progress)
    return environment.get_template("page.html.j2").render(
        report=ReportView(history, visitors),
        growth=Markup(growth_svg(history)),  # noqa: S704 - made by us, names escaped there
        styles=[_verbatim(environment, name) for name in _STYLES],
        scripts=[_verbatim(environment, name) for name in _SCRIPTS],
        columns=as_json(case_columns(history, visitors)),
        details=as_json(case_details(history)),
        timelines=as_json(pack_timelines(history.model, executions)),
    )


def as_json(value: Any) -> Markup:  # noqa: ANN401 - whatever JSON can say
    """A value as JSON that can stand in a `<script>`: nothing in it ends the element, or begins a comment."""
    text = dumps(value, separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)  # noqa: S704 - nothing is left in it that HTML could take for its own


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("scbm.reports", "html"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["breakable"] = breakable
    environment.filters["fragment"] = fragment
    environment.filters["prose"] = prose
    environment.filters["counted"] = counted
    return environment


def _verbatim(environment: Environment, name: str) -> Markup:
    """A style or a script of this package, as it is."""
    assert environment.loader is not None  # noqa: S101 - given above
    text, _, _ = environment.loader.get_source(environment, name)
    return Markup(text)  # noqa: S704 - our own file


def _executions(
    history: History,
    replay: Callable[[StoredCase], Execution | None],
    progress: Callable[[int, int], None] | None,
) -> Iterator[Execution | None]:
    for done, case in enumerate(history.cases, start=1):
        yield replay(case)
        if progress is not None:
            progress(done, len(history.cases))
