"""Mutation operators: what each changes in a small model, which mutants are left out, and their names and places."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.files import digest_of, load_model, read_located, read_model
from scbm.model import BehaviorModel
from scbm.mutation import MUTATIONS, Mutant, MutatedPart, mutants_of

AFTER = Path(__file__).parents[3] / "examples" / "robot_in_the_air" / "after.yaml"
CELL = """
behavior_model: cell
variables:
  door: {domain: [open, closed, ajar], initial: closed, random: [open, closed], source: input}
  hatch: {domain: [open, closed, ajar], initial: open, source: state}
  tries: {domain: 0..3, initial: 0}
  done: {domain: bool, initial: false}
  command: {domain: [none, scan], initial: none}
resources:
  scanner: {request: [command]}
  lamp: {request: []}
operations:
  scan:
    deadline: 10 s
    disabled_deadline: 50 ns
    pre: {g: 'done == false && (door == open || hatch != open)', gr: tries < 3, a: [scanner_req_trigger <- true]}
    post: {g: true, gr: scanner_req_state == succeeded, a: [done <- true], ar: [scanner_req_trigger <- false]}
    failed: {g: scanner_req_state == failed, a: [scanner_req_trigger <- false, tries += 1]}
    timedout: [scanner_req_trigger <- false]
  reset:
    pre: {g: done == true}
    post: {g: true, a: [done <- false]}
automatic_transitions:
  give_up: {g: tries == 3, a: [tries <- 0], ar: [plan.state <- aborted]}
  close: {g: 'door == open && scan.state == initial', a: [hatch <- closed]}
environment:
  opens: {guard: 'door == closed && hatch == open', actions: [door <- open], every: 10 s}
