"""All mutants of many models: the loader accepts each of them, and names do not occur twice."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.files import load_model, read_model, write_model
from scbm.model import BehaviorModel
from scbm.mutation import mutants_of
from support.profiles import share, slow_beyond, slow_where
from support.random_models import random_model

ROOT = Path(__file__).parents[2]
LARGE = ("actions", "durations", "handshakes", "objects", "sums")
WRITTEN = sorted((ROOT / "tests" / "models" / "valid").glob("*.yaml"))


def _unbound(model: BehaviorModel) -> BehaviorModel:
    return replace(model, resources=tuple(replace(each, binding=None) for each in model.resources))


def _assert_loadable(model: BehaviorModel, most: int) -> None:
    """Write and read up to `most` mutants, spread over all of them."""
    mutants = list(mutants_of(model))
    assert len(dict.fromkeys(mutant.name for mutant in mutants)) == len(mutants)
    for mutant in mutants[:: max(1, len(mutants) // most)]:
        changed = _unbound(mutant.model)
        assert read_model(write_model(changed), mutant.name) == changed
        assert changed != _unbound(model)


@pytest.mark.parametrize("file", slow_where(lambda file: file.stem in LARGE, WRITTEN), ids=lambda file: file.stem)
def test_mutants_of_written_models_can_be_loaded(file: Path) -> None:
    _assert_loadable(load_model(file), share(400, usual=8))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["robot_in_the_air/after.yaml", "dual_cnc/cell.yaml"])
def test_mutants_of_examples_can_be_loaded(name: str) -> None:
    _assert_loadable(load_model(ROOT / "examples" / name), share(200))


@pytest.mark.parametrize("number", slow_beyond(1, range(100)))
def test_mutants_of_random_models_can_be_loaded(number: int) -> None:
    _assert_loadable(random_model(number), share(200, usual=6))
