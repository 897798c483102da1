"""Cells of nodes: on `loopback` in virtual time, where runs are those of simulations; in wall time; over DDS."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from time import monotonic_ns

from msgspec import structs

from scbm.cases import Case
from scbm.cases.trace import MessageDisturbed, Record, ResourceChanged
from scbm.files import digest_of
from scbm.model import BehaviorModel
from scbm.nodes import Bus, BusError, ControllerNode, LostError, NodeContext, ResourcesNode, TesterNode, new_status
from scbm.nodes.buses.loopback import LoopbackHub
from scbm.nodes.node_messages import Status, encode
from scbm.nodes.roles.cell_topics import REPETITIONS, STATUS_PERIOD_S, CellTopics
from scbm.planning import PlanLimits
from scbm.running.simulation import PlainReactions
from scbm.testing import Execution, Tester
from support.loops import GUARD_S
from support.virtual_loop import VirtualLoop

JOINS_NS = int((REPETITIONS + 1) * STATUS_PERIOD_S * 1e9)
"""After this time the others of a cell know a node."""


def repeat_status(bus: Bus, status: Callable[[], Status]) -> None:
    """Publish a status again and again, as a node does, until the bus is closed."""
    publisher, loop = bus.publisher(CellTopics(f"/scbm/{status().model}").status), asyncio.get_running_loop()

    def publish() -> None:
        with suppress(BusError):
            publisher.publish({"data": encode(status())})
            loop.call_later(STATUS_PERIOD_S, publish)

    publish()


@dataclass
class Stage:
    """The buses of the nodes of a model, and what they print.

    Attributes:
        model: what they are for.
        join: opens a bus for a node of this name.
        now_ns: the clock of all.
    """

    model: BehaviorModel
    join: Callable[[str], Bus]
    now_ns: Callable[[], int] = monotonic_ns
    complaints: list[str] = field(default_factory=list)
    output: list[str] = field(default_factory=list)
    contexts: dict[str, NodeContext] = field(default_factory=dict)

    @staticmethod
    def virtual(model: BehaviorModel, loop: VirtualLoop) -> Stage:
        return Stage(model, LoopbackHub(loop.now_ns).join, loop.now_ns)

    def context(self, role: str, resources: Iterable[str] = (), digest: str | None = None) -> NodeContext:
        """Return a context with a bus of its own; the last one of each role is kept."""
        status = new_status(role, self.model, digest or digest_of(self.model), resources)
        context = NodeContext(
            self.join(role), self.model, status, self.complaints.append, self.output.append, self.now_ns
        )
        self.contexts[role] = context
        return context

    def controller(self, plan_limits: PlanLimits | None = None) -> ControllerNode:
        return ControllerNode(self.context("controller"), plan_limits=plan_limits)

    def resources(self, names: Iterable[str] | None = None) -> ResourcesNode:
        known = [resource.name for resource in self.model.resources]
        return ResourcesNode(self.context("resources", known if names is None else names), PlainReactions())

    def tester(self, time_scale: Fraction = Fraction(1)) -> TesterNode:
        return TesterNode(self.context("tester"), time_scale)


async def run_cases(stage: Stage, cases: Iterable[Case], time_scale: Fraction = Fraction(1)) -> list[Execution]:
    """Runs cases one by one in a whole cell, and leaves it."""
    controller, resources = stage.controller(), stage.resources()
    node, tester = stage.tester(time_scale), Tester(stage.model)
    await node.wait_for_cell(GUARD_S)
    executions = [await run_case(node, tester, case) for case in cases]
    await controller.close()
    await resources.close()
    for context in stage.contexts.values():
        await context.bus.close()
    assert stage.complaints == []
    return executions


async def run_case(node: TesterNode, tester: Tester, case: Case) -> Execution:
    """Runs one."""
    choices = tester.choices_of(case)
    done = await node.run(case, choices, tester.options_of(case))
    return tester.judged(case, done.run, done.log.reactions, done.log)


async def run_or_lose(node: TesterNode, tester: Tester, case: Case) -> Execution:
    """Runs one; of a lost run what a report gets."""
    try:
        return await run_case(node, tester, case)
    except LostError as error:
        partial = error.partial
        return tester.lost(case, str(error), *(() if partial is None else (partial.run, partial.log)))


def notes(records: Iterable[Record]) -> list[Record]:
    """What the tester noted of the network; where such a record stands depends on when the note of it came."""
    return [record for record in records if _is_note(record)]


def without_notes(records: Iterable[Record]) -> list[Record]:
    """The output lines of the runner."""
    return [record for record in records if not _is_note(record)]


def without_times(records: Sequence[Record]) -> list[Record]:
    """The same records, all at once: messages and plans take time where nothing is simulated."""
    return [structs.replace(record, at_ns=0) for record in records]


def _is_note(record: Record) -> bool:
    return isinstance(record, MessageDisturbed) or (
        isinstance(record, ResourceChanged) and record.injection == "network"
    )
