"""Deprecated name of `scbm.files`: reads and writes models, cases and bindings."""

from __future__ import annotations

import warnings

from scbm import files


def __getattr__(name: str) -> object:
    """Return the attribute of `scbm.files` with a deprecation warning; raise `AttributeError` if there is none."""
    value: object = getattr(files, name)
    warnings.warn(f"scbm.notation is now scbm.files: import {name} from there", DeprecationWarning, stacklevel=2)
    return value
