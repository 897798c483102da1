"""What proofs assume, in sentences (semantics 9.3)."""

from __future__ import annotations

import pytest

from scbm.cases.coverage import Decision
from scbm.cases.coverage.assumptions import assumptions
from scbm.files import read_model
from scbm.model import GoalOrder, RunPlans
from scbm.planning import model_with_plans
from support.wording import Wording

CELL = """
behavior_model: cell
variables:
  stop: {domain: [released, pressed], initial: released, source: input}
  door: {domain: [closed, open], initial: closed, source: input}
  visitors: {domain: 0..2, initial: 0}
  item: {domain: [none, box, tube], initial: none}
  weight: {domain: 0..9, initial: 0}
  limit: {domain: 0..9, initial: 5, source: constant}
resources:
  scanner: {publishes: {item: [none, box], visitors: [0, 1]}, shared: true}
  scale: {measures: [weight]}
operations:
  scan:
    pre: {g: stop == released && visitors == 0, a: [scale_req_trigger <- true]}
    post: {g: item == box && weight == limit}
goals: {done: item == box && door == open}
environment:
  press: {guard: visitors == 2, actions: [stop <- pressed]}
  enter: {guard: true, actions: [visitors += 1]}
"""
BARE = """
behavior_model: bare
variables: {lit: {domain: bool, initial: false}}
operations: {light: {pre: {g: lit == false}, post: {g: true, a: [lit <- true]}}}
goals: {lit: lit == true}
"""
EXCLUDED, UNCOVERABLE = Decision.EXCLUDED, Decision.UNCOVERABLE
SEQUENCE = "Goals of the model follow each other in any order, from an allowed initial state on."
ANY = "A plan is any sequence of operations that leads to the goal by the planner's rules."
CLOSED = "Only the model and replies to its requests change variables."


def test_changes_from_outside_are_named_with_their_sources(wording: Wording) -> None:
    first, second, *outside = assumptions(read_model(CELL), [UNCOVERABLE])
    assert (first, second) == (SEQUENCE, ANY)
    named = ["door", "stop, visitors", "item", "scanner", "none, box", "0, 1", "limit"]
    assert [sentence.rpartition(": ")[2] for sentence in outside] == [f"{each}." for each in named]
    wording(outside)


def test_a_model_without_anything_outside_is_closed() -> None:
    assert assumptions(read_model(BARE), [UNCOVERABLE]) == (SEQUENCE, ANY, CLOSED)


@pytest.mark.parametrize("decisions", [[], [Decision.COVERED, Decision.WAIVED, Decision.UNDECIDED]])
def test_without_proofs_nothing_is_assumed(decisions: list[Decision]) -> None:
    assert assumptions(read_model(BARE), decisions) == ()


@pytest.mark.parametrize(
    ("decisions", "plans", "sentence"),
    [
        ([UNCOVERABLE], RunPlans.CANONICAL, ANY),
        ([EXCLUDED], RunPlans.DRAWN, ANY),
        ([EXCLUDED], RunPlans.CANONICAL, "Plans are those of the planner canonical."),
        (
            [EXCLUDED, UNCOVERABLE],
            RunPlans.CANONICAL,
            "Exclusions by the planner assume plans of the planner canonical; all other proofs hold for any plans.",
        ),
    ],
)
def test_the_plans_are_those_of_the_proofs_that_there_are(
    decisions: list[Decision], plans: RunPlans, sentence: str
) -> None:
    assert assumptions(model_with_plans(plans, read_model(BARE)), decisions) == (SEQUENCE, sentence, CLOSED)


def test_goals_are_those_asked_for_or_else_those_of_the_model() -> None:
    single = "Each run starts in an allowed initial state, and pursues one goal of the model."
    declared = read_model(BARE + "runs: {goals: single}\n")
    assert assumptions(declared, [UNCOVERABLE])[0] == single
    assert assumptions(declared, [UNCOVERABLE], GoalOrder.SEQUENCE)[0] == SEQUENCE
    assert assumptions(read_model(BARE), [UNCOVERABLE], GoalOrder.SINGLE)[0] == single
