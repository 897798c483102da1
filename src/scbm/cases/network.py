"""The network between the runner and the resources: the value of each kind of fault in one case (semantics 7.9)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeVar

from scbm.cases.network_faults import NETWORK_FAULTS, WindowFault

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases.network_faults import AnyNetworkFault, FaultWindow, NetworkFault, Restart

T = TypeVar("T")


class Network:
    """How the network delivers requests and cancellations to a resource, and replies from it; immutable.

    Faults of different messages are independent. Messages of one resource in one direction arrive in the order in which
    they were sent, except those that a fault such as `reordering` delays.

    Each kind of `NETWORK_FAULTS` has a value, which is an attribute: `latency_ns`, `loss`, `partitions`. Values that
    are defaults are not stored.
    """

    __slots__ = ("_values",)

    def __init__(self, **values: object) -> None:
        """Make a network from values by their attributes; other kinds have their defaults.

        Raises:
            TypeError: there is no kind with such an attribute.
        """
        changed: list[tuple[str, Any]] = []
        for fault in NETWORK_FAULTS.values():
            value = values.pop(fault.attribute, fault.default)
            if value != fault.default:
                changed.append((fault.name, value))
        if values:
            raise TypeError(f"there is no network fault {', '.join(values)}")
        self._values = tuple(changed)

    def __getattr__(self, attribute: str) -> Any:  # noqa: ANN401 - each kind has values of its own type
        """Return the value of a kind by its attribute."""
        fault = next((fault for fault in NETWORK_FAULTS.values() if fault.attribute == attribute), None)
        if fault is None:
            raise AttributeError(f"there is no network fault {attribute}")
        return self._found(fault)

    def __eq__(self, other: object) -> bool:
        """Return whether all kinds have the same values."""
        return self._values == other._values if isinstance(other, Network) else NotImplemented

    def __hash__(self) -> int:
        """Return a hash of the values."""
        return hash(self._values)

    def __repr__(self) -> str:
        """Return all values."""
        values = ", ".join(f"{fault.attribute}={self._found(fault)!r}" for fault in NETWORK_FAULTS.values())
        return f"Network({values})"

    def value_of(self, fault: NetworkFault[T]) -> T:
        """Return the value of a kind."""
        value: T = self._found(fault)
        return value

    def _found(self, fault: NetworkFault[Any]) -> Any:  # noqa: ANN401 - each kind has values of its own type
        return next((value for name, value in self._values if name == fault.name), fault.default)

    def with_value(self, fault: NetworkFault[Any], value: object) -> Network:
        """Return the same network with another value of one kind."""
        values = {kind.attribute: kept for kind, kept in self.faults()}
        return Network(**{**values, fault.attribute: value})

    def faults(self) -> Iterator[tuple[AnyNetworkFault, Any]]:
        """Yield each kind whose value is not its default, with the value, in the order of the registry."""
        for name, value in self._values:
            yield NETWORK_FAULTS[name], value

    def windows(self) -> Iterator[tuple[WindowFault, int, FaultWindow]]:
        """Yield each window with its kind and its index among the windows of this kind."""
        for fault, value in self.faults():
            if isinstance(fault, WindowFault):
                for index, window in enumerate(value):
                    yield fault, index, window

    @property
    def restarts_of_resources(self) -> tuple[Restart, ...]:
        """The times at which resources are down."""
        return tuple(restart for fault, value in self.faults() for restart in fault.restarts(value))

    @property
    def draws(self) -> bool:
        """Whether the delivery of a message is drawn at random."""
        return any(fault.is_random for fault, _ in self.faults())

    @property
    def kept(self) -> Network:
        """The faults that a saved run keeps; the effects of the others become rules for single messages."""
        return Network(**{fault.attribute: value for fault, value in self.faults() if fault.is_kept})

    @property
    def may_lose_messages(self) -> bool:
        """Whether a message may never arrive."""
        return any(fault.may_lose_messages for fault, _ in self.faults())
