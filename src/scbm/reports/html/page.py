"""The HTML report as one file: filled templates, styles, scripts, and the data for the scripts."""

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
    """Return the complete HTML file as text; equal histories give equal files.

    Args:
        history: the history to show, with at least one run.
        replay: runs a case again for its timeline; returns `None` for a case that cannot be run again.
        progress: callback after each of these runs, with the number of finished runs and of all runs.
    """
    environment = _environment()
    visitors = Visitors.of(history)
    executions = _executions(history, replay, progress)
    return environment.get_template("page.html.j2").render(
        report=ReportView(history, visitors),
        growth=Markup(growth_svg(history)),  # noqa: S704 - our own SVG, in which names are escaped
        styles=[_verbatim(environment, name) for name in _STYLES],
        scripts=[_verbatim(environment, name) for name in _SCRIPTS],
        columns=as_json(case_columns(history, visitors)),
        details=as_json(case_details(history)),
        timelines=as_json(pack_timelines(history.model, executions)),
    )


def as_json(value: Any) -> Markup:  # noqa: ANN401 - any value that JSON can represent
    """Return `value` as JSON that is safe inside `<script>`: no text in it ends the element or begins a comment."""
    text = dumps(value, separators=(",", ":"))
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(text)  # noqa: S704 - all characters with a meaning in HTML are escaped


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
    """Return the text of a style sheet or a script of this package, unchanged."""
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
