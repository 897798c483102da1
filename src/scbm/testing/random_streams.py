"""Streams of chance: one for each purpose and case, made of the seed and the case's number alone (decision 5).

So a case is the same whether it is drawn first or last, alone or among a thousand, in this process or in another; and
what is drawn for one purpose does not shift what is drawn for another.
"""

from __future__ import annotations

from random import Random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.cases import Origin


def case_stream(origin: Origin) -> Random:
    """Goal and initial state."""
    return _stream("case", origin)


def reaction_stream(origin: Origin) -> Random:
    """How resources react."""
    return _stream("reactions", origin)


def fault_stream(origin: Origin) -> Random:
    """What the faults of the network are like."""
    return _stream("faults", origin)


def message_stream(origin: Origin) -> Random:
    """How the messages travel on such a network."""
    return _stream("messages", origin)


def _stream(purpose: str, origin: Origin) -> Random:
    return Random(f"scbm {purpose} {origin.seed} {origin.number}")
