"""Faults put into the repaired example, each with the random cases that find it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from scbm.cases import Network
from scbm.files import read_model
from scbm.testing import Execution, Failure, RandomCases, Tester

EXAMPLE = Path(__file__).parents[2] / "examples" / "robot_in_the_air" / "after.yaml"

_OUTCOMES = "outcomes: {succeed: 0.9, fail: 0.1, timeout: 0}"
_MANY_TIMEOUTS = (_OUTCOMES, "outcomes: {succeed: 0.3, fail: 0.1, timeout: 0.6}")
_PERFECT = Network()


@dataclass(frozen=True)
class Seeded:
    """A fault of a model.

    Attributes:
        replacements: texts of the example's file, and what stands in their place.
        network: how messages travel in the cases; `None` for another network in each.
        cases: at most so many cases are drawn until one fails.
    """

    replacements: tuple[tuple[str, str], ...]
    network: Network | None = _PERFECT
    cases: int = 500

    def find(self, seed: int = 1) -> tuple[Tester, Execution, Failure]:
        """The first random case that fails, and its first failure."""
        text = EXAMPLE.read_text(encoding="utf-8")
        for old, new in self.replacements:
            assert old in text, old
            text = text.replace(old, new)
        model = read_model(text)
        tester = Tester(model)
        for case in RandomCases(model, network=self.network).first(self.cases, seed):
            execution = tester.execute(case)
            if execution.verdict.failures:
                return tester, execution, execution.verdict.failures[0]
        raise AssertionError("no case fails")


_RING = """\
  open_at_agv:
    g: robot_at == agv && gripper_act == closed && item_a_at != gripper
    a: [gripper_act <- open]
  close_again:
    g: robot_at == agv && gripper_act == open && mounted == gripper && item_a_at == box_a
    a: [gripper_act <- closed]
"""


def _required(sentence: str) -> tuple[str, str]:
    """One more requirement."""
    return "requirements:\n", f"requirements:\n  seeded: {sentence}\n"


SEEDED = {
    "a guard lacks a condition": Seeded((("&& gantry_at != box_a && robot_at == home", "&& gantry_at != box_a"),)),
    "a guard asks for the wrong tool": Seeded(
        (
            ("&& mounted == gripper && gripper_act == open\n", "&& gripper_act == open\n"),
            _required("always gripper_req_state == executing -> mounted == gripper"),
        )
    ),
    "a counter is not stopped before its domain ends": Seeded(
        (("g: scan_timeouts == 5", "g: scan_timeouts == 5 && robot_at == home"), _MANY_TIMEOUTS), cases=5_000
    ),
    "two automatic transitions undo each other": Seeded(
        (
            (
                "  clear_scan_timeouts:",
                _RING + "  clear_scan_timeouts:",
            ),
        )
    ),
    "a failure is forgotten": Seeded(
        (
            (
                "a: [current.state <- failed, gantry_req_state <- initial, gantry_req_trigger <- false]",
                "a: [current.state <- failed, gantry_req_trigger <- false]",
            ),
            _required("never gantry_req_state == failed && current.state == initial && plan.state == executing"),
        )
    ),
    "a goal that cannot be reached from everywhere": Seeded(
        (
            (
                "&& mounted == gripper && gripper_act == closed && item_a_at != gripper",
                "&& mounted == gripper && gripper_act == closed && item_a_at == gripper",
            ),
        )
    ),
    "two lost messages in a row": Seeded((_required("never scan_timeouts == 2"),), network=None),
}
