"""What closing decides about random models whose environment acts and whose resources are shared, beside all runs."""

from __future__ import annotations

from functools import cache

import pytest
from msgspec.structs import replace

from scbm.closing import CloseLimits, Closer, Closing, Decision
from scbm.files import read_case, write_case
from scbm.model import (
    BehaviorModel,
    PlanSet,
)
from scbm.proofcheck import check_certificate
from scbm.testing import FailureKind, RandomCases, Tester
from support.enumeration import Enumeration, enumerate_runs
from support.opened_models import opened
from support.profiles import share, slow_beyond
from support.random_models import random_model, small_random_model
from support.shared_closings import shared_closing

_FEW = 3_000
"""Maximum number of situations of sequences of goals with any plans that are enumerated."""

SMALL = (2, 18, 9, 47, 49, 35, 43, 58, 59, 67, 72, 73, 81, 85, 86, 12, 37, 25, 40, 31)
"""Models that are enumerated and closed in a moment, the fastest first."""

MOST = 60_000


@cache
def model_of(number: int) -> BehaviorModel:
    """A random model in which others use resources, values are ruled out, and the environment moves some variables."""
    return opened(random_model(number), number)


@cache
def closing_of(number: int) -> Closing:
    return shared_closing(model_of(number))


@cache
def runs_of(number: int) -> Enumeration:
    return enumerate_runs(model_of(number), MOST, is_open=True)


@cache
def sequences_of(number: int) -> Enumeration:
    return enumerate_runs(model_of(number), MOST, is_open=True, is_sequence=True)


@pytest.mark.longer
@pytest.mark.parametrize("number", slow_beyond(1, SMALL))
def test_no_proof_is_wrong(number: int) -> None:
    proved = [d for d in closing_of(number).decided if d.decision is Decision.UNCOVERABLE]
    sequences = enumerate_runs(model_of(number), _FEW, is_open=True, is_sequence=True, plans=PlanSet.ANY)
    for runs in (runs_of(number), sequences):
        assert [str(d.obligation) for d in proved if runs.visits(str(d.obligation))] == []


@pytest.mark.longer
@pytest.mark.parametrize("number", slow_beyond(1, SMALL[: share(len(SMALL), least=3)]))
def test_cases_without_forced_states_are_runs(number: int) -> None:
    for each in closing_of(number).cases:
        runs = sequences_of(number) if each.case.later else runs_of(number)
        if each.case.limits.time_ns is None and runs.complete:
            never = each.execution.visited_freely & ~runs.visited & ~runs.cut_off
            assert runs.obligations.names(never) == (), each.case


@pytest.mark.longer
@pytest.mark.parametrize("number", slow_beyond(1, SMALL[: share(len(SMALL), least=3)]))
def test_certificates_hold_and_replays_visit_what_they_promise(number: int) -> None:
    model, closing = model_of(number), closing_of(number)
    for kind, certificate in closing.certificates:
        assert [str(flaw) for flaw in check_certificate(certificate, model)] == [], kind
    tester, obligations = Tester(model), closing.after.obligations
    for each in closing.cases:
        promised = sum(obligations.bit(d.obligation) for d in closing.decided if d.case == each.case.name)
        again = tester.execute(read_case(write_case(each.case, model, None), model))
        assert promised & ~again.visited == 0
        assert all(failure.kind is FailureKind.BUILT_IN for failure in again.verdict.failures)


@pytest.mark.longer
@pytest.mark.parametrize("number", slow_beyond(1, SMALL[: share(len(SMALL), least=3)]))
def test_random_cases_visit_nothing_that_no_run_visits_and_replay_alike(number: int) -> None:
    model, tester = model_of(number), Tester(model_of(number))
    runs = runs_of(number)
    for case in RandomCases(model, moves_inputs=True).first(25, 1):
        execution = tester.execute(case)
        never = execution.visited & ~runs.visited & ~runs.cut_off
        assert not runs.complete or runs.obligations.names(never) == ()
        recorded = read_case(write_case(execution.recorded_case, model, None), model)
        assert tester.execute(replace(recorded, origin=None)).digest == execution.digest


@pytest.mark.slow
def test_an_input_that_changes_again_is_not_put_back_between() -> None:
    model = opened(small_random_model(113), 113)
    for each in Closer(model, CloseLimits(situations=2_000, planning=3_000, random=100, changes=100)).close().cases:
        assert read_case(write_case(each.case, model, None), model).name == each.case.name
