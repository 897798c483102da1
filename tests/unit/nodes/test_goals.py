"""Statuses of goals in the bytes of a message, compared with what the codec reads."""

from __future__ import annotations

from uuid import UUID

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.nodes.links.goals import id_at, position_of, statuses_of
from scbm.nodes.types.cdr import BadPayloadError, codec_of
from scbm.nodes.types.definitions import GOAL_STATUS_ARRAY
from support.profiles import examples

CODEC = codec_of(GOAL_STATUS_ARRAY)
ONE = st.tuples(st.uuids(), st.integers(0, 2**31 - 1), st.integers(0, 6))
GOALS = st.lists(ONE, max_size=9, unique_by=lambda goal: goal[0])


def payload_of(goals: list[tuple[UUID, int, int]]) -> bytes:
    entries = [
        {"goal_info": {"goal_id": {"uuid": which.bytes}, "stamp": {"sec": sec, "nanosec": sec}}, "status": status}
        for which, sec, status in goals
    ]
    return CODEC.encode({"status_list": entries})


@given(GOALS, st.uuids())
@examples(300)
def test_statuses_and_ids_are_those_that_the_codec_reads(goals: list[tuple[UUID, int, int]], other: UUID) -> None:
    payload = payload_of(goals)
    statuses, entries = statuses_of(payload)
    read = CODEC.decode(payload).status_list
    assert list(statuses) == [entry.status for entry in read]
    assert [id_at(entries, position) for position in range(len(goals))] == [e.goal_info.goal_id.uuid for e in read]
    assert [position_of(entries, which.bytes) for which, _, _ in goals] == list(range(len(goals)))
    assert other in [which for which, _, _ in goals] or position_of(entries, other.bytes) is None


@pytest.mark.parametrize("cut", [0, 3, 7, 20, 32, 60])
def test_a_payload_that_is_cut_off_is_refused(cut: int) -> None:
    payload = payload_of([(UUID(int=1), 0, 4), (UUID(int=2), 0, 4)])
    with pytest.raises(BadPayloadError):
        statuses_of(payload[:cut])
