"""Runs in virtual time: simulated resources, a heap of events, and every free choice recorded.

The same choices give the same trace, byte for byte. Nothing here reads a clock, and nothing sleeps.
"""

from scbm.simulating.choices import Chooser, DrawnChoices, Reaction, RecordedChoices
from scbm.simulating.simulation import Simulated, Simulator

__all__ = ["Chooser", "DrawnChoices", "Reaction", "RecordedChoices", "Simulated", "Simulator"]
