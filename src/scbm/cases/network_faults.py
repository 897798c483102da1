"""The kinds of network faults: what each does to messages or resources, and what a case says about it (semantics 7.9).

`NETWORK_FAULTS` lists the kinds. Files, random cases, simulation, shrinking and reports iterate over this registry, and
none of them names a kind. The class of a kind derives from the form of its value: `TimeFault`, `ShareFault` or
`WindowFault`.
"""

from __future__ import annotations

from enum import Enum
from fractions import Fraction
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeAlias, TypeVar

from msgspec import Struct

if TYPE_CHECKING:
    from collections.abc import Iterable
    from typing import ClassVar


T = TypeVar("T")


class FaultAction(Enum):
    """The effect of a kind of fault. The members are in the order in which the faults act on a message."""

    CUT = "it loses messages before the rules of the case are followed"
    LOSE = "it loses a message that no rule delivers"
    DELAY = "it delays a message that is not lost"
    COPY = "it adds copies of a message, after the order of messages is restored"
    DOWN = "it acts on resources, and on no message"
    LIMIT = "it does nothing alone: other faults use its value"


class MessageChance(Protocol):
    """Random decisions about one message."""

    def happens(self, probability: Fraction | float) -> bool:
        """Return true with a probability."""
        ...

    def up_to(self, most_ns: int) -> int:
        """Return a time from 0 to `most_ns`, uniformly distributed."""
        ...


class FaultValues(Protocol):
    """The values of all kinds of faults in one network."""

    def value_of(self, fault: NetworkFault[T]) -> T:
        """Return the value of a kind."""
        ...


class MessageInTransit:
    """A message that is sent now. Faults change its attributes.

    Attributes:
        resource: the resource that it goes to, or comes from.
        now_ns: when it is sent, in time of the run.
        inward: whether it goes from the resource to the runner.
        is_lost: whether it never arrives.
        delay_ns: how long the first copy travels.
        keeps_order: whether it arrives after the messages that were sent before it.
        chance: makes random decisions; only for kinds that are `is_random`.
        network: the network, with the values of all kinds.
        later_ns: for each further copy, how long after the first one it arrives.
    """

    __slots__ = ("_chance", "delay_ns", "inward", "is_lost", "keeps_order", "later_ns", "network", "now_ns", "resource")

    def __init__(
        self, resource: str, now_ns: int, network: FaultValues, chance: MessageChance | None, *, inward: bool
    ) -> None:
        self.network = network
        self._chance = chance
        self.resource = resource
        self.now_ns = now_ns
        self.inward = inward
        self.is_lost = False
        self.delay_ns = 0
        self.keeps_order = True
        self.later_ns: list[int] = []

    @property
    def chance(self) -> MessageChance:
        """The source of random decisions."""
        assert self._chance is not None  # noqa: S101 - a network that draws has one
        return self._chance


class NetworkFault(Generic[T]):
    """One kind of network fault. A kind without a value, or with its default, does nothing.

    Attributes:
        name: its key in case files and in `--network`.
        help_text: what its value means; for editors and for the documentation.
        action: what it acts on.
        is_random: whether chance decides which messages it concerns; a case with such a fault needs `drawn`.
        default: its value in a network that does not mention it.
    """

    name: str
    help_text: str
    action: FaultAction
    is_random: bool = False
    default: T

    @property
    def attribute(self) -> str:
        """The name of its value in Python, with the unit."""
        return self.name

    @property
    def is_kept(self) -> bool:
        """Whether a saved run keeps the fault; the effects of other faults become rules for single messages."""
        return self.action in (FaultAction.CUT, FaultAction.DOWN)

    @property
    def may_lose_messages(self) -> bool:
        """Whether a message may never arrive, so that a request gets no reply."""
        return self.action in (FaultAction.CUT, FaultAction.LOSE, FaultAction.DOWN)

    def disturb(self, value: T, message: MessageInTransit) -> None:
        """Change how a message travels.

        Args:
            value: the value of this fault in the network.
            message: the message; what faults before this one did to it is in its attributes.
        """

    def restarts(self, value: T) -> Iterable[Restart]:  # noqa: ARG002 - kinds that act on resources override it
        """Return the times at which resources are down."""
        return ()


class TimeFault(NetworkFault[int]):
    """A fault whose value is a time in nanoseconds; 0 is no fault.

    Attributes:
        most_drawn_ms: the longest time of a randomly drawn network.
    """

    default = 0
    most_drawn_ms: int

    @property
    def attribute(self) -> str:
        """The name of its value in Python, with the unit."""
        return f"{self.name}_ns"


class ShareFault(NetworkFault[Fraction]):
    """A fault whose value is a probability; 0 is no fault."""

    default = Fraction(0)


class FaultWindow(Protocol):
    """A time during which a fault acts.

    Attributes:
        resource: the resource that it concerns; `None` for all.
        at_ns: when it begins, in time of the run.
        for_ns: how long it lasts.
    """

    __struct_fields__: ClassVar[tuple[str, ...]]

    @property
    def resource(self) -> str | None: ...  # noqa: D102 - documented above
    @property
    def at_ns(self) -> int: ...  # noqa: D102 - documented above
    @property
    def for_ns(self) -> int: ...  # noqa: D102 - documented above


