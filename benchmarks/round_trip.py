"""Round trips between two processes on this machine, over DDS: of bare cyclonedds, of the bus, of the runner.

Requests and replies are JSON in a `std_msgs/msg/String` (docs/reference/node-protocol.md). A round trip of the runner
begins when the runner sends the request, and ends when it receives the reply. The bare ones are Python too, with
the same types and qualities, a thread that waits, and no event loop. All are measured in turns, as other work on the
machine changes the figures, and less so their ratio.
"""

from __future__ import annotations

import asyncio
import json
import os
import subprocess
import sys
import time
from statistics import median, quantiles
from typing import TYPE_CHECKING, Any

from cyclonedds.core import InstanceState, Policy, Qos, ReadCondition, SampleState, ViewState, WaitSet
from cyclonedds.domain import DomainParticipant
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic as DdsTopic
from cyclonedds.util import duration

from scbm.cases import Case
from scbm.files import read_model
from scbm.nodes.buses.bus import Topic
from scbm.nodes.buses.dds import open_dds
from scbm.nodes.buses.dds.dds_classes import message_class
from scbm.nodes.buses.dds.dds_names import topic_name
from scbm.nodes.links.link import Correlation
from scbm.nodes.links.topic_link import TopicLink
from scbm.nodes.roles.wall_clock import Clock, Driver
from scbm.nodes.types.definitions import STRING
from scbm.running import GoalGiven, PlanAnswered, PlanStatus, Program, ReplyArrived, RunnerOptions
from scbm.running.simulation.case_runner import CaseRunner

if TYPE_CHECKING:
    from scbm.nodes.buses.bus import Bus, Received
    from scbm.nodes.links.link import Measurement, Reply
    from scbm.running import AskPlan, CancelRequest, RunFinished, SendRequest

DOMAIN = 231
ROUNDS = 5
TRIPS = 2_000
WARM_UP = 200
BURSTS = ((1_000, 50), (5_000, 200))
"""So many requests, with so many under way."""

GUARD_S = 60
"""What has no reply after this is lost."""

LOOPBACK = (
    "<CycloneDDS><Domain Id='any'><General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex><Peers><Peer Address='127.0.0.1'/></Peers></Discovery>"
    "</Domain></CycloneDDS>"
)
REQUEST, REPLY = Topic("/benchmark/request"), Topic("/benchmark/reply")
RUNNER_REQUEST, RUNNER_REPLY = Topic("/benchmark/runner/request"), Topic("/benchmark/runner/reply")
BARE_REQUEST, BARE_REPLY = Topic("/benchmark/bare/request"), Topic("/benchmark/bare/reply")


def request_text(number: int) -> str:
    """A request as a controller sends it."""
    return json.dumps({"id": f"9f2c0123456789abcdef-{number}", "request": {"scanner_command": "scan_item_a"}})


def reply_text(request: str) -> str:
    """Its reply."""
    return json.dumps({"id": json.loads(request)["id"], "succeeded": True})


# at the bus


async def answer_at_bus() -> None:
    """A resource."""
    bus = open_dds("resource", DOMAIN, print)
    replies = bus.publisher(REPLY)
    gone = asyncio.Event()
    bus.subscribe(
        REQUEST, lambda came: replies.publish({"data": reply_text(str(came.message.data))}), left=lambda _: gone.set()
    )
    at_runner = bus.publisher(RUNNER_REPLY)
    bus.subscribe(RUNNER_REQUEST, lambda came: at_runner.publish({"data": reply_text(str(came.message.data))}))
    await gone.wait()
    await bus.close()


class Asker:
    """A controller."""

    def __init__(self, bus: Bus) -> None:
        """Made once."""
        self.ready = asyncio.Event()
        self.answered: dict[str, float] = {}
        self.waiting: dict[str, asyncio.Future[None]] = {}
        self.requests = bus.publisher(REQUEST, self._matched)
        self.replies = bus.subscribe(REPLY, self._receive, self._matched)

    def _matched(self, _count: int) -> None:
        if self.requests.peers and self.replies.peers:
            self.ready.set()

    def _receive(self, came: Received) -> None:
        self.waiting.pop(json.loads(str(came.message.data))["id"]).set_result(None)

    def ask(self, number: int) -> asyncio.Future[None]:
        """Sends a request; the future is done with its reply."""
        text = request_text(number)
        done = asyncio.get_running_loop().create_future()
        self.waiting[json.loads(text)["id"]] = done
        self.requests.publish({"data": text})
        return done

    async def trips(self, count: int) -> list[float]:
        """Seconds of so many round trips, one after another."""
        taken = []
        for number in range(count):
            begin = time.perf_counter()
            await self.ask(number)
            taken.append(time.perf_counter() - begin)
        return taken

    async def burst(self, count: int, in_flight: int) -> float:
        """Seconds of so many requests, with so many under way at any time."""
        places = asyncio.Semaphore(in_flight)

        async def one(number: int) -> None:
            async with places:
                await self.ask(number)

        begin = time.perf_counter()
        try:
            async with asyncio.timeout(GUARD_S):
                await asyncio.gather(*(one(number) for number in range(count)))
        except TimeoutError:
            sys.exit(f"{len(self.waiting)} of {in_flight} under way were lost")
        return time.perf_counter() - begin


