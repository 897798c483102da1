"""Decisions about random mutants of small random models, beside all runs of original and mutant in lock-step."""

from __future__ import annotations

from functools import cache
from random import Random

import pytest
from msgspec.structs import replace

from scbm.model import BehaviorModel, GoalOrder, RunsDeclaration
from scbm.mutation import mutants_of
from scbm.mutation.equivalence.equivalences import Equivalences
from scbm.mutation.equivalence.mutant_decisions import DifferentMutant, EquivalentMutant
from support.lockstep import compare_runs
from support.opened_models import opened
from support.profiles import share, slow_beyond
from support.random_models import small_random_model

CLOSED = (2, 4, 24, 21, 22, 23, 27, 29, 26, 15, 12, 3, 25)
OPENED = (2, 14, 31, 18, 21, 25, 29, 36, 38, 22, 3, 28)
"""Models whose runs are few enough to be compared in a second or two; the environment of the others acts."""

MUTANTS = 8
"""So many mutants of each model: 200 together with all examples."""

USUAL = 1


@cache
def model_of(index: int) -> BehaviorModel:
    """Every second model is opened. Some have single goals, so that what follows the end of a run is different."""
    number = CLOSED[index // 2] if index % 2 == 0 else OPENED[index // 2]
    model = small_random_model(number)
    if index % 2:
        model = opened(model, number)
    return replace(model, runs=RunsDeclaration(GoalOrder.SINGLE if number % 2 else GoalOrder.SEQUENCE))


@pytest.mark.longer
@pytest.mark.parametrize("index", slow_beyond(USUAL, range(len(CLOSED) + len(OPENED))))
def test_no_mutant_is_wrongly_called_equivalent(index: int) -> None:
    original = model_of(index)
    known = list(mutants_of(original))
    equivalences = Equivalences(original)
    assert compare_runs(original, original).complete
    for mutant in Random(f"mutants {index}").sample(known, min(share(MUTANTS, usual=3), len(known))):
        decision = equivalences.decide(mutant.model)
        comparison = compare_runs(original, mutant.model)
        if isinstance(decision, EquivalentMutant):
            assert comparison.difference is None, mutant.name
            assert comparison.complete
        elif isinstance(decision, DifferentMutant):
            begins_alike = mutant.model.nominal_state == original.nominal_state  # where a case does not say otherwise
            assert comparison.difference is not None or not begins_alike, mutant.name
