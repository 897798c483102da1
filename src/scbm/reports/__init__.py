"""Reports for people: results as lines of text, one module for each format.

The modules return lines and print nothing. Reports on closing are imported from their own modules, as the package
`closing` takes long to load.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.reports.terminal.coverage_report import coverage_report, missing_report
    from scbm.reports.terminal.failure_report import failure_lines
    from scbm.reports.terminal.timeline import timeline

__all__ = ["coverage_report", "failure_lines", "missing_report", "timeline"]

__getattr__ = lazy_exports(
    __name__,
    {
        "terminal.coverage_report": "coverage_report missing_report",
        "terminal.failure_report": "failure_lines",
        "terminal.timeline": "timeline",
    },
)
