"""Drivers through rclpy, next to a fake of it (`support.fake_rclpy`): what is asked of rclpy, not what it does."""

from __future__ import annotations

import sys
from collections.abc import Awaitable, Callable, Iterator
from pathlib import Path
from subprocess import run as run_process
from threading import get_ident
from time import monotonic_ns
from types import SimpleNamespace
from typing import Any, TypeAlias

import pytest

from scbm.model import Resource
from scbm.nodes.bindings.ros_binding import MeasuredTopic, RosBinding
from scbm.nodes.buses.bus import MISMATCHES, Answered, BusError, Received, Service, Topic
from scbm.nodes.buses.rclpy_bus import RclpyBus, open_ros2
from scbm.nodes.links.measured_topics import MeasuredTopics
from scbm.nodes.types.definitions import (
    BOOL,
    FLOAT64,
    SET_BOOL,
    STRING,
    TRIGGER,
    FieldShape,
    ListShape,
    MessageDefinition,
    Primitive,
)
from support import loops
from support.fake_rclpy import Enums, Profile, Rclpy, endpoint_info, structure
from support.hearing import Heard
from support.kept import Kept
from support.loops import GUARD_S
from support.ros_types import reading, service_type
from support.wording import Wording

TALK, DISTANCE = Topic("/talk"), Topic("/distance", FLOAT64)
LIGHT = Service("/light", SET_BOOL)
RESULT = {"success": "boolean", "message": "string"}
TYPES = {
    "std_msgs.msg.String": structure(data="string"),
    "std_msgs.msg.Float64": structure(data="double"),
    "std_srvs.srv.Trigger": SimpleNamespace(Request=structure(), Response=structure(**RESULT)),
    "std_srvs.srv.SetBool": SimpleNamespace(Request=structure(data="boolean"), Response=structure(**RESULT)),
}
KEEP_ALL, RELIABLE = Enums.History.KEEP_ALL, Enums.Reliability.RELIABLE
BEST_EFFORT, VOLATILE = Enums.Reliability.BEST_EFFORT, Enums.Durability.VOLATILE

Play: TypeAlias = Callable[[RclpyBus], Awaitable[None]]


@pytest.fixture
def rclpy(monkeypatch: pytest.MonkeyPatch) -> Rclpy:
    fake = Rclpy()
    fake.install(monkeypatch, TYPES)
    return fake


@pytest.fixture
def scene() -> Iterator[Callable[[Play], None]]:
    """Plays with a bus that has nothing to warn of, and closes it."""
    complaints: list[str] = []

    def play_it(play: Play) -> None:
        async def scenario() -> None:
            bus = open_ros2("scbm_controller_drivers", 7, complaints.append)
            try:
                await play(bus)
            finally:
                await bus.close()

        loops.run(scenario())

    yield play_it
    assert complaints == []


def _ignore(_: object) -> None:
    """What comes does not matter here."""


# topics


def test_messages_come_on_the_loop_stamped_where_they_came(rclpy: Rclpy, scene: Callable[[Play], None]) -> None:
    received: list[Received] = []
    threads: list[int] = []

    async def play(bus: RclpyBus) -> None:
        kept = Kept[Received]()

        def receive(what: Received) -> None:
            threads.append(get_ident())
            kept(what)

        bus.subscribe(DISTANCE, receive)
        before_ns = monotonic_ns()
        rclpy.message("/distance", 0.25)
        rclpy.message("/distance", 0.5)
        received.extend(await kept.first(2))
        assert before_ns <= received[0].stamp_ns <= received[1].stamp_ns <= monotonic_ns()
        assert threads == [get_ident()] * 2

    scene(play)
    assert [(came.message.data, came.source) for came in received] == [(0.25, 0), (0.5, 0)]
    assert len(set(rclpy.threads)) == 1
    assert rclpy.threads[0] not in threads


