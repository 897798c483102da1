"""Moments and lengths of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hypothesis import strategies as st

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

_MS_NS = 1_000_000
_SECOND_MS = 1_000
_LATEST_MS = 20_000


def times(most_ms: int = _LATEST_MS, least_ms: int = 0) -> SearchStrategy[int]:
    """Nanoseconds that are whole milliseconds, often whole seconds."""
    milliseconds = st.integers(least_ms, most_ms)
    if most_ms - least_ms >= _SECOND_MS:
        seconds = st.integers(-(-least_ms // _SECOND_MS), most_ms // _SECOND_MS)
        milliseconds = seconds.map(lambda count: count * _SECOND_MS) | milliseconds
    return milliseconds.map(lambda ms: ms * _MS_NS)
