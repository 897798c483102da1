"""The plans that a run of a mutant gets where the case has recorded plans of the model."""

from __future__ import annotations

import pytest
from msgspec.structs import replace

from scbm.cases import Case, RecordedPlan
from scbm.cases.trace import AutomaticTaken, PlanReceived, state_after
from scbm.files import read_model
from scbm.running.simulation import Choices, PlainReactions, Simulator

MODEL = """
behavior_model: ways
variables:
  at: {domain: [a, b, c], initial: a}
  safe: {domain: bool, initial: true, source: state}
operations:
  direct: {pre: {g: at == a}, post: {g: true, a: [at <- c]}}
  other: {pre: {g: at == a && safe == true}, post: {g: true, a: [at <- c]}}
  half: {pre: {g: at == a}, post: {g: true, a: [at <- b]}}
  rest: {pre: {g: at == b}, post: {g: true, a: [at <- c]}}
goals:
  there: at == c
"""
MUTANT = MODEL.replace("[at <- b]", "[at <- b, safe <- false]")


def plans_of_mutant(mutant: str, *recorded: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Return the plans that the run of a case with recorded plans gets from the simulator of a mutant."""
    model = read_model(MODEL)
    case = Case(
        "case", *model.goals[0], model.nominal_state, plans=tuple(RecordedPlan("solved", plan) for plan in recorded)
    )
    simulator = Simulator(model).of_mutant(read_model(mutant), plans_alike=False)
    run = simulator.run(case, Choices(PlainReactions()))
    return [record.plan for record in run.records if isinstance(record, PlanReceived)]


@pytest.mark.parametrize(
    ("recorded", "plan"),
    [
        (("other",), ("other",)),
        (("half", "rest"), ("direct",)),
        (("rest",), ("direct",)),
    ],
    ids=["as-short", "longer", "no-plan"],
)
def test_a_recorded_plan_that_is_as_short_as_any_is_kept(recorded: tuple[str, ...], plan: tuple[str, ...]) -> None:
    assert plans_of_mutant(MUTANT, recorded) == [plan]


def test_a_recorded_plan_that_is_no_plan_of_the_mutant_is_replaced() -> None:
    assert plans_of_mutant(MODEL.replace("safe == true", "safe == false"), ("other",)) == [("direct",)]


def test_a_run_of_a_mutant_asks_the_planner_for_plans_that_the_case_does_not_have() -> None:
    undone = "automatic_transitions:\n  undo: {g: at == c && safe == true, a: [at <- a, safe <- false]}\ngoals:"
    assert plans_of_mutant(MODEL.replace("goals:", undone), ("other",)) == [("other",), ("direct",)]


def test_a_variable_of_a_mutant_may_have_more_values() -> None:
    more = MODEL.replace("[a, b, c]", "[a, b, c, d]").replace("[at <- b]", "[at <- d]")
    assert plans_of_mutant(more, ("other",)) == [("other",)]


def test_a_run_of_a_mutant_takes_the_operations_of_the_mutant() -> None:
    """The mutant shares the variables and all other operations with the model."""
    model = read_model(MODEL)
    other = "other: {pre: {g: at == a && safe == true}, post: {g: true, a: [at <- c"
    assert other in MODEL
    changed = read_model(MODEL.replace(other, f"{other}, safe <- false"))
    operations = (model.operations[0], changed.operations[1], *model.operations[2:])
    mutant = replace(model, operations=operations)
    simulator = Simulator(model).of_mutant(mutant, plans_alike=True)
    case = Case("case", *model.goals[0], model.nominal_state, plans=(RecordedPlan("solved", ("other",)),))
    run = simulator.run(case, Choices(PlainReactions()))
    assert state_after(run.records)["safe"] is False


def test_a_run_of_a_mutant_takes_its_automatic_transitions_and_not_those_of_the_model() -> None:
    text = MODEL.replace(
        "goals:", "automatic_transitions:\n  undo: {g: at == c && safe == true, a: [at <- a, safe <- false]}\ngoals:"
    )
    model = read_model(text.replace("at == c && safe", "at == b && safe"))
    mutant = replace(model, automatic_transitions=read_model(text).automatic_transitions)
    case = Case("case", *model.goals[0], model.nominal_state)
    for simulated, taken in ((Simulator(model), []), (Simulator(model).of_mutant(mutant, plans_alike=False), ["undo"])):
        records = simulated.run(case, Choices(PlainReactions())).records
        assert [record.transition for record in records if isinstance(record, AutomaticTaken)] == taken
