"""Whatever the network and the resources do: a run ends with a verdict, and a reply counts once, for its own request.

The cases are drawn by our own generator, which is as good for this as Hypothesis and a hundred times faster; Hypothesis
draws the models. Together they are more than ten thousand.
"""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from random import Random

import pytest
from hypothesis import given
from msgspec.structs import replace

from scbm.cases import CONDITIONS, Case, Condition, ConditionKind, Injection
from scbm.cases.trace import End, ReplyDropped, ReplyReceived, RequestCancelled, RequestSent, RunEnded
from scbm.files import load_model
from scbm.model import BehaviorModel, Outcome
from scbm.planning import PlanLimits
from scbm.running import RunnerOptions
from scbm.testing import Execution, RandomCases, Tester
from support.profiles import examples, share
from support.strategies import SECOND_NS, running_models

EXAMPLE = Path(__file__).parents[2] / "examples" / "robot_in_the_air" / "after.yaml"
OPTIONS = RunnerOptions(time_limit_ns=200 * SECOND_NS, plan_limit=30, livelock_bound=60)
LIMITS = PlanLimits(length=60, expansions=2_000)

OF_THE_EXAMPLE = 7_000
MODELS, OF_EACH_MODEL = 80, 50


def _injected(case: Case, model: BehaviorModel, seed: int) -> Case:
    """The case with conditions of resources that come and go."""
    random = Random(f"conditions {seed} {case.name}")
    injections = []
    for index in range(random.randrange(3)):
        kind = random.choice(list(CONDITIONS.values()))
        condition = Condition(kind, Fraction(random.randint(1, 30)) if kind.has_factor else Fraction(1))
        at_ns, hold_ns = random.randrange(20) * SECOND_NS, random.choice([None, random.randrange(15) * SECOND_NS])
        resource = random.choice(model.resources).name
        injections.append(Injection(f"i{index}", (), None, at_ns, hold_ns, resource, condition))
    return replace(case, injections=tuple(injections))


def _check(execution: Execution) -> None:
    """Follows the requests of a trace with a list of those in flight, which knows nothing of the runner."""
    in_flight: dict[int, str] = {}
    sent: dict[int, str] = {}
    answered: list[int] = []
    ends = []
    for record in execution.trace.records:
        match record:
            case RequestSent(request=request, resource=resource):
                assert request not in sent
                assert resource not in in_flight.values()
                sent[request] = in_flight[request] = resource
            case RequestCancelled(request=request, resource=resource):
                assert in_flight.pop(request) == resource
            case ReplyReceived(request=request, resource=resource, succeeded=succeeded):
                assert in_flight.pop(request) == resource
                answered.append(request)
                _check_reply(execution, request, succeeded=succeeded)
            case ReplyDropped(request=request, why=why):
                assert request not in in_flight
                assert why == ("repeated" if request in answered else "late")
                assert request in sent
            case RunEnded(end=end):
                assert not in_flight
                ends.append(End(end))
    assert ends == [execution.verdict.end]
    assert len(answered) == len(set(answered))


def _check_reply(execution: Execution, request: int, *, succeeded: bool) -> None:
    """A reply says what its resource was to say to this very request, or that it failed where it was made to fail."""
    outcome = execution.reactions[request - 1].outcome
    assert outcome is not Outcome.TIMEOUT
    is_failing = any(
        i.condition is not None and i.condition.kind is ConditionKind.FAILING for i in execution.case.injections
    )
    assert succeeded is (outcome is Outcome.SUCCEED) or (is_failing and not succeeded)


def _run_all(model: BehaviorModel, count: int, seed: int) -> dict[End, int]:
    """Runs and checks cases; how many ended in which way."""
    tester = Tester(model, OPTIONS, LIMITS)
    ends: dict[End, int] = {}
    for case in RandomCases(model, network=None).first(count, seed):
        execution = tester.execute(_injected(case, model, seed))
        _check(execution)
        ends[execution.verdict.end] = ends.get(execution.verdict.end, 0) + 1
    assert sum(ends.values()) == count
    return ends


@pytest.mark.slow
def test_seven_thousand_cases_of_the_example() -> None:
    count = share(OF_THE_EXAMPLE)
    ends = _run_all(load_model(EXAMPLE), count, seed=11)
    assert ends[End.REACHED] > count / 2
    assert ends[End.TIME_LIMIT]
    assert ends[End.ABORTED]


@given(running_models())
@examples(MODELS, usual=4)
def test_fifty_cases_of_each_of_eighty_models(model: BehaviorModel) -> None:
    _run_all(model, OF_EACH_MODEL, seed=12)


def test_these_are_more_than_ten_thousand() -> None:
    assert OF_THE_EXAMPLE + MODELS * OF_EACH_MODEL > 10_000
