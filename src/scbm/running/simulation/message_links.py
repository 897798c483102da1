"""How messages travel between the runner and simulated resources."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases import LOST

if TYPE_CHECKING:
    from random import Random

    from scbm.cases import Delivery, Network

_MICROSECOND_NS = 1_000
_WIDE_NS = 1_000_000


class Links:
    """One link to each resource and one back. On each, messages keep their order unless one is held back."""

    def __init__(self, network: Network, random: Random | None) -> None:
        self._network = network
        self._random = random
        self._last_ns: dict[tuple[str, bool], int] = {}
        self.are_plain = not network.latency_ns and not network.draws

    def cuts(self, resource: str, now_ns: int) -> bool:
        """Return whether a partition cuts the resource off now."""
        return any(
            cut.at_ns <= now_ns < cut.at_ns + cut.for_ns and cut.resource in (None, resource)
            for cut in self._network.partitions
        )

    def deliver(self, resource: str, now_ns: int, *, inward: bool) -> Delivery:
        """Decide how a message travels that is sent now; `inward` is from the resource to the runner.

        Only what can happen is drawn: whether it is lost, its jitter, whether it is held back, whether it is doubled.
        """
        network = self._network
        if self._happens(float(network.loss)):
            return LOST
        arrives_ns = now_ns + network.latency_ns + self._up_to(network.jitter_ns)
        if self._happens(float(network.reordering)):
            arrives_ns += self._up_to(network.held_back_ns)
        else:
            link = (resource, inward)
            arrives_ns = self._last_ns[link] = max(arrives_ns, self._last_ns.get(link, 0))
        copies = (arrives_ns - now_ns,)
        if self._happens(float(network.duplication)):
            return (*copies, copies[0] + self._up_to(network.held_back_ns))
        return copies

    def _happens(self, probability: float) -> bool:
        return bool(probability) and self._draw() < probability

    def _up_to(self, most_ns: int) -> int:
        """Round to whole microseconds, which are easy to read; finer in a narrow range."""
        if not most_ns:
            return 0
        step_ns = _MICROSECOND_NS if most_ns >= _WIDE_NS else 1
        return int(self._draw() * most_ns) // step_ns * step_ns

    def _draw(self) -> float:
        assert self._random is not None  # noqa: S101 - `Choices` sees to it
        return self._random.random()
