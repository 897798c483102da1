"""The keys of the network of a case: one for each kind of `NETWORK_FAULTS`, by the form of its value."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from typing import TYPE_CHECKING, Any, assert_never

from scbm.cases import NETWORK_FAULTS, Network, ShareFault, TimeFault, WindowFault
from scbm.files.codec.key_types import RESOURCE_NAME, TIME, MappingListType, ScalarType
from scbm.files.codec.keys import DefaultKey, Key, Keys, KeyType
from scbm.files.codec.value_reader import ValueReader
from scbm.files.language.quantities import format_share

if TYPE_CHECKING:
    from collections.abc import Iterator
    from fractions import Fraction

    from scbm.cases import AnyNetworkFault, FaultWindow

_SHARE: ScalarType[Fraction] = ScalarType(
    "share",
    "a share such as `2 %`",
    {
        "description": "A share in per cent, or a number from 0 to 1: `2 %`, `0.02`.",
        "anyOf": [
            {"type": "string", "pattern": r"^\d+(\.\d+)?\s*%$"},
            {"type": "number", "minimum": 0, "maximum": 1},
        ],
    },
    ValueReader.share,
    lambda share: format_share(share) if share else 0,
)


class WindowKeys(Keys):
    """A window of a fault: the base of one class for each `WindowFault`, which has its help texts."""

    in_flow = True

    def window(self, fault: WindowFault) -> FaultWindow:
        """Return the window; valid only if no error is noted."""
        resource, at_ns, for_ns = (self.value_of(key) for key in ("resource", "at", "for"))
        name = "" if fault.needs_resource else None
        named = name if resource is None else resource.name
        window: FaultWindow = fault.window(resource=named, at_ns=at_ns or 0, for_ns=for_ns or 0)
        return window


@cache
def _window_keys(fault: WindowFault) -> type[WindowKeys]:
    """Return the keys of a window, as the kind describes them."""
    optional: dict[str, Any] = {} if fault.needs_resource else {"absent": "all resources"}
    length: dict[str, Any] = {"required": True} if fault.needs_duration else {"default": 0}
    body = {
        "__doc__": fault.window_help,
        "resource": Key(RESOURCE_NAME, fault.resource_help, required=fault.needs_resource, **optional),
        "at": Key(TIME, fault.at_help, required=True, source="at_ns"),
        "for_": Key(TIME, fault.for_help, name="for", source="for_ns", **length),
    }
    return type(f"{fault.window_name.title().replace('_', '')}Keys", (WindowKeys,), body)


@cache
def _fault_key(fault: AnyNetworkFault) -> Key[Any]:
    """Return the key of a kind, by the form of its value."""
    kind: KeyType[Any]
    match fault:
        case TimeFault():
            kind = TIME
        case ShareFault():
            kind = _SHARE
        case WindowFault():
            kind = MappingListType(_window_keys(fault), f"list of {fault.window_name}s")
        case _:
            assert_never(fault)
    key = DefaultKey(kind, fault.help_text, default=fault.default, source=lambda network: network.value_of(fault))
    key.__set_name__(NetworkKeys, fault.name)
    return key


class FaultKeys(Mapping[str, Key[Any]]):
    """The keys of a network by name: those of `NETWORK_FAULTS`, read each time."""

    def __getitem__(self, name: str) -> Key[Any]:
        """Return the key of a kind."""
        return _fault_key(NETWORK_FAULTS[name])

    def __iter__(self) -> Iterator[str]:
        """Yield the names of the kinds."""
        return iter(NETWORK_FAULTS)

    def __len__(self) -> int:
        """Return the number of kinds."""
        return len(NETWORK_FAULTS)


class NetworkKeys(Keys):
    """Faults of the network between the runner and the resources."""

    declared = FaultKeys()

    def network(self) -> Network:
        """Return the network; valid only if no error is noted."""
        return Network(**{fault.attribute: self._value(fault) for fault in NETWORK_FAULTS.values()})

    def _value(self, fault: AnyNetworkFault) -> object:
        value = self.value_of(fault.name)
        return tuple(keys.window(fault) for keys in value) if isinstance(fault, WindowFault) else value


def random_keys(network: Network) -> Iterator[str]:
    """Yield the keys that leave something to chance."""
    return (fault.name for fault, _ in network.faults() if fault.is_random)


def network_owners() -> tuple[tuple[type[Keys], str], ...]:
    """Return what messages call the mappings of a network alone."""
    windows = (fault for fault in NETWORK_FAULTS.values() if isinstance(fault, WindowFault))
    return tuple((_window_keys(fault), f"a {fault.window_name}") for fault in windows)
