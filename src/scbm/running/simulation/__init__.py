"""Runs in virtual time: simulated resources, a heap of events, and a record of every free choice.

The same choices give the same trace, byte for byte. Nothing here reads a clock, and nothing sleeps.
"""

from typing import TYPE_CHECKING

from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.running.simulation.default_reactions import (
        DrawnReactions,
        PlainReactions,
        plainly_measured,
        typical_ns,
    )
    from scbm.running.simulation.environment_moves import DrawnMoves, RecordedMoves
    from scbm.running.simulation.free_choices import Choices, MessageKind, Reactions, leave_nothing_open
    from scbm.running.simulation.simulator import Simulated, Simulator, TooLongError, UnfinishedRunError, UnplannedError

__all__ = [
    "Choices",
    "DrawnMoves",
    "DrawnReactions",
    "MessageKind",
    "PlainReactions",
    "Reactions",
    "RecordedMoves",
    "Simulated",
    "Simulator",
    "TooLongError",
    "UnfinishedRunError",
    "UnplannedError",
    "leave_nothing_open",
    "plainly_measured",
    "typical_ns",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "default_reactions": "DrawnReactions PlainReactions plainly_measured typical_ns",
        "environment_moves": "DrawnMoves RecordedMoves",
        "free_choices": "Choices MessageKind Reactions leave_nothing_open",
        "simulator": "Simulated Simulator TooLongError UnfinishedRunError UnplannedError",
    },
)
