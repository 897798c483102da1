"""Clients and servers, over DDS on the loopback interface."""

from __future__ import annotations

import asyncio
import os
import re
from collections.abc import Callable, Coroutine, Mapping
from typing import Any

import pytest
from cyclonedds.core import Policy, Qos
from cyclonedds.domain import DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

from scbm.nodes.buses.bus import Answered, BusError, Service
from scbm.nodes.buses.dds import dds_services
from scbm.nodes.buses.dds.dds_classes import message_class
from scbm.nodes.buses.dds.dds_services import ServiceClient, ServiceServer
from scbm.nodes.buses.dds.raw_samples import RawWriter, delete
from scbm.nodes.types.cdr import Message
from scbm.nodes.types.definitions import SET_BOOL, TRIGGER, MessageDefinition, Scalar
from scbm.nodes.types.type_hashes import type_hash
from support.loops import run
from support.ros_types import service_type
from support.wording import Wording

ADD = Service(
    "/calculator/add",
    service_type("example_interfaces/srv/AddTwoInts", {"a": "int64", "b": "int64"}, {"sum": "int64"}),
)
LATCH = Service("/latch", SET_BOOL)
SCAN = Service("/scan", TRIGGER)


def add(asked: Message) -> Mapping[str, Scalar]:
    return {"sum": asked.a + asked.b}


class Side:
    """One participant, with the callbacks of its services."""

    def __init__(self, participant: DomainParticipant) -> None:
        self._participant = participant
        self._loop = asyncio.get_running_loop()
        self.answers: list[Answered] = []
        self.complaints: list[str] = []
        self.peers: list[int] = []
        self.held: list[Callable[[], None]] = []
        self.done = 0
        self._is_holding = False
        self._changed = asyncio.Event()
        self._kept: list[ServiceClient | ServiceServer] = []

    def client(self, service: Service) -> ServiceClient:
        made = ServiceClient(self._participant, service, self.hand_over, self._receive, self._matched, self.warn)
        self._kept.append(made)
        return made

    def server(self, service: Service, answer: Callable[..., Mapping[str, Scalar]]) -> ServiceServer:
        made = ServiceServer(self._participant, service, self.hand_over, answer, self.warn)
        self._kept.append(made)
        return made

    def close(self) -> None:
        for service in self._kept:
            service.close()

    def hand_over(self, work: Callable[[], None]) -> None:
        self._loop.call_soon_threadsafe(self._do, work)

    def hold(self) -> None:
        """From now on nothing is done of what is handed over."""
        self._is_holding = True

    def _do(self, work: Callable[[], None]) -> None:
        if self._is_holding:
            self.held.append(work)
        else:
            work()
            self.done += 1
        self._changed.set()

    def _receive(self, answered: Answered) -> None:
        self.answers.append(answered)

    def _matched(self, count: int) -> None:
        self.peers.append(count)

    def warn(self, what: str) -> None:
        self.complaints.append(what)
        self._changed.set()

    async def until(self, is_so: Callable[[], bool]) -> None:
        """Waits until it is so, which only something can make so that is handed over or complained of."""
        while not is_so():
            self._changed.clear()
            await self._changed.wait()

    async def until_there(self, client: ServiceClient, count: int = 1) -> None:
        await self.until(lambda: client.peers == count)

    async def until_answers(self, count: int) -> None:
        await self.until(lambda: len(self.answers) >= count)

    async def until_complaints(self, count: int) -> None:
        await self.until(lambda: len(self.complaints) >= count)


RELIABLE = Qos(
    Policy.Reliability.Reliable(2_000_000_000),
    Policy.History.KeepAll,
    Policy.DataRepresentation(use_cdrv0_representation=True),
)


class Halves:
    """The endpoints of another's server or client, by hand."""

    def __init__(self, participant: DomainParticipant, service: Service, mark: str = "") -> None:
        self._participant = participant
        self._service = service
        self._name = service.name
        self._request = message_class(service.type.request, is_call=True)
        self._response = message_class(service.type.response, is_call=True)
        self._qos = Qos(Policy.Userdata(mark.encode()), base=RELIABLE) if mark else RELIABLE

    def like(self, mark: str) -> Halves:
        """Others of the same participant."""
        return Halves(self._participant, self._service, mark)

    def _topic(self, *, of_requests: bool) -> Topic[IdlStruct]:
        name = f"rq{self._name}Request" if of_requests else f"rr{self._name}Reply"
        return Topic(self._participant, name, self._request if of_requests else self._response)

    def reader(self, *, of_requests: bool) -> DataReader[Any]:
        return DataReader(self._participant, self._topic(of_requests=of_requests), self._qos)

    def writer(self, *, of_requests: bool) -> RawWriter:
        return RawWriter(self._participant, self._topic(of_requests=of_requests), self._qos)


