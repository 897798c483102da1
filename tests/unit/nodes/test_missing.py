"""What is said of real drivers that are not there, and what of that no waiting mends."""

from __future__ import annotations

from dataclasses import dataclass

import pytest

from scbm.cases.trace import Changes
from scbm.nodes.buses.bus import Unmatched
from scbm.nodes.links.bound_link import MissingDrivers
from scbm.nodes.links.link import Correlation

WRONG, SIMILAR = Unmatched("`/a` is of another type", is_mismatch=True), Unmatched("one is at `/aa`", is_mismatch=False)
UNREACHED = "`arm` is not reached: "


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


@pytest.mark.parametrize(
    ("alone", "why"), [(None, "there is no peer at `/a`, `/b`"), (WRONG, WRONG.why), (SIMILAR, SIMILAR.why)]
)
def test_who_is_not_there_is_said_and_why(alone: Unmatched | None, why: str) -> None:
    links = {"lamp": Reaching(missing=()), "arm": Reaching(alone)}
    assert MissingDrivers(links).look() == ((f"{UNREACHED}{why}",), ())


def test_a_mismatch_is_believed_at_the_second_look_and_so_is_one_that_comes_back() -> None:
    arm = Reaching(WRONG)
    missing = MissingDrivers({"arm": arm})
    seen = []
    for alone in (WRONG, WRONG, WRONG, None, WRONG, WRONG, SIMILAR, SIMILAR):
        arm.alone = alone
        seen.append(len(missing.look()[1]))
    assert seen == [0, 1, 1, 0, 0, 1, 0, 0]
    assert missing.look() == ((f"{UNREACHED}{SIMILAR.why}",), ())
