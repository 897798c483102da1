"""Runs of every sort, for formats of traces."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from scbm.files import load_model, read_case, read_network
from scbm.model import BehaviorModel
from scbm.testing import Execution, RandomCases, Tester

ROOT = Path(__file__).parents[2]
BEFORE = load_model(ROOT / "examples/robot_in_the_air/before.yaml")
AFTER = load_model(ROOT / "examples/robot_in_the_air/after.yaml")
FAULTS = "loss: 20 %, duplication: 20 %, latency: 10 ms"
AGAINST = (ROOT / "examples/robot_in_the_air/cases/delivery_against_all_odds.yaml").read_text(encoding="utf-8")

LONG = ("odds", "livelock")
"""The runs with the most records."""


def runs(waiting: BehaviorModel, injected: str) -> Iterator[tuple[str, BehaviorModel, Execution]]:
    """Drawn runs on a bad network, all faults of resources, injections, and the models that are wrong.

    Args:
        waiting: a model with a lamp that is off at the beginning.
        injected: a case of it, with injections.
    """
    faulty = RandomCases(BEFORE, None, read_network(FAULTS, BEFORE))
    for number in (1, 6):
        yield f"faults-{number}", BEFORE, Tester(BEFORE).execute(faulty.case(1, number))
    yield "odds", AFTER, Tester(AFTER).execute(read_case(AGAINST, AFTER))
    yield "injected", waiting, Tester(waiting).execute(read_case(injected, waiting))
    nothing = "case: nothing_to_do\ngoal: lamp == off\n"
    yield "nothing-to-do", waiting, Tester(waiting).execute(read_case(nothing, waiting))
    for path in sorted((ROOT / "tests/models/fails_at_run").glob("*.yaml")):
        model = load_model(path)
        yield path.stem, model, Tester(model).execute(RandomCases(model).case(1, 1))
