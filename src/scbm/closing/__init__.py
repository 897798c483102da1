"""Every obligation of a model decided: covered by a case, proved uncoverable, or undecided (semantics 8.5)."""

from scbm.closing.decisions import Closing, ClosingCase, Decided, Decision, Suggestion, SuggestionKind

__all__ = ["Closing", "ClosingCase", "Decided", "Decision", "Suggestion", "SuggestionKind"]
