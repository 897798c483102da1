"""Doubts about requests that may outlive their operation; runs that show one violate `no_orphan`."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.cases import Case, OutcomeRule
from scbm.closing.advice.model_check import check_model
from scbm.closing.advice.request_doubts import doubts_about_requests
from scbm.files import load_model
from scbm.model import BehaviorModel, Outcome, Slug
from scbm.running import RunnerOptions
from scbm.testing import Tester
from support.models import scan_cell
from support.wording import Wording

S = 1_000_000_000
ROOT = Path(__file__).parents[4]
MODELS = sorted((*(ROOT / "examples").glob("*/*.yaml"), *(ROOT / "study").glob("models/*.yaml")))

CLEARS = "scan_req_trigger <- false"
IN_POST = ("[scan_req_state <- initial, scan_req_trigger <- false, box", "[scan_req_state <- initial, box")
IN_TIMEDOUT = ("    timedout: [scan_req_trigger <- false]\n", "")
IN_FAILED = (
    "<- failed, scan_req_state <- initial, scan_req_trigger <- false]",
    "<- failed, scan_req_state <- initial]",
)


def _doubts(model: BehaviorModel) -> list[tuple[str | int, ...]]:
    return [doubt.path for doubt in check_model(model).doubts if doubt.slug is Slug.REQUEST_NOT_CLEARED]


@pytest.mark.parametrize(
    ("fault", "path", "outcome"),
    [
        (IN_POST, ("operations", "scan_box", "post"), Outcome.SUCCEED),
        (IN_TIMEDOUT, ("operations", "scan_box", "timedout"), Outcome.TIMEOUT),
        (IN_FAILED, ("automatic_transitions", "scan_failed"), Outcome.FAIL),
    ],
)
def test_each_end_that_leaves_a_request_is_named(
    fault: tuple[str, str], path: tuple[str, ...], outcome: Outcome, wording: Wording
) -> None:
    model = scan_cell(fault)
    assert _doubts(model) == [path]
    (doubt,) = (doubt for doubt in check_model(model).doubts if doubt.slug is Slug.REQUEST_NOT_CLEARED)
    wording(f"{doubt.message}; {doubt.remedy}")
    case = Case("case", *model.goals[0], model.nominal_state, (OutcomeRule("scan", 1, 1, outcome),))
    violations = Tester(model, RunnerOptions(time_limit_ns=60 * S)).execute(case).violations
    assert [violation.requirement for violation in violations][:1] == ["no_orphan"]


def test_a_failed_transition_that_leaves_a_request_is_named() -> None:
    failed = (IN_TIMEDOUT[0], f"{IN_TIMEDOUT[0]}    failed: {{g: light == blue}}\n")
    assert _doubts(scan_cell(failed)) == [("operations", "scan_box", "failed")]


def test_an_operation_that_never_times_out_leaves_nothing_then() -> None:
    assert not _doubts(scan_cell(IN_TIMEDOUT, ("    deadline: 10 seconds\n", "")))


@pytest.mark.parametrize("guard", ["scan_box.state == timedout", "current.state == initial", "light == blue"])
def test_an_automatic_transition_may_clear_it(guard: str) -> None:
    tidy = (
        "automatic_transitions:",
        f"automatic_transitions:\n  tidy: {{g: scan_req_trigger == true && {guard}, a: [{CLEARS}]}}",
    )
    assert not _doubts(scan_cell(IN_TIMEDOUT, tidy))


@pytest.mark.parametrize("guard", ["scan_box.state == executing", "scan_box.state == completed"])
def test_an_automatic_transition_for_another_state_does_not_clear_it(guard: str) -> None:
    tidy = (
        "automatic_transitions:",
        f"automatic_transitions:\n  tidy: {{g: scan_req_state == failed && {guard}, a: [{CLEARS}]}}",
    )
    assert _doubts(scan_cell(IN_TIMEDOUT, tidy)) == [("operations", "scan_box", "timedout")]


def test_a_model_that_switches_no_orphan_off_has_no_doubts() -> None:
    assert not _doubts(scan_cell(IN_TIMEDOUT, more="requirements_off: {no_orphan: the scanner goes on}\n"))


@pytest.mark.parametrize("path", MODELS, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_models_that_clean_up_raise_no_doubt(path: Path) -> None:
    assert not list(doubts_about_requests(load_model(path)))
