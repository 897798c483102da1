"""Nodes as real processes, in a DDS domain of their own: started, listened to, killed, and waited for."""

from __future__ import annotations

import json
import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import IO, Any

from support.loops import GUARD_S, LINE_GUARD_S

PATIENCE = ("--wait", "10 min")
"""Nodes come when their processes have started; no test waits so long for one that comes."""

MODEL = """
behavior_model: trouble
variables:
  pressed: {domain: bool, initial: false}
  lit: {domain: bool, initial: false}
  arm_command: {domain: [none, press], initial: none}
resources:
  arm: {request: [arm_command], simulation: {latency: 1 s}}
  lamp: {simulation: {latency: 1 s}}
operations:
  press:
    deadline: 10 s
    pre: {g: arm_req_state == initial && pressed == false, a: [arm_req_trigger <- true, arm_command <- press]}
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [arm_req_state <- initial, arm_req_trigger <- false, pressed <- true]
    timedout: [arm_req_trigger <- false]
  light:
    deadline: 10 s
    pre: {g: lamp_req_state == initial && pressed == true && lit == false, a: [lamp_req_trigger <- true]}
    post:
      g: true
      gr: lamp_req_state == succeeded
      a: [lamp_req_state <- initial, lamp_req_trigger <- false, lit <- true]
    timedout: [lamp_req_trigger <- false]
goals: {done: lit == true}
"""
"""An arm presses, then a lamp is lit. What is not answered is tried again."""


class Ended:
    """The output of a process, and how it ended."""

    def __init__(self, code: int, out: str, err: str) -> None:
        self.code = code
        self.out = out
        self.err = err


