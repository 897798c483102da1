"""Peers that do not print what a test expects fail the test at once, or in time."""

from __future__ import annotations

import subprocess
import sys

import pytest

from support.peers import Peer


def test_a_peer_that_prints_other_lines_fails_the_test_in_time() -> None:
    command = [sys.executable, "-c", "print('one\\ntwo', flush=True); input()"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        peer = Peer(process)
        peer.says("two", "one")
        with pytest.raises(AssertionError, match="three"):
            peer.says("three", guard_s=0.0)
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
        with pytest.raises(AssertionError, match="ended"):
            peer.says("three")
        peer.kill()
