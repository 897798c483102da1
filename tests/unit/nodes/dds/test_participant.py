from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from cyclonedds.builtin import BuiltinDataReader, BuiltinTopicDcpsParticipant, DcpsParticipant
from cyclonedds.core import InstanceState, Policy, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.util import duration

from scbm.nodes.buses.bus import BusError
from scbm.nodes.buses.dds.participant import URI, Participant
from scbm.nodes.buses.dds.raw_samples import delete
from support.domains import LOOPBACK
from support.wording import Wording

LOST_WITHIN_S = 600
"""A guard, on a busy machine too."""


def refusal(domain: int) -> BusError:
    with pytest.raises(BusError) as raised:
        Participant("node", domain)
    return raised.value


def with_interface(name: str) -> str:
    return LOOPBACK.replace('"lo"', f'"{name}"')


@pytest.mark.parametrize(
    ("uri", "names"),
    [
        (with_interface("eth77"), "eth77"),
        ("<CycloneDDS><Domain></Dom></CycloneDDS>", "(Dom)"),
        ("<CycloneDDS><Domain><Foo>1</Foo></Domain></CycloneDDS>", "Foo: "),
        ("file:///no/such/file.xml", "file:///no/such/file.xml"),
        ("/no/such/Größe.xml", "/no/such/Größe.xml"),
    ],
)
def test_a_configuration_that_is_wrong_is_refused_in_its_own_words(  # noqa: PLR0913, PLR0917 - fixtures and a row
    domain: int,
    uri: str,
    names: str,
    monkeypatch: pytest.MonkeyPatch,
    capfd: pytest.CaptureFixture[str],
    wording: Wording,
) -> None:
    monkeypatch.setenv(URI, uri)
    error = refusal(domain)
    assert names in error.message  # the rest is what this version of Cyclone DDS says
    assert error.remedy is not None
    wording(error.remedy)
    assert capfd.readouterr() == ("", "")


def test_a_configuration_file_is_read(domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "cyclone.xml"
    file.write_text(with_interface("eth77"))
    monkeypatch.setenv(URI, f"file://{file}")
    assert "eth77" in refusal(domain).message
    file.write_text(LOOPBACK)
    Participant("node", domain).close()


def test_it_goes_without_a_configuration(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(URI)
    participant = Participant("node", domain)
    assert participant.warnings == []
    participant.close()


def test_what_cyclone_warns_of_is_kept(
    domain: int, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    old = "<General><NetworkInterfaceAddress>lo</NetworkInterfaceAddress></General>"
    monkeypatch.setenv(URI, f"<CycloneDDS><Domain>{old}</Domain></CycloneDDS>")
    participant = Participant("node", domain)
    participant.close()
    assert "NetworkInterfaceAddress" in "".join(participant.warnings)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("number", [-1, 233, 10_000])
def test_domains_have_numbers_that_have_ports(number: int, wording: Wording) -> None:
    error = refusal(number)
    wording((error.message, error.remedy))


JOIN = """
import sys
from scbm.nodes.buses.bus import BusError
from scbm.nodes.buses.dds.participant import Participant
try:
    participant = Participant("child", int(sys.argv[1]))
except BusError as error:
    print(error.message, error.remedy, sep="|")
else:
    print("joined", flush=True)
    sys.stdin.read()
"""


def child(domain: int, *prefix: str) -> subprocess.Popen[str]:
    command = [*prefix, sys.executable, "-c", JOIN, str(domain)]
    return subprocess.Popen(
        command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=dict(os.environ)
    )


@pytest.mark.slow
def test_more_processes_than_there_are_indices_are_refused(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    # Versions of Cyclone DDS differ in whether there are one or two indices then.
    monkeypatch.setenv(URI, LOOPBACK.replace(">60<", ">1<"))
    first = Participant("first", domain)
    second = child(domain)
    assert second.stdout is not None
    assert second.stdout.readline()
    out, err = child(domain).communicate()
    second.communicate()
    first.close()
    message, remedy = out.split("|")
    assert "index" in message  # what this version of Cyclone DDS says
    assert "`MaxAutoParticipantIndex`" in remedy
    assert not err


@pytest.mark.longer
def test_a_machine_without_a_network_is_reported(
    domain: int, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    unshare = shutil.which("unshare")
    if unshare is None or subprocess.run([unshare, "-rn", "true"], capture_output=True, check=False).returncode:
        pytest.skip("a network without interfaces cannot be made here")
    monkeypatch.delenv(URI)
    out, err = child(domain, unshare, "-rn").communicate()
    message, remedy = out.split("|")
    assert "interfaces" in message  # what this version of Cyclone DDS says
    wording(remedy)
    assert not err


class Watch:
    """The participants that another participant sees."""

    def __init__(self, domain: int) -> None:
        self.participant = DomainParticipant(domain)
        self._reader = BuiltinDataReader(self.participant, BuiltinTopicDcpsParticipant)
        self._news = WaitSet(self.participant)
        self._news.attach(ReadCondition(self._reader, SampleState.NotRead | ViewState.Any | InstanceState.Any))

    def until(self, is_so: Callable[[dict[str, DcpsParticipant]], bool]) -> dict[str, DcpsParticipant]:
        """Those that are there, by their names, once it is so."""
        there: dict[str, DcpsParticipant] = {}
        while True:
            for sample in self._reader.read(100):
                name = sample.qos[Policy.EntityName]
                if name is not None:
                    there[name.name] = sample
                is_gone = sample.sample_info.instance_state != InstanceState.Alive
                there = {key: one for key, one in there.items() if not (is_gone and one.key == sample.key)}
            if is_so(there):
                return there
            assert self._news.wait(duration(seconds=LOST_WITHIN_S)), f"nothing happens: {list(there)}"


def test_others_see_it_as_a_context_of_ros_until_it_leaves(domain: int) -> None:
    participant = Participant("scanner_driver", domain)
    watch = Watch(domain)
    seen = watch.until(lambda there: "scanner_driver" in there)["scanner_driver"]
    assert seen.key == participant.entity.guid
    assert seen.qos[Policy.Userdata] == Policy.Userdata(b"enclave=/;")
    participant.close()
    watch.until(lambda there: "scanner_driver" not in there)


def test_one_of_two_in_a_process_may_leave(domain: int) -> None:
    first, second = Participant("first", domain), Participant("second", domain)
    first.close()
    watch = Watch(domain)
    watch.until(lambda there: list(there) == ["second"])
    second.close()
    watch.until(lambda there: not there)


def test_participants_of_others_in_the_process_stay(domain: int) -> None:
    participant = Participant("ours", domain)
    other = DomainParticipant(domain)
    guid = other.guid
    participant.close()
    Participant("again", domain).close()
    assert other.guid == guid
    delete(other)


def test_the_configuration_of_the_process_stays_as_it_was(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    Participant("node", domain).close()
    assert os.environ[URI] == LOOPBACK
    monkeypatch.delenv(URI)
    Participant("node", domain).close()
    assert URI not in os.environ


def test_the_lease_is_one_second_unless_the_user_says_otherwise(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    def lease(uri: str) -> int:
        monkeypatch.setenv(URI, uri)
        participant = Participant("node", domain)
        lease_ns = participant.lease_ns
        participant.close()
        return lease_ns

    longer = LOOPBACK.replace("</Discovery>", "<LeaseDuration>7s</LeaseDuration></Discovery>")
    assert (lease(LOOPBACK), lease(longer)) == (duration(seconds=1), duration(seconds=7))
