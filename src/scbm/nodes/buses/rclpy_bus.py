"""A bus for drivers through rclpy, in an installation of ROS 2: any vendor, with services (decision 28)."""

from __future__ import annotations

import asyncio
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from itertools import count
from threading import Event, Thread
from time import monotonic, monotonic_ns
from typing import TYPE_CHECKING, Any, TypeAlias

from msgspec import Struct, field

from scbm.nodes.buses.bus import (
    ONLY_BEST_EFFORT,
    Answered,
    BusError,
    PeerCount,
    Received,
    Service,
    Topic,
    Unmatched,
    UnmatchedKind,
)
from scbm.nodes.types.cdr import BadValueError, codec_of
from scbm.nodes.types.definitions import ListShape, MessageDefinition, Primitive

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping
    from types import ModuleType

    from scbm.nodes.types.cdr import Message
    from scbm.nodes.types.definitions import FieldShape

Foreign: TypeAlias = Any
"""Something of rclpy, or of a package of messages: where there is no ROS 2, nothing is known of its type."""

_LOOK_S = 0.1
"""The period of looking for peers: rclpy reports changes of topics, and never those of services."""

_LEAVES_S = 1.0
"""Maximum time that `close` waits for subscriptions that have not acknowledged the last messages."""

_TYPES = {"bool": "boolean", "float32": "float", "float64": "double", "byte": "octet", "char": "uint8"}
"""The names of primitive types in rclpy that differ from those of ROS 2."""


def open_ros2(node: str, domain: int, warn: Callable[[str], None]) -> RclpyBus:
    """Open a bus on the running event loop.

    Args:
        node: the name that tools show.
        domain: of ROS 2.
        warn: gets a sentence about what rclpy cannot do later. It is called on the loop.

    Raises:
        BusError: there is no rclpy, or it does not start.
    """
    return RclpyBus(_rclpy(), node, domain, warn)


def _rclpy() -> ModuleType:
    try:
        import rclpy  # noqa: PLC0415 - it may be missing
        from rclpy import context, duration, executors, node, qos  # noqa: F401, PLC0415 - so that rclpy has them
    except ImportError as error:
        remedy = (
            "run `source /opt/ros/<distro>/setup.bash` first, with scbm installed for the Python of that distribution; "
            "the default, `--via dds`, needs no ROS 2"
        )
        raise _error(f"rclpy cannot be imported: {error}", remedy) from error
    return rclpy  # type: ignore[no-any-return]  # rclpy has no types


def _error(message: str, remedy: str | None = None) -> BusError:
    return BusError(message, remedy, where="rclpy")


@contextmanager
def _rclpy_errors(what: str) -> Iterator[None]:
    """Raise `BusError` for whatever rclpy raises: its errors have no base of their own."""
    try:
        yield
    except Exception as error:
        raise _error(f"{what}: {str(error).partition(', at ')[0] or type(error).__name__}") from error


