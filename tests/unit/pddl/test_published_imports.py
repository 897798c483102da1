"""Published problems, imported: `check` finds no errors, and the shortest plans have the published lengths.

So have the plans of Fast Downward for the problems that were exported again.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

import pytest

from conftest import Ran
from scbm.files import load_model
from scbm.model import BehaviorModel
from scbm.planning import Planner, Solved
from support.published_pddl import PUBLISHED

# the reader of `unified-planning` 1.3 calls old names of a library of its own
pytestmark = pytest.mark.filterwarnings("ignore:.* deprecated - use:DeprecationWarning")

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


def exported(model: Path, scbm: Scbm) -> tuple[Path, Path]:
    """Export a model next to its file, and return the domain and the problem of its goal."""
    out = model.parent / "out"
    assert scbm("export", "pddl", model, "--out", out).code == 0
    return out / "domain.pddl", out / "goal.pddl"


def optimal_length(domain: Path, problem: Path) -> int:
    """Return the length of the plan that Fast Downward proves to be optimal, with its own parser of PDDL.

    The search for invariants is left out: it takes 10 s for propositions, and LM-cut is admissible without them.
    """
    driver = files("up_fast_downward") / "downward" / "fast-downward.py"
    here = domain.parent
    options = ["--plan-file", "found.plan", "--sas-file", "task.sas", str(domain), str(problem)]
    options += ["--translate-options", "--invariant-generation-max-time", "0"]
    options += ["--search-options", "--search", "astar(lmcut())"]
    subprocess.run([sys.executable, str(driver), *options], cwd=here, check=True, capture_output=True)
    plan = (here / "found.plan").read_text(encoding="utf-8")
    return sum(not line.startswith(";") for line in plan.splitlines())


@pytest.mark.slow
@pytest.mark.parametrize("name", PUBLISHED)
def test_an_imported_problem_has_plans_of_the_published_length(name: str, scbm: Scbm, tmp_path: Path) -> None:
    model = imported(name, scbm, tmp_path)
    clean = name.startswith(("blocks", "gripper", "plansys2-factory"))
    # Other problems have trucks that never leave their city, samples that are nowhere, and facts that nothing reads.
    assert scbm("check", "--strict", model).code == (0 if clean else 1)
    assert shortest(load_model(model)) == PUBLISHED[name][2]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gripper-1", "rovers-1", "plansys2-simple", "plansys2-factory"])
def test_an_imported_problem_that_is_exported_and_imported_again_has_plans_of_the_same_length(
    name: str, scbm: Scbm, tmp_path: Path
) -> None:
    domain, problem = exported(imported(name, scbm, tmp_path), scbm)
    back = tmp_path / "back.yaml"
    assert scbm("import", "pddl", domain, problem, "-o", back).code == 0
    assert shortest(load_model(back)) == PUBLISHED[name][2]


@pytest.mark.peer
@pytest.mark.skipif(
    find_spec("up_fast_downward") is None and os.environ.get("SCBM_ALL_TOOLS") != "1",
    reason="not installed: up-fast-downward",
)
@pytest.mark.parametrize("name", PUBLISHED)
def test_an_imported_problem_that_is_exported_again_has_optimal_plans_of_the_published_length(
    name: str, scbm: Scbm, tmp_path: Path
) -> None:
    domain, problem = exported(imported(name, scbm, tmp_path), scbm)
    assert optimal_length(domain, problem) == PUBLISHED[name][2]
