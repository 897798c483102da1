"""The search of all runs for requests that violate a built-in requirement, without cases that may show it, too."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.closing import CloseLimits
from scbm.closing.proofs.proofs import scope_of_proofs
from scbm.closing.requirements.request_monitor import RequestMonitor
from scbm.closing.requirements.violation_search import ViolationSearch
from scbm.closing.runs.all_runs import AllRuns
from scbm.model import BehaviorModel
from support.models import scan_cell

ANSWERED_TOO_EARLY = (
    ("gr: scan_req_state", "gr: light == green && scan_req_state"),
    ("initial: green", "initial: blue"),
)


def violated(model: BehaviorModel) -> tuple[str, ...]:
    """Return the requirements that runs violate; all runs were searched."""
    runs = AllRuns(model, CloseLimits(), lambda _: None, replace(scope_of_proofs(model), keeps_notes=True))
    search = ViolationSearch(runs, RequestMonitor(model, runs.program), 100_000)
    found = search.violated()
    assert search.is_complete
    return found


@pytest.mark.parametrize(
    ("replacements", "found"),
    [
        ((), ()),
        ((("    timedout: [scan_req_trigger <- false]\n", ""),), ("no_orphan",)),
        ((("[scan_req_state <- initial, scan_req_trigger <- false, box", "[box"),), ("no_orphan",)),
        (
            (("<- failed, scan_req_state <- initial, scan_req_trigger", "<- failed, scan_req_trigger"),),
            ("ready_again",),
        ),
        (ANSWERED_TOO_EARLY, ("ready_again",)),
    ],
    ids=[
        "clean",
        "a timeout leaves a request",
        "a completion leaves it",
        "a failure leaves it",
        "a timeout leaves a reply",
    ],
)
def test_the_search_finds_what_an_operation_leaves_behind(
    replacements: tuple[tuple[str, str], ...], found: tuple[str, ...]
) -> None:
    assert violated(scan_cell(*replacements)) == found