class RclpyBus:
    """A node of ROS 2 with a context of its own. It is for links to drivers, and less than other buses.

    - `source` is always 0 and `left` is not supported: rclpy does not distinguish publishers.
    - Nothing is served.
    - A subscription also gets messages of its own publishers; a link never subscribes to its own topics.
    - Peers are polled ten times a second.
    """

    def __init__(self, rclpy: ModuleType, node: str, domain: int, warn: Callable[[str], None]) -> None:
        """See `open_ros2`."""
        self._rclpy = rclpy
        self._loop = asyncio.get_running_loop()
        self._warn = warn
        self._peers: list[_RclpyPeers] = []
        self._sent: list[tuple[Topic, Foreign]] = []
        self._heard: list[Topic] = []
        self._is_open = True
        self._stop = Event()
        with _rclpy_errors("rclpy does not start"):
            self._context = rclpy.context.Context()
            self._context.init(args=[], domain_id=domain)
            # As little as can be: the node is no place of parameters, and `--ros-args` are not for it.
            options = {"use_global_arguments": False, "enable_rosout": False, "start_parameter_services": False}
            self._node = rclpy.node.Node(node, context=self._context, **options)
            self._executor = rclpy.executors.SingleThreadedExecutor(context=self._context)
            self._executor.add_node(self._node)
            self.words = f"ROS 2 domain {domain}, {rclpy.get_rmw_implementation_identifier()}"
        self._thread = Thread(target=self._spin, name="rclpy", daemon=True)
        self._thread.start()

    @property
    def lease_ns(self) -> None:
        """None: rclpy does not say."""

    def publisher(self, topic: Topic, matched: Callable[[int], None] | None = None) -> _RclpyPublisher:
        """Return a publisher. Raises `BusError` for names and types that this ROS 2 does not have."""
        class_, qos = _message_class(topic.type), self._qos(topic)
        with _rclpy_errors(f"`{topic.name}` cannot be published"):
            entity = self._node.create_publisher(class_, topic.name, qos)
        self._sent.append((topic, entity))
        return _RclpyPublisher(topic, entity, class_, self._look_at(entity.get_subscription_count, matched))

    def subscribe(
        self,
        topic: Topic,
        receive: Callable[[Received], None],
        matched: Callable[[int], None] | None = None,
        left: Callable[[int], None] | None = None,
    ) -> _RclpyPeers:
        """Subscribe to a topic. Raises `BusError` as `publisher` does, and `ValueError` for `left`."""
        if left is not None:
            raise ValueError("rclpy does not say which publisher is gone")

        def receive_later(message: Foreign) -> None:
            self._later(receive, Received(message, 0, monotonic_ns()))

        class_, qos = _message_class(topic.type), self._qos(topic)
        with _rclpy_errors(f"`{topic.name}` cannot be subscribed to"):
            entity = self._node.create_subscription(class_, topic.name, receive_later, qos, raw=topic.is_raw)
        self._heard.append(topic)
        return self._look_at(entity.get_publisher_count, matched)

    def client(
        self, service: Service, receive: Callable[[Answered], None], matched: Callable[[int], None] | None = None
    ) -> _RclpyClient:
        """Return a client. Raises `BusError` for names and types that this ROS 2 lacks, or has with other fields."""
        class_, qos = _class(service.type.name), self._qos(Topic(service.name))
        _refuse_others(class_.Request, service.type.request)
        _refuse_others(class_.Response, service.type.response)
        with _rclpy_errors(f"`{service.name}` cannot be called"):
            entity = self._node.create_client(class_, service.name, qos_profile=qos)
        peers = self._look_at(lambda: self._servers(entity, service.name), matched)
        return _RclpyClient(service, entity, class_.Request, peers, partial(self._later, receive))

    def _servers(self, entity: Foreign, name: str) -> int:
        """Return the number of servers of a service; older versions of rclpy tell only whether there is one."""
        if not entity.service_is_ready():
            return 0
        count_services = getattr(self._node, "count_services", None)
        return 1 if count_services is None else max(1, count_services(name))

    def serve(self, service: Service, answer: object) -> None:  # noqa: ARG002 - as every bus has it
        """Raise `ValueError`: the services of drivers are called, none is served."""
        raise ValueError("nothing is served through rclpy")

    def _qos(self, topic: Topic) -> Foreign:
        qos = self._rclpy.qos
        reliability, durability = qos.ReliabilityPolicy, qos.DurabilityPolicy
        return qos.QoSProfile(
            history=qos.HistoryPolicy.KEEP_ALL,
            reliability=reliability.BEST_EFFORT if topic.is_best_effort else reliability.RELIABLE,
            durability=durability.TRANSIENT_LOCAL if topic.is_latched else durability.VOLATILE,
        )

    def why_unmatched(self, what: Topic | Service) -> Unmatched | None:
        """Return a mismatch if others use another type, or are less reliable."""
        if isinstance(what, Service):
            types = dict(self._node.get_service_names_and_types()).get(what.name, [])
            return _of_another_type(what.name, types, what.type.name)
        heard = self._node.get_publishers_info_by_topic(what.name) if what in self._heard else []
        sent = [topic for topic, _ in self._sent]
        hearers = self._node.get_subscriptions_info_by_topic(what.name) if what in sent else []
        other = _of_another_type(what.name, [info.topic_type for info in (*heard, *hearers)], what.type.name)
        best_effort = self._rclpy.qos.ReliabilityPolicy.BEST_EFFORT
        is_too_weak = not what.is_best_effort and any(info.qos_profile.reliability == best_effort for info in heard)
        weak = Unmatched(f"`{what.name}` has a publication, but {ONLY_BEST_EFFORT}", UnmatchedKind.MISMATCH)
        return other or (weak if is_too_weak else None)

    def _look_at(self, look: Callable[[], int], matched: Callable[[int], None] | None) -> _RclpyPeers:
        peers = _RclpyPeers(matched, look=look)
        self._peers.append(peers)
        return peers

    def _later(self, function: Callable[..., object], *arguments: object) -> None:
        """Run a callback on the loop, unless the bus is closed by then."""
        self._loop.call_soon_threadsafe(self._call, function, *arguments)

    def _call(self, function: Callable[..., object], *arguments: object) -> None:
        if self._is_open:
            function(*arguments)

    # on the thread of the executor

    def _spin(self) -> None:
        looks_s = monotonic()
        while self._context.ok() and not self._stop.is_set():
            try:
                self._executor.spin_once(timeout_sec=_LOOK_S)
                if monotonic() >= looks_s:
                    self._look()
                    looks_s = monotonic() + _LOOK_S
            except Exception as error:  # noqa: BLE001 - no caller could handle it
                self._later(self._warn, f"rclpy: {error}")
        for peers in tuple(self._peers):  # the context was shut down, so all peers are lost
            self._later(peers.are, 0)

    def _look(self) -> None:
        for peers in tuple(self._peers):
            self._later(peers.are, peers.look())

    # the end

    async def close(self) -> None:
        """Leave. Wait up to a second for acknowledgements of published messages."""
        if self._is_open:
            self._is_open = False
            await asyncio.to_thread(self._leave)

    def _leave(self) -> None:
        ends_s = monotonic() + _LEAVES_S
        for _, publisher in self._sent:
            with suppress(Exception):  # not every vendor can say it
                publisher.wait_for_all_acked(self._rclpy.duration.Duration(seconds=max(0.0, ends_s - monotonic())))
        self._stop.set()
        self._thread.join()
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()


