"""Doubts: what is suspicious about a model, and in which part of its file."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.model import Slug


@dataclass(frozen=True, slots=True)
class Doubt:
    """One doubt.

    Attributes:
        slug: its identifier, documented in `docs/reference/messages.md`.
        message: one sentence.
        path: the keys that lead to the part of the model file.
        remedy: what to inspect or to change.
    """

    slug: Slug
    message: str
    path: tuple[str, ...]
    remedy: str | None = None
