"""Closing: every obligation of a model is covered by a case, proved uncoverable, or undecided (semantics 8.5)."""

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
