"""The vendors of DDS: a GUID begins with two bytes that identify its vendor (RTPS 9.3.1.2)."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from uuid import UUID


class ServiceLayout(StrEnum):
    """Whether a vendor correlates requests and responses as Cyclone DDS does."""

    SAME = "as Cyclone DDS"
    PERHAPS = "as its programs choose"
    OTHER = "in another way"


_VENDORS = {
    0x0101: ("RTI Connext DDS", ServiceLayout.OTHER),
    0x0103: ("OpenDDS", ServiceLayout.OTHER),
    0x010F: ("Fast DDS", ServiceLayout.OTHER),
    0x0110: ("Cyclone DDS", ServiceLayout.SAME),
    0x0111: ("GurumDDS", ServiceLayout.OTHER),
    0x0112: ("RustDDS", ServiceLayout.PERHAPS),  # ros2-client on it has three layouts
}


def is_callable(guid: UUID) -> bool:
    """Return whether plain DDS can call services of this vendor, as far as is known."""
    return _vendor(guid)[1] is not ServiceLayout.OTHER


def why_not_callable(service: str, guid: UUID) -> str | None:
    """Return why plain DDS cannot call a service that this vendor serves; `None` if it can."""
    vendor, layout = _vendor(guid)
    why = f"`{service}` is served through {vendor}, whose services plain DDS cannot call"
    return why if layout is ServiceLayout.OTHER else None


def why_doubtful(service: str, guid: UUID) -> str | None:
    """Return why calls of a service may have no response; `None` for vendors with the layout of Cyclone DDS."""
    vendor, layout = _vendor(guid)
    why = f"`{service}` is served through {vendor}, perhaps in another layout: plain DDS calls that of Cyclone DDS"
    return why if layout is ServiceLayout.PERHAPS else None


def _vendor(guid: UUID) -> tuple[str, ServiceLayout]:
    number = int.from_bytes(guid.bytes[:2])
    return _VENDORS.get(number, (f"a DDS with the vendor number {number:#06x}", ServiceLayout.OTHER))
