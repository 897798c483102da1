"""Requests as calls of services: each once, to the right service, and its response as the reply."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from time import monotonic_ns

import pytest

from scbm.model import Reference, Resource, Value
from scbm.nodes.bindings.ros_binding import CallChoice, Interval, RosBinding, ServiceCall
from scbm.nodes.buses.bus import Answered, BusError, Client, Service, UnmatchedKind
from scbm.nodes.buses.loopback import LoopbackBus, LoopbackHub
from scbm.nodes.links.link import Correlation, LinkContext
from scbm.nodes.links.service_link import ServiceLink
from scbm.nodes.types.cdr import Message
from scbm.nodes.types.definitions import SET_BOOL, TRIGGER, Scalar, ServiceDefinition
from support.hearing import Heard
from support.loops import run
from support.ros_types import SUCCESS, path_to, reading, service_type, trigger
from support.wording import Wording

SCAN = trigger("/scan")
ADD = service_type("some/srv/Add", {"a": "int64", "b": "float64"}, {"sum": "float64", "code": "int8"})
ADDING = ServiceCall(
    "/add",
    ADD,
    ((path_to(ADD.request, "a"), Reference("shelf")), (path_to(ADD.request, "b"), Reference("shelf"))),
    ((path_to(ADD.response, "code"), 0),),
    (
        reading("code", ADD.response, "code"),
        reading("zone", ADD.response, "sum", (("near", Interval(None, 1.5)), ("far", Interval(1.5, 9.0)))),
    ),
)
DATA = path_to(SET_BOOL.request)
LIGHT = CallChoice(
    "light",
    (
        ("on", ServiceCall("/light", SET_BOOL, ((DATA, True),), SUCCESS)),
        ("off", ServiceCall("/light", SET_BOOL, ((DATA, False),), SUCCESS)),
        ("blink", trigger("/blink")),
    ),
)


def resource(requests: ServiceCall | CallChoice) -> Resource:
    return Resource("scanner", ("light", "shelf"), ("zone", "code"), binding=RosBinding({}, requests))


@dataclass
class Driver:
    """Serves services, and keeps what they are asked."""

    hub: LoopbackHub
    asked: list[tuple[str, Mapping[str, Scalar]]] = field(default_factory=list)

    def serve(self, name: str, kind: ServiceDefinition = TRIGGER, **response: Scalar) -> LoopbackBus:
        bus = self.hub.join("driver")

        def answer(asked: Message) -> Mapping[str, Scalar]:
            self.asked.append((name, vars(asked)))
            return {"success": True, "message": "", **response} if not response or "success" in response else response

        bus.serve(Service(name, kind), answer)
        return bus


@dataclass
class Harness:
    """A link, its callbacks, and the driver behind it."""

    link: ServiceLink
    heard: Heard
    driver: Driver
    complaints: list[str]

    @staticmethod
    def of(requests: ServiceCall | CallChoice, prepare: Callable[[Driver], object] = lambda _: None) -> Harness:
        hub = LoopbackHub()
        driver, heard, complaints = Driver(hub), Heard(), list[str]()
        prepare(driver)
        bus = hub.join("controller")
        link = ServiceLink(LinkContext(bus, resource(requests), heard, complaints.append, monotonic_ns))
        return Harness(link, heard, driver, complaints)

    def send(self, number: int, **values: Value) -> None:
        self.link.send(Correlation("run", number), tuple(values.items()))

    def cancel(self, number: int) -> None:
        self.link.cancel(Correlation("run", number))

    async def answered(self, count: int) -> None:
        await self.heard.until(lambda: len(self.heard.replies) >= count)


@pytest.mark.parametrize("succeeded", [True, False])
def test_the_response_to_a_call_is_the_reply_to_its_request(succeeded: bool) -> None:  # noqa: FBT001 - a case
    async def scene() -> None:
        harness = Harness.of(SCAN, lambda driver: driver.serve("/scan", success=succeeded))
        before_ns = monotonic_ns()
        harness.send(7)
        await harness.answered(1)
        ((name, reply),) = harness.heard.replies
        assert (name, reply.request, reply.succeeded, reply.measured) == (
            "scanner",
            Correlation("run", 7),
            succeeded,
            (),
        )
        assert before_ns <= reply.stamp_ns <= monotonic_ns()
        assert harness.driver.asked == [("/scan", {})]

    run(scene())


def test_the_value_of_a_variable_decides_which_service_is_called_and_with_what() -> None:
    async def scene() -> None:
        def prepare(driver: Driver) -> None:
            driver.serve("/light", SET_BOOL)
            driver.serve("/blink")

        harness = Harness.of(LIGHT, prepare)
        for number, light in enumerate(("off", "blink", "on")):
            harness.send(number, light=light, shelf=3)
            await harness.answered(number + 1)
        assert harness.driver.asked == [("/light", {"data": False}), ("/blink", {}), ("/light", {"data": True})]
        assert harness.heard.numbers() == [(0, True), (1, True), (2, True)]

    run(scene())


def test_fields_get_the_values_that_the_request_carries_as_their_types_want_them() -> None:
    async def scene() -> None:
        harness = Harness.of(ADDING, lambda driver: driver.serve("/add", ADD, sum=1.5, code=0))
        harness.send(1, light="on", shelf=3)
        await harness.answered(1)
        ((_, fields),) = harness.driver.asked
        assert fields == {"a": 3, "b": 3.0}
        assert [type(value) for value in fields.values()] == [int, float]

    run(scene())


@pytest.mark.parametrize(("total", "zone"), [(1.25, "near"), (1.5, "far"), (9.0, "9.0")])
def test_a_response_that_says_succeeded_measures(total: float, zone: str) -> None:
    async def scene() -> None:
        harness = Harness.of(ADDING, lambda driver: driver.serve("/add", ADD, sum=total, code=0))
        harness.send(1, shelf=3)
        await harness.answered(1)
        reply = harness.heard.replies[0][1]
        assert (reply.succeeded, reply.measured) == (True, (("code", 0), ("zone", zone)))

    run(scene())


def test_a_response_that_says_failed_measures_nothing() -> None:
    async def scene() -> None:
        harness = Harness.of(ADDING, lambda driver: driver.serve("/add", ADD, sum=0.5, code=1))
        harness.send(1, shelf=3)
        await harness.answered(1)
        reply = harness.heard.replies[0][1]
        assert (reply.succeeded, reply.measured) == (False, ())

    run(scene())


def test_a_response_of_which_nothing_is_asked_says_succeeded() -> None:
    async def scene() -> None:
        empty = service_type("std_srvs/srv/Empty")
        hub, heard = LoopbackHub(), Heard()
        hub.join("driver").serve(Service("/reset", empty), lambda _: {})
        link = ServiceLink(
            LinkContext(hub.join("controller"), resource(ServiceCall("/reset", empty)), heard, print, monotonic_ns)
        )
        link.send(Correlation("run", 1), ())
        await heard.until(lambda: bool(heard.replies))
        assert heard.numbers() == [(1, True)]

    run(scene())


def test_requests_wait_for_their_service_in_their_order_and_those_that_are_cancelled_are_forgotten() -> None:
    async def scene() -> None:
        harness = Harness.of(SCAN)
        for number in (1, 2, 3):
            harness.send(number)
        harness.cancel(2)
        assert not harness.link.is_there
        harness.driver.serve("/scan")
        await harness.answered(2)
        assert harness.heard.numbers() == [(1, True), (3, True)]
        assert len(harness.driver.asked) == 2

    run(scene())


def test_a_service_with_two_servers_is_not_called_until_one_of_them_leaves(wording: Wording) -> None:
    async def scene() -> None:
        harness = Harness.of(SCAN, lambda driver: driver.serve("/scan"))
        await harness.heard.until(lambda: len(harness.heard.presence) == 1)
        assert harness.link.is_there
        second = harness.driver.serve("/scan")
        await harness.heard.until(lambda: len(harness.heard.presence) == 2)
        harness.send(1)
        assert (harness.link.is_there, harness.link.missing) == (False, ())
        crowded = harness.link.why_unmatched()
        assert crowded is not None
        assert crowded.kind is UnmatchedKind.CROWDED
        wording(crowded.why)
        assert harness.driver.asked == []
        await second.close()
        await harness.answered(1)
        assert len(harness.driver.asked) == 1

    run(scene())


def test_a_request_waits_for_no_service_but_its_own() -> None:
    async def scene() -> None:
        harness = Harness.of(LIGHT, lambda driver: driver.serve("/blink"))
        harness.send(1, light="on")
        harness.send(2, light="blink")
        await harness.answered(1)
        assert harness.heard.numbers() == [(2, True)]
        assert not harness.link.is_there
        harness.driver.serve("/light", SET_BOOL)
        await harness.answered(2)
        assert harness.heard.numbers() == [(2, True), (1, True)]

    run(scene())


def test_a_cancelled_call_goes_on_and_its_response_is_dropped() -> None:
    async def scene() -> None:
        harness = Harness.of(SCAN, lambda driver: driver.serve("/scan"))
        harness.send(1)
        harness.cancel(1)
        harness.send(2)
        await harness.answered(1)
        assert harness.heard.numbers() == [(2, True)]
        assert len(harness.driver.asked) == 2

    run(scene())


def test_a_call_to_a_server_that_is_lost_is_not_repeated_and_has_no_reply() -> None:
    async def scene() -> None:
        harness = Harness.of(SCAN)
        server = harness.driver.serve("/scan")
        await harness.heard.until(lambda: harness.heard.presence == [("scanner", True)])
        harness.send(1)
        await server.close()  # the call is still on its way
        harness.send(2)
        await harness.heard.until(lambda: harness.heard.presence[1:] == [("scanner", False)])
        harness.driver.serve("/scan")
        await harness.answered(1)
        assert harness.heard.numbers() == [(2, True)]
        assert len(harness.driver.asked) == 1

    run(scene())


def test_requests_of_two_runs_with_one_number_are_two() -> None:
    async def scene() -> None:
        harness = Harness.of(SCAN)
        for name in ("first", "second"):
            harness.link.send(Correlation(name, 1), ())
        harness.link.cancel(Correlation("first", 1))
        harness.driver.serve("/scan")
        await harness.answered(1)
        assert [reply.request for _, reply in harness.heard.replies] == [Correlation("second", 1)]

    run(scene())


def test_of_two_calls_with_one_number_only_the_one_that_is_meant_is_cancelled() -> None:
    async def scene() -> None:
        harness = Harness.of(SCAN, lambda driver: driver.serve("/scan"))
        for name in ("first", "second"):
            harness.link.send(Correlation(name, 1), ())
        harness.link.cancel(Correlation("first", 1))
        await harness.answered(1)
        assert [reply.request for _, reply in harness.heard.replies] == [Correlation("second", 1)]

    run(scene())


def test_a_second_response_to_one_call_is_dropped() -> None:
    async def scene() -> None:
        hub, heard = LoopbackHub(), Heard()
        hub.join("driver").serve(Service("/scan", TRIGGER), lambda _: {"success": True, "message": ""})
        bus = Repeating(hub, "controller", asyncio.get_running_loop())
        link = ServiceLink(LinkContext(bus, resource(SCAN), heard, print, monotonic_ns))
        for number in (1, 2):
            link.send(Correlation("run", number), ())
        await heard.until(lambda: len(heard.replies) >= 2)
        assert heard.numbers() == [(1, True), (2, True)]

    run(scene())


class Repeating(LoopbackBus):
    """A bus that gives each answer twice, as if two servers had answered."""

    def client(  # type: ignore[override] # what the protocol says of it is enough here
        self, service: Service, receive: Callable[[Answered], None], matched: Callable[[int], None] | None = None
    ) -> Client:
        def twice(answered: Answered) -> None:
            receive(answered)
            receive(answered)

        return super().client(service, twice, matched)


def test_a_request_with_a_value_that_no_service_is_bound_to_has_failed_and_nobody_is_called() -> None:
    async def scene() -> None:
        def prepare(driver: Driver) -> None:
            driver.serve("/light", SET_BOOL)
            driver.serve("/blink")

        harness = Harness.of(LIGHT, prepare)
        before_ns = monotonic_ns()
        harness.send(1, light="none")
        assert harness.heard.replies == []  # not in the midst of sending
        await harness.answered(1)
        ((_, reply),) = harness.heard.replies
        assert (reply.request.number, reply.succeeded, reply.measured) == (1, False, ())
        assert before_ns <= reply.stamp_ns <= monotonic_ns()
        assert harness.driver.asked == []

    run(scene())


def test_the_resource_is_there_while_all_of_its_services_are() -> None:
    async def scene() -> None:
        harness = Harness.of(LIGHT)
        harness.driver.serve("/blink")
        light = harness.driver.serve("/light", SET_BOOL)
        await harness.heard.until(lambda: bool(harness.heard.presence))
        seen = [harness.link.is_there]
        await light.close()
        await harness.heard.until(lambda: len(harness.heard.presence) == 2)
        assert [*seen, harness.link.is_there] == [True, False]
        assert harness.heard.presence == [("scanner", True), ("scanner", False)]

    run(scene())


def test_a_resource_that_was_there_before_is_reported_too() -> None:
    async def scene() -> None:
        harness = Harness.of(SCAN, lambda driver: driver.serve("/scan"))
        assert harness.link.is_there
        await harness.heard.until(lambda: harness.heard.presence == [("scanner", True)])

    run(scene())


class Refusing:
    """A client without a server, then of a server that does not take the first call."""

    peers = 0

    def __init__(self) -> None:
        self.calls = 0

    def call(self, _: Mapping[str, Scalar]) -> int:
        self.calls += 1
        if self.calls == 1:
            raise BusError("full")
        return self.calls


def test_a_call_that_is_not_taken_keeps_none_of_those_that_wait_behind_it(
    monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    client = Refusing()
    opened: list[Callable[[int], None]] = []

    def client_that_refuses(_: LoopbackBus, __: Service, ___: object, matched: Callable[[int], None]) -> Refusing:
        opened.append(matched)
        return client

    monkeypatch.setattr(LoopbackBus, "client", client_that_refuses)

    async def scene() -> None:
        harness = Harness.of(SCAN)
        for number in (1, 2, 3):
            harness.send(number)
        assert client.calls == 0
        client.peers = 1
        opened[0](1)
        assert client.calls == 3
        (complaint,) = harness.complaints
        wording(complaint)
        assert harness.heard.presence == [("scanner", True)]

    run(scene())


def test_a_request_that_nobody_can_carry_out_fails_by_the_clock_of_the_bus() -> None:
    async def scene() -> None:
        heard = Heard()
        link = ServiceLink(LinkContext(LoopbackHub().join("controller"), resource(LIGHT), heard, print, lambda: 7))
        link.send(Correlation("run", 1), (("light", "none"),))
        await heard.until(lambda: bool(heard.replies))
        assert heard.replies[0][1].stamp_ns == 7

    run(scene())


def test_why_nobody_is_there_is_reported_for_each_service_that_is_missing() -> None:
    async def scene() -> None:
        harness = Harness.of(LIGHT)
        assert harness.link.why_unmatched() is None
        harness.driver.serve("/light", TRIGGER)
        harness.driver.serve("/blink", SET_BOOL)
        body = harness.link.why_unmatched()
        assert body is not None
        assert all(word in body.why for word in ("`/light`", "`/blink`", "; "))
        harness.driver.serve("/blink")
        body = harness.link.why_unmatched()
        assert body is not None
        assert "`/light`" in body.why
        assert "`/blink`" not in body.why

    run(scene())


class Doubtful(LoopbackBus):
    """A bus whose servers may not understand calls."""

    def client(  # type: ignore[override] # what the protocol says of it is enough here
        self, service: Service, receive: Callable[[Answered], None], matched: Callable[[int], None] | None = None
    ) -> Client:
        made = super().client(service, receive, matched)
        made.why_doubtful = lambda: "perhaps"  # type: ignore[assignment, method-assign] # as another vendor
        return made


@pytest.mark.parametrize("is_answered", [True, False])
def test_the_first_call_that_is_cancelled_without_any_response_is_reported(is_answered: bool) -> None:  # noqa: FBT001 - a case
    async def scene() -> None:
        hub, heard, complaints = LoopbackHub(), Heard(), list[str]()
        hub.join("driver").serve(Service("/scan", TRIGGER), lambda _: {"success": True, "message": ""})
        bus = Doubtful(hub, "controller", asyncio.get_running_loop())
        link = ServiceLink(LinkContext(bus, resource(SCAN), heard, complaints.append, monotonic_ns))
        if is_answered:
            link.send(Correlation("run", 1), ())
            await heard.until(lambda: bool(heard.replies))
        for number in (2, 3):
            link.send(Correlation("run", number), ())
            link.cancel(Correlation("run", number))
        assert complaints == ([] if is_answered else ["request 2 to `scanner` got no response: perhaps"])

    run(scene())
