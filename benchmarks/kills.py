"""Kills nodes of a cell at random moments, starts them again, and looks whether anything went wrong.

`kills.py [--kills N] [--seed S]`: a controller, two nodes of resources and a tester are processes in a DDS domain of
their own. One after another of them is killed (SIGKILL), ended (SIGTERM, SIGINT) or stopped for a while (SIGSTOP), at
moments that are drawn, while testers run random cases. Nothing may hang, no verdict may be wrong, nothing may happen
twice.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import random
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from statistics import median
from threading import Event, Thread
from typing import IO, TYPE_CHECKING, Any

from scbm.cases.trace import ReplyReceived, RequestSent, Trace, trace_digest
from scbm.files import digest_of, load_model
from scbm.nodes.buses.dds import open_dds
from scbm.nodes.roles.cell_topics import CellTopics
from scbm.running import Program
from scbm.testing.event_logs.event_log import open_event_log, replay

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel
    from scbm.nodes.buses.bus import Received

MODEL = Path(__file__).parents[1] / "examples" / "robot_in_the_air" / "after.yaml"
LOOPBACK = (
    "<CycloneDDS><Domain Id='any'><General><Interfaces><NetworkInterface name='lo' multicast='false'/></Interfaces>"
    "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>auto</ParticipantIndex>"
    "<MaxAutoParticipantIndex>60</MaxAutoParticipantIndex><Peers><Peer Address='127.0.0.1'/></Peers></Discovery>"
    "</Domain></CycloneDDS>"
)
SCALE = 20
CASES = 10
"""So many cases a tester has; the next one begins when it has ended."""

NETWORK = "loss: 1 %, jitter: 50 ms"
"""What every second tester does to messages: nothing that makes two of one."""

CALM_S = (0.2, 3.0)
"""Between two kills."""

AWAY_S = 2.0
"""So long a node that was killed stays away at most."""

ENDS_S = 120.0
"""So long a node may take to end when it is asked to."""

HANGS_S = 900.0
"""A tester that takes so long for its cases hangs."""

_LATE_NS = 3_000_000_000
"""A message that comes so long after a kill belongs to another one."""

KINDS = (
    *((signal.SIGKILL,) * 7),
    signal.SIGTERM,
    signal.SIGINT,
    *((signal.SIGSTOP,) * 2),
)
NODES = ("controller", "robot, gantry", "scanner, gripper", "tester")


@dataclass(frozen=True)
class Line:
    """The output lines of a process with their times."""

    stamp_ns: int
    text: str


class Process:
    """A node, and what it says."""

    def __init__(self, name: str, arguments: list[str], directory: Path, domain: int) -> None:
        """Starts it."""
        self.name = name
        self.out: list[Line] = []
        self.err: list[Line] = []
        self.hits: list[tuple[int, signal.Signals]] = []
        self.began_ns = time.monotonic_ns()
        self.ended_ns: int | None = None
        self.command = [sys.executable, "-m", "scbm", "node", *arguments, "--domain", str(domain)]
        self.popen: subprocess.Popen[str] = subprocess.Popen(
            self.command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            cwd=directory,
        )
        self._spoke = Event()
        pairs = ((self.popen.stdout, self.out, self._spoke), (self.popen.stderr, self.err))
        self._threads = [Thread(target=_read, args=pair, daemon=True) for pair in pairs]
        for thread in self._threads:
            thread.start()

    def hit(self, kind: signal.Signals) -> None:
        """Sends a signal, and remembers when."""
        self.hits.append((time.monotonic_ns(), kind))
        self.popen.send_signal(kind)

    def starts(self, wait_s: float) -> None:
        """Waits for its first line: a node has joined its cell then."""
        self._spoke.wait(wait_s)

    def end(self, wait_s: float) -> int | None:
        """Waits until it has ended, and for its whole output; `None` if it hangs, and it is killed."""
        try:
            code: int | None = self.popen.wait(wait_s)
        except subprocess.TimeoutExpired:
            self.popen.kill()
            self.popen.wait()
            code = None
        for thread in self._threads:
            thread.join()
        self.ended_ns = time.monotonic_ns()
        return code

    @property
    def was_ended(self) -> bool:
        """Whether it was asked to end, by a signal or a closed input."""
        return any(kind is not signal.SIGSTOP for _, kind in self.hits)


def _read(stream: IO[str], lines: list[Line], spoke: Event | None = None) -> None:
    for text in stream:
        lines.append(Line(time.monotonic_ns(), text.rstrip("\n")))
        if spoke is not None:
            spoke.set()


@dataclass
class Run:
    """A run, as a listener saw it."""

    case: str
    asked_ns: int
    went_ns: int | None = None
    ended_ns: int | None = None
    abandoned_ns: int | None = None


@dataclass
class Listener:
    """Hears what the tester and the controller say."""

    model: BehaviorModel
    domain: int
    runs: dict[str, Run] = field(default_factory=dict)
    _is_there: Event = field(default_factory=Event)
    _is_over: asyncio.Event = field(default_factory=asyncio.Event)

    def start(self) -> None:
        """Begins."""
        self._thread = Thread(target=asyncio.run, args=(self._listen(),))
        self._thread.start()
        self._is_there.wait()

    def stop(self) -> None:
        """Ends."""
        self._loop.call_soon_threadsafe(self._is_over.set)
        self._thread.join()

    async def _listen(self) -> None:
        self._loop = asyncio.get_running_loop()
        bus, topics = open_dds("listener", self.domain, print), CellTopics.of(self.model)
        bus.subscribe(topics.case, self._hear)
        bus.subscribe(topics.run, self._hear)
        self._is_there.set()
        await self._is_over.wait()
        await bus.close()

    def _hear(self, received: Received) -> None:
        message = json.loads(str(received.message.data))
        if message["kind"] == "prepare" and message["run"] not in self.runs:
            name = message["case"].partition("case: ")[2].partition("\n")[0]
            self.runs[message["run"]] = Run(name, received.stamp_ns)
        run = self.runs.get(message.get("run", ""))
        if run is not None and message["kind"] == "go":
            run.went_ns = received.stamp_ns
        elif run is not None and message["kind"] == "ended":
            run.ended_ns = received.stamp_ns
        elif run is not None and message["kind"] == "abandon":
            run.abandoned_ns = received.stamp_ns


class Cell:
    """The processes, those that were killed among them."""

    def __init__(self, directory: Path, domain: int, chance: random.Random, seed: int) -> None:
        """Starts all of them."""
        self.directory = directory
        self.domain = domain
        self.chance = chance
        self.wrong: list[str] = []
        self.kills: Counter[tuple[str, str]] = Counter()
        self.all: list[Process] = []
        self._seeds = count(seed * 1000)
        self.now = {name: self._start(name) for name in NODES}

    def _start(self, name: str) -> Process:
        model = str(MODEL)
        if name == "tester":
            seed = next(self._seeds)
            network = ["--network", NETWORK] if seed % 2 else []
            options = ["--cases", str(CASES), "--seed", str(seed), "--json", "--logs", str(self.directory / str(seed))]
            arguments = ["tester", model, *options, *network, "--time-scale", str(SCALE), "--wait", "10 min"]
        elif name == "controller":
            arguments = ["controller", model]
        else:
            arguments = ["resources", model, *name.split(", ")]
        self.all.append(Process(name, arguments, self.directory, self.domain))
        return self.all[-1]

    def calm(self, seconds: float) -> None:
        """Lets time pass; a tester that has ended meanwhile is followed by the next."""
        until = time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0:
            tester = self.now["tester"]
            try:
                tester.popen.wait(min(left, 0.2))
            except subprocess.TimeoutExpired:
                if time.monotonic_ns() - tester.began_ns > HANGS_S * 1e9:
                    self.wrong.append(f"a tester hangs: {tester.command}")
                    tester.hit(signal.SIGKILL)
            else:
                tester.end(ENDS_S)
                self.now["tester"] = self._start("tester")

    def kill_one(self) -> None:
        """Kills a node, and brings it back."""
        name, kind = self.chance.choice(NODES), self.chance.choice(KINDS)
        away_s = self.chance.choice((0.0, self.chance.uniform(0, AWAY_S)))
        node = self.now[name]
        self.kills[name, kind.name] += 1
        node.hit(kind)
        if kind is signal.SIGSTOP:
            self.calm_without(name, self.chance.uniform(0.3, 3))
            node.popen.send_signal(signal.SIGCONT)
            return
        if node.end(ENDS_S) is None:
            self.wrong.append(f"{name} does not end by {kind.name}: {node.out[-3:]} {node.err[-3:]}")
        self.calm_without(name, away_s)
        self.now[name] = self._start(name)

    def calm_without(self, name: str, seconds: float) -> None:
        """The same while a node is away."""
        if name == "tester":
            time.sleep(seconds)
        else:
            self.calm(seconds)

    def end(self) -> None:
        """Lets the last tester finish, and ends all others."""
        if self.now["tester"].end(HANGS_S) is None:
            self.wrong.append("the last tester hangs")
        for name in NODES[:-1]:
            self.now[name].starts(ENDS_S)
            self.now[name].hit(signal.SIGTERM)
            code = self.now[name].end(ENDS_S)
            if code != 0:
                self.wrong.append(f"{name} ends by SIGTERM with {code}: {self.now[name].err}")


# what may not be


def check(cell: Cell, listener: Listener, model: BehaviorModel) -> Counter[str]:
    """Adds to `wrong` of the cell what is; returns the verdicts."""
    verdicts: Counter[str] = Counter()
    for tester in (process for process in cell.all if process.name == "tester"):
        if tester.was_ended:
            verdicts["testers that were ended"] += 1
            continue
        try:
            report = json.loads("\n".join(line.text for line in tester.out))
        except ValueError:
            cell.wrong.append(f"a tester reports nothing: {tester.command} {tester.err}")
            continue
        if len(report["cases"]) != CASES:
            cell.wrong.append(f"{len(report['cases'])} cases have a verdict")
        for case in report["cases"]:
            verdicts[_word(case)] += 1
            verdicts.update(case["failures"])
            cell.wrong += _wrong_verdict(case, tester, cell, listener)
    for process in cell.all:
        cell.wrong += _wrong_end(process)
    cell.wrong += _twice(cell)
    for path in sorted(cell.directory.rglob("*.log")):
        cell.wrong += _wrong_log(path, model)
        verdicts["logs that give their trace again"] += 1
    return verdicts


def _word(case: dict[str, Any]) -> str:
    end = str(case["verdict"]).replace("_", " ")
    return end if case["passed"] or end == "lost" else f"{end}, failed"


def _wrong_verdict(case: dict[str, Any], tester: Process, cell: Cell, listener: Listener) -> Iterator[str]:
    runs = [run for run in listener.runs.values() if run.case == case["name"]]  # testers have seeds of their own
    failures = f"{case['name']}: {case['failures']}"
    if case["verdict"] == "lost":
        begin = runs[0].asked_ns if runs else tester.began_ns
        end = (runs[-1].abandoned_ns if runs else None) or time.monotonic_ns()
        if not _was_hit(cell, tester, begin - 5_000_000_000, end):
            yield f"lost, and no node was hit: {failures}"
    elif not case["passed"]:
        yield f"failed: {failures}"
    elif not runs or runs[-1].went_ns is None or runs[-1].ended_ns is None:
        return  # who listens may not have found a new node yet that speaks already
    elif any(  # earlier runs of the case had no controller, and it began again
        runs[-1].went_ns < stamp_ns < runs[-1].ended_ns - 100_000_000
        for process in cell.all
        if process.name == "controller"
        for stamp_ns, kind in process.hits
        if kind is signal.SIGKILL
    ):
        yield f"passed, and the controller was killed in its time: {failures}"


def _was_hit(cell: Cell, tester: Process, begin_ns: int, end_ns: int) -> bool:
    """Whether a controller or the tester was hit in a time, or a controller was not there yet."""
    return any(
        begin_ns < stamp_ns < end_ns
        for process in cell.all
        if process.name == "controller" or process is tester
        for stamp_ns, _ in process.hits
    )


def _wrong_end(process: Process) -> Iterator[str]:
    code, kinds = process.popen.returncode, [kind for _, kind in process.hits]
    early = () if process.out else (130, -signal.SIGTERM)  # it was ended while it loaded
    good = (0,) if process.name != "tester" else (130,) if process.was_ended else (0, 1)
    if process.ended_ns is not None and signal.SIGKILL not in kinds and code not in (*good, *early):
        yield f"{process.name} ended with {code} after {kinds}: {[line.text for line in process.err]}"


def _twice(cell: Cell) -> Iterator[str]:
    """Requests that were taken or answered more than once, by any node."""
    reported = Counter(
        match[0]
        for process in cell.all
        for line in process.out
        if (match := re.search(r"(gets|answers) run_[0-9a-f]+-\d+", line.text))
    )
    return (f"{words}: {times} times" for words, times in reported.items() if times > 1)


def _wrong_log(path: Path, model: BehaviorModel) -> Iterator[str]:
    log = open_event_log(path).read(model, digest_of(model))
    records = replay(log, Program(model))
    if trace_digest(Trace(model.name, log.case.name, records)) != log.trace:
        yield f"{path} gives another trace"
    sent = [record.request for record in records if isinstance(record, RequestSent)]
    answered = Counter(record.request for record in records if isinstance(record, ReplyReceived))
    for request, times in answered.items():
        if times > 1 or request not in sent:
            yield f"{path}: request {request} was answered {times} times"


# figures


def noticed(cell: Cell, listener: Listener) -> dict[str, list[float]]:
    """Seconds from a SIGKILL to the line or message that tells of it, if there is one before the next."""
    delays_s: dict[str, list[float]] = {
        "controller, by the tester": [],
        "tester, by the controller": [],
        "resources": [],
    }
    controller_lines = [line for process in cell.all if process.name == "controller" for line in process.out]
    for process in cell.all:
        for stamp_ns, kind in process.hits:
            if kind is not signal.SIGKILL:
                continue
            if process.name == "controller":
                stamps = [
                    run.abandoned_ns
                    for run in listener.runs.values()
                    if run.abandoned_ns and run.went_ns and run.went_ns < stamp_ns < run.abandoned_ns
                ]
                _add(delays_s["controller, by the tester"], stamp_ns, stamps)
            elif process.name == "tester":
                gone = [line.stamp_ns for line in controller_lines if line.text.startswith("the tester is gone")]
                _add(delays_s["tester, by the controller"], stamp_ns, gone)
            else:
                name = process.name.partition(",")[0]
                gone = [line.stamp_ns for line in controller_lines if line.text == f"{name} is not there"]
                _add(delays_s["resources"], stamp_ns, gone)
    return delays_s


def _add(seconds: list[float], stamp_ns: int, later_ns: list[int]) -> None:
    behind = [later - stamp_ns for later in later_ns if 0 < later - stamp_ns < _LATE_NS]
    if behind:
        seconds.append(min(behind) / 1e9)


def went_on(cell: Cell, listener: Listener) -> list[float]:
    """Seconds from a new controller's first line to the next case that goes."""
    goes = sorted(run.went_ns for run in listener.runs.values() if run.went_ns is not None)
    begins = [process.out[0].stamp_ns for process in cell.all if process.name == "controller" and process.out]
    behind = (next((go for go in goes if go > begin), None) for begin in begins[1:])
    return [(go - begin) / 1e9 for begin, go in zip(begins[1:], behind, strict=True) if go is not None]


