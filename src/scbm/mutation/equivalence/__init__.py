"""Equivalence: whether a mutant of a model ever behaves otherwise, as a proof or as a case that shows it."""
