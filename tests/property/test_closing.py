"""What closing decides about random models, beside all their runs."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from scbm.cases.trace import End, ends_of
from scbm.closing import Closer, Closing, Decision
from scbm.files import read_case, write_case
from scbm.model import BehaviorModel, PlanSet
from scbm.model.sources import outside_groups
from scbm.proofcheck import certificate_text, check_certificate
from scbm.testing import Campaign, FailureKind, RandomCases, Tester
from support.enumeration import Enumeration, enumerate_runs
from support.profiles import share, slow_beyond
from support.random_models import random_model
from support.shared_closings import shared_closing

# fmt: off
SMALL = (
    2, 18, 9, 47, 49, 35, 43, 58, 59, 67, 72, 73, 81, 85, 86, 89, 91, 92, 95, 98,
    12, 37, 25, 40, 31, 3, 4, 5, 8, 10, 22, 24, 33, 38, 45, 48, 65, 76, 79, 80,
)
# fmt: on
"""Models that are enumerated and closed in a moment, the fastest first; benchmarks/close.py takes all."""

_MOST = 3_000
"""Maximum number of situations of sequences of goals that are enumerated; of any plans there are too many for all."""

TESTS = Path(__file__).parents[1]

LIMIT_ENDS = (End.TIME_LIMIT, End.REPLAN_LIMIT, End.PLANNER_LIMIT, End.LIVELOCK)
"""A livelock is also what a run ends as in which too many things happen at one moment."""


@cache
def model_of(number: int) -> BehaviorModel:
    return random_model(number)


@cache
def closing_of(number: int) -> Closing:
    return shared_closing(model_of(number))


def wrong_proofs(closing: Closing, enumeration: Enumeration) -> list[str]:
    """What is called uncoverable though a run visits it; the figure's obligations and those beside it."""
    proved = (d for d in closing.decided if d.decision is Decision.UNCOVERABLE)
    return [f"{d.obligation} ({d.reason})" for d in proved if enumeration.visits(str(d.obligation))]


def wrong_exclusions(closing: Closing, enumeration: Enumeration) -> list[str]:
    """What is called excluded by the planner though a run with its plans visits it."""
    excluded = (d for d in closing.decided if d.decision is Decision.EXCLUDED)
    return [f"{d.obligation} ({d.reason})" for d in excluded if enumeration.visits(str(d.obligation))]


def impossible_cases(closing: Closing, enumeration: Enumeration, sequences: Enumeration) -> list[str]:
    """What cases without injections visit though no run does; the enumeration would be wrong.

    Args:
        closing: the result of closing.
        enumeration: all runs for single goals in which nothing changes from outside.
        sequences: runs for goals that follow each other, with changes from outside; if these are not all, cases with
            several goals are left out, and all cases of models with such changes: these may begin with other inputs.
    """
    found, is_open = [], bool(outside_groups(closing.model))
    for each in closing.cases:
        if each.case.injections or (not sequences.complete and (is_open or each.case.later)):
            continue
        runs = sequences if sequences.complete else enumeration
        allowed = runs.visited | enumeration.visited
        if any(ended.end in LIMIT_ENDS for ended in ends_of(each.execution.trace.records)):
            allowed |= runs.cut_off
        never = each.execution.visited & ~allowed
        found += [f"{each.case.name}: {name}" for name in enumeration.obligations.names(never)]
    return found


def overlooked(closing: Closing) -> list[str]:
    """What is undecided though a simulated run visits it: all runs are enumerated anew, if there is a doubt."""
    undecided = [str(d.obligation) for d in closing.decided if d.decision is Decision.UNDECIDED]
    if not undecided:
        return []
    simulated = enumerate_runs(closing.model, simulated=True)
    return [name for name in undecided if name in simulated.obligations.names(simulated.visited)]


def failing_replays(closing: Closing) -> list[str]:
    """What is wrong with the cases when they are run again, and when they are written, read, and run."""
    return [complaint for each in closing.cases for complaint in _faults_of(closing, each.case.name)]


def _faults_of(closing: Closing, name: str) -> Iterator[str]:
    case = next(each.case for each in closing.cases if each.case.name == name)
    model, tester = closing.model, Tester(closing.model)
    obligations = closing.after.obligations
    promised = sum(obligations.bit(d.obligation) for d in closing.decided if d.case == name)
    again = read_case(write_case(case, model, "model.yaml"), model)
    for how, replayed in (("", case), (" once written", again)):
        execution = tester.execute(replayed)
        for failure in execution.verdict.failures:
            # Not all random models clean up or settle at rest; closing reports that.
            if failure.kind not in (FailureKind.BUILT_IN, FailureKind.LIVELOCK):
                yield f"{name} fails{how}: {failure}"
        for missed in obligations.names(promised & ~execution.visited):
            yield f"{name} does not visit {missed}{how}"