def payload(definition: MessageDefinition, guid: int, seq: int, values: Mapping[str, Scalar]) -> bytes:
    """Return what cyclonedds makes of a request or a response, padded as in RTPS."""
    class_: Any = message_class(definition, is_call=True)
    sample = class_(**{"guid": guid, "seq": seq, **(values or {"structure_needs_at_least_one_member": 0})})
    data: bytes = sample.serialize(use_version_2=False)
    return data + bytes(-len(data) % 4)


class Cell:
    """Participants of one domain, that leave it at the end."""

    def __init__(self, domain: int) -> None:
        self._domain = domain
        self._participants: list[DomainParticipant] = []
        self._sides: list[Side] = []

    def _participant(self) -> DomainParticipant:
        self._participants.append(DomainParticipant(self._domain))
        return self._participants[-1]

    def side(self) -> Side:
        self._sides.append(Side(self._participant()))
        return self._sides[-1]

    def halves(self, service: Service, mark: str = "") -> Halves:
        return Halves(self._participant(), service, mark)

    def close(self) -> None:
        for side in self._sides:
            side.close()
        for participant in self._participants:
            delete(participant)


def checked_story(domain: int, story: Callable[[Cell], Coroutine[Any, Any, None]]) -> None:
    async def play() -> None:
        cell = Cell(domain)
        try:
            await story(cell)
        finally:
            cell.close()

    run(play())


