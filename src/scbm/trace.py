"""Deprecated name of `scbm.cases.trace`: the records of a run, and how to read and write them."""

from __future__ import annotations

from scbm.cases import trace
from scbm.model.lazy_exports import deprecated_exports

__getattr__ = deprecated_exports("scbm.trace", trace)
