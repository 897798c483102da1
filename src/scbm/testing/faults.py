"""Networks drawn at random: for each case other faults, each of them as often there as not."""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, TypeVar

from scbm.cases import Network, Partition, Restart
from scbm.testing.chance import fault_stream

if TYPE_CHECKING:
    from random import Random

    from scbm.cases import Origin
    from scbm.model import BehaviorModel

_T = TypeVar("_T")

_MS_NS = 1_000_000
_MOST_LATENCY_MS = 50
_MOST_JITTER_MS = 200
_MOST_PER_CENT = 20
_MOST_HELD_BACK_MS = 2_000
_LATEST_MS = 20_000
_LONGEST_MS = 5_000


def draw_network(model: BehaviorModel, origin: Origin) -> Network:
    """A network with faults. Durations are whole milliseconds, probabilities whole per cent of at most 20.

    Partitions and restarts are drawn from the first twenty seconds of the run; they last five at most.
    """
    resources = [resource.name for resource in model.resources]
    draw = _Draw(fault_stream(origin))
    return Network(
        latency_ns=draw.perhaps(_MOST_LATENCY_MS) * _MS_NS,
        jitter_ns=draw.perhaps(_MOST_JITTER_MS) * _MS_NS,
        loss=Fraction(draw.perhaps(_MOST_PER_CENT), 100),
        duplication=Fraction(draw.perhaps(_MOST_PER_CENT), 100),
        reordering=Fraction(draw.perhaps(_MOST_PER_CENT), 100),
        held_back_ns=draw.from_one_to(_MOST_HELD_BACK_MS) * _MS_NS,
        partitions=(Partition(draw.moment_ns(), draw.length_ns(), draw.one_of([None, *resources])),)
        if draw.coin()
        else (),
        restarts=(Restart(draw.one_of(resources), draw.moment_ns(), draw.length_ns()),)
        if draw.coin() and resources
        else (),
    )


class _Draw:
    """Draws of the kinds that networks are made of."""

    def __init__(self, random: Random) -> None:
        self._random = random

    def coin(self) -> bool:
        return self._random.random() < 1 / 2

    def from_one_to(self, most: int) -> int:
        return 1 + int(self._random.random() * most)

    def perhaps(self, most: int) -> int:
        """Nothing, or as often a number from one to `most`."""
        return self.from_one_to(most) if self.coin() else 0

    def moment_ns(self) -> int:
        return int(self._random.random() * _LATEST_MS) * _MS_NS

    def length_ns(self) -> int:
        return self.from_one_to(_LONGEST_MS) * _MS_NS

    def one_of(self, choices: list[_T]) -> _T:
        return choices[int(self._random.random() * len(choices))]
