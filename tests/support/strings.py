"""Strategies for strings, without the table of characters that UTF-8 encodes.

Hypothesis needs that table for `text()` and `from_regex()`. In a fresh checkout each process makes it, which takes a
second of CPU.
"""

from __future__ import annotations

from hypothesis import strategies as st

CHARACTERS = st.characters(exclude_categories=["Cs"])
"""All characters that UTF-8 encodes."""


def matching(pattern: str) -> st.SearchStrategy[str]:
    """Return the strings of ASCII characters that match a regular expression as a whole."""
    return st.from_regex(pattern, fullmatch=True, alphabet=st.characters(max_codepoint=127))