# with a runner


class RunnerSide:
    """A runner in wall time whose resources are asked again and again, as fast as they answer."""

    def __init__(self, bus: Bus, resources: int, rounds: int) -> None:
        """So many resources, each asked so many times; all of them at once."""
        model = read_model(asking(resources, rounds))
        self._goal = model.goals[0]
        case = Case("asks", *self._goal, model.nominal_state)
        runner = CaseRunner(Program(model), case, RunnerOptions(plan_limit=10**9))
        self._driver = Driver(runner, Clock(time.monotonic_ns()), self)
        self._link = TopicLink(bus, "all", (RUNNER_REQUEST, RUNNER_REPLY), self, print)
        self._sent: dict[int, float] = {}
        self._there = asyncio.Event()
        self._over = asyncio.Event()
        self.taken: list[float] = []

    async def run(self) -> float:
        """Seconds until all is asked and answered."""
        await self._there.wait()
        begin = time.perf_counter()
        self._driver.give(GoalGiven(*self._goal), time.monotonic_ns())
        try:
            async with asyncio.timeout(GUARD_S):
                await self._over.wait()
        except TimeoutError:
            sys.exit(f"{len(self._sent)} requests were lost")
        return time.perf_counter() - begin

    def send(self, request: SendRequest) -> None:
        """A trip begins."""
        self._sent[request.request] = time.perf_counter()
        self._link.send(Correlation("run_bench", request.request), request.payload)

    def cancel(self, request: CancelRequest) -> None:
        """Never comes."""

    def plan(self, asked: AskPlan) -> None:
        """The one operation."""
        answer = PlanAnswered(asked.ask, PlanStatus.SOLVED, ("work",))
        asyncio.get_running_loop().call_soon(self._driver.give, answer, time.monotonic_ns())

    def stepped(self, _at_ns: int, event: object, _records: object) -> None:
        """The runner has taken an event."""

    def finished(self, _: RunFinished) -> None:
        """All is done."""
        self._over.set()

    def on_reply(self, _resource: str, reply: Reply) -> None:
        """A trip ends."""
        self.taken.append(time.perf_counter() - self._sent.pop(reply.request.number))
        self._driver.give(ReplyArrived(reply.request.number, reply.succeeded), reply.stamp_ns)

    def on_values(self, _resource: str, _measurement: Measurement) -> None:
        """Never comes."""

    def on_presence(self, _resource: str, *, is_there: bool) -> None:
        """The run can begin."""
        if is_there:
            self._there.set()


def asking(resources: int, rounds: int) -> str:
    """A model whose automatic transitions ask each of its resources so many times while its operation executes."""
    names = [f"r{number}" for number in range(resources)]
    lines = ["behavior_model: asking", "variables:"]
    lines += [f"  {name}_n: {{domain: 0..{rounds}, initial: 0}}" for name in names]
    all_asked = " && ".join(f"{name}_n == {rounds}" for name in names)
    lines += ["  done: {domain: bool, initial: false}", "resources:", *(f"  {name}: {{}}" for name in names)]
    lines += ["operations:", "  work:", "    pre: {g: done == false}"]
    lines += [f'    post: {{g: true, gr: "{all_asked}", a: [done <- true]}}', "automatic_transitions:"]
    for name in names:
        idle = f"{name}_req_state == initial && {name}_req_trigger == false && {name}_n < {rounds}"
        taken = f"{name}_req_state <- initial, {name}_req_trigger <- false, {name}_n += 1"
        lines.append(f'  ask_{name}: {{g: "current.state == executing && {idle}", a: [{name}_req_trigger <- true]}}')
        lines.append(f'  take_{name}: {{g: "{name}_req_state == succeeded", a: [{taken}]}}')
    return "\n".join([*lines, "goals:", "  all: done == true", ""])


# bare


