"""From what a case says of the network to a network."""

from __future__ import annotations

from fractions import Fraction
from itertools import compress
from typing import TYPE_CHECKING

from scbm.cases import Network, Partition, Restart

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.notation.case_parts import CaseParts
    from scbm.notation.document import Node


def drawing(network: Network) -> Iterator[str]:
    """The keys of what is a matter of chance in it."""
    amounts = (network.jitter_ns > 0, network.loss > 0, network.duplication > 0, network.reordering > 0)
    yield from compress(("jitter", "loss", "duplication", "reordering"), amounts)


class NetworkBuilder:
    """Reads what stands under `network`."""

    def __init__(self, parts: CaseParts) -> None:
        self._parts = parts

    def network(self, node: Node | None) -> Network:
        """The network; what is not said is plain."""
        if node is None:
            return Network()
        held_back_ns = self._parts.time(node.get("held_back"))
        partitions, restarts = node.get("partitions"), node.get("restarts")
        return Network(
            self._parts.time(node.get("latency")) or 0,
            self._parts.time(node.get("jitter")) or 0,
            self._share(node.get("loss")),
            self._share(node.get("duplication")),
            self._share(node.get("reordering")),
            Network().held_back_ns if held_back_ns is None else held_back_ns,
            tuple(self._partition(element) for element in (partitions.elements if partitions is not None else ())),
            tuple(self._restart(element) for element in (restarts.elements if restarts is not None else ())),
        )

    def _share(self, node: Node | None) -> Fraction:
        return self._parts.share(node) or Fraction(0)

    def _partition(self, node: Node) -> Partition:
        resource = self._parts.resource(node.get("resource"))
        at_ns, for_ns = self._parts.time(node.get("at")), self._parts.time(node.get("for"))
        return Partition(at_ns or 0, for_ns or 0, None if resource is None else resource.name)

    def _restart(self, node: Node) -> Restart:
        resource = self._parts.resource(node.get("resource"))
        at_ns, for_ns = self._parts.time(node.get("at")), self._parts.time(node.get("for"))
        return Restart("" if resource is None else resource.name, at_ns or 0, for_ns or 0)
