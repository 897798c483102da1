"""Deprecated name of `scbm.plugins.hypothesis`: Hypothesis strategies for the test cases of a model."""

from __future__ import annotations

import warnings

from scbm.plugins import hypothesis


def __getattr__(name: str) -> object:
    """Return the strategy with a deprecation warning; raise `AttributeError` if there is none of this name."""
    value: object = getattr(hypothesis, name)
    message = f"scbm.strategies is now scbm.plugins.hypothesis: import {name} from there"
    warnings.warn(message, DeprecationWarning, stacklevel=2)
    return value