class Bare:
    """A writer, a reader, and a thread that waits."""

    def __init__(self, written: Topic, read: Topic) -> None:
        """Made once for each side."""
        self.participant = DomainParticipant(DOMAIN)
        qos = Qos(
            Policy.Reliability.Reliable(duration(seconds=1)),
            Policy.History.KeepAll,
            Policy.DataRepresentation(use_cdrv0_representation=True),
        )
        self.type = message_class(STRING)
        self.writer = DataWriter(self.participant, DdsTopic(self.participant, topic_name(written.name), self.type), qos)
        self.reader = DataReader(self.participant, DdsTopic(self.participant, topic_name(read.name), self.type), qos)
        self.waitset = WaitSet(self.participant)
        self.waitset.attach(ReadCondition(self.reader, SampleState.Any | ViewState.Any | InstanceState.Any))

    def send(self, text: str) -> None:
        """Sends a message."""
        self.writer.write(self.type(data=text))  # type: ignore[call-arg]  # the class is made at run time

    def wait(self) -> list[str]:
        """The messages that came; waits for one."""
        self.waitset.wait(duration(seconds=10))
        taken: list[Any] = self.reader.take(100)
        return [sample.data for sample in taken if sample.sample_info.valid_data]

    def meet(self) -> None:
        """Waits for the other side."""
        while not (self.writer.get_matched_subscriptions() and self.reader.get_matched_publications()):
            time.sleep(0.01)


def answer_bare() -> None:
    """A resource."""
    bare = Bare(BARE_REPLY, BARE_REQUEST)
    bare.meet()
    while bare.reader.get_matched_publications():
        for text in bare.wait():
            bare.send(reply_text(text))


def bare_trips(bare: Bare, count: int) -> list[float]:
    """Seconds of so many round trips, one after another."""
    taken = []
    for number in range(count):
        begin = time.perf_counter()
        bare.send(request_text(number))
        while not (texts := bare.wait()):
            pass
        json.loads(texts[0])
        taken.append(time.perf_counter() - begin)
    return taken


# figures


def printed_us(name: str, taken: list[float]) -> float:
    """Prints the figures of some trips; returns the median in microseconds."""
    middle = median(taken) * 1e6
    print(f"  {name:4} median {middle:6.0f} us, 99th percentile {quantiles(taken, n=100)[-1] * 1e6:6.0f} us")
    return middle


async def runner_trips(count: int) -> list[float]:
    """Seconds of so many round trips through the link of a runner, one after another."""
    bus = open_dds("controller_with_a_runner", DOMAIN, print)
    side = RunnerSide(bus, 1, count)
    await side.run()
    await bus.close()
    return side.taken


async def measure() -> None:
    """Prints the figures."""
    bus = open_dds("controller", DOMAIN, print)
    asker = Asker(bus)
    await asker.ready.wait()
    bare = Bare(BARE_REQUEST, BARE_REPLY)
    await asyncio.to_thread(bare.meet)
    await asker.trips(WARM_UP)
    bare_trips(bare, WARM_UP)
    ratios: dict[str, list[float]] = {"bus": [], "runner": []}
    for number in range(ROUNDS):
        print(f"round {number + 1}, {TRIPS} trips each")
        bare_us = printed_us("bare", bare_trips(bare, TRIPS))
        ratios["bus"].append(printed_us("bus", await asker.trips(TRIPS)) / bare_us)
        ratios["runner"].append(printed_us("runner", await runner_trips(TRIPS)) / bare_us)
    for name, found in ratios.items():
        print(f"{name} / bare: {median(found):.2f} (from {min(found):.2f} to {max(found):.2f})")
    for count, in_flight in BURSTS:
        seconds = await asker.burst(count, in_flight)
        print(f"{count} requests with {in_flight} under way: {count / seconds:,.0f} a second, none lost")
    at_runner = open_dds("controller_with_a_runner", DOMAIN, print)
    count, in_flight = BURSTS[0]
    seconds = await RunnerSide(at_runner, in_flight, count // in_flight).run()
    await at_runner.close()
    print(f"the same through a runner: {count / seconds:,.0f} a second, none lost")
    await bus.close()  # and the other side ends


def main() -> None:
    """Starts the other side, and measures."""
    os.environ.setdefault("CYCLONEDDS_URI", LOOPBACK)
    match sys.argv[1:]:
        case ["bus"]:
            asyncio.run(answer_at_bus())
        case ["bare"]:
            answer_bare()
        case _:
            sides = [subprocess.Popen([sys.executable, __file__, side]) for side in ("bus", "bare")]
            try:
                asyncio.run(measure())
            finally:
                for side in sides:
                    side.terminate()
                    side.wait()


if __name__ == "__main__":
    main()
