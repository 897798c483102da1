"""`non_blocking` gives no alarm for models in which nothing blocks: examples, and models from public sources."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.files import load_model
from scbm.model import GoalOrder, RunsDeclaration
from scbm.testing import RandomCases, Tester, Unjudged

ROOT = Path(__file__).parents[3]
EXAMPLES = sorted((ROOT / "examples").glob("*/*.yaml"))
PUBLIC = sorted((ROOT / "study" / "models").glob("*.yaml"))
SEQUENCES = [path for path in PUBLIC if load_model(path).runs.goals is GoalOrder.SEQUENCE]


@pytest.mark.parametrize("path", [*EXAMPLES, *SEQUENCES], ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_random_cases_with_goals_in_a_row_give_no_alarm(path: Path) -> None:
    """A model that says that its runs are single is judged as if it did not say so."""
    written = load_model(path)
    model = replace(written, runs=RunsDeclaration(plans=written.runs.plans))
    tester, random = Tester(model), RandomCases(model, goals=3)
    runs = [tester.execute(random.case(1, number)) for number in range(1, 11)]
    assert not [each for run in runs for each in run.violations if each.requirement == "non_blocking"]
    assert not [run for run in runs if run.unjudged is Unjudged.TOO_LONG]


def test_there_are_enough_public_models() -> None:
    assert len(SEQUENCES) >= 12
