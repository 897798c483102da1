"""The pictures of reports (`PICTURES`), made by packages that reports do not import: modules are named as text.

To add one: a function from a history to `ReportPictures`, and an entry here.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from msgspec import Struct, field

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from scbm.store import History


class ReportPictures(Struct, frozen=True):
    """One kind of picture in the HTML report, as texts that begin with `<svg` and in which all names are escaped.

    Attributes:
        model: the picture on the page *Model*; empty for none.
        operations: the pictures beside operations, by their names.
        note: a sentence on the page *Model*, such as why there is no picture; empty for none.
    """

    model: str = ""
    operations: Mapping[str, str] = field(default_factory=dict)
    note: str = ""


class PictureEntry(Struct, frozen=True):
    """A kind of picture.

    Attributes:
        title: the heading above it.
        module: the module with the functions, imported when a report is written.
        html: the name of the function from a `History` to `ReportPictures`.
        markdown: the name of the function from a `History` to blocks of Markdown, the most important first; empty for
            none. They stand at the end of the summary, and those that do not fit are left out.
    """

    title: str
    module: str
    html: str
    markdown: str = ""

    def pictures(self, history: History) -> ReportPictures:
        """Return the pictures for the HTML report."""
        made: ReportPictures = getattr(import_module(self.module), self.html)(history)
        return made

    def blocks(self, history: History) -> Sequence[str]:
        """Return the blocks for the summary in Markdown."""
        if not self.markdown:
            return ()
        made: Sequence[str] = getattr(import_module(self.module), self.markdown)(history)
        return made


PICTURES: dict[str, PictureEntry] = {
    "automata": PictureEntry(
        "What changes each variable", "scbm.drawing.report_pictures", "automata_pictures", "missing_diagrams"
    ),
}
"""The kinds of pictures, in the order of the page *Model*."""
