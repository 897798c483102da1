"""How messages travel."""

from __future__ import annotations

from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from hypothesis import strategies as st

from scbm.cases import Network, Partition, Restart
from scbm.strategies.choices import one_of
from scbm.strategies.times import times

if TYPE_CHECKING:
    from hypothesis.strategies import DrawFn, SearchStrategy

    from scbm.model import BehaviorModel

_MOST_LATENCY_MS = 50
_MOST_JITTER_MS = 200
_MOST_PER_CENT = 20
_MOST_HELD_BACK_MS = 2_000
_LONGEST_MS = 5_000
_MOST_FAULTS = 2

_PLAIN_NS = Network().held_back_ns
_HELD_BACK = st.just(_PLAIN_NS) | times(_MOST_HELD_BACK_MS, 1)
_SHARE = st.integers(0, _MOST_PER_CENT).map(lambda per_cent: Fraction(per_cent, 100))


def networks(model: BehaviorModel) -> SearchStrategy[Network]:
    """Networks with faults of all sorts: latency, jitter, loss, duplication, reordering, partitions, restarts.

    Shrinks towards a perfect one. A network that is a matter of chance (`Network.draws`) needs a case with an origin.
    """
    resources = [resource.name for resource in model.resources]
    cut = st.builds(Partition, times(), times(_LONGEST_MS, 1), one_of([None, *resources]))
    down = st.builds(Restart, one_of(resources), times(), times(_LONGEST_MS)) if resources else st.nothing()

    @st.composite
    def network(draw: DrawFn) -> Network:
        latency_ns, jitter_ns = draw(times(_MOST_LATENCY_MS)), draw(times(_MOST_JITTER_MS))
        plain = Network(latency_ns, jitter_ns, draw(_SHARE), draw(_SHARE), draw(_SHARE))
        return replace(
            plain,
            held_back_ns=draw(_HELD_BACK) if plain.duplication or plain.reordering else _PLAIN_NS,
            partitions=tuple(draw(st.lists(cut, max_size=_MOST_FAULTS))),
            restarts=tuple(draw(st.lists(down, max_size=_MOST_FAULTS))),
        )

    return network()