def test_a_message_is_stamped_before_the_loop_comes_to_it(rclpy: Rclpy, scene: Callable[[Play], None]) -> None:
    async def play(bus: RclpyBus) -> None:
        kept = Kept[Received]()
        bus.subscribe(TALK, kept)
        rclpy.message("/talk", "hello")
        rclpy.did()
        busy_until_ns = monotonic_ns()
        (received,) = await kept.first(1)
        assert received.stamp_ns <= busy_until_ns

    scene(play)


def test_what_is_published_is_a_message_of_ros(rclpy: Rclpy, scene: Callable[[Play], None]) -> None:
    async def play(bus: RclpyBus) -> None:
        bus.publisher(TALK).publish({"data": "hello"})

    scene(play)
    (sent,) = rclpy.endpoints["/talk"].sent
    assert type(sent) is TYPES["std_msgs.msg.String"]
    assert sent.data == "hello"


@pytest.mark.parametrize("is_best_effort", [False, True])
def test_topics_keep_all_and_are_as_reliable_as_declared(
    rclpy: Rclpy, scene: Callable[[Play], None], *, is_best_effort: bool
) -> None:
    async def play(bus: RclpyBus) -> None:
        bus.publisher(Topic("/sent", is_best_effort=is_best_effort))
        bus.subscribe(Topic("/heard", is_best_effort=is_best_effort), _ignore)
        bus.client(LIGHT, _ignore)

    scene(play)
    events = Profile(KEEP_ALL, BEST_EFFORT if is_best_effort else RELIABLE, VOLATILE)
    assert [rclpy.endpoints[name].qos for name in ("/sent", "/heard")] == [events, events]
    assert rclpy.endpoints["/light"].qos == Profile(KEEP_ALL, RELIABLE, VOLATILE)


@pytest.mark.slow
def test_each_end_learns_how_many_are_there_whenever_that_changes(rclpy: Rclpy, scene: Callable[[Play], None]) -> None:
    async def play(bus: RclpyBus) -> None:
        changes = {name: Kept[int]() for name in ("/talk", "/distance", "/light")}
        ends = (
            bus.publisher(TALK, changes["/talk"]),
            bus.subscribe(DISTANCE, _ignore, changes["/distance"]),
            bus.client(LIGHT, _ignore, changes["/light"]),
        )
        assert [end.peers for end in ends] == [0, 0, 0]
        for name, kept in changes.items():
            rclpy.endpoints[name].others = 1
            await kept.ends_with(1)
        assert [end.peers for end in ends] == [1, 1, 1]
        for name, kept in changes.items():
            rclpy.endpoints[name].others = 0
            await kept.ends_with(0)
        assert [kept.all for kept in changes.values()] == [[1, 0]] * 3

    scene(play)


def test_a_measured_topic_of_a_binding_is_heard(rclpy: Rclpy, scene: Callable[[Play], None]) -> None:
    async def play(bus: RclpyBus) -> None:
        heard = Heard()
        measured = MeasuredTopic("/zone", STRING, reading("zone"), is_best_effort=True)
        topics = MeasuredTopics(
            bus, Resource("scanner", (), ("zone",), binding=RosBinding({}, None, (measured,))), heard
        )
        rclpy.endpoints["/zone"].others = 1
        await heard.until(lambda: heard.presence == [("scanner", True)])
        rclpy.message("/zone", "near")
        await heard.until(lambda: bool(heard.values))
        assert topics.is_there
        assert heard.values[0][1].values == (("zone", "near"),)

    scene(play)
    assert rclpy.endpoints["/zone"].qos.reliability is BEST_EFFORT


# services


