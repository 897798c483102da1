"""DDS domains for tests: each test has its own, in all processes, and no message leaves the machine."""

from __future__ import annotations

import fcntl
import socket
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

LOOPBACK = (
    '<CycloneDDS><Domain Id="any"><General>'
    '<Interfaces><NetworkInterface name="lo" multicast="false"/></Interfaces><AllowMulticast>false</AllowMulticast>'
    "</General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>"
    '<Peers><Peer Address="127.0.0.1"/></Peers></Discovery></Domain></CycloneDDS>'
)
"""For `CYCLONEDDS_URI`: the loopback interface, without multicast."""

_DOMAINS = range(20, 220)


def is_empty(domain: int) -> bool:
    """Return whether no participant is there: a process that another test left behind would be heard in this one."""
    return all(_is_free(discovery_port(domain, index)) for index in range(10))


def discovery_port(domain: int, index: int) -> int:
    """Return the port at which a participant of a domain hears of others, as DDSI-RTPS has it (9.6.1.1)."""
    return 7_400 + 250 * domain + 10 + 2 * index


def _is_free(port: int) -> bool:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as listening:
        try:
            listening.bind(("0.0.0.0", port))  # noqa: S104 - as Cyclone DDS binds; nothing is read
        except OSError:
            return False
    return True


@contextmanager
def own_domain() -> Iterator[int]:
    """Yield a domain that no other test has."""
    for domain in _DOMAINS:
        with (Path(tempfile.gettempdir()) / f"scbm-test-domain-{domain}").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            if is_empty(domain):
                yield domain
                return
    raise AssertionError("all domains are taken")
