"""Whatever fails, and however: it becomes a case that is no larger, can be written down, and fails the same again."""

from __future__ import annotations

from hypothesis import given

from scbm.files import read_case, write_case
from scbm.model import BehaviorModel
from scbm.planning import PlanLimits
from scbm.running import RunnerOptions
from scbm.testing import RandomCases, Shrinker, Tester
from support.profiles import examples
from support.strategies import SECOND_NS, running_models

OPTIONS = RunnerOptions(time_limit_ns=200 * SECOND_NS, plan_limit=30, livelock_bound=60)
LIMITS = PlanLimits(length=60, expansions=2_000)


@given(running_models())
@examples(80, usual=5)
def test_failing_cases_of_any_model_become_small_cases_that_fail_again(model: BehaviorModel) -> None:
    tester = Tester(model, OPTIONS, LIMITS)
    shrinker = Shrinker(tester, most_runs=150)
    for case in RandomCases(model, network=None).first(4, seed=5):
        execution = tester.execute(case)
        for failure in execution.verdict.failures[:2]:
            shrunk = shrinker.shrink(execution, failure)
            assert shrunk.after <= shrunk.before
            assert shrunk.failure.is_like(failure)
            read = read_case(write_case(shrunk.execution.case, model, None), model)
            again = tester.execute(read)
            assert again.digest == shrunk.execution.digest
            assert shrunk.failure in again.verdict.failures
