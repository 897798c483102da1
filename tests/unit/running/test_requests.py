"""Replies that answer no request in flight, and why they are dropped (semantics 6.2)."""

from __future__ import annotations

import pytest

from scbm.running import Program
from scbm.running.requests import Requests
from support.models import scan_cell

KEPT = 1_024
"""The number of answered requests whose replies are recognized when they are repeated."""


@pytest.mark.parametrize(("later", "why"), [(0, "repeated"), (KEPT - 1, "repeated"), (KEPT, "late")])
def test_a_repeated_reply_is_recognized_for_a_thousand_later_ones(later: int, why: str) -> None:
    (line,) = Program(scan_cell()).requests
    requests = Requests()
    for _ in range(1 + later):
        assert requests.answer(requests.send(line)) is line
    assert requests.answer(1) == why
    assert requests.dropped[why] == 1


def test_a_reply_to_a_request_that_was_never_sent_is_unknown() -> None:
    (line,) = Program(scan_cell()).requests
    requests = Requests()
    assert requests.answer(0) == "unknown"
    assert requests.answer(1) == "unknown"
    sent = requests.send(line)
    assert requests.cancel(line) == sent
    assert requests.answer(sent) == "late"
    assert requests.dropped == {"late": 1, "repeated": 0, "unknown": 2}
