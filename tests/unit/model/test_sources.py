"""Who changes a variable, declared or inferred."""

from __future__ import annotations

import pytest

from scbm.files import read_model
from scbm.model import BehaviorModel
from scbm.model.sources import (
    changed_from_outside,
    free_groups,
    inputs,
    moved,
    outside_groups,
    outside_values,
    published_by,
    replied,
    still,
    unassigned,
    undeclared,
)

CELL = """
behavior_model: cell
variables:
  estop: {domain: [released, pressed], initial: released%s}
  curtain: {domain: [clear, broken], initial: clear}
  item: {domain: [none, box], initial: none}
  scanned: {domain: bool, initial: false}
  count: {domain: 0..3, initial: 0%s}
  note: {domain: [x, y], initial: x}
resources:
  scanner: {measures: [item]%s}
  safety: {measures: [curtain]}
operations:
  scan:
    pre: {g: scanned == false && curtain == clear, a: [scanner_req_trigger <- true]}
    post: {g: true, a: [scanned <- true, scanner_req_trigger <- false]}
automatic_transitions:
  stop: {g: estop == pressed && count < 3, a: [count += 1]}
goals:
  done: scanned == true && item == box
"""


def cell(estop: str = "", count: str = "", scanner: str = "") -> BehaviorModel:
    return read_model(CELL % (estop, count, scanner))


def test_what_is_read_and_changed_by_nothing_else_is_an_input() -> None:
    assert inputs(cell()) == ("estop", "count")
    assert "note" not in inputs(cell())  # nothing reads it


@pytest.mark.parametrize(("source", "expected"), [("state", ()), ("constant", ()), ("input", ("estop",))])
def test_a_declared_source_decides(source: str, expected: tuple[str, ...]) -> None:
    assert inputs(cell(estop=f", source: {source}", count=", source: state")) == expected


def test_what_only_the_model_changes_and_nothing_assigns_is_unassigned() -> None:
    model = cell(estop=", source: state", count=", source: state")
    assert unassigned(model) == ("estop",)
    assert unassigned(cell(estop=", source: constant")) == ()


def test_what_only_automatic_transitions_assign_is_an_input_until_it_is_declared() -> None:
    assert undeclared(cell()) == ("count",)
    assert undeclared(cell(count=", source: state")) == ()
    declared = cell(count=", source: input")
    assert (undeclared(declared), inputs(declared)) == ((), ("estop", "count"))


def test_a_resource_that_gets_no_requests_publishes_what_it_measures() -> None:
    model = cell()
    scanner, safety = model.resources
    assert (replied(model), published_by(scanner, model), published_by(safety, model)) == (("item",), (), ("curtain",))
    publishing = cell(scanner=", publishes: [item]")
    assert published_by(publishing.resources[0], publishing) == ("item",)


def test_the_values_of_one_message_change_together() -> None:
    text = CELL.replace("measures: [curtain]", "publishes: [curtain, note]") % ("", "", "")
    assert [group.names for group in free_groups(read_model(text))] == [("estop",), ("count",), ("curtain", "note")]
    assert changed_from_outside(read_model(text)) == ("estop", "count", "curtain", "note")


MOVED = """environment:
  press: {guard: estop == released, actions: [estop <- pressed]}
  reset: {guard: count > 0, actions: [count -= 1]}
"""


def test_what_environment_transitions_assign_does_not_change_freely() -> None:
    model = read_model(CELL % ("", "", "") + MOVED)
    assert moved(model) == ("estop", "count")
    assert inputs(model) == ("estop", "count")
    assert undeclared(model) == ()
    assert [group.names for group in free_groups(model)] == [("curtain",)]
    assert changed_from_outside(model) == ("curtain", "estop", "count")


def test_what_only_the_environment_reads_matters() -> None:
    text = CELL % ("", "", "") + "environment:\n  press: {guard: note == x, actions: [estop <- pressed]}\n"
    assert "note" in inputs(read_model(text))
    assert "note" not in still(read_model(text))


def test_a_variable_of_an_operation_changes_from_outside_if_the_environment_assigns_it() -> None:
    text = CELL % ("", "", "") + "environment:\n  again: {guard: scanned == true, actions: [scanned <- false]}\n"
    model = read_model(text)
    assert "scanned" not in inputs(model)
    assert "scanned" in changed_from_outside(model)


def test_values_that_resources_never_send_do_not_come_from_outside() -> None:
    text = CELL.replace("measures: [curtain]", "measures: {curtain: [broken]}, publishes: [note]") % ("", "", "")
    model = read_model(text)
    assert free_groups(model)[-1].values == (("note", ("x", "y")), ("curtain", ("broken",)))
    assert list(free_groups(model)[-1].changes(("curtain", "note"))) == [
        (("curtain", "broken"),),
        (("note", "x"),),
        (("note", "x"), ("curtain", "broken")),
        (("note", "y"),),
        (("note", "y"), ("curtain", "broken")),
    ]
    assert outside_values(model)["curtain"] == ("broken",)
    assert model.resources[1].sends(model.space["curtain"]) == ("broken",)
    assert model.resources[1].sends(model.space["note"]) == ("x", "y")


def test_transitions_and_shared_resources_change_something_from_outside() -> None:
    text = CELL.replace("measures: [item]%s}", "measures: [item], shared: true}") % ("", "") + MOVED
    model = read_model(text)
    scanner, _ = model.resources
    assert outside_groups(model) == (*free_groups(model), *model.environment, scanner)
    assert scanner.request_state not in changed_from_outside(model)
