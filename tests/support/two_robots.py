"""A cell with two equal robots: under canonical plans the second one never moves."""

from __future__ import annotations

from scbm.files import read_model
from scbm.model import BehaviorModel

_OPERATION = """  {verb}_{n}:
    deadline: 10 s
    pre:
      g: box == {begin} && robot_{n}_req_state == initial
      a: [robot_{n}_req_trigger <- true]
    post:
      g: true
      gr: robot_{n}_req_state == succeeded
      a: [robot_{n}_req_trigger <- false, robot_{n}_req_state <- initial, box <- {end}]
    failed: {{g: robot_{n}_req_state == failed, a: [robot_{n}_req_trigger <- false, robot_{n}_req_state <- initial]}}
    timedout: [robot_{n}_req_trigger <- false]
"""

_STEPS = [(verb, n) for n in (1, 2) for verb in ("pick", "place")]

_TEXT = """behavior_model: two_robots
variables:
  box: {domain: [shelf, held_1, held_2, table], initial: shelf}
resources:
  robot_1: {simulation: {latency: {uniform: [1 s, 2 s]}}}
  robot_2: {simulation: {latency: {uniform: [1 s, 2 s]}}}
operations:
""" + "".join(
    _OPERATION.format(
        verb=verb, n=n, begin="shelf" if verb == "pick" else f"held_{n}", end=f"held_{n}" if verb == "pick" else "table"
    )
    for verb, n in _STEPS
)


def two_robots_text(plans: str = "drawn", more: str = "", goals: str = "  served: box == table\n") -> str:
    """The text of the model; `plans` are those that it declares, `more` is added to its operations."""
    return f"{_TEXT}{more}goals:\n{goals}runs: {{goals: single, plans: {plans}}}\n"


def two_robots(plans: str = "drawn", more: str = "", goals: str = "  served: box == table\n") -> BehaviorModel:
    """The model; arguments as in `two_robots_text`."""
    return read_model(two_robots_text(plans, more, goals))
