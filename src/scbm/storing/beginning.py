"""A run that begins now: the one place of the store that reads a clock, and that draws what tells runs apart."""

from __future__ import annotations

import shlex
from datetime import UTC, datetime
from typing import TYPE_CHECKING
from uuid import uuid4

from scbm.storing.history import Run, Source, sayable

if TYPE_CHECKING:
    from collections.abc import Sequence


def begin_run(command: Sequence[str], model_path: str, model_text: str, nodes: str | None = None) -> Run:
    """A run that no other one is equal to.

    Args:
        command: the words of the command line.
        model_path: the model file, as people are told of it.
        model_text: what it says.
        nodes: where its cases run, in words; `None` for simulation.
    """
    started = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%S.%fZ")
    return Run(uuid4().hex, started, sayable(shlex.join(command)), Source(sayable(model_path), model_text), nodes=nodes)
