"""Measures the CPU time of our process for goals of an action, and its memory, beside bare calls of a service.

`goals.py [--goals N]`: another process serves both over plain DDS. It answers at once, and lists at most 100 finished
goals in each status message. The limits are those of `LIMITS`; the exit code is 1 beyond one of them.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from scbm.files import read_bindings, read_model
from scbm.nodes.buses.bus import Answered, Bus, Service, Topic
from scbm.nodes.buses.dds import open_dds
from scbm.nodes.links.action_link import ActionLink
from scbm.nodes.links.goals import GoalStatus
from scbm.nodes.links.link import Correlation, LinkContext, Measurement, Reply
from scbm.nodes.types.definitions import (
    CANCEL_GOAL,
    GOAL_STATUS_ARRAY,
    TRIGGER,
    ActionDefinition,
    ListShape,
    MessageDefinition,
    Primitive,
)

if TYPE_CHECKING:
    from scbm.nodes.types.cdr import Message

DOMAIN = 201
_SEQUENCE = (("sequence", ListShape(Primitive("int32"))),)
FIBONACCI = ActionDefinition(
    "test_msgs/action/Fibonacci",
    MessageDefinition("test_msgs/action/Fibonacci_Goal", (("order", Primitive("int32")),)),
    MessageDefinition("test_msgs/action/Fibonacci_Result", _SEQUENCE),
    MessageDefinition("test_msgs/action/Fibonacci_Feedback", _SEQUENCE),
)
CALLED = Service("/called", TRIGGER)
MAX_LISTED = 100
BLOCK = 100
"""Goals and calls are measured in blocks of so many."""

LIMITS = {"goal to call": 6.0, "last third to first": 1.25, "memory": 1.1}
"""A goal is two calls and two status messages, whose entries Cyclone DDS walks through itself: four to five calls."""

LOOPBACK = (
    "<CycloneDDS><Domain Id='any'><General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<Peers><Peer Address='127.0.0.1'/></Peers></Discovery></Domain></CycloneDDS>"
)
TESTS = Path(__file__).parents[1] / "tests"
MODEL = """
behavior_model: gantry_cell
variables:
  lifted: {domain: bool, initial: false}
  order: {domain: 0..9, initial: 0}
resources:
  gantry: {request: [order]}
operations:
  lift: {request: gantry, with: {order: 1}, guard: lifted == false, effects: [lifted <- true]}
goals: {done: lifted == true}
"""
BINDINGS = f"""
bindings_of: gantry_cell
interfaces: [{TESTS / "models" / "interfaces"}]
resources:
  gantry: {{action: {{name: /lift, type: test_msgs/action/Fibonacci, goal: {{order: order}}}}}}
