"""The keys of the network of a case: how messages travel between runner and resources."""

from __future__ import annotations

from fractions import Fraction
from itertools import compress
from typing import TYPE_CHECKING

from scbm.cases import Network, Partition, Restart
from scbm.files.codec.key_types import RESOURCE_NAME, TIME, MappingListType, ScalarType
from scbm.files.codec.keys import DefaultKey, Key, Keys
from scbm.files.codec.value_reader import ValueReader
from scbm.files.language.quantities import format_share

if TYPE_CHECKING:
    from collections.abc import Iterator

_NONE = Fraction(0)
_SHARE = ScalarType(
    "share",
    "a share such as `2 %`",
    {
        "description": "A share in per cent, or a number from 0 to 1: `2 %`, `0.02`.",
        "anyOf": [
            {"type": "string", "pattern": r"^\d+(\.\d+)?\s*%$"},
            {"type": "number", "minimum": 0, "maximum": 1},
        ],
    },
    ValueReader.share,
    lambda share: format_share(share) if share else 0,
)


class PartitionKeys(Keys):
    """A time in which messages are lost."""

    in_flow = True

    resource = Key(RESOURCE_NAME, "The resource that is cut off.", absent="all resources")
    at = Key(TIME, "When the partition begins, in time of the run.", required=True, source="at_ns")
    for_ = Key(TIME, "How long the partition lasts.", name="for", required=True, source="for_ns")

    def partition(self) -> Partition:
        """Return the partition; valid only if no error is noted."""
        return Partition(self.at or 0, self.for_ or 0, None if self.resource is None else self.resource.name)


class RestartKeys(Keys):
    """A time in which a resource is down. It forgets all earlier requests."""

    in_flow = True

    resource = Key(RESOURCE_NAME, "The resource that is down.", required=True)
    at = Key(TIME, "When the resource goes down, in time of the run.", required=True, source="at_ns")
    for_ = DefaultKey(TIME, "How long the resource is down.", name="for", default=0, source="for_ns")

    def restart(self) -> Restart:
        """Return the restart; valid only if no error is noted."""
        return Restart("" if self.resource is None else self.resource.name, self.at or 0, self.for_)


class NetworkKeys(Keys):
    """Faults of the network between the runner and the resources."""

    latency = DefaultKey(TIME, "How long each message travels.", default=0, source="latency_ns")
    jitter = DefaultKey(
        TIME,
        "The maximum additional time that a message travels, each value equally probable.",
        default=0,
        source="jitter_ns",
    )
    loss = DefaultKey(_SHARE, "The probability that a message is lost.", default=_NONE)
    duplication = DefaultKey(
        _SHARE, "The probability that a message arrives twice, the second time up to `held_back` later.", default=_NONE
    )
    reordering = DefaultKey(
        _SHARE, "The probability that a message is held back, so that later messages overtake it.", default=_NONE
    )
    held_back = DefaultKey(
        TIME, "The maximum time that a message is held back.", default=Network().held_back_ns, source="held_back_ns"
    )
    partitions = DefaultKey(
        MappingListType(PartitionKeys, "list of partitions"), "Times in which messages are lost.", default=()
    )
    restarts = DefaultKey(
        MappingListType(RestartKeys, "list of restarts"), "Times in which a resource is down.", default=()
    )

    def network(self) -> Network:
        """Return the network; valid only if no error is noted."""
        return Network(
            self.latency,
            self.jitter,
            self.loss,
            self.duplication,
            self.reordering,
            self.held_back,
            tuple(keys.partition() for keys in self.partitions),
            tuple(keys.restart() for keys in self.restarts),
        )


def random_keys(network: Network) -> Iterator[str]:
    """Yield the keys that leave something to chance."""
    amounts = (network.jitter_ns > 0, network.loss > 0, network.duplication > 0, network.reordering > 0)
    yield from compress(("jitter", "loss", "duplication", "reordering"), amounts)


NETWORK_OWNERS: tuple[tuple[type[Keys], str], ...] = ((PartitionKeys, "a partition"), (RestartKeys, "a restart"))
"""What messages call the mappings of a network alone."""
