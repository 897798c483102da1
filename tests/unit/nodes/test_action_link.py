"""Requests as goals of actions, over the loopback: sent once and in turn, and cancelled though no driver waits."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import dataclass, field
from math import nan
from time import monotonic_ns
from typing import Any, TypeAlias
from uuid import UUID

import pytest
from msgspec.structs import replace

from scbm.files import read_model
from scbm.model import Reference, Resource
from scbm.nodes.bindings.ros_binding import ActionCall, Interval, Reading, RosBinding, binding_of
from scbm.nodes.buses.bus import UnmatchedKind
from scbm.nodes.buses.loopback import LoopbackBus, LoopbackHub
from scbm.nodes.links.action_link import ActionLink
from scbm.nodes.links.goals import GoalStatus, goal_id
from scbm.nodes.links.link import Correlation, LinkContext
from scbm.nodes.links.measured_topics import Refusals
from scbm.nodes.types.definitions import ActionDefinition, ListShape, MessageDefinition, Primitive
from scbm.running import Program
from support.action_servers import ActionServer
from support.fibonacci import CELL, FIBONACCI, GANTRY, INT, path
from support.hearing import Heard
from support.loops import run
from support.wording import Wording


@dataclass
class Scene:
    """A link and its server."""

    hub: LoopbackHub = field(default_factory=LoopbackHub)
    resource: Resource = GANTRY
    within_s: float = 10.0
    heard: Heard = field(default_factory=Heard)
    complaints: list[str] = field(default_factory=list)
    fates: list[tuple[int, str]] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.bus: LoopbackBus = self.hub.join("driver")
        binding = binding_of(self.resource).requests
        assert isinstance(binding, ActionCall)
        self.server = ActionServer(self.bus, binding.name, binding.type)
        context = LinkContext(
            self.hub.join("controller"), self.resource, self.heard, self.complaints.append, monotonic_ns,
            lambda request, fate: self.fates.append((request.number, fate.value)), lambda _: self.within_s,
        )  # fmt: skip
        self.link = ActionLink(context)

    async def send(self, number: int) -> UUID:
        """Send a request, and wait until its goal has come to the server, if it can."""
        request = Correlation("run", number)
        self.link.send(request, (("shelf", number),))
        await settled()
        return goal_id(request)

    async def cancel(self, number: int) -> None:
        self.link.cancel(Correlation("run", number))
        await settled()

    async def end(self, which: UUID, status: GoalStatus, *sequence: int) -> None:
        self.server.end(which, status, sequence=list(sequence))
        await settled()


Story: TypeAlias = Callable[[Scene], Coroutine[Any, Any, None]]


async def settled() -> None:
    """Wait until all messages in the loopback have come; none needs so many turns of the loop."""
    for _ in range(20):
        await asyncio.sleep(0)


def play(story: Story, resource: Resource = GANTRY) -> Scene:
    async def scenario() -> Scene:
        scene = Scene(resource=resource)
        await settled()
        await story(scene)
        await settled()
        return scene

    return run(scenario())


@pytest.mark.parametrize(
    ("status", "sequence", "expected"),
    [
        (GoalStatus.SUCCEEDED, (0, 5), (True, (("zone", "far"),))),
        (GoalStatus.SUCCEEDED, (1, 5), (False, ())),
        (GoalStatus.SUCCEEDED, (), (False, ())),
        (GoalStatus.ABORTED, (0, 5), (False, ())),
        (GoalStatus.CANCELED, (0, 5), (False, ())),
        (GoalStatus.UNKNOWN, (0, 5), (False, ())),
    ],
)
def test_the_end_of_a_goal_is_the_reply(status: GoalStatus, sequence: tuple[int, ...], expected: object) -> None:
    async def story(scene: Scene) -> None:
        which = await scene.send(1)
        assert scene.server.goals[which].order == 1
        assert scene.heard.replies == []
        await scene.end(which, status, *sequence)

    scene = play(story)
    ((name, reply),) = scene.heard.replies
    assert (name, reply.request) == ("gantry", Correlation("run", 1))
    assert (reply.succeeded, reply.measured) == expected
    assert scene.complaints == []
    ends = {GoalStatus.SUCCEEDED: "succeeded", GoalStatus.ABORTED: "aborted", GoalStatus.CANCELED: "cancelled"}
    assert scene.fates == [(1, "accepted"), *([(1, ends[status])] if status in ends else [])]


def test_a_rejected_goal_has_failed() -> None:
    async def story(scene: Scene) -> None:
        scene.server.accepts = False
        await scene.send(1)
        await scene.send(2)

    scene = play(story)
    assert scene.heard.numbers() == [(1, False), (2, False)]
    assert scene.fates == [(1, "rejected"), (2, "rejected")]
    assert len(scene.server.goals) == 2


def test_feedback_measures(wording: Wording) -> None:
    async def story(scene: Scene) -> None:
        scene.server.accepts = None
        which = await scene.send(1)
        scene.server.feed_back(which, sequence=[9])
        await settled()
        scene.server.accept(which)
        await settled()
        scene.server.feed_back(which, sequence=[1])
        scene.server.feed_back(UUID(int=0), sequence=[9])
        scene.server.feed_back(which, sequence=[7])

    scene = play(story)
    assert [measured.values for _, measured in scene.heard.values] == [(("zone", "near"),), (("zone", "far"),)]
    wording("".join(f"{each}\n" for each in scene.complaints))


def test_the_next_goal_waits_until_the_one_before_is_over() -> None:
    async def story(scene: Scene) -> None:
        first = await scene.send(1)
        second = await scene.send(2)
        assert list(scene.server.goals) == [first]
        await scene.end(first, GoalStatus.SUCCEEDED, 0, 0)
        assert list(scene.server.goals) == [first, second]

    play(story)


def test_a_goal_that_waits_and_is_cancelled_is_never_sent() -> None:
    async def story(scene: Scene) -> None:
        first = await scene.send(1)
        await scene.send(2)
        await scene.cancel(2)
        await scene.end(first, GoalStatus.SUCCEEDED, 0, 0)
        assert list(scene.server.goals) == [first]
        assert scene.server.cancels == []

    play(story)


@pytest.mark.parametrize("is_accepted", [True, False])
def test_a_cancellation_reaches_the_server_also_if_the_goal_is_accepted_later(is_accepted: bool) -> None:  # noqa: FBT001 - a case
    async def story(scene: Scene) -> None:
        scene.server.accepts = True if is_accepted else None
        which = await scene.send(1)
        await scene.cancel(1)
        if not is_accepted:
            assert scene.server.cancels == []
            scene.server.accept(which)
            await settled()
        assert scene.server.cancels == [which]
        scene.server.accepts = True
        following = await scene.send(2)
        assert (list(scene.server.goals), scene.link.is_there) == ([which], True)
        await scene.end(which, GoalStatus.CANCELED)
        assert (list(scene.server.goals), scene.link.is_there) == ([which, following], True)
        await scene.end(following, GoalStatus.SUCCEEDED, 0, 0)

    scene = play(story)
    assert scene.heard.numbers() == [(2, True)]
    assert scene.fates == [(1, "accepted"), (1, "cancelled"), (2, "accepted"), (2, "succeeded")]


def test_a_goal_that_is_rejected_after_its_cancellation_is_over() -> None:
    async def story(scene: Scene) -> None:
        scene.server.accepts = None
        which = await scene.send(1)
        await scene.cancel(1)
        scene.server.accept(which, accepted=False)
        await settled()
        assert scene.server.cancels == []
        assert scene.link.is_there

    assert play(story).heard.replies == []


def test_a_cancelled_goal_is_over_by_its_status_though_its_result_never_comes() -> None:
    async def story(scene: Scene) -> None:
        which = await scene.send(1)
        await scene.cancel(1)
        scene.server.has(which, GoalStatus.CANCELED)
        await settled()
        await scene.send(2)
        assert len(scene.server.goals) == 2

    assert play(story).fates == [(1, "accepted"), (1, "cancelled"), (2, "accepted")]


def test_messages_about_a_former_goal_do_not_end_the_present_one() -> None:
    async def story(scene: Scene) -> None:
        first = await scene.send(1)
        await scene.cancel(1)
        scene.server.has(first, GoalStatus.CANCELED)  # its result comes later
        await settled()
        second = await scene.send(2)
        await scene.end(first, GoalStatus.SUCCEEDED, 0, 0)
        await scene.cancel(2)
        await scene.send(3)
        assert list(scene.server.goals) == [first, second]
        await scene.end(second, GoalStatus.CANCELED)
        assert len(scene.server.goals) == 3

    scene = play(story)
    assert scene.heard.replies == []
    assert scene.fates == [(1, "accepted"), (1, "cancelled"), (2, "accepted"), (2, "cancelled"), (3, "accepted")]


def test_a_refused_cancellation_is_reported_and_the_goal_watched(wording: Wording) -> None:
    async def story(scene: Scene) -> None:
        scene.server.refuses_cancel = True
        which = await scene.send(1)
        await scene.cancel(1)
        assert scene.link.is_there
        await scene.send(2)
        assert list(scene.server.goals) == [which]
        await scene.end(which, GoalStatus.SUCCEEDED, 0, 0)
        assert len(scene.server.goals) == 2

    scene = play(story)
    assert scene.heard.replies == []
    assert scene.fates == [(1, "accepted"), (1, "cancel_refused"), (1, "succeeded"), (2, "accepted")]
    wording("".join(f"{each}\n" for each in scene.complaints))


def test_an_ignored_cancellation_is_reported_after_the_time_of_its_operation(wording: Wording) -> None:
    async def story(scene: Scene) -> None:
        await scene.send(1)
        scene.within_s = 0.0
        await scene.cancel(1)

    scene = play(story)
    assert scene.fates == [(1, "accepted"), (1, "cancel_ignored")]
    wording("".join(f"{each}\n" for each in scene.complaints))


def test_the_goal_of_another_program_makes_a_server_busy(wording: Wording) -> None:
    async def story(scene: Scene) -> None:
        other = UUID(int=7)
        scene.server.has(other, GoalStatus.EXECUTING)
        await settled()
        why = scene.link.why_unmatched()
        assert why is not None
        scene.complaints.append(why.why)
        await scene.send(1)
        assert scene.server.goals == {}
        scene.server.has(other, GoalStatus.SUCCEEDED)
        await settled()
        assert len(scene.server.goals) == 1
        assert scene.server.cancels == []

    wording("".join(f"{each}\n" for each in play(story).complaints))


def test_a_late_status_of_a_goal_that_is_over_keeps_nobody_waiting() -> None:
    async def story(scene: Scene) -> None:
        which = await scene.send(1)
        await scene.end(which, GoalStatus.SUCCEEDED, 0, 0)
        scene.server.has(which, GoalStatus.EXECUTING)
        await settled()
        assert scene.link.is_there

    play(story)


@pytest.mark.parametrize("is_accepted", [True, False])
def test_the_end_of_a_run_cancels_its_goal_and_the_driver_is_there_once_that_is_over(
    is_accepted: bool,  # noqa: FBT001 - a case
    wording: Wording,
) -> None:
    async def story(scene: Scene) -> None:
        scene.server.accepts = True if is_accepted else None
        which = await scene.send(1)
        await scene.send(2)
        assert (scene.link.end_run(), scene.link.end_run(), scene.link.is_there) == (True, True, False)
        why = scene.link.why_unmatched()
        assert why is not None
        scene.complaints.append(why.why)
        await settled()
        if not is_accepted:
            scene.server.accept(which)
            await settled()
        await scene.end(which, GoalStatus.CANCELED)
        assert scene.server.cancels == list(scene.server.goals) == [which]
        assert (scene.link.end_run(), scene.link.is_there) == (False, True)

    scene = play(story)
    order = ("accepted", "outlived_run") if is_accepted else ("outlived_run", "accepted")
    assert [fate for _, fate in scene.fates] == [*order, "cancelled"]
    wording("".join(f"{each}\n" for each in scene.complaints))


def test_a_lost_server_gives_no_reply_and_another_one_gets_the_next_goal(wording: Wording) -> None:
    async def story(scene: Scene) -> None:
        await scene.send(1)
        await scene.bus.close()
        await settled()
        assert not scene.link.is_there
        server = ActionServer(scene.hub.join("driver"), "/fibonacci", FIBONACCI)
        await settled()
        following = await scene.send(2)
        assert list(server.goals) == [following]

    scene = play(story)
    assert scene.heard.replies == []
    wording("".join(f"{each}\n" for each in scene.complaints))


@pytest.mark.parametrize("is_accepted", [True, False])
def test_a_server_that_leaves_after_the_next_one_has_come_is_lost_with_its_goal(is_accepted: bool) -> None:  # noqa: FBT001 - a case
    async def story(scene: Scene) -> None:
        scene.within_s = 0.0
        scene.server.accepts = True if is_accepted else None
        await scene.send(1)
        server = ActionServer(scene.hub.join("driver"), "/fibonacci", FIBONACCI)
        await settled()
        scene.link.end_run()
        await scene.bus.close()
        await settled()
        following = await scene.send(2)
        assert (list(server.goals), scene.link.is_there) == ([following], True)

    assert play(story).heard.replies == []


@pytest.mark.parametrize("is_accepted", [True, False])
def test_a_goal_at_a_server_that_another_one_joins_for_a_while_is_watched(is_accepted: bool) -> None:  # noqa: FBT001 - a case
    async def story(scene: Scene) -> None:
        scene.server.accepts = True if is_accepted else None
        first = await scene.send(1)
        other = scene.hub.join("driver")
        ActionServer(other, "/fibonacci", FIBONACCI)
        await settled()
        scene.link.end_run()
        await other.close()
        await settled()
        await scene.send(2)
        if not is_accepted:
            scene.server.accept(first)
            await settled()
        assert (list(scene.server.goals), scene.server.cancels, scene.link.is_there) == ([first], [first], False)
        await scene.end(first, GoalStatus.CANCELED)
        assert len(scene.server.goals) == 2

    assert play(story).heard.replies == []


def test_several_servers_are_reported(wording: Wording) -> None:
    async def story(scene: Scene) -> None:
        ActionServer(scene.hub.join("driver"), "/fibonacci", FIBONACCI)
        await settled()
        why = scene.link.why_unmatched()
        assert why is not None
        assert why.kind is UnmatchedKind.CROWDED
        scene.complaints.append(why.why)
        await scene.send(1)
        assert scene.server.goals == {}

    wording("".join(f"{each}\n" for each in play(story).complaints))


NUMBERS = (("numbers", ListShape(Primitive("float64"))),)
SCAN = ActionDefinition(
    "my_robot/action/Scan",
    MessageDefinition("my_robot/action/Scan_Goal", (("order", INT),)),
    MessageDefinition("my_robot/action/Scan_Result", NUMBERS),
    MessageDefinition("my_robot/action/Scan_Feedback", NUMBERS),
)


def scanner(element: int, *, has_ranges: bool = True) -> Resource:
    """A resource that measures its zone by one element of a list, in feedback and in results."""
    ranges = (("near", Interval(None, 3.0)), ("far", Interval(3.0, None))) if has_ranges else ()
    meanings = () if has_ranges else ((1.0, "near"), (7.0, "far"))
    result, feedback = (
        (Reading("zone", path(part, f"numbers[{element}]"), ranges, meanings),) for part in (SCAN.result, SCAN.feedback)
    )
    goal = ((path(SCAN.goal, "order"), Reference("shelf")),)
    call = ActionCall("/scan", SCAN, goal=goal, succeeded=(), measured=result, feedback=feedback)
    return Resource("gantry", ("shelf",), ("zone",), binding=RosBinding({}, call))


@pytest.mark.parametrize("has_ranges", [True, False])
def test_what_is_no_number_is_refused_with_the_reason(has_ranges: bool, wording: Wording) -> None:  # noqa: FBT001 - a case
    resource = scanner(0, has_ranges=has_ranges)

    async def story(scene: Scene) -> None:
        which = await scene.send(1)
        scene.server.feed_back(which, numbers=[nan])
        scene.server.feed_back(which, numbers=[])
        await settled()
        scene.server.end(which, GoalStatus.SUCCEEDED, numbers=[nan])

    scene = play(story, resource)
    assert scene.heard.numbers() == [(1, True)]
    changes = [measured.values for _, measured in scene.heard.values]
    changes += [reply.measured for _, reply in scene.heard.replies]
    warnings: list[str] = []
    for each in changes:
        program = Program(replace(read_model(CELL), resources=(resource,)))
        Refusals(program, warnings.append).look("gantry", each, ("zone",))
    wording("".join(f"{each}\n" for each in warnings) + "".join(f"{each}\n" for each in scene.complaints))


@pytest.mark.longer
def test_the_last_of_a_million_elements_is_measured() -> None:
    async def story(scene: Scene) -> None:
        which = await scene.send(1)
        scene.server.feed_back(which, numbers=[9.0] * 999_999 + [1.0])
        await settled()
        scene.server.end(which, GoalStatus.SUCCEEDED, numbers=[1.0] * 999_999 + [9.0])

    scene = play(story, scanner(999_999))
    assert [measured.values for _, measured in scene.heard.values] == [(("zone", "near"),)]
    assert [(reply.succeeded, reply.measured) for _, reply in scene.heard.replies] == [(True, (("zone", "far"),))]


@pytest.mark.parametrize("other", [UUID(int=0), UUID(int=7)])
def test_an_unknown_goal_changes_nothing_for_the_own_one_and_keeps_the_next_one_waiting(other: UUID) -> None:
    async def story(scene: Scene) -> None:
        first = await scene.send(1)
        scene.server.has(other, GoalStatus.ABORTED)
        scene.server.has(other, GoalStatus.EXECUTING)
        await settled()
        scene.server.feed_back(other, sequence=[9])
        scene.server.feed_back(first, sequence=[1])
        await settled()
        why = scene.link.why_unmatched()
        assert why is not None
        assert f"busy with goal {other} of another program" in why.why
        await scene.end(first, GoalStatus.SUCCEEDED, 0, 5)
        await scene.send(2)
        assert list(scene.server.goals) == [first]
        scene.server.has(other, GoalStatus.CANCELED)
        await settled()
        assert len(scene.server.goals) == 2

    scene = play(story)
    assert [measured.values for _, measured in scene.heard.values] == [(("zone", "near"),)]
    assert scene.heard.numbers() == [(1, True)]
    assert (scene.server.cancels, scene.complaints) == ([], [])
