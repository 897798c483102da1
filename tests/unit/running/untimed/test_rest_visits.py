"""What a runner at rest can visit: the shared search against one that follows each change anew."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scbm.running.outside_changes import Maker, OutsideChanges
from scbm.running.untimed import rest_visits
from scbm.running.untimed.rest_visits import RestVisits
from scbm.running.untimed.situations import TooManyRestsError

if TYPE_CHECKING:
    from collections.abc import Callable, Collection, Iterator

STATES = 8

Settled = tuple[int, tuple[int, ...]]


class Listed(Maker):
    """A maker whose changes are listed: those from each state."""

    def __init__(self, name: str, changes: list[list[int]]) -> None:
        super().__init__(name)
        self._changes = changes

    def following(self, state: int, in_flight: Collection[int]) -> Iterator[int]:  # noqa: ARG002 - of others
        yield from self._changes[state]


def followed(changes: list[list[list[int]]], settle: Callable[[int], Settled], state: int) -> int:
    """Return what can follow a settled state, by following each change from it."""
    visits, reached, todo = 0, [state], [state]
    while todo:
        here = todo.pop()
        for after in [after for each in changes for after in each[here]]:
            visited, settled = settle(after)
            visits |= visited
            new = [each for each in settled if each not in reached]
            reached += new
            todo += new
    return visits


states = st.integers(0, STATES - 1)
tables = st.lists(st.lists(states, max_size=3), min_size=STATES, max_size=STATES)


@given(
    st.lists(tables, min_size=1, max_size=3),
    st.lists(st.tuples(st.integers(0, 7), st.none() | states), min_size=STATES, max_size=STATES),
    st.permutations(range(STATES)),
)
def test_every_end_of_a_run_visits_what_its_changes_lead_to(
    changes: list[list[list[int]]], settled: list[tuple[int, int | None]], order: list[int]
) -> None:
    def settle(state: int) -> Settled:
        visited, after = settled[state]
        return visited, () if after is None else (after,)

    outside = OutsideChanges([Listed(str(number), each) for number, each in enumerate(changes)])
    search = RestVisits(outside, settle)
    assert [search.of(state) for state in order] == [followed(changes, settle, state) for state in order]


def test_a_search_with_too_many_states_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rest_visits, "MOST_RESTS", 5)
    line = OutsideChanges([Listed("on", [[state + 1] for state in range(7)])])
    with pytest.raises(TooManyRestsError):
        RestVisits(line, lambda state: (0, (state,))).of(0)