def test_a_call_is_answered(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client = here.client(ADD)
        assert client.peers == 0
        server = there.server(ADD, add)
        await here.until_there(client)

        first, second = client.call({"a": 41, "b": 1}), client.call({"a": -1, "b": 1})
        await here.until_answers(2)

        assert first != second
        assert [(answer.call, answer.message.sum) for answer in here.answers] == [(first, 42), (second, 0)]
        assert here.answers[0].stamp_ns <= here.answers[1].stamp_ns
        assert here.peers == [1]
        assert here.complaints == there.complaints == []
        server.close()
        client.close()

    checked_story(domain, calls)


def test_fields_of_all_kinds_pass(domain: int) -> None:
    heard: list[Mapping[str, Scalar]] = []

    def answer(asked: Message) -> Mapping[str, Scalar]:
        heard.append(vars(asked))
        return {"success": False, "message": "klemmt — ü"}

    async def calls(cell: Cell) -> None:
        side = cell.side()
        client, scans = side.client(LATCH), side.client(SCAN)
        side.server(LATCH, answer)
        side.server(SCAN, answer)
        await side.until_there(client)
        await side.until_there(scans)

        client.call({"data": True})
        scans.call({})
        await side.until_answers(2)

        assert sorted(heard, key=len) == [{}, {"data": True}]
        assert [vars(answer.message) for answer in side.answers] == [{"success": False, "message": "klemmt — ü"}] * 2

    checked_story(domain, calls)


def test_fields_of_any_name_pass(domain: int) -> None:
    fields = dict.fromkeys(("class", "self", "serialize", "guid", "seq"), "string")
    odd = Service("/odd", service_type("some_srvs/srv/Odd", fields, fields))
    values = {name: f"<{name}>" for name in fields}

    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client = here.client(odd)
        there.server(odd, lambda asked: {name: f"{value}!" for name, value in vars(asked).items()})
        await here.until_there(client)

        call = client.call(values)
        await here.until_answers(1)

        assert here.answers[0].call == call
        assert vars(here.answers[0].message) == {name: f"{value}!" for name, value in values.items()}
        assert here.complaints == there.complaints == []

    checked_story(domain, calls)


@pytest.mark.longer
@pytest.mark.parametrize("in_flight", [50, 200])
def test_none_of_many_calls_is_lost(domain: int, in_flight: int) -> None:
    total = 1000

    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client = here.client(ADD)
        there.server(ADD, add)
        await here.until_there(client)

        wanted: dict[int, dict[str, Scalar]] = {}
        while len(here.answers) < total:
            while len(wanted) < min(total, len(here.answers) + in_flight):
                wanted[client.call({"a": len(wanted), "b": 1})] = {"sum": len(wanted) + 1}
            await here.until_answers(len(here.answers) + 1)

        assert {answer.call: vars(answer.message) for answer in here.answers} == wanted
        assert len(here.answers) == total
        assert here.complaints == there.complaints == []

    checked_story(domain, calls)


def test_each_client_hears_its_own_answers_alone(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        sides = [cell.side() for _ in range(3)]
        clients = [side.client(ADD) for side in sides]
        sides[0].server(ADD, add)
        for side, client in zip(sides, clients, strict=True):
            await side.until_there(client)

        for number, client in enumerate(clients):
            for index in range(20):
                client.call({"a": 100 * number, "b": index})
        for number, side in enumerate(sides):
            await side.until_answers(20)
            assert [vars(answer.message)["sum"] for answer in side.answers] == [
                100 * number + index for index in range(20)
            ]
            assert side.complaints == []

    checked_story(domain, calls)


def test_servers_come_and_go(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        here, there, elsewhere = cell.side(), cell.side(), cell.side()
        client = here.client(ADD)
        first = there.server(ADD, add)
        await here.until_there(client)
        second, third = elsewhere.server(ADD, add), elsewhere.server(ADD, add)
        await here.until_there(client, 3)
        names = client.server_names()
        assert len(names) == 3
        assert all(f"process {os.getpid()}" in name for name in names)
        second.close()
        await here.until_there(client, 2)
        first.close()
        third.close()
        await here.until_there(client, 0)
        assert here.peers[-1] == 0

    checked_story(domain, calls)


@pytest.mark.parametrize(("taker", "responder"), [("", ""), ("serviceid=1;", "serviceid=2;")])
def test_half_a_server_is_none(domain: int, taker: str, responder: str) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client = here.client(ADD)
        kept = cell.halves(ADD, taker).reader(of_requests=True), cell.halves(ADD, responder).writer(of_requests=False)
        await here.until(lambda: bool(client.pair.readers() and client.pair.writers()))
        whole = there.server(ADD, add)
        await here.until_there(client, 1)
        whole.close()
        await here.until_there(client, 0)

        assert here.peers == [1, 0]
        assert all(kept)

    checked_story(domain, calls)


def test_halves_of_one_participant_that_say_so_are_no_server(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client = here.client(ADD)
        one = cell.halves(ADD, "serviceid=1;")
        kept = one.reader(of_requests=True), one.like("serviceid=2;").writer(of_requests=False)
        await here.until(lambda: bool(client.pair.readers() and client.pair.writers()))
        whole = there.server(ADD, add)
        await here.until_there(client, 1)
        whole.close()
        await here.until_there(client, 0)

        assert here.peers == [1, 0]
        assert all(kept)

    checked_story(domain, calls)


def test_both_halves_say_to_whom_they_belong_as_rmw_cyclonedds_does(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client, server = here.client(ADD), there.server(ADD, add)
        await here.until_there(client)
        await there.until(lambda: bool(server.pair.readers() and server.pair.writers()))

        for pair, key in ((server.pair, "clientid"), (client.pair, "serviceid")):
            (reader,), (writer,) = pair.readers(), pair.writers()
            assert reader.identities[key] == writer.identities[key]
            hashes = {type_hash(half) for half in (ADD.type.request, ADD.type.response)}
            assert {reader.identities["typehash"], writer.identities["typehash"]} == hashes
            assert re.fullmatch(r"[0-9a-f]{1,2}(\.[0-9a-f]{1,2}){15}", reader.identities[key])

    checked_story(domain, calls)


def test_endpoints_lose_nothing_and_speak_as_ros_2_does(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        side = cell.side()
        for pair in (side.client(ADD).pair, side.server(ADD, add).pair):
            for endpoint in (pair.reader, pair.writer):
                qos = endpoint.get_qos()
                assert qos[Policy.History] == Policy.History.KeepAll
                assert isinstance(qos[Policy.Reliability], Policy.Reliability.Reliable)
                assert qos[Policy.Durability] == Policy.Durability.Volatile
                assert qos[Policy.DataRepresentation] == Policy.DataRepresentation(use_cdrv0_representation=True)
            assert not pair.writer.get_qos()[Policy.WriterDataLifecycle].autodispose

    checked_story(domain, calls)


def test_a_server_that_does_not_say_who_it_is_counts(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.halves(ADD)
        client = here.client(ADD)
        kept = there.reader(of_requests=True), there.writer(of_requests=False)
        await here.until_there(client)
        assert all(kept)

    checked_story(domain, calls)


class HandServer:
    """A server by hand: it says what a test wants it to."""

    def __init__(self, halves: Halves, service: Service) -> None:
        self._service = service.type
        self._reader, self._writer = halves.reader(of_requests=True), halves.writer(of_requests=False)

    async def guid(self, side: Side, client: ServiceClient) -> int:
        """That of the client, from the request that it has sent."""
        await side.until(lambda: bool(client.pair.readers()))
        taken = await asyncio.to_thread(self._reader.take_one, timeout=600_000_000_000)
        return int(taken.guid)

    def say(self, guid: int, seq: int, fields: Mapping[str, Scalar]) -> None:
        self._writer.write_payload(payload(self._service.response, guid, seq, fields))

    def say_bytes(self, data: bytes) -> None:
        self._writer.write_payload(data)


def test_a_second_response_to_a_call_is_dropped_and_complained_of(domain: int, wording: Wording) -> None:
    async def calls(cell: Cell) -> None:
        here = cell.side()
        client, server = here.client(ADD), HandServer(cell.halves(ADD), ADD)
        await here.until_there(client)
        call = client.call({"a": 1, "b": 1})
        guid = await server.guid(here, client)
        for total in (2, 3, 4):
            server.say(guid, call, {"sum": total})
        await here.until_complaints(2)

        assert [vars(answer.message) for answer in here.answers] == [{"sum": 2}]
        first, second = here.complaints
        assert first == second
        wording(first)

    checked_story(domain, calls)


def test_responses_to_calls_that_were_never_made_are_complained_of_once(domain: int, wording: Wording) -> None:
    async def calls(cell: Cell) -> None:
        here = cell.side()
        client, server = here.client(ADD), HandServer(cell.halves(ADD), ADD)
        await here.until_there(client)
        call = client.call({"a": 1, "b": 1})
        guid = await server.guid(here, client)
        for other in (call + 6, 0, -1):
            server.say(guid, other, {"sum": 0})
        server.say(guid, call, {"sum": 2})
        await here.until_answers(1)

        assert [vars(answer.message) for answer in here.answers] == [{"sum": 2}]
        (complaint,) = here.complaints
        assert str(call + 6) in complaint
        wording(complaint)

    checked_story(domain, calls)


def test_responses_of_others_are_dropped_without_a_word(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        here = cell.side()
        client, server = here.client(ADD), HandServer(cell.halves(ADD), ADD)
        await here.until_there(client)
        call = client.call({"a": 1, "b": 1})
        guid = await server.guid(here, client)
        server.say(guid ^ 1, call, {"sum": 99})
        server.say(guid, call, {"sum": 2})
        await here.until_answers(1)

        assert [vars(answer.message) for answer in here.answers] == [{"sum": 2}]
        assert here.complaints == []

    checked_story(domain, calls)


def test_a_response_that_is_no_text_is_complained_of_and_takes_no_other_with_it(domain: int, wording: Wording) -> None:
    async def calls(cell: Cell) -> None:
        here = cell.side()
        client, server = here.client(SCAN), HandServer(cell.halves(SCAN), SCAN)
        await here.until_there(client)
        call = client.call({})
        guid = await server.guid(here, client)
        right = payload(SCAN.type.response, guid, call, {"success": True, "message": "ab"})
        server.say_bytes(right.replace(b"ab", b"\xff\xfe"))
        server.say_bytes(right)
        await here.until_answers(1)

        assert [vars(answer.message) for answer in here.answers] == [{"success": True, "message": "ab"}]
        (complaint,) = here.complaints
        wording(complaint)

    checked_story(domain, calls)


def test_a_response_waits_for_the_reader_of_its_client(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dds_services, "READER_WAIT_S", 3600)

    async def calls(cell: Cell) -> None:
        there, client = cell.side(), cell.halves(ADD, "clientid=7.7;")
        served: list[Message] = []

        def answer(asked: Message) -> Mapping[str, Scalar]:
            served.append(asked)
            return add(asked)

        server = there.server(ADD, answer)
        writer = client.writer(of_requests=True)
        await there.until(lambda: bool(server.pair.writers()))
        others = cell.halves(ADD, "clientid=8.8;").reader(of_requests=False)
        await there.until(lambda: bool(server.pair.readers()))
        writer.write_payload(payload(ADD.type.request, 5, 1, {"a": 1, "b": 2}))
        await there.until(lambda: bool(served))
        before = there.done
        late = cell.halves(ADD, "clientid=9.9;").reader(of_requests=False)
        await there.until(lambda: there.done > before)

        reader = client.reader(of_requests=False)
        response = await asyncio.to_thread(reader.take_one, timeout=600_000_000_000)

        assert (response.guid, response.seq) == (5, 1)
        assert response.sum == 3
        assert there.complaints == []
        assert [len(other.take(N=9)) for other in (others, late)] == [1, 1]

    checked_story(domain, calls)


def test_a_response_whose_client_does_not_hear_is_complained_of(
    domain: int, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.setattr(dds_services, "READER_WAIT_S", 0)

    async def calls(cell: Cell) -> None:
        there, client = cell.side(), cell.halves(ADD, "clientid=7.7;")
        server = there.server(ADD, add)
        writer = client.writer(of_requests=True)
        await there.until(lambda: bool(server.pair.writers()))
        writer.write_payload(payload(ADD.type.request, 5, 1, {"a": 1, "b": 2}))
        await there.until_complaints(1)

        (complaint,) = there.complaints
        wording(complaint)

    checked_story(domain, calls)


def test_a_client_that_does_not_say_who_it_is_is_answered_at_once(domain: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(dds_services, "READER_WAIT_S", 3600)

    async def calls(cell: Cell) -> None:
        there, client = cell.side(), cell.halves(ADD)
        server = there.server(ADD, add)
        reader, writer = client.like("clientid=8.8;").reader(of_requests=False), client.writer(of_requests=True)
        await there.until(lambda: bool(server.pair.writers() and server.pair.readers()))
        writer.write_payload(payload(ADD.type.request, 5, 1, {"a": 1, "b": 2}))

        response = await asyncio.to_thread(reader.take_one, timeout=600_000_000_000)

        assert response.sum == 3

    checked_story(domain, calls)


def test_what_was_handed_over_before_a_client_was_closed_is_dropped(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client = here.client(ADD)
        there.server(ADD, add)
        await here.until_there(client)
        here.hold()
        client.call({"a": 1, "b": 1})
        await here.until(lambda: bool(here.held))
        client.close()
        for work in here.held:
            work()

        assert here.answers == []
        assert here.peers == [1]

    checked_story(domain, calls)


def test_an_answer_that_is_none_is_complained_of(domain: int, wording: Wording) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client = here.client(ADD)
        there.server(ADD, lambda _: {"sum": 2**63})
        await here.until_there(client)
        client.call({"a": 1, "b": 1})
        await there.until_complaints(1)

        (complaint,) = there.complaints
        wording(complaint)
        assert here.answers == []

    checked_story(domain, calls)


def test_a_call_with_wrong_fields_is_refused_and_not_sent(domain: int, wording: Wording) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client = here.client(ADD)
        there.server(ADD, add)
        await here.until_there(client)
        for wrong in ({"a": 1, "b": 1.5}, {"a": 1, "b": 1, "c": 1}):
            with wording.raises(BusError):
                client.call(wrong)
        call = client.call({"a": 1, "b": 1})
        await here.until_answers(1)

        assert [answer.call for answer in here.answers] == [call]

    checked_story(domain, calls)


def test_a_closed_client_hears_nothing_more(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client, other = here.client(ADD), here.client(LATCH)

        def answer(fields: Message) -> Mapping[str, Scalar]:
            client.close()
            return add(fields)

        there.server(ADD, answer)
        there.server(LATCH, lambda _: {"success": True, "message": ""})
        await here.until_there(client)
        await here.until_there(other)
        client.call({"a": 1, "b": 1})
        other.call({"data": True})
        await here.until_answers(1)

        assert [vars(answer.message) for answer in here.answers] == [{"success": True, "message": ""}]
        with pytest.raises(BusError, match="`rq/calculator/addRequest`"):
            client.call({"a": 1, "b": 1})

    checked_story(domain, calls)


def test_a_closed_server_is_asked_nothing_more(domain: int, wording: Wording) -> None:
    async def calls(cell: Cell) -> None:
        here, there = cell.side(), cell.side()
        client = here.client(ADD)
        asked: list[Mapping[str, Scalar]] = []

        def answer(request: Message) -> Mapping[str, Scalar]:
            asked.append(vars(request))
            server.close()
            return add(request)

        server = there.server(ADD, answer)
        await here.until_there(client)
        for _ in range(5):
            client.call({"a": 1, "b": 1})
        await here.until_there(client, 0)

        assert asked == [{"a": 1, "b": 1}]
        (complaint,) = there.complaints
        wording(complaint.partition(": ")[0])  # the rest is what this version of Cyclone DDS says

    checked_story(domain, calls)


def test_a_participant_that_has_left_is_a_bus_error(domain: int) -> None:
    async def calls(cell: Cell) -> None:
        here = cell.side()
        cell.close()
        with pytest.raises(BusError, match=r"`rq/calculator/addRequest` .*`rr/calculator/addReply`"):
            here.client(ADD)

    checked_story(domain, calls)
