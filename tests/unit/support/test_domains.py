"""Domains for tests."""

from __future__ import annotations

import socket

from support.domains import discovery_port, is_empty, own_domain


def test_no_two_tests_have_one_domain() -> None:
    with own_domain() as first, own_domain() as second:
        assert first != second


def test_a_domain_in_which_a_process_was_left_is_not_empty() -> None:
    with own_domain() as domain, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as left:
        assert is_empty(domain)
        left.bind(("127.0.0.1", discovery_port(domain, 1)))
        assert not is_empty(domain)
