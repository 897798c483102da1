"""How much has to be visited."""

import pytest

from scbm.cases.coverage import KINDS, Aspect, Coverage, Obligation, Obligations, Threshold
from support.models import scan_cell

OBLIGATIONS = Obligations.of(scan_cell())
NAMES = {str(o): OBLIGATIONS.bit(o) for o in OBLIGATIONS}


def _coverage(*names: str) -> Coverage:
    return Coverage(OBLIGATIONS, (("case", sum(NAMES[name] for name in names)),))


def test_the_figure_counts_if_no_kind_is_named() -> None:
    half = _coverage("scan_box/executing", "scan_box/completed", "automatic/scan_failed", "scan_box/queued")
    assert Threshold(50).is_met(half)
    assert not Threshold(50.01).is_met(half)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "all"])
def test_each_kind_counts_alone(kind: str) -> None:
    name = "automatic/scan_failed" if kind == "automatic" else f"scan_box/{kind}"
    others = [other for other in NAMES if other != name]
    assert Threshold(100, kind).is_met(_coverage(name))
    assert not Threshold(1, kind).is_met(_coverage(*others))


def test_nothing_to_visit_meets_nothing() -> None:
    assert not Threshold(0).is_met(Coverage(Obligations(())))


def test_nothing_visited_meets_nought() -> None:
    assert Threshold(0, "failed").is_met(_coverage())


@pytest.mark.parametrize(("percent", "visited", "of"), [(8.8, 33, 375), (64.4, 161, 250), (35.2, 132, 375)])
def test_a_threshold_that_is_exactly_reached_is_met(percent: float, visited: int, of: int) -> None:
    """Binary fractions are a little more than what was written: 8.8 * 375 is 3300.0000000000005."""
    obligations = Obligations([Obligation(f"o{number}", Aspect.TAKEN) for number in range(of)])
    assert Threshold(percent).is_met(Coverage(obligations, (("case", (1 << visited) - 1),)))
    assert not Threshold(percent).is_met(Coverage(obligations, (("case", (1 << (visited - 1)) - 1),)))
