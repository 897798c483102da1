"""Shrinking: the smallest case that fails for the same reason (semantics 7.9)."""
