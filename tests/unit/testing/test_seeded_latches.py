"""A latch that a failed reply sets and nothing resets, in each example with sequences of goals (semantics 7.12)."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import pytest
from ruamel.yaml import YAML

from scbm.cases import Case, CaseGoal, OutcomeRule
from scbm.files import load_model, read_model, write_model
from scbm.model import BehaviorModel, GoalOrder, Outcome, State
from scbm.testing import Execution, Shrinker, Tester, Unjudged

EXAMPLES = Path(__file__).parents[3] / "examples"
SEQUENCES = sorted(path for path in EXAMPLES.glob("*/*.yaml") if load_model(path).runs.goals is GoalOrder.SEQUENCE)


def with_latch(model: BehaviorModel) -> BehaviorModel:
    """Return a model in which the first failed reply sets `jam`, and no operation starts while it is set."""
    written = YAML(typ="safe", pure=True).load(write_model(model))
    written["variables"]["jam"] = {"domain": "bool", "initial": False, "source": "state"}
    sets = {
        f"jam_{number}": {"g": f"{each.request_state} == failed && jam == false", "a": ["jam <- true"]}
        for number, each in enumerate(model.resources)
    }
    written["automatic_transitions"] = sets | written.get("automatic_transitions", {})
    for operation in written["operations"].values():
        guard = operation["pre"]["g"]
        guards = [guard] if isinstance(guard, str) else list(guard)
        operation["pre"]["g"] = [*guards, "jam == false"]
    return load(written)


def load(written: object) -> BehaviorModel:
    text = StringIO()
    YAML(typ="safe", pure=True).dump(written, text)
    return read_model(text.getvalue())


def run_with_failures(tester: Tester) -> Execution:
    """Return a run for three goals in which each second reply fails."""
    model = tester.model
    nominal = model.nominal_state
    goal, predicate = next((name, each) for name, each in model.goals if not each.holds(nominal))
    rules = tuple(
        OutcomeRule(each.name, number, number, Outcome.FAIL) for each in model.resources for number in (2, 4, 6)
    )
    later = tuple(CaseGoal(name, each) for name, each in model.goals[:2])
    return tester.execute(Case("latch", goal, predicate, State(model.space, dict(nominal)), rules, later=later))


@pytest.mark.longer
@pytest.mark.parametrize("path", SEQUENCES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_a_latch_is_found_with_the_smallest_history_and_its_variable(path: Path) -> None:
    tester = Tester(with_latch(load_model(path)))
    run = run_with_failures(tester)
    (failure,) = [each for each in run.verdict.failures if each.subject == "non_blocking"]
    small = Shrinker(tester).shrink(run, failure)
    (violation,) = [each for each in small.execution.violations if each.requirement == "non_blocking"]
    assert violation.values == (("jam", True),)
    assert (small.after.operations, small.after.choices) == (1, 1)
    assert not small.execution.case.later


@pytest.mark.parametrize("path", SEQUENCES, ids=lambda path: f"{path.parent.name}-{path.stem}")
def test_without_the_latch_the_same_history_blocks_nothing(path: Path) -> None:
    run = run_with_failures(Tester(load_model(path)))
    assert "non_blocking" not in [each.requirement for each in run.violations]
    assert run.unjudged is not Unjudged.TOO_LONG
