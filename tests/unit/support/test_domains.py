"""Domains for tests."""

from __future__ import annotations

import socket

from support.domains import own_domain


def test_a_domain_in_which_a_process_was_left_is_not_taken() -> None:
    with own_domain() as first, own_domain() as second:
        assert first != second
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as left:
        left.bind(("127.0.0.1", 7_400 + 250 * first + 12))  # of the second participant
        with own_domain() as other:
            assert other != first