class NodeProcess:
    """A process whose lines of stdout can be waited for.

    Attributes:
        process: of the operating system.
    """

    def __init__(self, command: list[str], directory: Path, environment: Mapping[str, str] | None = None) -> None:
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            command, stdin=pipe, stdout=pipe, stderr=pipe, text=True, cwd=directory, env=environment
        )
        self._output_lines: list[str] = []
        self._complained: list[str] = []
        self._lines: Queue[str | None] = Queue()
        assert self.process.stdout is not None
        assert self.process.stderr is not None
        self._threads = [
            Thread(target=_read, args=(self.process.stdout, self._output_lines, self._lines), daemon=True),
            Thread(target=_read, args=(self.process.stderr, self._complained), daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def says(self, pattern: str, guard_s: float = LINE_GUARD_S) -> re.Match[str]:
        """Waits for a line of stdout that matches as a whole; those before it are left behind."""
        until = time.monotonic() + guard_s
        try:
            while (line := self._lines.get(timeout=max(0.0, until - time.monotonic()))) is not None:
                if match := re.fullmatch(pattern, line):
                    return match
        except Empty:
            raise AssertionError(f"for {guard_s} s nothing like `{pattern}`: {self.all}") from None
        raise AssertionError(f"it ended, and printed nothing like `{pattern}`: {self.all}")

    @property
    def all(self) -> str:
        """The output so far."""
        return "\n".join(("", *self._output_lines, "-- stderr", *self._complained))

    @property
    def output_lines(self) -> tuple[str, ...]:
        """The lines of stdout so far."""
        return tuple(self._output_lines)

    def write_line(self, line: str) -> None:
        """Write a line to its stdin."""
        assert self.process.stdin is not None
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()

    def send(self, name: signal.Signals) -> None:
        """Sends a signal."""
        self.process.send_signal(name)

    def kill(self) -> None:
        """SIGKILL, and it is gone."""
        self.process.kill()
        self.process.wait(GUARD_S)

    def end(self) -> None:
        """Kill it, if it still runs, and forget its output."""
        _end(self.process)

    def ends(self, guard_s: float = GUARD_S) -> Ended:
        """Waits until it ends."""
        code = self.process.wait(guard_s)
        for thread in self._threads:
            thread.join(guard_s)
        return Ended(code, _joined(self._output_lines), _joined(self._complained))


def _joined(lines: list[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def _read(stream: IO[str], kept: list[str], lines: Queue[str | None] | None = None) -> None:
    for line in stream:
        kept.append(line.rstrip("\n"))
        if lines is not None:
            lines.put(kept[-1])
    if lines is not None:
        lines.put(None)


@dataclass
class ProcessCell:
    """Processes of one model in one domain, whose files are in one directory."""

    domain: int
    directory: Path
    stack: ExitStack
    model: Path = field(init=False)

    def __post_init__(self) -> None:
        self.model = self.directory / "model.yaml"
        self.model.write_text(MODEL, encoding="utf-8")

    def case(self, name: str, text: str = "") -> Path:
        """A case file for the goal, with more lines of it."""
        path = self.directory / f"{name}.yaml"
        path.write_text(f"case: {name}\nmodel: model.yaml\ngoal: done\n{text}\n", encoding="utf-8")
        return path

    def start(self, *arguments: object) -> NodeProcess:
        """`scbm …` in the domain; it is killed at the end, if it still runs."""
        command = [sys.executable, "-m", "scbm", *map(str, arguments), "--domain", str(self.domain)]
        node = NodeProcess(command, self.directory)
        self.stack.callback(_end, node.process)
        return node

    def program(self, path: Path) -> NodeProcess:
        """A program in Python that gets the domain as its argument; it is killed at the end, if it still runs."""
        node = NodeProcess([sys.executable, str(path), str(self.domain)], self.directory)
        self.stack.callback(_end, node.process)
        return node

    def controller(self, model: Path | None = None) -> NodeProcess:
        """A controller, which is there."""
        node = self.start("node", "controller", model or self.model)
        node.says("controller of .*")
        return node

    def resources(self, *names: str) -> NodeProcess:
        """Resources, which are there."""
        node = self.start("node", "resources", self.model, *names)
        node.says("resources of .*")
        return node

    def tester(self, *arguments: object, scale: int = 4) -> NodeProcess:
        """Start a tester, which prints JSON at its end and keeps all logs.

        At the scale 4 the deadlines of `MODEL` are 2.5 s of the wall: a busy machine has killed a node by then.
        """
        patience = () if "--wait" in arguments else PATIENCE
        options = ("--json", "--logs", "logs", "--time-scale", scale, *patience)
        return self.start("node", "tester", self.model, *options, *arguments)

    def log(self, case: str) -> Path:
        """The log of a case."""
        return self.directory / "logs" / f"{case}.log"


def _end(process: subprocess.Popen[str]) -> None:
    if process.poll() is None:
        process.send_signal(signal.SIGCONT)
        process.kill()
    process.wait(GUARD_S)
    for stream in (process.stdin, process.stdout, process.stderr):
        if stream is not None:
            stream.close()


@contextmanager
def process_cell(domain: int, directory: Path) -> Iterator[ProcessCell]:
    """A cell without processes yet; all of them are ended at the end."""
    with ExitStack() as stack:
        yield ProcessCell(domain, directory, stack)


def verdicts(ended: Ended) -> dict[str, tuple[str, bool, str]]:
    """Of each case that a tester reports: its end, whether it passed, and why not."""
    assert ended.out, ended.err
    cases = json.loads(ended.out)["cases"]
    return {case["name"]: (case["verdict"], case["passed"], "; ".join(case["failures"])) for case in cases}


def wait_for_end(process: int, guard_s: float = GUARD_S) -> None:
    """Wait until a process has ended that is no child of this one."""
    try:
        handle = os.pidfd_open(process)
    except ProcessLookupError:
        return
    try:
        ready, _, _ = select.select([handle], [], [], guard_s)
    finally:
        os.close(handle)
    assert ready, f"process {process} still runs"


def process_of(status: dict[str, Any]) -> int:
    """The process of a node that has printed its identity."""
    match = re.match(r"process (\d+) on ", status["words"])
    assert match, status
    return int(match[1])