def _spread(seconds: list[float]) -> str:
    if not seconds:
        return "-"
    return f"median {median(seconds):.2f} s, most {max(seconds):.2f} s, of {len(seconds)}"


def main() -> None:
    """Kills, checks, prints; ends with 1 if anything was wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--domain", type=int, default=230)
    options = parser.parse_args()
    os.environ.setdefault("CYCLONEDDS_URI", LOOPBACK)
    model = load_model(MODEL)
    listener = Listener(model, options.domain)
    listener.start()
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as directory:
        chance = random.Random(options.seed)  # noqa: S311 - no secrets
        cell = Cell(Path(directory), options.domain, chance, options.seed)
        cell.calm(3)
        for number in range(1, options.kills + 1):
            cell.kill_one()
            cell.calm(cell.chance.uniform(*CALM_S))
            if not number % 20:
                print(f"{number} kills, {time.monotonic() - began:.0f} s", flush=True)
        cell.end()
        listener.stop()
        verdicts = check(cell, listener, model)
    print(f"seed {options.seed}: {options.kills} kills in {time.monotonic() - began:.0f} s")
    for (name, kind), times in sorted(cell.kills.items()):
        print(f"  {times:4} {kind:8} {name}")
    for word, times in verdicts.most_common():
        print(f"  {times:4} {word}")
    for name, seconds in noticed(cell, listener).items():
        print(f"  a killed {name} is missed after: {_spread(seconds)}")
    print(f"  a new controller has its first case after: {_spread(went_on(cell, listener))}")
    lines = Counter(re.sub(r"[0-9a-f]{8,}|\d+", "…", line.text) for process in cell.all for line in process.err)
    for text, times in lines.most_common(20):
        print(f"  {times:4} on stderr: {text[:200]}")
    for wrong in cell.wrong:
        print(f"WRONG {wrong}")
    sys.exit(1 if cell.wrong else 0)


if __name__ == "__main__":
    main()
