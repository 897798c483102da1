"""The models of a session of pytest, kept in its stash. It imports little, as `scbm.plugins.pytest` loads it always."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from scbm.plugins.pytest.session_models import SessionModels

MODELS = pytest.StashKey["SessionModels"]()
"""The key of the models; without it the session has no cases so far."""


def models_of(config: pytest.Config) -> SessionModels:
    """Return the models of a session with their results; made at the first call."""
    if MODELS not in config.stash:
        from scbm.plugins.pytest.session_models import SessionModels  # noqa: PLC0415 - only where there is a case

        config.stash[MODELS] = SessionModels(config)
    return config.stash[MODELS]
