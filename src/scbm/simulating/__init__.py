"""Runs in virtual time: simulated resources, a heap of events, and every free choice kept.

The same choices give the same trace, byte for byte. Nothing here reads a clock, and nothing sleeps.
"""

from scbm.simulating.choices import Choices, Message, Reactions, leave_nothing_open
from scbm.simulating.reactions import DrawnReactions, PlainReactions, typical_ns
from scbm.simulating.simulation import Simulated, Simulator, TooLongError

__all__ = [
    "Choices",
    "DrawnReactions",
    "Message",
    "PlainReactions",
    "Reactions",
    "Simulated",
    "Simulator",
    "TooLongError",
    "leave_nothing_open",
    "typical_ns",
]
