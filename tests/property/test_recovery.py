"""An operation that some run starts is never reported as never enabled."""

from __future__ import annotations

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from scbm.cases.trace import OperationStepped
from scbm.closing.advice import CheckLimits, check_model
from scbm.model import BehaviorModel, InputError, OperationState, Slug
from scbm.planning import PlanLimits
from scbm.running import RunnerOptions
from scbm.testing import RandomCases, Tester
from support.profiles import examples
from support.random_models import random_model
from support.strategies import SECOND_NS, running_models

OPTIONS = RunnerOptions(time_limit_ns=100 * SECOND_NS, plan_limit=12, livelock_bound=60)
LIMITS = PlanLimits(length=50, expansions=5_000)


def started(model: BehaviorModel, seed: int, count: int) -> list[str]:
    """Return the operations that random cases execute. Raises `InputError` if no initial state is allowed."""
    tester = Tester(model, OPTIONS, LIMITS)
    executions = [tester.execute(case) for case in RandomCases(model).first(count, seed)]
    records = (record for execution in executions for record in execution.trace.records)
    steps = (record for record in records if isinstance(record, OperationStepped))
    return [step.operation for step in steps if step.target is OperationState.EXECUTING]


def doubted(model: BehaviorModel, states: int) -> list[str | int]:
    """Return the operations that are reported as never enabled."""
    doubts = check_model(model, CheckLimits(states=states, chains=100)).doubts
    return [str(doubt.path[1]) for doubt in doubts if doubt.slug is Slug.OPERATION_NEVER_ENABLED]


@pytest.mark.slow
@given(running_models(), st.integers(0, 2**32), st.sampled_from([2, 50, 5_000]))
@settings(examples(200), suppress_health_check=[HealthCheck.too_slow])
def test_operations_that_runs_start_are_not_doubted(model: BehaviorModel, seed: int, states: int) -> None:
    try:
        names = started(model, seed, 6)
    except InputError:
        assume(False)
        raise
    assert [name for name in doubted(model, states) if name in names] == []


@pytest.mark.slow
@given(st.integers(1, 200))
@settings(examples(60), suppress_health_check=[HealthCheck.too_slow])
def test_operations_of_larger_models_that_runs_start_are_not_doubted(number: int) -> None:
    model = random_model(number)
    assert [name for name in doubted(model, 20_000) if name in started(model, number, 20)] == []
