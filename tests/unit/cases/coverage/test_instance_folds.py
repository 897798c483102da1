"""Lists of names in which instances stand under the name of their entry."""

from __future__ import annotations

from scbm.cases.coverage import Aspect, InstanceFolds, Obligation
from scbm.closing.summaries import in_few_words
from scbm.files import read_model

MODEL = read_model(
    """behavior_model: doors
types: {door: [d1, d2, d3, d4, d5]}
variables:
  open[door]: {domain: bool, initial: false}
operations:
  open_it[d in door]: {pre: {g: open.d == false}, post: {g: true, a: [open.d <- true]}}
  rest: {pre: {g: true}, post: {g: true}}
automatic_transitions:
  open_it[d in door]: {g: open.d == true, a: [open.d <- false]}
"""
)
FOLDS = InstanceFolds.of(MODEL)
DOORS = [f"open_it.d{number}" for number in range(1, 6)]


def test_all_instances_are_one_name_with_their_number() -> None:
    assert FOLDS.folded([*DOORS[:2], "rest", *DOORS[2:]]) == ("open_it (5)", "rest")


def test_many_instances_are_counted_and_few_are_named() -> None:
    assert FOLDS.folded(DOORS[:4]) == ("open_it (4 of 5)",)
    assert FOLDS.folded(DOORS[1:4]) == tuple(DOORS[1:4])


def test_names_of_models_without_parameters_stay() -> None:
    assert InstanceFolds({}, {}).folded(["open_it.d1", "rest"]) == ("open_it.d1", "rest")


def test_groups_of_obligations_are_folded_by_kind() -> None:
    about = [Obligation(name, aspect) for name in DOORS for aspect in (Aspect.FAILED, Aspect.TIMEDOUT, Aspect.TAKEN)]
    assert in_few_words(about, FOLDS) == ("open_it (5): failed, timedout", "automatic/open_it (5)")
    assert in_few_words(about[:3]) == ("open_it.d1: failed, timedout", "automatic/open_it.d1")
