"""Reports of missing drivers, and which of these no waiting mends."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from scbm.cases.trace import Changes
from scbm.nodes.buses.bus import Unmatched, UnmatchedKind
from scbm.nodes.links.bound_link import MissingDrivers
from scbm.nodes.links.link import Correlation
from support.wording import Wording

WRONG, SIMILAR = Unmatched("of-another-type", UnmatchedKind.MISMATCH), Unmatched("similar")


@dataclass
class Reaching:
    """A link of which a test says whether its driver is there."""

    alone: Unmatched | None = None
    missing: tuple[str, ...] = ("/a", "/b", "/a")

    @property
    def is_there(self) -> bool:
        return not self.missing

    def why_unmatched(self) -> Unmatched | None:
        return self.alone

    def send(self, request: Correlation, values: Changes) -> None:
        raise NotImplementedError

    def cancel(self, request: Correlation) -> None:
        raise NotImplementedError

    def end_run(self) -> bool:
        raise NotImplementedError


@pytest.mark.parametrize("alone", [None, WRONG, SIMILAR], ids=["no_driver", "wrong", "similar"])
def test_who_is_not_there_is_reported_and_why(alone: Unmatched | None, wording: Wording) -> None:
    links = {"lamp": Reaching(missing=()), "arm": Reaching(alone)}
    (trouble,) = MissingDrivers(links).look()
    assert trouble.kind == UnmatchedKind.ABSENT
    assert alone is None or trouble.words.endswith(alone.why)
    wording(trouble.words)


def test_a_mismatch_is_believed_at_the_second_look_and_so_is_one_that_comes_back() -> None:
    arm = Reaching(WRONG)
    missing = MissingDrivers({"arm": arm})
    seen = []
    for alone in (WRONG, WRONG, WRONG, None, WRONG, WRONG, SIMILAR, SIMILAR):
        arm.alone = alone
        (trouble,) = missing.look()
        seen.append(trouble.kind == UnmatchedKind.MISMATCH)
    assert seen == [False, True, True, False, False, True, False, False]
