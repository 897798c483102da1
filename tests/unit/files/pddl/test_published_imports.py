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


@pytest.mark.parametrize("name", PUBLISHED)
def test_an_imported_problem_and_its_export_have_plans_of_the_published_length(
    name: str, scbm: Scbm, tmp_path: Path
) -> None:
    domain, problem, length = PUBLISHED[name]
    (tmp_path / "domain.pddl").write_text(domain)
    (tmp_path / "problem.pddl").write_text(problem)
    model = tmp_path / "model.yaml"
    assert scbm("import", "pddl", tmp_path / "domain.pddl", tmp_path / "problem.pddl", "-o", model).code == 0
    assert scbm("check", model).code == 0
    assert shortest(load_model(model)) == length
    assert scbm("export", "pddl", model, "--out", tmp_path / "out").code == 0
    back = tmp_path / "back.yaml"
    assert scbm("import", "pddl", tmp_path / "out/domain.pddl", tmp_path / "out/goal.pddl", "-o", back).code == 0
    assert shortest(load_model(back)) == length
