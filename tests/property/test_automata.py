"""Each change of a run is an edge of the automaton of its variable, named by what made the change."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from random import Random

import pytest

from scbm.cases import Case
from scbm.drawing.automata import ModelAutomata
from scbm.files import load_model
from scbm.model import BehaviorModel, InitialStates
from scbm.testing import RandomCases, Tester, load_suite
from support.disturbed_cases import disturbed
from support.drawn_changes import changes_of, changes_without_edge
from support.opened_models import varied
from support.profiles import share, slow_beyond
from support.random_models import random_model

ROOT = Path(__file__).parents[2]
MODELS = [*ROOT.glob("tests/models/valid/*.yaml"), *ROOT.glob("study/models/*.yaml"), *ROOT.glob("examples/*/*.yaml")]
CASES_EACH = 20
NUMBERS = slow_beyond(25, range(share(500, usual=25)))


def random_cases(model: BehaviorModel, count: int, seed: int) -> Iterator[Case]:
    """Random cases of a model: over networks with faults, with moving inputs and without, some of them disturbed."""
    random = Random(f"automata {seed}")
    for moves_inputs in (False, True):
        for case in RandomCases(model, network=None, moves_inputs=moves_inputs).first(count // 2, seed):
            is_disturbed = random.random() < 0.3 and len(model.variables) > 2
            yield disturbed(case, model, random) if is_disturbed else case


@cache
def drawn(number: int) -> ModelAutomata:
    return ModelAutomata.of(random_model(number) if number % 4 == 0 else varied(number))


@pytest.mark.parametrize("path", sorted(MODELS), ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_changes_in_runs_of_the_corpus_are_edges(path: Path) -> None:
    model = load_model(path)
    automata, tester = ModelAutomata.of(model), Tester(model)
    cases = (
        list(random_cases(model, share(20, least=4), 1))
        if model.goals and any(InitialStates(model).allowed(100))
        else []
    )
    assert [each for case in cases for each in changes_without_edge(automata, tester.execute(case))] == []


def test_changes_in_the_cases_of_the_paper_are_edges() -> None:
    model = load_model(ROOT / "examples/robot_in_the_air/after.yaml")
    automata, tester = ModelAutomata.of(model), Tester(model)
    cases = [each.case for each in load_suite([ROOT / "examples/robot_in_the_air/cases"], model)]
    found = [change for case in cases for change in changes_of(automata, tester.execute(case))]
    assert len(found) > len(cases)
    assert all(is_edge for _, is_edge in found)


@pytest.mark.parametrize("number", NUMBERS)
def test_changes_in_random_runs_are_edges(number: int) -> None:
    automata = drawn(number)
    tester = Tester(automata.model)
    cases = random_cases(automata.model, CASES_EACH, number)
    assert [each for case in cases for each in changes_without_edge(automata, tester.execute(case))] == []
