"""Expands what a model file says once: from one tree of YAML nodes to another, before any key is checked.

Expanded nodes keep the places of the text that they come from, so all later errors point there (decision 51).
"""
