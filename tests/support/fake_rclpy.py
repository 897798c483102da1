"""A stand-in for rclpy, as its fake: what `scbm.nodes.buses.rclpy_bus` uses of it, without any middleware.

It shows what scbm asks of rclpy and on which threads; that rclpy does what is asked, no test with it can show. Names,
arguments and the threads of callbacks are those of rclpy 7 (Jazzy).
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum
from queue import Empty, Queue
from threading import Event, get_ident
from types import ModuleType, SimpleNamespace
from typing import Any, TypeAlias

import pytest

from support.loops import GUARD_S

Made: TypeAlias = Any
"""A class, or something that is made of one, of a package that is not there."""


class Enums:
    """Of `rclpy.qos`."""

    History = Enum("History", "KEEP_LAST KEEP_ALL")
    Reliability = Enum("Reliability", "RELIABLE BEST_EFFORT")
    Durability = Enum("Durability", "TRANSIENT_LOCAL VOLATILE")


@dataclass(frozen=True)
class Profile:
    """A QoSProfile."""

    history: Enums.History
    reliability: Enums.Reliability
    durability: Enums.Durability


def structure(**fields: str) -> type:
    """A class of messages with fields of these types, which takes no others and only what they can hold."""
    kinds: dict[str, type] = {"boolean": bool, "string": str, "float": float, "double": float}

    class Structure:
        def __init__(self, **values: object) -> None:
            for name, value in values.items():
                setattr(self, name, value)

        def __setattr__(self, name: str, value: object) -> None:
            assert name in fields
            assert type(value) is kinds.get(fields[name], int), f"`{name}` is no {fields[name]}"
            super().__setattr__(name, value)

        @classmethod
        def get_fields_and_field_types(cls) -> Mapping[str, str]:
            return fields

    return Structure


@dataclass
class Endpoint:
    """A publisher, a subscription or a client of the bus, and what the others do."""

    name: str
    type: Any
    qos: Profile
    others: int = 0
    sent: list[Any] = field(default_factory=list)
    futures: list[Future] = field(default_factory=list)
    callback: Callable[[Any], None] | None = None
    calls: list[str] = field(default_factory=list)

    def get_subscription_count(self) -> int:
        return self.others

    def get_publisher_count(self) -> int:
        return self.others

    def service_is_ready(self) -> bool:
        return self.others > 0

    def publish(self, message: Made) -> None:
        if self.others < 0:
            raise RuntimeError("Failed to publish: timed out, at ./src/rcl/publisher.c:423")
        self.sent.append(message)

    def wait_for_all_acked(self, timeout: float) -> bool:
        self.calls.append(f"waits for up to {timeout:.0f} s")
        raise RuntimeError("not every vendor can say it")

    def call_async(self, request: Made) -> Future:
        self.sent.append(request)
        self.futures.append(Future())
        return self.futures[-1]


class Future:
    """Of one call."""

    def __init__(self) -> None:
        self._response: Any = None
        self._done: Callable[[Future], None] | None = None

    def add_done_callback(self, done: Callable[[Future], None]) -> None:
        self._done = done

    def result(self) -> Made:
        return self._response

    def answer(self, response: Made) -> None:
        """A response came; on the thread of the executor."""
        self._response = response
        assert self._done is not None
        self._done(self)


class Rclpy:
    """The fake, and what a test sees of it.

    Attributes:
        events: what happened to contexts, nodes and executors.
        endpoints: by name, what was made.
        publishers, subscriptions, services: what `get_…` returns about others.
        threads: on which work was done.
    """

    def __init__(self) -> None:
        self.events: list[str] = []
        self.endpoints: dict[str, Endpoint] = {}
        self.publishers: list[Any] = []
        self.subscriptions: list[Any] = []
        self.services: list[tuple[str, list[str]]] = []
        self.threads: list[int] = []
        self.fails: str | None = None
        self._is_ok = True
        self._work: Queue[Callable[[], None]] = Queue()

    def do(self, work: Callable[[], None]) -> None:
        """Has the executor do it, as what comes from a middleware."""
        self._work.put(work)

    def did(self) -> None:
        """Waits until all of it is done, with the loop held up."""
        done = Event()
        self.do(done.set)
        assert done.wait(GUARD_S)

    def message(self, topic: str, data: object) -> None:
        """A message comes."""
        callback = self.endpoints[topic].callback
        assert callback is not None
        self.do(lambda: callback(SimpleNamespace(data=data)))

    def shut_down(self) -> None:
        """End the context from outside."""
        self._is_ok = False

    def install(self, monkeypatch: pytest.MonkeyPatch, types: Mapping[str, Any]) -> None:
        """From now on `import rclpy` finds it; and packages are found with these types: `std_msgs.msg.String`."""
        history, reliability, durability = Enums.History, Enums.Reliability, Enums.Durability
        qos = {"HistoryPolicy": history, "ReliabilityPolicy": reliability, "DurabilityPolicy": durability}
        parts: dict[str, dict[str, Any]] = {
            "rclpy": {"get_rmw_implementation_identifier": lambda: "rmw_fastrtps_cpp"},
            "rclpy.context": {"Context": lambda: _Context(self)},
            "rclpy.duration": {"Duration": lambda seconds: seconds},
            "rclpy.executors": {"SingleThreadedExecutor": lambda context: _Executor(self, context)},
            "rclpy.node": {"Node": lambda name, **options: _Node(self, name, options)},
            "rclpy.qos": {"QoSProfile": Profile, **qos},
        }
        for name, found in types.items():
            package, _, short = name.rpartition(".")
            parts.setdefault(package.partition(".")[0], {})
            parts.setdefault(package, {})[short] = found
        modules = {name: _module(name, attributes) for name, attributes in parts.items()}
        for name, module in modules.items():
            parent, _, short = name.rpartition(".")
            if parent:
                setattr(modules[parent], short, module)
            monkeypatch.setitem(sys.modules, name, module)


def _module(name: str, attributes: Mapping[str, Any]) -> ModuleType:
    module = ModuleType(name)
    module.__path__ = []
    for attribute, value in attributes.items():
        setattr(module, attribute, value)
    return module


class _Context:
    def __init__(self, fake: Rclpy) -> None:
        self._fake = fake

    def init(self, *, args: Iterable[str], domain_id: int) -> None:
        if self._fake.fails is not None:
            raise RuntimeError(self._fake.fails)
        self._fake.events.append(f"context in domain {domain_id} with {list(args)}")

    def ok(self) -> bool:
        return self._fake._is_ok

    def try_shutdown(self) -> None:
        self._fake.events.append("context shut down")


class _Node:
    def __init__(self, fake: Rclpy, name: str, options: Mapping[str, object]) -> None:
        assert isinstance(options["context"], _Context)
        fake.events.append(f"node {name}")
        self._fake = fake

    def _made(self, name: str, type_: Made, qos: Profile, callback: Callable[[Any], None] | None = None) -> Endpoint:
        self._fake.endpoints[name] = Endpoint(name, type_, qos, callback=callback)
        return self._fake.endpoints[name]

    def create_publisher(self, type_: Made, name: str, qos: Profile) -> Endpoint:
        if "__" in name:
            raise ValueError("topic name is invalid")
        return self._made(name, type_, qos)

    def create_subscription(
        self, type_: Made, name: str, callback: Callable[[Any], None], qos: Profile, *, raw: bool
    ) -> Endpoint:
        assert not raw, "only a real rclpy has payloads"
        return self._made(name, type_, qos, callback)

    def create_client(self, type_: Made, name: str, *, qos_profile: Profile) -> Endpoint:
        return self._made(name, type_, qos_profile)

    def get_publishers_info_by_topic(self, name: str) -> list[Any]:
        return [info for info in self._fake.publishers if info.name == name]

    def get_subscriptions_info_by_topic(self, name: str) -> list[Any]:
        return [info for info in self._fake.subscriptions if info.name == name]

    def get_service_names_and_types(self) -> list[tuple[str, list[str]]]:
        return self._fake.services

    def destroy_node(self) -> None:
        self._fake.events.append("node destroyed")


class _Executor:
    def __init__(self, fake: Rclpy, context: _Context) -> None:
        assert isinstance(context, _Context)
        self._fake = fake

    def add_node(self, node: _Node) -> None:
        assert isinstance(node, _Node)

    def spin_once(self, timeout_sec: float) -> None:
        try:
            work = self._fake._work.get(timeout=timeout_sec)
        except Empty:
            return
        self._fake.threads.append(get_ident())
        work()

    def shutdown(self) -> None:
        self._fake.events.append("executor shut down")


def endpoint_info(name: str, type_: str, *, is_best_effort: bool = False) -> Made:
    """What ROS 2 reports about an endpoint of another node."""
    reliability = Enums.Reliability.BEST_EFFORT if is_best_effort else Enums.Reliability.RELIABLE
    return SimpleNamespace(name=name, topic_type=type_, qos_profile=SimpleNamespace(reliability=reliability))
