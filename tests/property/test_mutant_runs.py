"""Cases that are left out for a mutant: their runs on the mutant are those on the original, record by record."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Case, CaseLimits
from scbm.cases.trace import Changes, Record, RunnerStarted, RunStarted
from scbm.files import load_model
from scbm.model import BehaviorModel
from scbm.model.predicates import TRUE
from scbm.mutation import MutationRuns, mutants_of
from scbm.testing import Execution, RandomCases, Tester, load_suite
from support.profiles import share, slow_beyond
from support.random_models import random_model
from support.two_robots import two_robots

EXAMPLES = Path(__file__).parents[2] / "examples"
WRITTEN = sorted((Path(__file__).parents[1] / "models" / "valid").glob("*.yaml"))


def _comparable(execution: Execution) -> list[object]:
    """The records of a run; an operation that is gone or in another place changes the first state that is recorded."""
    return [
        replace(record, state=(), changes=())
        if isinstance(record, RunnerStarted | RunStarted)
        else replace(record, changes=_sorted(record))
        for record in execution.trace.records
    ]


def _sorted(record: Record) -> Changes:
    return tuple(sorted(record.changes))


def _assert_sound(model: BehaviorModel, cases: Iterable[Case], most: int) -> None:
    """Run all cases that are left out for up to `most` mutants, spread over all of them."""
    tester = Tester(model)
    runs = MutationRuns(tester, cases)
    records = [_comparable(tester.execute(case)) for case in runs.cases]
    mutants = list(mutants_of(model))
    for mutant in mutants[:: max(1, len(mutants) // most)]:
        under_test = runs.under_test(mutant)
        for number, case in enumerate(runs.cases):
            if not under_test.may_differ(number, case):
                assert _comparable(under_test.execute(case)) == records[number], (mutant.name, case.name)
                assert under_test.failure(case) is None, (mutant.name, case.name)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["robot_in_the_air", "dual_cnc"])
def test_runs_of_written_cases_are_left_out_soundly(name: str) -> None:
    models = {"robot_in_the_air": "after.yaml", "dual_cnc": "cell.yaml"}
    model = load_model(EXAMPLES / name / models[name])
    written = load_suite([EXAMPLES / name / "cases"], model)
    _assert_sound(model, [each.case for each in written], share(900, 60))


@pytest.mark.parametrize("file", WRITTEN, ids=lambda file: file.stem)
def test_runs_of_models_with_each_key_are_left_out_soundly(file: Path) -> None:
    model = load_model(file)
    if model.goals and model.initial_states == TRUE:
        drawn = RandomCases(model, moves_inputs=True).first(3, 0)
        limits = CaseLimits(time_ns=share(60) * 60_000_000_000)  # an environment that always acts fills the hour
        _assert_sound(model, (replace(case, limits=limits) for case in drawn), share(200, usual=8))


@pytest.mark.longer
@pytest.mark.parametrize("number", slow_beyond(2, range(100)))
def test_runs_of_random_models_are_left_out_soundly(number: int) -> None:
    model = random_model(number)
    moves_inputs = number % 2 == 1
    _assert_sound(
        model, RandomCases(model, network=None, moves_inputs=moves_inputs).first(4, number), share(300, usual=10)
    )


@pytest.mark.slow
def test_runs_with_drawn_plans_are_left_out_soundly() -> None:
    model = two_robots()
    _assert_sound(model, RandomCases(model).first(5, 0), 200)
