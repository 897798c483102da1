"""Deprecated name of `scbm.files`: reads and writes models, cases and bindings."""

from __future__ import annotations

from scbm import files
from scbm.model.lazy_exports import deprecated_exports

__getattr__ = deprecated_exports("scbm.notation", files)
