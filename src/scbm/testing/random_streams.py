"""Random streams: one for each purpose and case, from the seed and the number of the case (decision 5).

So a case is the same whether it is drawn first or last, alone or among a thousand, in this process or in another; and
draws for one purpose do not shift those for another.
"""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.cases import Origin


def case_stream(origin: Origin) -> Random:
    """Return the stream that draws goal and initial state."""
    return _stream("case", origin)


def goal_stream(origin: Origin) -> Random:
    """Return the stream that draws the goals after the first one."""
    return _stream("goals", origin)


def reaction_stream(origin: Origin) -> Random:
    """Return the stream that draws the reactions of resources."""
    return _stream("reactions", origin)


def fault_stream(origin: Origin) -> Random:
    """Return the stream that draws the faults of the network."""
    return _stream("faults", origin)


def message_stream(origin: Origin) -> Random:
    """Return the stream that draws the fate of each message."""
    return _stream("messages", origin)


def environment_stream(origin: Origin) -> Random:
    """Return the stream that draws what the environment changes."""
    return _stream("environment", origin)


def draw_plans(origin: Origin) -> Callable[[], float]:
    """Return the function that gives the random numbers for plans drawn from all shortest ones."""
    return _stream("plans", origin).random


def _stream(purpose: str, origin: Origin) -> Random:
    return Random(f"scbm {purpose} {origin.seed} {origin.number}")
