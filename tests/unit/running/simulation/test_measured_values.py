"""Values that simulated replies measure: those listed, as they are weighted, for successful and for failed replies."""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from random import Random

import pytest

from scbm.cases import Case, Condition, ConditionKind, Injection, OutcomeRule
from scbm.cases.trace import ReplyReceived
from scbm.closing import Closer, Decision
from scbm.files import load_model, read_model, write_model
from scbm.model import BehaviorModel, Outcome, Resource, Value
from scbm.running.simulation import Choices, DrawnReactions, PlainReactions
from scbm.testing import RandomCases, Tester

MODELS = Path(__file__).parents[3] / "models" / "valid"
COUNTING = load_model(MODELS / "counting_camera.yaml")
WEIGHTED = load_model(MODELS / "weighted_measurements.yaml")
WEIGHTED_CAMERA, GRIPPER = WEIGHTED.resources


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


# weights


def _shares(resource: Resource, name: str, outcome: Outcome = Outcome.SUCCEED) -> dict[Value | None, float]:
    """Return how often the drawn replies of one outcome carry each value of a variable; `None` if they carry none."""
    drawn = DrawnReactions(Random("draws"))
    reactions = [each for _ in range(4_000) if (each := drawn.react(resource)).outcome is outcome]
    counts = Counter(dict(each.measured or ()).get(name) for each in reactions)
    return {value: count / len(reactions) for value, count in counts.items()}


@pytest.mark.parametrize(
    ("name", "shares"),
    [
        ("seen", {"part": 0.8, "no_part": 0.2}),
        ("count", {3: 3 / 3.1, 1: 0.1 / 3.1}),
        ("sharp", {True: 0.9, False: 0.1}),
    ],
)
def test_values_come_as_often_as_their_weights_say(name: str, shares: dict[Value, float]) -> None:
    assert _shares(WEIGHTED_CAMERA, name) == pytest.approx(shares, abs=0.03)


def test_a_plain_reply_measures_the_first_value_that_can_be_drawn() -> None:
    measured = PlainReactions().react(WEIGHTED_CAMERA).measured
    assert measured == (("seen", "part"), ("count", 3), ("sharp", True))


def test_without_weights_each_value_takes_one_random_number_as_before() -> None:
    camera = _camera("{measures: {n: [3, 0, 1, 2]}, simulation: {latency: 1 s}}")
    drawn, random = DrawnReactions(Random("draws")), Random("draws")
    for _ in range(100):
        random.random()  # the outcome
        assert drawn.react(camera).measured == (("n", (3, 0, 1, 2)[int(random.random() * 4)]),)


# failed replies


def test_failed_replies_measure_their_own_values_and_successful_ones_do_not() -> None:
    assert _shares(GRIPPER, "cause", Outcome.FAIL) == pytest.approx({"jam": 0.7, "empty": 0.3}, abs=0.03)
    assert _shares(GRIPPER, "cause") == {None: 1}
    assert _shares(GRIPPER, "sharp", Outcome.FAIL) == {None: 1}
    assert _shares(GRIPPER, "sharp") == {True: 1}


def test_a_rule_that_makes_a_plain_request_fail_measures_the_first_value() -> None:
    rules = (
        OutcomeRule("gripper", 1, 1, Outcome.FAIL),
        OutcomeRule("gripper", 2, 2, Outcome.FAIL, measured=(("cause", "empty"),)),
        OutcomeRule("gripper", 3, 3, Outcome.FAIL, measured=()),
    )
    choices = Choices(PlainReactions(), rules)
    measured = [choices.react(GRIPPER, None).measured for _ in range(4)]
    assert measured == [(("cause", "jam"),), (("cause", "empty"),), (), (("sharp", True),)]


def test_a_resource_in_the_condition_failing_measures_as_a_plain_failed_reply() -> None:
    worn = Injection("worn", resource="gripper", condition=Condition(ConditionKind.FAILING), hold_ns=1_500_000_000)
    case = Case("worn", *WEIGHTED.goals[0], WEIGHTED.nominal_state, injections=(worn,))
    records = Tester(WEIGHTED).execute(case).trace.records
    replies = [each for each in records if isinstance(each, ReplyReceived) and each.resource == "gripper"]
    changes = [dict(reply.changes).get("cause") for reply in replies]
    assert changes[0] == "jam"


def test_closing_says_where_a_failed_reply_measures_nothing() -> None:
    text = (MODELS / "weighted_measurements.yaml").read_text(encoding="utf-8")
    unexplained = "g: gripper_req_state == failed && cause == none && current.state == executing"
    ends = "[current.state <- failed, gripper_req_state <- initial, gripper_req_trigger <- false]"
    model = read_model(f"{text}automatic_transitions:\n  unexplained: {{{unexplained}, a: {ends}}}\n")
    closing = Closer(model).close()
    assert {each.obligation.subject: each.decision for each in closing.decided}["unexplained"] is Decision.COVERED
    rules = [rule for case in closing.cases for rule in case.case.outcomes]
    assert () in [rule.measured for rule in rules if rule.outcome is Outcome.FAIL]
