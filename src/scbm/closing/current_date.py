"""The date of today, which decides which waivers count: the core has no clock.

`SOURCE_DATE_EPOCH` sets another date, as for reproducible builds.
"""

from __future__ import annotations

import os
from datetime import UTC, datetime

_EPOCH = "SOURCE_DATE_EPOCH"


def today() -> str:
    """Return the date of today in UTC, such as `2026-11-23`; `SOURCE_DATE_EPOCH` sets it, in seconds since 1970."""
    text = os.environ.get(_EPOCH, "")
    seconds = int(text) if text.isascii() and text.isdigit() and len(text) < len("100000000000") else None
    moment = datetime.now(UTC) if seconds is None else datetime.fromtimestamp(seconds, UTC)
    return moment.date().isoformat()