class _RclpyPeers(PeerCount, eq=False, kw_only=True):
    """The number of matched peers; `look` counts them, on the thread of the executor."""

    look: Callable[[], int]


class _RclpyPublisher(Struct, frozen=True):
    topic: Topic
    entity: Foreign
    message: Foreign
    others: _RclpyPeers

    @property
    def peers(self) -> int:
        return self.others.peers

    def publish(self, values: Mapping[str, object]) -> None:
        message = _made(self.message, self.topic.type, values)
        with _rclpy_errors(f"`{self.topic.name}`: nothing can be sent"):
            self.entity.publish(message)


class _RclpyClient(Struct, frozen=True):
    service: Service
    entity: Foreign
    request: Foreign
    servers: _RclpyPeers
    answered: Callable[[Answered], None]
    calls: Iterator[int] = field(default_factory=lambda: count(1))

    @property
    def peers(self) -> int:
        return self.servers.peers

    def server_names(self) -> tuple[str, ...]:
        return ()

    def why_doubtful(self) -> None:
        """None: rclpy matches only servers that it can call."""

    def call(self, values: Mapping[str, object]) -> int:
        request = _made(self.request, self.service.type.request, values)
        number = next(self.calls)
        with _rclpy_errors(f"`{self.service.name}`: nothing can be sent"):
            future = self.entity.call_async(request)
        future.add_done_callback(partial(self._answer, number))
        return number

    def _answer(self, number: int, future: Foreign) -> None:
        """Handle a response, at most one for each call. Called on the thread of the executor."""
        self.answered(Answered(number, future.result(), monotonic_ns()))


