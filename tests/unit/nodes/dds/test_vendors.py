"""Vendors of DDS, by the first bytes of GUIDs: whose services plain DDS calls, and what is said of the others."""

from __future__ import annotations

from uuid import UUID

import pytest

from scbm.nodes.buses.dds.vendors import is_callable, why_doubtful, why_not_callable
from support.wording import Wording


@pytest.mark.parametrize("vendor", ["0101", "010f", "0110", "0112", "01ff"])
def test_the_vendor_decides_whether_a_service_is_called(vendor: str, wording: Wording) -> None:
    guid = UUID(vendor + "0" * 28)
    why = why_not_callable("/scan", guid)
    assert is_callable(guid) is (why is None)
    wording(f"not callable: {why}\ndoubtful: {why_doubtful('/scan', guid)}\n")
