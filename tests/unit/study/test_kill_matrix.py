"""Which cases find which mutants, against runs of the original beside each run of a mutant."""

from __future__ import annotations

from dataclasses import replace

import pytest
from kill_matrix import ORACLES, KillMatrix, MutantRow, OriginalRuns, mutant_row, operator_weights, sample
from subjects import generated_model

from scbm.mutation import MutationRuns, mutants_of
from scbm.testing import RandomCases, Tester
from scbm.testing.recorded_results import goals_to_record
from scbm.testing.verdicts import FailureKind

CASES, EACH = 8, 9
"""The number of cases, and one of so many mutants is tried."""


@pytest.mark.longer
def test_a_row_says_which_cases_find_a_mutant_by_each_oracle() -> None:
    model = generated_model(2)
    tester = Tester(model)
    runs = MutationRuns(tester, RandomCases(model).first(CASES, seed=1))
    originals = OriginalRuns(runs.cases, tester)
    found_by_some = [0] * len(ORACLES)
    # records of the start of a run have the states of all operations, so those of such mutants always differ
    compared = [mutant for mutant in mutants_of(model) if not mutant.operator.startswith("operation-")]
    for mutant in compared[::EACH]:
        expected = [0] * len(ORACLES)
        for number, case in enumerate(runs.cases):
            original, run = tester.execute(case), Tester(mutant.model).execute(case)
            recorded = [goals_to_record(each.trace.records, model, tester.obligations) for each in (original, run)]
            kinds = [failure.kind for failure in run.verdict.failures]
            by_oracle = (
                run.trace.records != original.trace.records,
                any(kind is not FailureKind.BUILT_IN for kind in kinds),
                bool(kinds),
                bool(kinds) or recorded[0] != recorded[1],
            )
            expected = [bits | finds << number for bits, finds in zip(expected, by_oracle, strict=True)]
        assert list(mutant_row(runs, mutant, originals).found) == expected, mutant.name
        found_by_some = [bits | more for bits, more in zip(found_by_some, expected, strict=True)]
    assert all(found_by_some)


@pytest.mark.longer
def test_a_weight_says_how_many_mutants_of_its_operator_one_of_the_sample_stands_for() -> None:
    model, most = generated_model(1), 60
    known = list(mutants_of(model))
    drawn = sample(known, most)
    weights = operator_weights(model, most)
    assert len(known) > most
    assert weights is not None
    assert sum(weights[mutant.operator] for mutant in drawn) == pytest.approx(len(known))
    assert min(weights.values()) == 1
    every = operator_weights(model, len(known))
    assert every is not None
    assert set(every.values()) == {1}


@pytest.mark.longer
def test_a_model_with_other_mutants_than_its_kill_matrix_has_no_weights() -> None:
    model, most = generated_model(1), 60
    known = list(mutants_of(model))
    rows = tuple(MutantRow(mutant.name, mutant.operator, (0,) * len(ORACLES)) for mutant in sample(known, most))
    same = KillMatrix("generated-1", "generated", "another digest", mutants=rows, all_mutants=len(known))
    assert operator_weights(model, most, same) == operator_weights(model, most)
    assert operator_weights(model, most, replace(same, all_mutants=len(known) + 1)) is None
    assert operator_weights(model, most, replace(same, mutants=(*rows, rows[0]))) is None
