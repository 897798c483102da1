"""Deprecated name of `scbm.cases.trace`: the records of a run, and how to read and write them."""

from __future__ import annotations

import warnings

from scbm.cases import trace


def __getattr__(name: str) -> object:
    """Return the attribute of `scbm.cases.trace` with a deprecation warning, or raise `AttributeError`."""
    value: object = getattr(trace, name)
    warnings.warn(f"scbm.trace is now scbm.cases.trace: import {name} from there", DeprecationWarning, stacklevel=2)
    return value
