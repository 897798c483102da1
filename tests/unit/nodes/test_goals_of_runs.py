"""Goals of actions in runs, over the loopback in virtual time: their counts, what is left of them, and busy servers."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from typing import Any, TypeAlias, TypeVar
from uuid import UUID

import pytest

from scbm.cases.trace import End, Record, RequestSent, ResourceChanged
from scbm.files import read_bindings, read_case, read_model
from scbm.nodes import ControllerNode, Lack, NotReadyError, TesterNode
from scbm.nodes.links.goals import GoalStatus
from scbm.testing import Execution, Tester
from support.action_servers import ActionServer
from support.fibonacci import BINDINGS, CELL, FIBONACCI
from support.loops import GUARD_S
from support.nodes import Stage, run_or_lose
from support.virtual_loop import VirtualLoop, run_virtually
from support.wording import Wording

MODEL = read_bindings(BINDINGS, read_model(CELL))
SECOND_NS = 10**9
T = TypeVar("T")


@dataclass
class Cell:
    """A controller, a tester and a server."""

    loop: VirtualLoop
    stage: Stage
    controller: ControllerNode
    server: ActionServer
    tester: TesterNode
    tasks: list[asyncio.Task[Any]] = field(default_factory=list)

    @property
    def goals(self) -> dict[str, int]:
        """The counts of the tester."""
        return {fate: count for (_, fate), count in self.tester.goals.items()}

    async def run(self, more: str = "") -> Execution:
        return await run_or_lose(self.tester, Tester(MODEL), read_case(f"case: lifts\ngoal: done\n{more}", MODEL))

    def beside(self, work: Coroutine[Any, Any, T]) -> asyncio.Task[T]:
        """Begin a coroutine that runs until it ends, or until the test does."""
        task = self.loop.create_task(work)
        self.tasks.append(task)
        return task

    async def close(self) -> None:
        """Cancel the coroutines that still run; raise the error of one that has failed."""
        for task in self.tasks:
            task.cancel()
        for result in await asyncio.gather(*self.tasks, return_exceptions=True):
            if isinstance(result, Exception):
                raise result

    async def comes(self, number: int = 1) -> UUID:
        """Wait until so many goals have come; return the last one."""
        await self.server.until(lambda: len(self.server.goals) >= number)
        return list(self.server.goals)[number - 1]

    async def is_to_be_cancelled(self, which: UUID) -> None:
        await self.server.until(lambda: which in self.server.cancels)
        await self.loop.settle()


Story: TypeAlias = Callable[[Cell], Coroutine[Any, Any, None]]


def play(story: Story) -> Cell:
    async def scene(loop: VirtualLoop) -> Cell:
        stage = Stage.virtual(MODEL, loop)
        server = ActionServer(stage.join("driver"), "/fibonacci", FIBONACCI, says_status=False)
        controller = ControllerNode(stage.context("controller", ["gantry"]))
        cell = Cell(loop, stage, controller, server, stage.tester())
        await cell.tester.wait_for_cell(GUARD_S)
        await story(cell)
        await cell.close()
        return cell

    return run_virtually(scene)


def notes(records: tuple[Record, ...]) -> list[str]:
    return [record.condition for record in records if isinstance(record, ResourceChanged)]


def test_a_goal_that_succeeds_is_counted() -> None:
    async def story(cell: Cell) -> None:
        async def serve() -> None:
            cell.server.end(await cell.comes(), GoalStatus.SUCCEEDED)

        cell.beside(serve())
        execution = await cell.run()
        assert (execution.verdict.end, notes(execution.trace.records)) == (End.REACHED, [])

    assert play(story).goals == {"accepted": 1, "succeeded": 1}


def test_a_goal_that_is_given_up_is_cancelled_before_the_next_one_and_its_driver_stays_there() -> None:
    async def story(cell: Cell) -> None:
        async def serve() -> None:
            first = await cell.comes()
            await cell.is_to_be_cancelled(first)
            await cell.loop.settle(SECOND_NS // 2)
            assert len(cell.server.goals) == 1
            cell.server.end(first, GoalStatus.CANCELED)
            cell.server.end(await cell.comes(2), GoalStatus.SUCCEEDED)

        cell.beside(serve())
        execution = await cell.run()
        assert (execution.verdict.end, notes(execution.trace.records)) == (End.REACHED, [])
        assert [goal.order for goal in cell.server.goals.values()] == [3, 2]

    assert play(story).goals == {"accepted": 2, "cancelled": 1, "succeeded": 1}


@pytest.mark.parametrize("is_refused", [True, False])
def test_a_cancellation_without_effect_is_in_the_trace_and_counted(is_refused: bool, wording: Wording) -> None:  # noqa: FBT001 - a case
    async def story(cell: Cell) -> None:
        async def serve() -> None:
            cell.server.refuses_cancel = is_refused
            first = await cell.comes()
            await cell.is_to_be_cancelled(first)
            await cell.loop.settle(5 * SECOND_NS // 2)
            assert len(cell.server.goals) == 1
            cell.server.end(first, GoalStatus.SUCCEEDED)
            cell.server.end(await cell.comes(2), GoalStatus.SUCCEEDED)

        cell.beside(serve())
        execution = await cell.run()
        assert execution.verdict.end is End.REACHED
        (found,) = [r for r in execution.trace.records if isinstance(r, ResourceChanged)]
        sent = [r.at_ns for r in execution.trace.records if isinstance(r, RequestSent)]
        assert found.at_ns - sent[0] >= (2 if is_refused else 4) * SECOND_NS  # the deadline of its operation, or twice
        wording(execution.sentence(found, {}).text + "\n")

    cell = play(story)
    lost = "cancel_refused" if is_refused else "cancel_ignored"
    assert cell.goals == {"accepted": 2, lost: 1, "succeeded": 2}
    assert len(cell.stage.complaints) == 1


def test_a_goal_that_outlives_its_run_is_cancelled_and_the_next_run_waits_for_its_end() -> None:
    async def story(cell: Cell) -> None:
        async def serve() -> None:
            first = await cell.comes()
            await cell.is_to_be_cancelled(first)
            await cell.loop.settle(SECOND_NS)
            assert len(cell.server.goals) == 1
            cell.server.end(first, GoalStatus.CANCELED)
            cell.server.end(await cell.comes(2), GoalStatus.SUCCEEDED)

        cell.beside(serve())
        execution = await cell.run("limits: {time: 1 s}\n")
        assert execution.verdict.end is End.TIME_LIMIT
        before_ns = cell.loop.now_ns()
        assert (await cell.run()).verdict.end is End.REACHED
        assert cell.loop.now_ns() - before_ns >= SECOND_NS

    assert play(story).goals == {"accepted": 2, "outlived_run": 1, "cancelled": 1, "succeeded": 1}


def test_a_controller_that_leaves_waits_until_its_goal_is_accepted_and_cancelled() -> None:
    async def story(cell: Cell) -> None:
        cell.server.accepts = None
        run = cell.beside(cell.run())
        first = await cell.comes()
        left = cell.beside(cell.controller.close())
        await cell.loop.settle(SECOND_NS)
        assert not left.done()
        cell.server.accept(first)
        await cell.is_to_be_cancelled(first)
        assert not left.done()
        cell.server.end(first, GoalStatus.CANCELED)
        await left
        assert (await run).verdict.end is End.LOST

    assert play(story).goals == {"outlived_run": 1, "accepted": 1, "cancelled": 1}


def test_a_controller_does_not_wait_for_ever_for_a_server_that_ignores_cancellations() -> None:
    async def story(cell: Cell) -> None:
        cell.beside(cell.run())
        await cell.comes()
        before_ns = cell.loop.now_ns()
        await cell.controller.close()
        assert SECOND_NS < cell.loop.now_ns() - before_ns < 5 * SECOND_NS

    play(story)


def test_a_lost_tester_has_the_goal_of_its_run_cancelled() -> None:
    async def story(cell: Cell) -> None:
        cell.beside(cell.run())
        first = await cell.comes()
        await cell.stage.contexts["tester"].bus.close()
        await cell.is_to_be_cancelled(first)

    play(story)


def test_no_run_begins_while_a_goal_of_another_program_is_active(wording: Wording) -> None:
    async def story(cell: Cell) -> None:
        other = UUID(int=7)
        cell.server.has(other, GoalStatus.EXECUTING)
        await cell.loop.settle(SECOND_NS)
        with pytest.raises(NotReadyError) as raised:
            await cell.tester.wait_for_cell(1.0)
        (reason,) = raised.value.reasons
        assert reason.lack is Lack.GOAL
        wording(reason.message + "\n")
        cell.server.has(other, GoalStatus.SUCCEEDED)
        await cell.tester.wait_for_cell(GUARD_S)
        assert (cell.server.goals, cell.server.cancels) == ({}, [])

    play(story)


def test_a_server_without_goals_is_there_only_once_its_status_would_have_come(wording: Wording) -> None:
    async def scene(loop: VirtualLoop) -> None:
        stage = Stage.virtual(MODEL, loop)
        ActionServer(stage.join("driver"), "/fibonacci", FIBONACCI, says_status=False)
        ControllerNode(stage.context("controller", ["gantry"]))
        tester = stage.tester()
        with pytest.raises(NotReadyError) as raised:
            await tester.wait_for_cell(0.9)
        wording("".join(f"{reason.message}\n" for reason in raised.value.reasons))
        await tester.wait_for_cell(GUARD_S)

    run_virtually(scene)