class WindowFault(NetworkFault[tuple[FaultWindow, ...]]):
    """A fault that acts at some times of the run; its value is a list of windows.

    Attributes:
        window: the class of a window: a frozen struct with the attributes of `FaultWindow`.
        window_name: what messages call one window: a noun, such as `partition`.
        window_help: what a window means.
        resource_help, at_help, for_help: what the keys of a window mean.
        needs_resource: whether a window must name a resource; else a window without one concerns all resources.
        needs_duration: whether a window must say how long it lasts; else one without `for` lasts 0 s.
    """

    default = ()
    window: type[Any]
    window_name: str
    window_help: str
    resource_help: str
    at_help: str
    for_help: str
    needs_resource: bool = False
    needs_duration: bool = True


AnyNetworkFault: TypeAlias = TimeFault | ShareFault | WindowFault
"""A kind by the form of its value."""


# values of windows


class Partition(Struct, frozen=True):
    """A partition: the network loses all messages sent between `at_ns` and `at_ns + for_ns`.

    Attributes:
        at_ns: when it begins, in time of the run.
        for_ns: its duration.
        resource: the resource that is cut off; `None` cuts off all resources.
    """

    at_ns: int
    for_ns: int
    resource: str | None = None


class Restart(Struct, frozen=True):
    """A restart: a resource is down between `at_ns` and `at_ns + for_ns`, and loses its requests.

    Attributes:
        resource: the name of the resource.
        at_ns: when it goes down, in time of the run.
        for_ns: how long it is down; messages that arrive during this time are lost.
    """

    resource: str
    at_ns: int
    for_ns: int = 0


# the kinds


class LatencyFault(TimeFault):
    """Every message travels for the same time."""

    name = "latency"
    help_text = "How long each message travels."
    action = FaultAction.DELAY
    most_drawn_ms = 50

    def disturb(self, value: int, message: MessageInTransit) -> None:
        """Delay the message."""
        message.delay_ns += value


class JitterFault(TimeFault):
    """Every message travels for an additional time, uniformly distributed."""

    name = "jitter"
    help_text = "The maximum additional time that a message travels, each value equally probable."
    action = FaultAction.DELAY
    is_random = True
    most_drawn_ms = 200

    def disturb(self, value: int, message: MessageInTransit) -> None:
        """Delay the message by up to `value`."""
        message.delay_ns += message.chance.up_to(value)


class LossFault(ShareFault):
    """Some messages are lost."""

    name = "loss"
    help_text = "The probability that a message is lost."
    action = FaultAction.LOSE
    is_random = True

    def disturb(self, value: Fraction | float, message: MessageInTransit) -> None:
        """Lose the message, perhaps."""
        message.is_lost = message.chance.happens(value)


class DuplicationFault(ShareFault):
    """Some messages arrive twice."""

    name = "duplication"
    help_text = "The probability that a message arrives twice, the second time up to `held_back` later."
    action = FaultAction.COPY
    is_random = True

    def disturb(self, value: Fraction | float, message: MessageInTransit) -> None:
        """Add a copy, perhaps."""
        if message.chance.happens(value):
            message.later_ns.append(message.chance.up_to(message.network.value_of(HELD_BACK)))


class ReorderingFault(ShareFault):
    """Some messages are held back, so that later messages overtake them."""

    name = "reordering"
    help_text = "The probability that a message is held back, so that later messages overtake it."
    action = FaultAction.DELAY
    is_random = True

    def disturb(self, value: Fraction | float, message: MessageInTransit) -> None:
        """Hold the message back, perhaps."""
        if message.chance.happens(value):
            message.keeps_order = False
            message.delay_ns += message.chance.up_to(message.network.value_of(HELD_BACK))


class HeldBackLimit(TimeFault):
    """The maximum delay by duplication and reordering."""

    name = "held_back"
    help_text = "The maximum time that a message is held back."
    action = FaultAction.LIMIT
    default = 100_000_000
    most_drawn_ms = 2_000


class PartitionFault(WindowFault):
    """Times in which messages are lost, whatever the rules of the case say."""

    name = "partitions"
    help_text = "Times in which messages are lost."
    action = FaultAction.CUT
    window = Partition
    window_name = "partition"
    window_help = "A time in which messages are lost."
    resource_help = "The resource that is cut off."
    at_help = "When the partition begins, in time of the run."
    for_help = "How long the partition lasts."

    def disturb(self, value: tuple[FaultWindow, ...], message: MessageInTransit) -> None:
        """Lose a message that is sent in one of the windows."""
        for cut in value:
            if cut.at_ns <= message.now_ns < cut.at_ns + cut.for_ns and cut.resource in (None, message.resource):
                message.is_lost = True


class RestartFault(WindowFault):
    """Times in which a resource is down."""

    name = "restarts"
    help_text = "Times in which a resource is down."
    action = FaultAction.DOWN
    window = Restart
    window_name = "restart"
    window_help = "A time in which a resource is down. It forgets all earlier requests."
    resource_help = "The resource that is down."
    at_help = "When the resource goes down, in time of the run."
    for_help = "How long the resource is down."
    needs_resource = True
    needs_duration = False

    def restarts(self, value: tuple[FaultWindow, ...]) -> Iterable[Restart]:
        """Return the times at which resources are down."""
        return (Restart(window.resource or "", window.at_ns, window.for_ns) for window in value)


HELD_BACK = HeldBackLimit()

NETWORK_FAULTS: dict[str, AnyNetworkFault] = {
    fault.name: fault
    for fault in (
        LatencyFault(),
        JitterFault(),
        LossFault(),
        DuplicationFault(),
        ReorderingFault(),
        HELD_BACK,
        PartitionFault(),
        RestartFault(),
    )
}
"""The kinds of network faults by their keys, in the order of the keys in files.

Random networks are drawn in this order, and so is the effect of the faults of one `FaultAction` on a message. So a new
kind stands at the end, where it does not shift the draws for the others.
"""
