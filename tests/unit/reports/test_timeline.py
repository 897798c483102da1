"""A run as text: what only runs over nodes have to say."""

from __future__ import annotations

from io import BytesIO

import pytest

from scbm.cases.trace import ResourceChanged
from scbm.files import read_case, read_model
from scbm.reports import timeline
from scbm.reports.run.mcap_trace import write_mcap
from scbm.running.simulation import Simulated
from scbm.testing import Tester
from support.capturing import captured
from support.models import SCAN_CELL
from support.wording import Wording

MODEL = read_model(SCAN_CELL)
GONE, BACK = ResourceChanged(0, "network", "scan", "down"), ResourceChanged(0, "network", "scan", "well")
RESTART = "network: {restarts: [{resource: scan, at: 1 h, for: 1 s}]}"


@pytest.mark.parametrize(
    ("more", "is_real"), [("", True), (RESTART, True), ("", False)], ids=["node", "restart", "simulated"]
)
def test_a_resource_that_is_lost_with_its_node_is_distinguished_from_one_that_the_case_restarts(
    more: str,
    is_real: bool,  # noqa: FBT001 - a parameter of the test
    wording: Wording,
) -> None:
    case = read_case(f"case: scans\ngoal: scanned\n{more}\n", MODEL)
    log, (first, *others) = captured(MODEL, case)
    run = Simulated(log.end, others[-1].at_ns, (first, GONE, BACK, *others))
    execution = Tester(MODEL).judged(case, run, log.reactions, log if is_real else None)
    drawn = [str(line) for line in timeline(MODEL, execution, every=False)]
    lines = [line[line.index("⚡") :] for line in drawn if "⚡" in line]
    assert len(lines) == 2
    wording(lines)
    nominal = MODEL.nominal_state
    assert [f"⚡ {execution.sentence(record, nominal).text}" for record in (GONE, BACK)] == lines


def test_a_violation_has_its_own_time() -> None:
    late = "requirements: {late: box_is_scanned == false leads to box_is_scanned == true within 500 ms}"
    model = read_model(SCAN_CELL + late)
    execution = Tester(model).execute(
        read_case("case: scans\ngoal: scanned\noutcomes: {scan: [{after: 1 s}]}\n", model)
    )
    (violation,) = execution.violations
    before = execution.trace.records[violation.record].at_ns
    drawn = [str(line) for line in timeline(model, execution, every=False)]
    assert before < violation.at_ns == 500_000_000
    assert [line[:11] for line in drawn if "✗ late" in line] == ["    0.500 s"]
    assert write_mcap(model, execution, BytesIO())