goals: {done: done == true}
"""
"""A model with a part of each kind."""


def of(operator: str, text: str = CELL) -> list[tuple[str, str, str]]:
    """The mutants of one operator: the end of the name behind the entry, and the lines before and after."""
    return [(mutant.name, mutant.before, mutant.after) for mutant in mutants_of(read_model(text), [operator])]


def names_of(operator: str, text: str = CELL) -> list[str]:
    return [name for name, _, _ in of(operator, text)]


def test_a_conjunct_is_left_out() -> None:
    assert of("guard-drop")[:2] == [
        (
            "scan/pre.g/drop:done == false",
            "pre.g: done == false && (door == open || hatch != open)",
            "pre.g: door == open || hatch != open",
        ),
        (
            "scan/pre.g/drop:door == open || hatch != open",
            "pre.g: done == false && (door == open || hatch != open)",
            "pre.g: done == false",
        ),
    ]
    assert names_of("guard-drop")[2:] == [
        "scan/pre.gr/drop:tries < 3",
        "scan/post.gr/drop:scanner_req_state == succeeded",
        "scan/failed.g/drop:scanner_req_state == failed",
        "reset/pre.g/drop:done == true",
        "automatic/give_up/g/drop:tries == 3",
        "automatic/close/g/drop:door == open",
        "automatic/close/g/drop:scan.state == initial",
    ]


def test_a_conjunct_is_negated() -> None:
    assert [after for _, _, after in of("guard-negate")] == [
        "pre.g: done != false && (door == open || hatch != open)",
        "pre.g: done == false && !(door == open || hatch != open)",
        "pre.gr: tries >= 3",
        "post.gr: scanner_req_state != succeeded",
        "failed.g: scanner_req_state != failed",
        "pre.g: done != true",
        "g: tries != 3",
        "g: door != open && scan.state == initial",
        "g: door == open && scan.state != initial",
    ]


def test_a_guard_compares_with_the_next_value_unless_that_is_its_negation() -> None:
    assert [after for _, _, after in of("guard-value")] == [
        "pre.g: done == false && (door == closed || hatch != open)",
        "pre.g: done == false && (door == open || hatch != closed)",
        "post.gr: scanner_req_state == failed",
        "failed.g: scanner_req_state == initial",
        "g: tries == 0",
        "g: door == closed && scan.state == initial",
        "g: door == open && scan.state == disabled",
    ]


def test_a_guard_compares_the_next_variable_with_the_same_domain_and_role() -> None:
    assert names_of("guard-variable") == [
        "scan/post.gr/variable:lamp_req_state == succeeded",
        "scan/failed.g/variable:lamp_req_state == failed",
        "automatic/close/g/variable:hatch == open",
        "automatic/close/g/variable:reset.state == initial",
    ]


def test_a_threshold_is_one_less_and_one_more_within_the_domain() -> None:
    assert names_of("guard-threshold") == [
        "scan/pre.gr/threshold:tries < 2",
        "automatic/give_up/g/threshold:tries == 2",
    ]


def test_a_conjunct_moves_where_the_planner_reads_it() -> None:
    assert of("guard-move") == [
        (
            "scan/pre.g/move:done == false",
            "pre.g: done == false && (door == open || hatch != open); pre.gr: tries < 3",
            "pre.g: door == open || hatch != open; pre.gr: tries < 3 && done == false",
        ),
        (
            "scan/pre.g/move:door == open || hatch != open",
            "pre.g: done == false && (door == open || hatch != open); pre.gr: tries < 3",
            "pre.g: done == false; pre.gr: tries < 3 && (door == open || hatch != open)",
        ),
        (
            "scan/pre.gr/move:tries < 3",
            "pre.gr: tries < 3; pre.g: done == false && (door == open || hatch != open)",
            "pre.gr: true; pre.g: done == false && (door == open || hatch != open) && tries < 3",
        ),
        (
            "scan/post.gr/move:scanner_req_state == succeeded",
            "post.gr: scanner_req_state == succeeded; post.g: true",
            "post.gr: true; post.g: scanner_req_state == succeeded",
        ),
        (
            "reset/pre.g/move:done == true",
            "pre.g: done == true; pre.gr: true",
            "pre.g: true; pre.gr: done == true",
        ),
    ]


def test_actions_are_left_out_changed_and_moved() -> None:
    assert names_of("action-drop") == [
        "scan/pre.a/drop:scanner_req_trigger <- true",
        "scan/post.a/drop:done <- true",
        "scan/post.ar/drop:scanner_req_trigger <- false",
        "reset/post.a/drop:done <- false",
    ]
    assert names_of("action-value") == [
        "scan/pre.a/value:scanner_req_trigger <- false",
        "scan/post.a/value:done <- false",
        "scan/post.ar/value:scanner_req_trigger <- true",
        "reset/post.a/value:done <- true",
        "scan/failed.a/value:scanner_req_trigger <- true",
        "scan/failed.a/value:tries -= 1",
        "scan/timedout/value:scanner_req_trigger <- true",
        "automatic/give_up/a/value:tries <- 1",
        "automatic/close/a/value:hatch <- ajar",
    ]
    assert names_of("action-move") == [
        "scan/pre.a/move:scanner_req_trigger <- true",
        "scan/post.a/move:done <- true",
        "scan/post.ar/move:scanner_req_trigger <- false",
        "reset/post.a/move:done <- false",
    ]


def test_clean_up_is_left_out_and_no_automatic_transition_loses_its_only_action() -> None:
    assert of("clean-up-drop") == [
        (
            "scan/failed.a/drop:scanner_req_trigger <- false",
            "failed.a: [scanner_req_trigger <- false, tries += 1]",
            "failed.a: [tries += 1]",
        ),
        (
            "scan/failed.a/drop:tries += 1",
            "failed.a: [scanner_req_trigger <- false, tries += 1]",
            "failed.a: [scanner_req_trigger <- false]",
        ),
        ("scan/timedout/drop:scanner_req_trigger <- false", "timedout: [scanner_req_trigger <- false]", "timedout: []"),
        ("automatic/give_up/a/drop:tries <- 0", "a: [tries <- 0]", "a: []"),
        ("automatic/give_up/ar/drop:plan.state <- aborted", "ar: [plan.state <- aborted]", "ar: []"),
    ]


def test_deadlines_go_or_change_by_a_factor_of_ten() -> None:
    assert of("deadline-none") == [
        ("scan/deadline/none", "deadline: 10 s", ""),
        ("scan/disabled_deadline/none", "disabled_deadline: 50 ns", ""),
    ]
    assert names_of("deadline-shorter") == ["scan/deadline/1 s", "scan/disabled_deadline/5 ns"]
    assert names_of("deadline-longer") == ["scan/deadline/100 s", "scan/disabled_deadline/500 ns"]


def test_the_timedout_actions_go_with_the_deadline() -> None:
    (mutant, _) = mutants_of(read_model(CELL), ["deadline-none"])
    assert mutant.parts == (MutatedPart.DEADLINE, MutatedPart.TIMEDOUT)
    assert mutant.model.operation("scan").timedout == ()


def test_transitions_and_operations_are_left_out_or_change_places() -> None:
    assert names_of("transition-drop") == ["scan/failed/drop", "automatic/give_up/drop", "automatic/close/drop"]
    assert of("transition-swap") == [
        (
            "automatic/give_up/swap:close",
            "automatic_transitions: give_up, close",
            "automatic_transitions: close, give_up",
        )
    ]
    assert of("operation-swap") == [("scan/swap:reset", "operations: scan, reset", "operations: reset, scan")]


@pytest.mark.parametrize(
    ("guard", "expected"),
    [
        ("door == open", ["scan/drop", "reset/drop"]),
        ("reset.state == initial", ["scan/drop"]),
        ("current.name == scan", ["reset/drop"]),
        ("current.name in {none, scan}", ["reset/drop"]),
    ],
)
def test_an_operation_that_something_else_names_stays(guard: str, expected: list[str]) -> None:
    text = CELL.replace("'door == open && scan.state == initial'", f"'{guard}'")
    assert names_of("operation-drop", text) == expected


def test_an_operation_may_name_itself() -> None:
    text = CELL.replace(" && scan.state == initial", "").replace("gr: tries < 3", "gr: current.name == scan")
    assert names_of("operation-drop", text) == ["scan/drop", "reset/drop"]


def test_requirements_name_operations_too() -> None:
    text = CELL.replace(" && scan.state == initial", "") + "requirements: {r: never reset.state == failed}"
    assert names_of("operation-drop", text) == ["scan/drop"]


def test_requests_carry_less_or_something_else() -> None:
    assert of("request-drop") == [
        ("resource/scanner/request/drop:command", "request: [command]", "request: []"),
    ]
    assert names_of("request-other") == ["resource/scanner/request/command->door"]
    assert names_of("trigger-other") == [
        "scan/pre.a/trigger:lamp_req_trigger <- true",
        "scan/post.ar/trigger:lamp_req_trigger <- false",
        "scan/failed.a/trigger:lamp_req_trigger <- false",
        "scan/timedout/trigger:lamp_req_trigger <- false",
    ]


def test_initial_values_change_and_drawn_ones_stay() -> None:
    mutants = {mutant.name: mutant for mutant in mutants_of(read_model(CELL), ["initial-value"])}
    assert list(mutants) == [
        "variable/door/initial/ajar",
        "variable/hatch/initial/closed",
        "variable/tries/initial/1",
        "variable/done/initial/true",
        "variable/command/initial/scan",
    ]
    assert mutants["variable/door/initial/ajar"].model.space["door"].random == ("open", "closed")
    assert mutants["variable/hatch/initial/closed"].model.space["hatch"].random == ("closed",)


def test_environment_transitions_change() -> None:
    assert names_of("environment-drop") == ["environment/opens/drop"]
    assert names_of("environment-guard") == [
        "environment/opens/guard/drop:door == closed",
        "environment/opens/guard/negate:door == closed",
        "environment/opens/guard/drop:hatch == open",
        "environment/opens/guard/negate:hatch == open",
    ]
    assert names_of("environment-action") == ["environment/opens/actions/value:door <- closed"]


def test_a_change_without_a_meaning_is_no_mutant() -> None:
    text = CELL.replace("gr: tries < 3", "gr: 'door in {open, closed, ajar}'")
    assert not [name for name in names_of("guard-drop", text) if "pre.gr" in name]


def test_a_mutant_that_means_the_same_as_an_earlier_one_is_left_out() -> None:
    negated = names_of("guard-negate")
    assert "reset/pre.g/negate:done == true" in negated
    assert "reset/pre.g/value:done == false" not in names_of("guard-value")


@pytest.mark.slow
def test_which_mutants_an_operator_makes_does_not_depend_on_the_selection() -> None:
    every = list(mutants_of(read_model(CELL)))
    for operator in MUTATIONS:
        assert names_of(operator) == [mutant.name for mutant in every if mutant.operator == operator]


def test_equal_names_get_numbers() -> None:
    text = CELL.replace("g: done == true}", "g: 'done == true && (hatch == open || door == open && hatch == open)'}")
    names = names_of("guard-variable", text)
    assert [name for name in names if "reset" in name and "door == open" in name] == [
        "reset/pre.g/variable:door == open",
        "reset/pre.g/variable:door == open#2",
    ]


def test_a_waiver_for_what_is_left_out_goes_with_it() -> None:
    waiver = "{obligation: reset/failed, reason: never, author: me, date: 2026-01-01}"
    mutants = {mutant.name: mutant for mutant in mutants_of(read_model(f"{CELL}waivers: [{waiver}]\n"))}
    assert mutants["reset/drop"].model.waivers == ()
    assert len(mutants["scan/swap:reset"].model.waivers) == 1


def _line(mutant: Mutant, text: str) -> str:
    _, places = read_located(text)
    return places.find(mutant.path)[1].strip()


def test_each_mutant_has_the_line_of_its_part() -> None:
    mutants = {mutant.name: mutant for mutant in mutants_of(read_model(CELL))}
    expected = {
        "scan/deadline/none": "deadline: 10 s",
        "scan/timedout/drop:scanner_req_trigger <- false": "timedout: [scanner_req_trigger <- false]",
        "automatic/give_up/drop": "give_up: {g: tries == 3, a: [tries <- 0], ar: [plan.state <- aborted]}",
        "resource/scanner/request/drop:command": "scanner: {request: [command]}",
        "variable/done/initial/true": "done: {domain: bool, initial: false}",
        "reset/drop": "reset:",
    }
    text = CELL.replace(" && scan.state == initial", "")
    mutants |= {mutant.name: mutant for mutant in mutants_of(read_model(text), ["operation-drop"])}
    assert {name: _line(mutants[name], text) for name in expected} == expected


def test_requirements_goals_and_simulation_never_change() -> None:
    model = load_model(AFTER)
    for mutant in mutants_of(model):
        changed = mutant.model
        assert (changed.requirements, changed.goals, changed.initial_states) == (
            model.requirements,
            model.goals,
            model.initial_states,
        )
        assert [each.simulation for each in changed.resources] == [each.simulation for each in model.resources]


def _digests(model: BehaviorModel) -> list[str]:
    return [digest_of(mutant.model) for mutant in mutants_of(model)]


def test_no_two_mutants_are_equal() -> None:
    model = read_model(CELL)
    digests = [*_digests(model), digest_of(model)]
    assert len(dict.fromkeys(digests)) == len(digests)
