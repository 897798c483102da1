"""Reads measured topics through a bus, `dds` or `rclpy`: prints a value of each variable, and ends with the last."""

import asyncio
import os
import sys
from pathlib import Path

from scbm.files import read_bindings, read_model
from scbm.nodes.bindings.ros_binding import binding_of
from scbm.nodes.buses.dds import open_dds
from scbm.nodes.buses.rclpy_bus import open_ros2
from scbm.nodes.links.link import Measurement
from scbm.nodes.links.measured_topics import MeasuredTopics


class Listener:
    """Prints what is measured."""

    def __init__(self, names: list[str]) -> None:
        self.missing = names
        self.is_done = asyncio.Event()

    def on_values(self, _: str, measurement: Measurement) -> None:
        for name, value in measurement.values:
            if name in self.missing:
                self.missing.remove(name)
                print(name, value, flush=True)
        if not self.missing:
            self.is_done.set()

    def on_presence(self, _: str, *, is_there: bool) -> None:
        pass

    def on_reply(self, *_: object) -> None:
        pass


async def main(via: str, model: str, bindings: str) -> None:
    open_bus = open_dds if via == "dds" else open_ros2
    bus = open_bus("measured_values", int(os.environ["ROS_DOMAIN_ID"]), lambda what: print("warning", what))
    resource = read_bindings(bindings, read_model(model)).resources[0]
    listener = Listener([measured.reading.variable for measured in binding_of(resource).measured])
    MeasuredTopics(bus, resource, listener)
    print("up", bus.words, flush=True)
    await listener.is_done.wait()
    await bus.close()


asyncio.run(main(sys.argv[1], *(Path(file).read_text(encoding="utf-8") for file in sys.argv[2:])))
