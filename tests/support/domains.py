"""DDS domains for tests: each test has its own, in all processes, and no message leaves the machine."""

from __future__ import annotations

import fcntl
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


@contextmanager
def own_domain() -> Iterator[int]:
    """Yield a domain that no other test has."""
    for domain in _DOMAINS:
        with (Path(tempfile.gettempdir()) / f"scbm-test-domain-{domain}").open("w") as lock:
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                continue
            yield domain
            return
    raise AssertionError("all domains are taken")
