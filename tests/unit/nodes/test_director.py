"""Who decides what becomes of requests decides as a simulation does, and says it where it has to be known."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction

import pytest
from msgspec.structs import replace

from scbm.cases import AT_ONCE, LOST, Condition, ConditionKind, Network, OutcomeRule, Partition, Reaction
from scbm.cases.trace import (
    NETWORK,
    BecameCurrent,
    MessageDisturbed,
    OperationStepped,
    Record,
    ReplyDropped,
    ReplyReceived,
    RequestSent,
    ResourceChanged,
)
from scbm.model import OperationState, Outcome
from scbm.nodes.node_messages import Answering, Become, Fate, React, RestartResource
from scbm.nodes.roles.director import Director
from scbm.running import CancelRequest, ChangeResource, SendRequest
from scbm.running.simulation import Choices, PlainReactions
from scbm.testing.event_logs.event_records import Note
from support.models import scan_cell
from support.wording import Wording

MODEL = scan_cell()
RESOURCES = {resource.name: resource for resource in MODEL.resources}
SECOND_NS = 10**9


@dataclass
class Outbox:
    """A stage that keeps the published messages."""

    messages: list[React | Fate | Become | RestartResource] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)

    def publish(self, message: React | Fate | Become | RestartResource) -> None:
        self.messages.append(message)

    def note(self, record: Note) -> None:
        self.notes.append(record)


def director(*forced: OutcomeRule, network: Network = Network(), real: tuple[str, ...] = ()) -> tuple[Director, Outbox]:  # noqa: B008 - an immutable value
    outbox = Outbox()
    choices = Choices(PlainReactions(), forced, network)
    return Director("run_1", RESOURCES, real, choices, outbox), outbox


def sent(number: int) -> SendRequest:
    return SendRequest(number, "scan", (("scan_command", "scan_box"),))


def test_each_request_gets_the_reaction_that_a_simulation_would_give_it() -> None:
    directing, outbox = director()
    directing.follow([sent(1), sent(2)], 0)
    expected = PlainReactions().react(RESOURCES["scan"])
    assert not directing.is_relayed
    assert outbox.messages == [
        React("run_1", number, "scan", "succeed", expected.latency_ns, None, AT_ONCE) for number in (1, 2)
    ]
    assert directing.reactions([]) == (expected, expected)


def test_rules_of_operations_speak_of_the_requests_that_are_sent_while_these_are_current() -> None:
    directing, outbox = director(OutcomeRule("scan_box", 1, 1, Outcome.FAIL, 5))
    directing.follow([sent(1), BecameCurrent(0, "scan_box", ()), sent(2)], 0)
    left = OperationStepped(0, "scan_box", OperationState.FAILED, OperationState.INITIAL, None, ())
    directing.follow([BecameCurrent(0, "scan_box", ()), left, sent(3)], 0)
    outcomes = [message.outcome for message in outbox.messages if isinstance(message, React)]
    assert outcomes == ["succeed", "fail", "succeed"]


def test_how_messages_travel_is_reported_with_the_time_at_which_they_are_sent() -> None:
    network = Network(partitions=(Partition(2 * SECOND_NS, SECOND_NS),))
    directing, outbox = director(OutcomeRule("scan", 1, 1, reply=(7, 9)), network=network)
    assert directing.is_relayed
    directing.follow([sent(1)], 0)
    directing.answering(Answering("run_1", 1, "scan", 4), SECOND_NS)
    directing.follow([CancelRequest(1, "scan")], SECOND_NS)
    directing.follow([CancelRequest(1, "scan"), sent(2)], 2 * SECOND_NS)
    directing.answering(Answering("run_1", 1, "scan", 5), 3 * SECOND_NS - 1)
    react, *fates, second, late = outbox.messages
    assert isinstance(react, React)
    assert fates == [
        Fate("run_1", 1, "scan", 4, (7, 9)),
        Fate("run_1", 1, "scan", 0, AT_ONCE),
        Fate("run_1", 1, "scan", 0, LOST),
    ]
    assert isinstance(second, React)
    assert second.copies == LOST
    assert late == Fate("run_1", 1, "scan", 5, LOST)
    assert outbox.notes == [
        MessageDisturbed(0, 1, "scan", "reply", 2),
        MessageDisturbed(0, 1, "scan", "cancel", 0),
        MessageDisturbed(0, 2, "scan", "request", 0),
        MessageDisturbed(0, 1, "scan", "reply", 0),
    ]


def test_cancellations_travel_by_themselves_where_no_message_has_a_fate() -> None:
    directing, outbox = director()
    directing.follow([sent(1), CancelRequest(1, "scan")], 0)
    assert [message.kind for message in outbox.messages] == ["react"]


@pytest.mark.parametrize(("request_", "resource"), [(0, "scan"), (2, "scan"), (10**9, "scan"), (1, "light")])
def test_an_answer_to_a_request_that_was_never_sent_is_refused(request_: int, resource: str, wording: Wording) -> None:
    directing, outbox = director(OutcomeRule("scan", 1, 1, reply=LOST))
    directing.follow([sent(1)], 0)
    with wording.raises(ValueError):
        directing.answering(Answering("run_1", request_, resource, 1), 0)
    assert len(outbox.messages) == 1


def test_conditions_go_to_their_resource() -> None:
    directing, outbox = director()
    slower = Condition(ConditionKind.SLOWER, Fraction(5, 2))
    directing.follow([ChangeResource("scan", slower), ChangeResource("scan", Condition())], 0)
    assert outbox.messages == [Become("run_1", "scan", "slower", "5/2"), Become("run_1", "scan", "well", "1")]
    assert outbox.notes == []  # the runner itself says that


def test_restarts_go_to_their_resource_and_into_the_trace() -> None:
    directing, outbox = director()
    directing.follow([ChangeResource("scan", Condition(ConditionKind.FAILING))], 0)
    for is_down in (True, True, False, False):
        directing.restart("scan", is_down=is_down)
    assert outbox.messages[1:] == [RestartResource("run_1", "scan", is_down) for is_down in (True, True, True, False)]
    words = ["down", "down", "down", "failing"]
    assert outbox.notes == [ResourceChanged(0, NETWORK, "scan", word) for word in words]


def test_a_node_that_comes_back_learns_what_holds_of_its_resources() -> None:
    directing, outbox = director(OutcomeRule("scan", 2, 2, request=(3, 5)))
    directing.publish_again(["scan"])
    assert outbox.messages == []
    directing.follow([ChangeResource("scan", Condition(ConditionKind.OCCUPIED)), sent(1), sent(2), sent(3)], 0)
    directing.restart("scan", is_down=True)
    directing.follow([ReplyReceived(0, 1, "scan", True, ()), CancelRequest(3, "scan")], 0)
    outbox.messages.clear()
    directing.publish_again(["another"])
    assert outbox.messages == []
    directing.publish_again(["scan"])
    become, restart, react = outbox.messages
    assert become == Become("run_1", "scan", "occupied", "1")
    assert restart == RestartResource("run_1", "scan", is_down=True)
    assert isinstance(react, React)
    assert (react.request, react.copies) == (2, (3, 5))


def test_of_real_resources_nothing_is_reported_and_what_was_seen_is_kept() -> None:
    directing, outbox = director(OutcomeRule("scan", 4, 4, Outcome.FAIL), real=("scan",))
    directing.follow([sent(number) for number in (1, 2, 3)], 0)
    directing.follow([CancelRequest(3, "scan")], 0)
    assert outbox.messages == []
    records: list[Record] = [
        RequestSent(10, 1, "scan", (), ()),
        ReplyReceived(35, 1, "scan", False, ()),
        RequestSent(40, 2, "scan", (), ()),
        ReplyReceived(41, 2, "scan", True, ()),
        RequestSent(50, 3, "scan", (), ()),
    ]
    assert directing.reactions(records) == (
        Reaction("scan", Outcome.FAIL, 25),
        Reaction("scan", Outcome.SUCCEED, 1),
        Reaction("scan", Outcome.TIMEOUT, 0),
    )


def test_a_reply_that_was_due_and_never_came_was_lost() -> None:
    directing, _ = director()
    expected = PlainReactions().react(RESOURCES["scan"])
    due_ns = expected.latency_ns
    directing.follow([sent(1), sent(2), sent(3), sent(4)], 0)
    directing.follow([ReplyReceived(due_ns, 1, "scan", True, ()), CancelRequest(2, "scan")], due_ns)
    directing.follow([CancelRequest(3, "scan")], due_ns + 1)
    directing.follow([ReplyDropped(0, 4, "late"), CancelRequest(4, "scan")], due_ns + 1)
    assert directing.reactions([]) == (expected, expected, replace(expected, reply=LOST), expected)


def test_a_reply_that_the_case_stands_in_the_way_of_is_not_missed() -> None:
    directing, _ = director()
    expected = PlainReactions().react(RESOURCES["scan"])
    directing.follow([sent(1), ChangeResource("scan", Condition(ConditionKind.DEAD)), sent(2)], 0)
    directing.follow([CancelRequest(1, "scan"), CancelRequest(2, "scan")], 100 * SECOND_NS)
    assert directing.reactions([]) == (expected, expected)


def test_nothing_is_due_of_a_resource_that_is_down() -> None:
    directing, _ = director()
    directing.restart("scan", is_down=True)
    directing.follow([sent(1)], 0)
    directing.restart("scan", is_down=False)
    directing.follow([sent(2)], 0)
    directing.follow([CancelRequest(1, "scan"), CancelRequest(2, "scan")], 100 * SECOND_NS)
    assert [reaction.reply == LOST for reaction in directing.reactions([])] == [False, True]


def cancelled(directing: Director, request: int, at_ns: int) -> Reaction:
    """The messages about the one request that was sent, once it is cancelled."""
    directing.follow([CancelRequest(request, "scan")], at_ns)
    return directing.reactions([])[request - 1]


@pytest.mark.parametrize(
    "lost",
    [
        OutcomeRule("scan", 1, 1, request=LOST),
        OutcomeRule("scan", 1, 1, Outcome.TIMEOUT),
        OutcomeRule("scan", 1, 1, reply=LOST),
    ],
    ids=["request", "outcome", "reply"],
)
def test_a_reply_that_is_not_to_come_is_not_missed(lost: OutcomeRule) -> None:
    directing, _ = director(lost)
    directing.follow([sent(1)], 0)
    if lost.reply is not None:
        directing.answering(Answering("run_1", 1, "scan", 1), 0)
    decided = directing.reactions([])[0]
    assert cancelled(directing, 1, 100 * SECOND_NS) == decided


@pytest.mark.parametrize(("cancelled_after_ns", "is_missed"), [(1, False), (2, True)])
def test_a_reply_is_due_once_the_first_copy_of_the_request_has_come_and_been_worked_on(
    cancelled_after_ns: int, *, is_missed: bool
) -> None:
    directing, _ = director(OutcomeRule("scan", 1, 1, latency_ns=5, request=(9, 3)))
    directing.follow([sent(1)], 10)
    reaction = cancelled(directing, 1, 10 + 3 + 5 - 1 + cancelled_after_ns)
    assert (reaction.reply == LOST) == is_missed


@pytest.mark.parametrize(("cancelled_after_ns", "is_missed"), [(1, False), (2, True)])
def test_a_reply_that_is_on_its_way_is_due_when_its_first_copy_arrives(
    cancelled_after_ns: int, *, is_missed: bool
) -> None:
    directing, _ = director(OutcomeRule("scan", 1, 1, latency_ns=5, reply=(9, 3)))
    directing.follow([sent(1)], 0)
    directing.answering(Answering("run_1", 1, "scan", 1), 5)
    reaction = cancelled(directing, 1, 5 + 3 - 1 + cancelled_after_ns)
    assert (reaction.reply == LOST) == is_missed


def test_what_stands_in_the_way_of_one_resource_keeps_the_replies_of_no_other() -> None:
    outbox = Outbox()
    both = {resource.name: resource for resource in scan_cell(("resources:\n", "resources:\n  lamp: {}\n")).resources}
    directing = Director("run_1", both, (), Choices(PlainReactions(), (), Network()), outbox)
    directing.follow([sent(1), SendRequest(2, "lamp", ())], 0)
    directing.restart("lamp", is_down=True)
    directing.follow([CancelRequest(1, "scan"), CancelRequest(2, "lamp")], 100 * SECOND_NS)
    assert [reaction.reply == LOST for reaction in directing.reactions([])] == [True, False]
