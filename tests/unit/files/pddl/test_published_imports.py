"""Published problems, imported: `check` finds no errors, and the shortest plans have the published lengths."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Ran
from scbm.files import load_model
from scbm.model import BehaviorModel
from scbm.planning import Planner, Solved
from support.published_pddl import PUBLISHED

# the reader of `unified-planning` 1.3 calls old names of a library of its own
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:.* deprecated - use:DeprecationWarning")]

Scbm = Callable[..., Ran]


def shortest(model: BehaviorModel) -> int:
    ((_, goal),) = model.goals
    answer = Planner(model).plan(model.nominal_state, goal)
    assert isinstance(answer, Solved)
    return len(answer.plan)


def imported(name: str, scbm: Scbm, directory: Path) -> Path:
    domain, problem, _ = PUBLISHED[name]
    (directory / "domain.pddl").write_text(domain)
    (directory / "problem.pddl").write_text(problem)
    model = directory / "model.yaml"
    assert scbm("import", "pddl", directory / "domain.pddl", directory / "problem.pddl", "-o", model).code == 0
    return model


@pytest.mark.parametrize("name", PUBLISHED)
def test_an_imported_problem_has_plans_of_the_published_length(name: str, scbm: Scbm, tmp_path: Path) -> None:
    model = imported(name, scbm, tmp_path)
    assert scbm("check", model).code == 0
    assert shortest(load_model(model)) == PUBLISHED[name][2]


@pytest.mark.parametrize("name", ["gripper-1"])  # the reader takes 15 s for the propositions of blocks-4-0
def test_an_imported_problem_that_is_exported_and_imported_again_has_plans_of_the_same_length(
    name: str, scbm: Scbm, tmp_path: Path
) -> None:
    model = imported(name, scbm, tmp_path)
    assert scbm("export", "pddl", model, "--out", tmp_path / "out").code == 0
    back = tmp_path / "back.yaml"
    assert scbm("import", "pddl", tmp_path / "out/domain.pddl", tmp_path / "out/goal.pddl", "-o", back).code == 0
    assert shortest(load_model(back)) == PUBLISHED[name][2]
