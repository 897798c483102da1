"""Values that simulated replies measure: those listed, as they are weighted, for successful and for failed replies."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random

from scbm.files import load_model, read_model, write_model
from scbm.model import BehaviorModel, Resource
from scbm.running.simulation import DrawnReactions, PlainReactions
from scbm.testing import RandomCases, Tester

MODELS = Path(__file__).parents[3] / "models" / "valid"
COUNTING = load_model(MODELS / "counting_camera.yaml")


def _ends(model: BehaviorModel, cases: int = 20) -> Counter[str]:
    executions = map(Tester(model).execute, RandomCases(model).first(cases, 1))
    return Counter(execution.verdict.end.value for execution in executions)


def _camera(keys: str) -> Resource:
    """Return the camera of the counting cell with other keys, as it is after writing and reading, too."""
    text = (MODELS / "counting_camera.yaml").read_text(encoding="utf-8")
    written = "{measures: {n: [3, 0, 1, 2]}, simulation: {latency: 1 s}}"
    assert written in text
    model = read_model(text.replace(written, keys))
    assert read_model(write_model(model)) == model
    return model.resources[0]


def test_a_list_with_all_values_of_the_domain_is_what_replies_draw_from() -> None:
    assert _ends(COUNTING) == {"reached": 20}
    drawn = DrawnReactions(Random("draws"))
    measured = {drawn.react(COUNTING.resources[0]).measured for _ in range(100)}
    assert measured == {(("n", 0),), (("n", 1),), (("n", 2),), (("n", 3),)}


def test_a_plain_reply_measures_the_first_value_as_listed() -> None:
    assert PlainReactions().react(COUNTING.resources[0]).measured == (("n", 3),)


def test_variables_without_a_list_are_not_drawn() -> None:
    for keys in ("{measures: [n]}", "{measures: {n: any}}"):
        assert PlainReactions().react(_camera(keys)).measured is None


def test_what_a_resource_publishes_does_not_say_what_its_replies_draw_from() -> None:
    camera = _camera("{measures: {n: any}, publishes: {n: [0, 1, 2, 3]}}")
    assert PlainReactions().react(camera).measured is None
    camera = _camera("{measures: {n: [1, 2]}, publishes: {n: [2, 1]}}")
    assert PlainReactions().react(camera).measured == (("n", 1),)