def _of_another_type(name: str, types: list[str], wanted: str) -> Unmatched | None:
    other = next((there for there in types if there != wanted), None)
    why = f"`{name}` is of type {other} there, and not of {wanted}"
    return None if other is None else Unmatched(why, UnmatchedKind.MISMATCH)


def _class(name: str) -> Foreign:
    package, kind, short = name.split("/")
    action, _, part = short.rpartition("_") if kind == "action" else (short, "", "")
    try:
        whole = getattr(import_module(f"{package}.{kind}"), action)
        if part in _PARTS_OF_ACTIONS:
            return getattr(whole.Impl, _PARTS_OF_ACTIONS[part])
        return getattr(whole, part) if part else whole
    except (ImportError, AttributeError) as error:
        raise _error(f"this ROS 2 has no type {name}: {error}", f"source the workspace that has `{package}`") from error


_PARTS_OF_ACTIONS = {
    "SendGoal": "SendGoalService",
    "GetResult": "GetResultService",
    "FeedbackMessage": "FeedbackMessage",
}
"""The classes of what actions consist of, in the class `Impl` of an action."""


def _message_class(definition: MessageDefinition) -> Foreign:
    class_ = _class(definition.name)
    _refuse_others(class_, definition)
    return class_


def _refuse_others(class_: Foreign, definition: MessageDefinition) -> None:
    """Raise `BusError` if a message has other fields in this ROS 2; nested ones are compared when they are made."""
    there = dict(class_.get_fields_and_field_types())
    bound = {name: _rclpy_name(shape) for name, shape in definition.fields}
    if there != bound:
        raise _error(
            f"{definition.name} has the fields {_shown(there)}, and the binding means {_shown(bound)}",
            "name the folder of its package in this workspace under `interfaces`",
        )


def _rclpy_name(shape: FieldShape) -> str:
    """Return the name that rclpy has for a type: `double[9]`, `sequence<std_msgs/Header, 3>`, `string<8>`."""
    if isinstance(shape, ListShape):
        element = _rclpy_name(shape.element)
        if shape.is_array:
            return f"{element}[{shape.size}]"
        return f"sequence<{element}, {shape.size}>" if shape.size else f"sequence<{element}>"
    if isinstance(shape, MessageDefinition):
        package, _, short = shape.name.split("/")
        return f"{package}/{short}"
    return f"string<{shape.bound}>" if shape.bound else _TYPES.get(shape.name, shape.name)


def _made(class_: Foreign, definition: MessageDefinition, values: Mapping[str, object]) -> Foreign:
    """Return a message of rclpy with these values; what is left out is zero. Raises `BusError`."""
    try:
        complete = codec_of(definition).complete(values)
    except BadValueError as error:
        raise _error(str(error)) from error
    with _rclpy_errors(f"{definition.name} cannot be made"):
        return _filled(class_(), definition, complete)


def _filled(made: Foreign, definition: MessageDefinition, message: Message) -> Foreign:
    for name, shape in definition.fields:
        value = getattr(message, name)
        element = shape.element if isinstance(shape, ListShape) else shape
        if isinstance(element, MessageDefinition):
            class_ = _class(element.name)
            parts = [_filled(class_(), element, part) for part in (value if isinstance(shape, ListShape) else [value])]
            value = parts if isinstance(shape, ListShape) else parts[0]
        elif element == Primitive("byte"):
            value = [bytes((each,)) for each in value] if isinstance(shape, ListShape) else bytes((value,))
        elif isinstance(value, bytes):
            value = list(value)  # numpy takes bytes for one text
        setattr(made, name, value)
    return made


def _shown(fields: Mapping[str, str]) -> str:
    return "{" + ", ".join(f"{name}: {kind}" for name, kind in fields.items()) + "}"