def test_calls_are_answered_once_each_whatever_their_order(rclpy: Rclpy, scene: Callable[[Play], None]) -> None:
    async def play(bus: RclpyBus) -> None:
        answers = Kept[Answered]()
        client = bus.client(LIGHT, answers)
        on, off = client.call({"data": True}), client.call({"data": False})
        assert on != off
        light = rclpy.endpoints["/light"]
        assert [sent.data for sent in light.sent] == [True, False]
        assert all(type(sent) is light.type.Request for sent in light.sent)
        first, second = light.futures
        respond = light.type.Response
        before_ns = monotonic_ns()
        rclpy.do(lambda: second.answer(respond(success=False, message="dark")))
        rclpy.do(lambda: first.answer(respond(success=True, message="")))
        answered = await answers.first(2)
        assert [(answer.call, answer.message.success, answer.message.message) for answer in answered] == [
            (off, False, "dark"),
            (on, True, ""),
        ]
        assert before_ns <= answered[0].stamp_ns <= answered[1].stamp_ns <= monotonic_ns()

    scene(play)


def test_a_type_that_the_user_has_built_is_found_by_its_name(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    fake = Rclpy()
    fields = {"shelf": "uint8", "gentle": "boolean", "force": "float", "way": "double", "where": "string"}
    pick = SimpleNamespace(Request=structure(**fields), Response=structure())
    fake.install(monkeypatch, {"picker_msgs.srv.Pick": pick})
    kinds = ("uint8", "bool", "float32", "float64", "string")
    type_ = service_type("picker_msgs/srv/Pick", dict(zip(fields, kinds, strict=True)))

    async def scenario() -> None:
        bus = open_ros2("scbm", 0, _ignore)
        client = bus.client(Service("/pick", type_), _ignore)
        client.call({"shelf": 3, "gentle": True, "force": 0.5, "way": 1.0, "where": "left"})
        with wording.raises(BusError):
            client.call({"shelf": "3", "gentle": True, "force": 0.5, "way": 1.0, "where": "left"})
        await bus.close()

    loops.run(scenario())
    assert [sent.shelf for sent in fake.endpoints["/pick"].sent] == [3]


def test_lists_of_bytes_and_numbers_become_what_rclpy_takes(monkeypatch: pytest.MonkeyPatch) -> None:
    fake, sent = Rclpy(), SimpleNamespace
    fields: dict[str, FieldShape] = {
        "id": ListShape(Primitive("uint8"), 3, is_array=True),
        "levels": ListShape(Primitive("byte")),
        "level": Primitive("byte"),
        "angles": ListShape(Primitive("float64"), 2),
    }
    made: list[object] = []

    class Odd:
        def __init__(self) -> None:
            made.append(self)

        @classmethod
        def get_fields_and_field_types(cls) -> dict[str, str]:
            return {"id": "uint8[3]", "levels": "sequence<octet>", "level": "octet", "angles": "sequence<double, 2>"}

    fake.install(monkeypatch, {"odd_msgs.msg.Odd": Odd})

    async def scenario() -> None:
        bus = open_ros2("scbm", 0, _ignore)
        topic = Topic("/odd", MessageDefinition("odd_msgs/msg/Odd", tuple(fields.items())))
        bus.publisher(topic).publish({"id": [1, 2, 3], "levels": b"\1\2", "level": 7, "angles": [0.5]})
        await bus.close()

    loops.run(scenario())
    (odd,) = made
    assert sent(**vars(odd)) == sent(id=[1, 2, 3], levels=[b"\1", b"\2"], level=b"\7", angles=[0.5])


# what is wrong


@pytest.mark.parametrize(
    "make",
    [
        lambda bus: bus.client(Service("/pick", service_type("picker_msgs/srv/Pick")), _ignore),
        lambda bus: bus.client(Service("/pick", service_type("std_srvs/srv/Pick")), _ignore),
        lambda bus: bus.subscribe(Topic("/on", BOOL), _ignore),
        lambda bus: bus.client(Service("/x", service_type("std_srvs/srv/Trigger", {}, {"success": "bool"})), _ignore),
        lambda bus: bus.client(Service("/x", service_type(SET_BOOL.name, {"data": "int8"})), _ignore),
        lambda bus: bus.publisher(Topic("/a__b")),
    ],
    ids=["package", "service type", "message type", "response field", "request field", "name"],
)
def test_what_this_ros_does_not_have_is_reported(
    rclpy: Rclpy, scene: Callable[[Play], None], make: Callable[[RclpyBus], object], wording: Wording
) -> None:
    async def play(bus: RclpyBus) -> None:
        with wording.raises(BusError) as raised:
            make(bus)
        assert raised.value.where == "rclpy"

    scene(play)
    assert rclpy.endpoints == {}


def test_what_rclpy_cannot_send_is_reported_without_the_place_in_its_source(
    rclpy: Rclpy, scene: Callable[[Play], None], wording: Wording
) -> None:
    async def play(bus: RclpyBus) -> None:
        publisher = bus.publisher(TALK)
        rclpy.endpoints["/talk"].others = -1
        with wording.raises(BusError):
            publisher.publish({"data": "hello"})

    scene(play)


@pytest.mark.parametrize(
    "ask",
    [
        lambda bus: bus.subscribe(TALK, _ignore, left=_ignore),
        lambda bus: bus.serve(LIGHT, dict),
    ],
    ids=["who left", "served"],
)
def test_what_rclpy_is_not_for_is_refused(
    rclpy: Rclpy, scene: Callable[[Play], None], ask: Callable[[RclpyBus], object]
) -> None:
    async def play(bus: RclpyBus) -> None:
        with pytest.raises(ValueError, match="rclpy"):
            ask(bus)

    scene(play)
    assert rclpy.endpoints == {}


@pytest.mark.parametrize(
    ("what", "is_mismatch"),
    [
        (Topic("/talk"), True),
        (Topic("/weak"), True),
        (Topic("/weak", is_best_effort=True), False),
        (Topic("/fine"), False),
        (Topic("/unmatched"), False),
        (LIGHT, True),
        (Service("/scan", TRIGGER), False),
        (Service("/unmatched", TRIGGER), False),
    ],
    ids=lambda value: value.name if isinstance(value, Topic | Service) else None,
)
def test_why_a_driver_is_not_heard_is_reported(
    rclpy: Rclpy, scene: Callable[[Play], None], what: Topic | Service, *, is_mismatch: bool, wording: Wording
) -> None:
    text = "std_msgs/msg/String"
    rclpy.publishers = [
        endpoint_info("/talk", "std_msgs/msg/Bool"),
        endpoint_info("/weak", text, is_best_effort=True),
        endpoint_info("/fine", text),
    ]
    rclpy.services = [("/light", ["std_srvs/srv/SetBool", "std_srvs/srv/Trigger"]), ("/scan", ["std_srvs/srv/Trigger"])]

    async def play(bus: RclpyBus) -> None:
        if isinstance(what, Topic):
            bus.subscribe(what, _ignore)
        else:
            bus.client(what, _ignore)
        unmatched = bus.why_unmatched(what)
        assert (unmatched is not None and unmatched.kind in MISMATCHES) == is_mismatch
        if unmatched is not None:
            wording(unmatched.why)

    scene(play)


def test_who_publishes_best_effort_hinders_no_publisher_of_ours(
    rclpy: Rclpy, scene: Callable[[Play], None], wording: Wording
) -> None:
    rclpy.publishers = [endpoint_info("/talk", "std_msgs/msg/Bool", is_best_effort=True)]
    rclpy.subscriptions = [endpoint_info("/talk", "std_msgs/msg/String", is_best_effort=True)]

    async def play(bus: RclpyBus) -> None:
        bus.publisher(TALK)
        assert bus.why_unmatched(TALK) is None
        rclpy.subscriptions = [endpoint_info("/talk", "std_msgs/msg/Int64")]
        unmatched = bus.why_unmatched(TALK)
        assert unmatched is not None
        assert unmatched.kind in MISMATCHES
        wording(unmatched.why)

    scene(play)


def test_what_goes_wrong_in_rclpy_is_reported_and_the_next_message_comes(rclpy: Rclpy) -> None:
    async def scenario() -> None:
        complaints, kept = Kept[str](), Kept[Received]()
        bus = open_ros2("scbm", 0, complaints)
        bus.subscribe(TALK, kept)

        def fail() -> None:
            raise RuntimeError("broken")

        rclpy.do(fail)
        rclpy.message("/talk", "after")
        assert [came.message.data for came in await kept.first(1)] == ["after"]
        assert complaints.all == ["rclpy: broken"]
        await bus.close()

    loops.run(scenario())


def test_nobody_is_there_any_more_when_somebody_shuts_rclpy_down(rclpy: Rclpy, scene: Callable[[Play], None]) -> None:
    async def play(bus: RclpyBus) -> None:
        changes = Kept[int]()
        heard = bus.subscribe(TALK, _ignore, changes)
        rclpy.endpoints["/talk"].others = 2
        await changes.ends_with(2)
        rclpy.shut_down()
        await changes.ends_with(0)
        assert heard.peers == 0

    scene(play)


# beginning and end


def test_it_joins_with_what_is_its_own_and_leaves_in_order(
    rclpy: Rclpy, scene: Callable[[Play], None], wording: Wording
) -> None:
    async def play(bus: RclpyBus) -> None:
        wording(bus.words)
        assert rclpy.events == ["context in domain 7 with []", "node scbm_controller_drivers"]
        bus.publisher(TALK)
        await bus.close()
        assert rclpy.events[2:] == ["executor shut down", "node destroyed", "context shut down"]
        assert rclpy.endpoints["/talk"].calls == ["waits for up to 1 s"]

    scene(play)  # which closes it again: nothing comes of that
    assert len(rclpy.events) == 5


def test_a_closed_bus_calls_nobody_back(rclpy: Rclpy) -> None:
    async def scenario() -> list[Received]:
        kept = Kept[Received]()
        bus = open_ros2("scbm", 0, _ignore)
        bus.subscribe(TALK, kept)
        rclpy.message("/talk", "too late")
        rclpy.did()  # it is on its way to the loop, which does not come to it
        await bus.close()
        return kept.all

    assert loops.run(scenario()) == []


def test_rclpy_that_does_not_start_is_reported(rclpy: Rclpy, wording: Wording) -> None:
    rclpy.fails = "failed to initialize rcl: no RMW, at ./src/rcl/init.c:1"

    async def scenario() -> None:
        open_ros2("scbm", 0, _ignore)

    with wording.raises(BusError):
        loops.run(scenario())


# the command line

MODEL = """
behavior_model: measuring
variables:
  lit: {domain: bool, initial: false}
resources:
  lamp: {measures: [lit], ros: {measured: {lit: {topic: /lit, type: std_msgs/msg/Bool}}}}
operations: {}
"""


@pytest.mark.longer
def test_without_rclpy_a_controller_says_what_to_source(tmp_path: Path, wording: Wording) -> None:
    (tmp_path / "rclpy.py").write_text("raise ModuleNotFoundError(\"No module named 'rclpy'\", name='rclpy')\n")
    (tmp_path / "model.yaml").write_text(MODEL)
    words = [sys.executable, "-m", "scbm", "node", "controller", "model.yaml", "--real", "lamp", "--via", "rclpy"]
    environment: dict[str, Any] = {"PYTHONPATH": str(tmp_path), "ROS_DOMAIN_ID": "1"}
    ended = run_process(
        words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False, timeout=GUARD_S
    )
    assert (ended.returncode, ended.stdout) == (2, "")
    first, second = ended.stderr.splitlines()
    assert first.startswith("rclpy: error[bus-unusable]: ")
    wording((first, second))


@pytest.mark.parametrize(
    "options", [["--transport", "dds"], ["--transport", "loopback"], []], ids=["dds", "loopback", "simulation"]
)
def test_to_say_how_drivers_are_reached_where_there_are_none_is_an_error(
    scbm: Callable[..., Any], tmp_path: Path, options: list[str], wording: Wording
) -> None:
    path = tmp_path / "model.yaml"
    path.write_text(MODEL)
    ran = scbm("test", path, *options, "--via", "rclpy")
    assert ran.code == 2
    assert ran.err.startswith("--via: error[bad-option]: ")
    wording(ran.err)
