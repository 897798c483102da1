"""Closing: every obligation of a model is covered by a case, proved uncoverable, or undecided (semantics 8.5)."""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.closing.closer import Closer
    from scbm.closing.decisions import Closing, ClosingCase, Decided, Decision, Suggestion, SuggestionKind
    from scbm.closing.runs.all_runs import CloseLimits

__all__ = [
    "CloseLimits",
    "Closer",
    "Closing",
    "ClosingCase",
    "Decided",
    "Decision",
    "Suggestion",
    "SuggestionKind",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "closer": "Closer",
        "decisions": "Closing ClosingCase Decided Decision Suggestion SuggestionKind",
        "runs.all_runs": "CloseLimits",
    },
)
