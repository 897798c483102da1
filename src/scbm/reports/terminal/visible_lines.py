"""Styled lines as readers see them: control characters and bidirectional marks are shown as escapes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.model.visible_text import ACTING_IN_A_LINE, escape_of

if TYPE_CHECKING:
    import re

    from rich.text import Text


def visible_line(text: Text, acting: re.Pattern[str] = ACTING_IN_A_LINE) -> Text:
    """Return a styled text with the characters that match `acting` escaped; styles keep their places."""
    shown, end = text.blank_copy(), 0
    for match in acting.finditer(text.plain):
        shown.append_text(text[end : match.start()]).append(escape_of(match))
        end = match.end()
    return shown.append_text(text[end:]) if end else text
