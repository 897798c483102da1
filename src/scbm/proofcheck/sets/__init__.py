"""The check of sets of situations, which certificates have as decision diagrams."""
