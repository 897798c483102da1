"""A link of scbm to an action, through rclpy: it takes commands from its standard input, and prints what it hears.

`goal_sender.py BINDINGS` reads a file with bindings of `support.fibonacci.CELL`, and takes the lines
`send NUMBER ORDER`, `cancel NUMBER`, `end`.
"""

import asyncio
import os
import sys
from pathlib import Path
from time import monotonic_ns

from scbm.files import load_bindings, read_model
from scbm.nodes.buses.rclpy_bus import open_ros2
from scbm.nodes.links.action_link import ActionLink
from scbm.nodes.links.link import Correlation, LinkContext, Measurement, Reply
from support.fibonacci import CELL


def say(*words: object) -> None:
    print(*words, flush=True)


class Listener:
    """Prints what comes through the link."""

    def on_reply(self, _: str, reply: Reply) -> None:
        say("reply", reply.request.number, reply.succeeded, *(value for _, value in reply.measured))

    def on_values(self, _: str, measurement: Measurement) -> None:
        say("feedback", *(value for _, value in measurement.values))

    def on_presence(self, _: str, *, is_there: bool) -> None:
        say("there" if is_there else "gone")


async def main() -> None:
    bus = open_ros2("scbm_goal_sender", int(os.environ["ROS_DOMAIN_ID"]), lambda what: say("warning", what))
    count = lambda request, fate: say("goal", request.number, fate.value)  # noqa: E731 - of one line
    model = read_model(CELL.replace("publishes: [zone]", "publishes: [zone], measures: [zone]"))
    (gantry,) = load_bindings(Path(sys.argv[1]), model).resources
    link = ActionLink(LinkContext(bus, gantry, Listener(), lambda what: say("warning", what), monotonic_ns, count))
    say("up", bus.words)
    while (line := (await asyncio.to_thread(sys.stdin.readline)).split()) and line[0] != "end":
        request = Correlation("run", int(line[1]))
        if line[0] == "send":
            link.send(request, (("order", int(line[2])),))
        else:
            link.cancel(request)
    while link.end_run():  # noqa: ASYNC110 - links report only ends of requests
        await asyncio.sleep(0.01)
    await bus.close()


asyncio.run(main())
