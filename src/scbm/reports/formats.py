"""The file formats of `scbm report`, by the names of their options (`FORMATS`).

To add one: a function from a history to a text, and an entry here.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.store import History, StoredCase
    from scbm.testing import Execution


class ReportFormat(Struct, frozen=True):
    """A file format that `scbm report` writes.

    Attributes:
        help: what `scbm report --help` says of the option.
        module: the module with the function, imported when the format is asked for.
        function: the name of the function from a `History` to the text of the file.
        runs_cases: whether the function has a second parameter, which runs a stored case again.
    """

    help: str
    module: str
    function: str
    runs_cases: bool = False

    def text(self, history: History, run_again: Callable[[StoredCase], Execution | None]) -> str:
        """Return the text of the file."""
        make = getattr(import_module(self.module), self.function)
        text: str = make(history, run_again) if self.runs_cases else make(history)
        return text


FORMATS: dict[str, ReportFormat] = {
    "html": ReportFormat("One page for a browser.", "scbm.reports.html", "html_report", runs_cases=True),
    "junit": ReportFormat("JUnit XML: cases as tests.", "scbm.reports.ci.junit", "junit_xml"),
    "cobertura": ReportFormat("Cobertura XML: lines of the model.", "scbm.reports.ci.cobertura", "cobertura_xml"),
    "lcov": ReportFormat("LCOV: lines of the model.", "scbm.reports.ci.lcov", "lcov_info"),
    "sarif": ReportFormat("SARIF: failures.", "scbm.reports.ci.sarif", "sarif_log"),
    "markdown": ReportFormat("A job summary.", "scbm.reports.ci.markdown", "markdown"),
    "badge": ReportFormat("An SVG badge with the figure.", "scbm.reports.ci.badge", "badge"),
}
"""The formats by the names of their options: `junit` is `--junit FILE`."""
