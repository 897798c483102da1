"""The HTML report: one file that shows a whole coverage store and needs nothing else.

`page` puts it together from what `views` and `data` take out of a history; `page.js` makes it move.
"""

from scbm.reports.html.page import html_report

__all__ = ["html_report"]