def incomplete(closing: Closing) -> Iterator[str]:
    """What is decided without a case or a certificate, and cases that add nothing."""
    claimed = {kind: set(c.claims) for kind, c in closing.certificates}
    cases = dict(closing.after.cases)
    obligations = closing.after.obligations
    if tuple(d.obligation for d in closing.decided) != obligations.all:
        yield "not every obligation is decided once, in order"
    for d in closing.decided:
        if d.decision is Decision.COVERED and not cases.get(d.case or "", 0) & obligations.bit(d.obligation):
            yield f"{d.obligation} is covered by {d.case}, which does not visit it"
        if d.decision is Decision.UNCOVERABLE and str(d.obligation) not in claimed.get(d.certificate or "", ()):
            yield f"no certificate claims {d.obligation}"
    visited = closing.before.visited
    for each in closing.cases:
        new = each.execution.visited & ~visited
        visited |= new
        if not new or obligations.names(new) != tuple(map(str, each.adds)):
            yield f"{each.case.name} adds {each.adds}"


def flaws(closing: Closing) -> list[str]:
    """What is wrong with the certificates."""
    return [
        f"{kind}: {flaw}"
        for kind, certificate in closing.certificates
        for flaw in check_certificate(certificate, closing.model)
    ]


def texts_of(closing: Closing) -> str:
    """All cases and certificates as text."""
    cases = [write_case(each.case, closing.model, "model.yaml") for each in closing.cases]
    return "\n".join((*cases, *(certificate_text(certificate) for _, certificate in closing.certificates)))


@pytest.mark.parametrize("number", slow_beyond(1, SMALL))
def test_no_proof_is_wrong_and_what_runs_visit_is_covered(number: int) -> None:
    closing, enumeration = closing_of(number), enumerate_runs(model_of(number))
    assert enumeration.complete
    any_plans = enumerate_runs(model_of(number), _MOST, is_open=True, is_sequence=True, plans=PlanSet.ANY)
    assert wrong_proofs(closing, any_plans) == []
    sequences = enumerate_runs(model_of(number), _MOST, is_open=True, is_sequence=True)
    assert wrong_exclusions(closing, sequences) == []
    assert impossible_cases(closing, enumeration, sequences) == []
    assert overlooked(closing) == []


@pytest.mark.parametrize("number", slow_beyond(1, SMALL[: share(len(SMALL), least=4)]))
def test_every_decision_has_a_case_that_passes_or_a_certificate_that_holds(number: int) -> None:
    closing = closing_of(number)
    assert list(incomplete(closing)) == []
    assert failing_replays(closing) == []
    assert flaws(closing) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", SMALL[: share(5, least=2)])
def test_what_a_suite_visits_is_left_to_it(number: int) -> None:
    model = model_of(number)
    suite = Campaign.of(model, Tester(model).results(RandomCases(model).first(5, seed=1)))
    closing = Closer(model).close(suite)
    assert closing.before == suite.coverage
    assert list(incomplete(closing)) == []
    assert [d.decision for d in closing.decided] == [d.decision for d in closing_of(number).decided]
    visited = sum(closing.after.obligations.bit(o) for each in closing.cases for o in each.adds)
    assert not visited & suite.coverage.visited


@pytest.mark.slow
@pytest.mark.parametrize("number", SMALL[: share(5, least=2)])
def test_closing_twice_decides_alike(number: int) -> None:
    again, first = Closer(model_of(number)).close(), closing_of(number)
    assert again.decided == first.decided
    assert again.cases == first.cases
    assert texts_of(again) == texts_of(first)


_SCRIPT = """
from property.test_closing import SMALL, closing_of, texts_of
for number in SMALL[:5]:
    print(closing_of(number).decided, texts_of(closing_of(number)))
"""


@pytest.mark.slow
def test_the_hash_seed_changes_nothing() -> None:
    environments = [{**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": str(TESTS)} for seed in ("0", "1")]
    outputs = [
        subprocess.run([sys.executable, "-c", _SCRIPT], env=environment, capture_output=True, check=True).stdout
        for environment in environments
    ]
    assert outputs[0] == outputs[1] != b""
