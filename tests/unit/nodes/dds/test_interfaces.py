"""Nodes take nothing from the network unless an option opens it; those of one machine find each other either way."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from scbm.nodes.buses.bus import BusError
from scbm.nodes.buses.dds.interfaces import configuration
from scbm.nodes.buses.dds.participant import URI, Participant
from support.loops import GUARD_S

pytestmark = pytest.mark.dds

PROGRAM = """
import sys, time
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsParticipant
from scbm.nodes.buses.dds.participant import Participant

participant = Participant("other", int(sys.argv[1]), sys.argv[2])
reader = BuiltinDataReader(participant.entity, BuiltinTopicDcpsParticipant)
while len({sample.key for sample in reader.read(100)}) < 2:
    time.sleep(0.05)
print("found", flush=True)
sys.stdin.read()
"""


def devices() -> list[str]:
    """Return the device that each UDP socket of this process is bound to, if it is bound to one."""
    found = []
    for path in Path("/proc/self/fd").iterdir():
        try:
            is_socket = str(path.readlink()).startswith("socket:")
        except OSError:
            continue
        if is_socket:
            with socket.socket(fileno=os.dup(int(path.name))) as opened:
                if opened.family == socket.AF_INET and opened.type == socket.SOCK_DGRAM:
                    device = opened.getsockopt(socket.SOL_SOCKET, socket.SO_BINDTODEVICE, 16)
                    found.append(device.rstrip(b"\0").decode())
    return found


def test_no_socket_of_a_node_on_loopback_takes_messages_from_the_network(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(URI)
    participant = Participant("node", domain, "loopback")
    assert set(devices()) == {"lo"}
    assert participant.warnings == []
    participant.close()
    other = Participant("node", domain, "all")
    assert set(devices()) == {""}
    assert other.warnings == []
    other.close()


@pytest.mark.parametrize(("one", "other"), [("loopback", "loopback"), ("loopback", "all"), ("all", "all")])
def test_nodes_of_one_machine_find_each_other(
    domain: int, one: str, other: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(URI)
    commands = [[sys.executable, "-c", PROGRAM, str(domain), interface] for interface in (one, other)]
    started = [
        subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) for command in commands
    ]
    try:
        assert [process.stdout.readline() for process in started if process.stdout] == ["found\n"] * 2
    finally:
        for process in started:
            process.communicate(timeout=GUARD_S)


def test_an_interface_that_is_named_goes_before_the_configuration(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(URI, configuration("eth77"))
    with pytest.raises(BusError, match="eth77"):
        Participant("node", domain)
    participant = Participant("node", domain, "loopback")
    (warning,) = participant.warnings
    assert URI in warning
    participant.close()