"""


def serve(bus: Bus, kind: ActionDefinition) -> None:
    """Accept each goal, and end it at once."""
    listed: list[dict[str, object]] = []
    status = bus.publisher(Topic("/lift/_action/status", GOAL_STATUS_ARRAY, is_latched=True))
    bus.publisher(Topic("/lift/_action/feedback", kind.feedback_message))

    def publish(which: bytes, is_over: bool) -> None:  # noqa: FBT001 - of this function alone
        entry = {"goal_info": {"goal_id": {"uuid": which}}, "status": int(GoalStatus.SUCCEEDED)}
        active = [] if is_over else [{**entry, "status": int(GoalStatus.EXECUTING)}]
        listed.extend([entry] if is_over else [])
        del listed[:-MAX_LISTED]
        status.publish({"status_list": [*listed, *active]})

    def take(request: Message) -> dict[str, object]:
        publish(bytes(request.goal_id.uuid), is_over=False)
        return {"accepted": True}

    def result(request: Message) -> dict[str, object]:
        publish(bytes(request.goal_id.uuid), is_over=True)
        return {"status": int(GoalStatus.SUCCEEDED), "result": {"sequence": [1]}}

    bus.serve(Service("/lift/_action/send_goal", kind.send_goal), take)
    bus.serve(Service("/lift/_action/get_result", kind.get_result), result)
    bus.serve(Service("/lift/_action/cancel_goal", CANCEL_GOAL), lambda _: {"return_code": 1})
    bus.serve(CALLED, lambda _: {"success": True})


class Waiting:
    """Sends goals and calls one by one."""

    def __init__(self, bus: Bus) -> None:
        (gantry,) = read_bindings(BINDINGS, read_model(MODEL)).resources
        self._is_there, self._news = asyncio.Event(), asyncio.Event()
        self.link = ActionLink(LinkContext(bus, gantry, self, self.warn, time.monotonic_ns))
        self.client = bus.client(CALLED, self._answered)

    def warn(self, what: str) -> None:
        """Stop: nothing is to be warned of."""
        raise SystemExit(what)

    def on_reply(self, _: str, reply: Reply) -> None:
        """Go on with the next goal."""
        if not reply.succeeded:
            raise SystemExit(str(reply))
        self._news.set()

    def on_values(self, _: str, measurement: Measurement) -> None:
        """Stop: there is no feedback."""
        raise SystemExit(str(measurement))

    def on_presence(self, _: str, *, is_there: bool) -> None:
        """Begin once the server is there."""
        if is_there:
            self._is_there.set()

    def _answered(self, _: Answered) -> None:
        self._news.set()

    async def is_there(self) -> None:
        """Wait for the server."""
        await self._is_there.wait()

    async def goals(self, first: int) -> float:
        """Return the CPU seconds of this process for a block of goals."""
        begun = time.process_time()
        for number in range(first, first + BLOCK):
            self._news.clear()
            self.link.send(Correlation("run", number), (("order", 1),))
            await self._news.wait()
        return time.process_time() - begun

    async def calls(self) -> float:
        """Return those for a block of calls."""
        begun = time.process_time()
        for _ in range(BLOCK):
            self._news.clear()
            self.client.call({})
            await self._news.wait()
        return time.process_time() - begun


async def measure(goals: int) -> dict[str, float]:
    """Return the figures of so many goals."""
    bus = open_dds("goals", DOMAIN, print)
    waiting = Waiting(bus)
    await waiting.is_there()
    await waiting.goals(0)
    calls, blocks, memory = [], [], []
    for block in range(1, goals // BLOCK):
        calls.append(await waiting.calls())
        blocks.append(await waiting.goals(block * BLOCK))
        memory.append(resident_kb())
    await bus.close()
    few = max(1, len(blocks) // 3)
    return {
        "goal to call": min(blocks) / min(calls),
        "last third to first": min(blocks[-few:]) / min(blocks[:few]),
        "memory": memory[-1] / memory[len(memory) // 10],
        "CPU ms for each goal": 1000 * min(blocks) / BLOCK,
    }


def resident_kb() -> int:
    """Return the resident memory of this process."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize() // 1024


async def serve_until_end() -> None:
    """Serve until the standard input ends."""
    bus = open_dds("server", DOMAIN, print)
    serve(bus, FIBONACCI)
    await asyncio.to_thread(sys.stdin.read)
    await bus.close()


def main() -> int:
    """Print the figures; return 1 if one is beyond its limit."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--goals", type=int, default=10_000)
    parser.add_argument("--serve", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    os.environ["CYCLONEDDS_URI"] = LOOPBACK
    if options.serve:
        asyncio.run(serve_until_end())
        return 0
    with subprocess.Popen([sys.executable, __file__, "--serve"], stdin=subprocess.PIPE):  # it ends with its input
        found = asyncio.run(measure(options.goals))
    for name, value in found.items():
        limit = f" (limit {LIMITS[name]:g})" if name in LIMITS else ""
        print(f"{name}: {value:.2f}{limit}")
    return int(any(found[name] > limit for name, limit in LIMITS.items()))


if __name__ == "__main__":
    sys.exit(main())
