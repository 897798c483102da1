"""The random models: each is what its file says, and together they have everything."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from scbm.files import read_model, write_model
from scbm.model import Add, BehaviorModel, InitialStates, Transition, Truth
from support.profiles import share
from support.random_models import random_model

ALL = range(1, 201)
SOME = ALL[: share(200) if share(200) == len(ALL) else 8]
"""Making a model takes longer than all that the tests ask of it."""


@pytest.mark.slow
def test_each_is_read_as_it_is_written() -> None:
    assert [number for number in SOME if read_model(write_model(random_model(number))) != random_model(number)] == []


@pytest.mark.longer
def test_sizes_are_within_bounds() -> None:
    for number in SOME:
        model = random_model(number)
        assert 3 <= len(model.variables) <= 12
        assert 3 <= len(model.operations) <= 20
        assert 1 <= len(model.resources) <= 4
        assert 1 <= len(model.goals) <= 5
        assert not model.requirements


@pytest.mark.longer
def test_each_has_an_initial_state() -> None:
    assert all(next(InitialStates(random_model(number)).allowed(10_000), None) is not None for number in SOME)


def reads(transition: Transition) -> set[str]:
    return {*transition.g.reads(), *transition.gr.reads()}


@pytest.mark.slow
@pytest.mark.parametrize(
    "has",
    [
        lambda model: any(operation.deadline_ns is None for operation in model.operations),
        lambda model: any(operation.deadline_ns == 0 for operation in model.operations),
        lambda model: any(operation.disabled_deadline_ns for operation in model.operations),
        lambda model: any(operation.failed for operation in model.operations),
        lambda model: any(operation.pre.gr != Truth(True) for operation in model.operations),
        lambda model: any(operation.post.g != Truth(True) for operation in model.operations),
        lambda model: any(operation.pre.ar for operation in model.operations),
        lambda model: any(isinstance(action, Add) for o in model.operations for action in o.timedout),
        lambda model: any("current.name" in reads(t) for t in model.automatic_transitions),
        lambda model: any("plan.state" in reads(t) for t in model.automatic_transitions),
        lambda model: any(t.name == "back" for t in model.automatic_transitions),
        lambda model: any(t.name.startswith("behind_") for t in model.automatic_transitions),
        lambda model: any(resource.measures for resource in model.resources),
        lambda model: model.initial_states != Truth(True),
    ],
)
def test_every_kind_of_thing_is_there_more_than_once(has: Callable[[BehaviorModel], bool]) -> None:
    assert sum(has(random_model(number)) for number in ALL) > 4
