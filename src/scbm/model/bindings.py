"""The binding of a resource to a real driver, as far as the model knows it."""

from __future__ import annotations

from typing import Any

from scbm.model.struct_classes import PartlyCompared


class Binding(PartlyCompared, frozen=True):
    """How a real resource is reached. What it means is known to `nodes`, whose bindings are a subclass.

    Attributes:
        written: the data of the binding, as in its file; one that nothing has checked is this class itself.
    """

    written: Any
    uncompared = ("written",)
