"""Opening a participant of a domain, and leaving it."""

from __future__ import annotations

import os
from contextlib import contextmanager
from typing import TYPE_CHECKING

from cyclonedds.core import DDSException, Policy, Qos
from cyclonedds.domain import DomainParticipant

from scbm.realtime.bus import BusError
from scbm.realtime.dds.cyclone_log import heard
from scbm.realtime.dds.raw import delete

if TYPE_CHECKING:
    from collections.abc import Iterator

URI = "CYCLONEDDS_URI"
LAST_DOMAIN = 232
"""The ports of higher ones do not exist."""

_OURS = (
    "<CycloneDDS><Domain Id='any'><Discovery><LeaseDuration>1s</LeaseDuration><SPDPInterval>200ms</SPDPInterval>"
    "</Discovery></Domain></CycloneDDS>"
)
"""A process that was killed is missed after the lease. Each says so often that it is there that one which stands still
for half of that is not; Cyclone DDS by itself missed it, and found it again only after half a minute. `CYCLONEDDS_URI`
comes behind, so it may say otherwise.
"""

_CORRECT = f"correct `{URI}`, or unset it"
_REMEDIES = (
    ("participant index", f"end other processes in this domain, or raise `MaxAutoParticipantIndex` in `{URI}`"),
    (
        "failed to find interfaces",
        "the machine needs a network interface that is up; for itself alone: `ip link set lo up`",
    ),
    (
        "available interface",
        f"correct the network interface in `{URI}`, or unset it; `ip address` shows which there are",
    ),
    ("configuration file", _CORRECT),
    ("config:", _CORRECT),
)


class Participant:
    """A participant of a domain, as a ROS 2 context has one.

    Attributes:
        entity: of DDS.
        warnings: what Cyclone DDS had to say, though it started.
    """

    def __init__(self, node: str, domain: int) -> None:
        """Joins. Raises `BusError`."""
        if not 0 <= domain <= LAST_DOMAIN:
            raise BusError(f"there is no DDS domain {domain}", f"domains are numbered from 0 to {LAST_DOMAIN}")
        self.warnings: list[str] = []
        try:
            # One thread at a time hears the log, so that the environment has one at a time, too.
            with heard(self.warnings), _completed_configuration():
                self.entity = DomainParticipant(domain, _qos(node))
        except DDSException as error:
            raise _error(domain, self.warnings, error) from error

    def close(self) -> None:
        """Leaves. Blocks for up to a second while what was sent before is not acknowledged."""
        delete(self.entity)


@contextmanager
def _completed_configuration() -> Iterator[None]:
    """Cyclone DDS reads it with the first participant of a process in a domain, and forgets it with the last.

    A `Domain` with a configuration of its own would be there until it is deleted, and take the participants of others
    in the process with it.
    """
    uri = os.environ.get(URI)
    os.environ[URI] = f"{_OURS},{uri or ''}"
    try:
        yield
    finally:
        if uri is None:
            del os.environ[URI]
        else:
            os.environ[URI] = uri


def _qos(node: str) -> Qos:
    return Qos(Policy.Userdata(b"enclave=/;"), Policy.EntityName(node))


def _error(domain: int, lines: list[str], error: DDSException) -> BusError:
    """Why: Cyclone DDS logs it, and raises a code that says nothing."""
    said = "; ".join(lines) or str(error)
    remedy = next((remedy for part, remedy in _REMEDIES if part in said), None)
    return BusError(f"DDS domain {domain} cannot be joined: {said}", remedy)
