"""Integrations with pytest and Hypothesis."""
