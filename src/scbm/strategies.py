"""Deprecated name of `scbm.plugins.hypothesis`: Hypothesis strategies for the test cases of a model."""

from __future__ import annotations

from scbm.model.lazy_exports import deprecated_exports
from scbm.plugins import hypothesis

__getattr__ = deprecated_exports("scbm.strategies", hypothesis)
