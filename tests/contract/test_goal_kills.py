"""Killed controllers, testers and action servers in each phase of a goal: no hang, and no two motions at once."""

from __future__ import annotations

import random
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from support.fibonacci import BINDINGS, CELL
from support.node_processes import NodeProcess, ProcessCell, process_cell, verdicts
from support.peers import LEASE_1S
from support.profiles import share

pytestmark = pytest.mark.dds

SERVER = Path(__file__).parents[1] / "support" / "phased_server.py"
PHASES = ("asked", "accepted", "fed", "over")
KILLS = [(victim, phase) for phase in PHASES for victim in ("controller", "server", "tester")]
MODEL = CELL.replace("deadline: 2 s", "deadline: 8 s")


@dataclass
class Scene:
    """The processes of a cell; each of them may be killed, and comes again."""

    cell: ProcessCell
    cases: int
    servers: list[NodeProcess] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.cell.model.write_text(MODEL, encoding="utf-8")
        (self.cell.directory / "bindings.yaml").write_text(BINDINGS, encoding="utf-8")
        for number in range(self.cases):
            self.cell.case(f"case_{number}")
        self.start_server()
        self.start_controller()
        self.start_tester()

    def start_server(self) -> None:
        self.servers.append(self.cell.program(SERVER))
        self.servers[-1].says("up")

    def start_controller(self) -> None:
        options = ("--real", "gantry", "--bindings", "bindings.yaml")
        self.controller = self.cell.start("node", "controller", self.cell.model, *options)
        self.controller.says("controller of .*")

    def start_tester(self) -> None:
        self.lost = 0
        self.tester = self.cell.tester(*(f"case_{number}.yaml" for number in range(self.cases)), scale=1)

    def says(self, phase: str) -> str:
        """Let goals go on until one is in a phase; return its number."""
        while True:
            printed = self.servers[-1].says("(asked|accepted|fed|over|cancelled) ([0-9]+)")
            if printed[1] == phase:
                return printed[2]
            self.go(printed[1], printed[2])

    def go(self, phase: str, number: str) -> None:
        self.servers[-1].write_line(f"go {phase} {number}")

    def kill(self, victim: str, phase: str) -> None:
        """Kill a process once a goal is in a phase, and start it again."""
        number = self.says(phase)
        if victim == "server":
            self.servers[-1].kill()
            self.lost += 1  # if both servers are there for a moment
            if phase == "asked":  # else it is not known for a while whether the next server has the goal
                self.controller.says("gantry is not reached")
            self.start_server()
        elif victim == "controller":
            self.controller.kill()
            self.lost += 1
            self.go("asked", number)  # what the server has got is carried out without its client
            self.start_controller()
            if phase != "over":
                self.controller.says(".* is busy with goal .*")
                self.go(phase, number)
        else:
            self.tester.kill()
            self.go("asked", number)
            if phase != "over":
                self.servers[-1].says(f"cancelled {number}")
            self.start_tester()


def test_no_kill_lets_a_goal_begin_beside_another_or_makes_a_wrong_verdict(
    domain: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("CYCLONEDDS_URI", LEASE_1S)
    kills = random.Random(1).sample(KILLS, len(KILLS))[: share(12, usual=10)] * (1 if share(100) < 100 else 9)
    with process_cell(domain, tmp_path) as cell:
        scene = Scene(cell, 2 * len(kills) + 4)
        for victim, phase in kills:
            scene.kill(victim, phase)
        scene.servers[-1].write_line("free")
        ended = scene.tester.ends()
        ends = [end for end, _, _ in verdicts(ended).values()]
        assert {*ends} <= {"reached", "lost"}
        assert ends.count("lost") <= scene.lost, verdicts(ended)
        assert len(ends) == scene.cases
        assert all(cell.log(f"case_{number}").exists() for number in range(scene.cases))
        printed = [line for server in scene.servers for line in server.output_lines]
        assert not [line for line in printed if line.startswith(("overlap", "warning"))]
