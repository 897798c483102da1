"""The HTML report: one self-contained file that shows a whole coverage store.

`page` combines what `views` and `timelines` derive from a history; `page.js` makes it interactive.
"""

from scbm.reports.html.page import html_report

__all__ = ["html_report"]
