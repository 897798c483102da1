"""Runs in wall time: nodes that exchange messages, and what carries these (paper, Figure 5)."""
