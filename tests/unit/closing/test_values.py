"""The values that runs can give variables, and the impossible transitions, in the words of the model."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.closing.proofs.possible_values import possible_values, ruled_out
from scbm.files import load_model, read_model
from scbm.model import BehaviorModel, Value
from support.models import scan_cell
from support.wording import Wording

ROOT = Path(__file__).parents[3]


def _ruled_out(model: BehaviorModel) -> dict[str, str]:
    return {str(obligation): why for obligation, why in ruled_out(model, possible_values(model))}


def _shown(reasons: dict[str, str]) -> list[str]:
    return [f"{obligation}: {why}" for obligation, why in reasons.items()]


def _cell(*replacements: tuple[str, str]) -> dict[str, tuple[Value, ...]]:
    return possible_values(scan_cell(*replacements))


@pytest.mark.parametrize("name", ["before", "after"])
def test_in_the_example_every_value_is_possible(name: str) -> None:
    model = load_model(ROOT / f"examples/robot_in_the_air/{name}.yaml")
    values = possible_values(model)
    assert values == {variable.name: variable.domain.values for variable in model.running_space}
    assert ruled_out(model, values) == ()


def test_the_values_are_those_that_the_steps_assign() -> None:
    values = _cell()
    assert values["light"] == ("green",)
    assert values["count"] == (0,)
    assert values["box_is_scanned"] == (False, True)
    assert values["scan_req_state"] == ("initial", "executing", "succeeded", "failed")
    assert values["temperature"] == tuple(range(10))
    assert values["scan_box.state"] == ("initial", "disabled", "executing", "timedout", "failed", "completed")


def test_initial_states_draw_from_the_random_values() -> None:
    assert _cell(("initial: green}", "initial: green, random: [green, blue]}"))["light"] == ("green", "blue")


def test_nothing_is_sent_or_measured_where_nothing_asks_for_it() -> None:
    values = _cell(("scan_req_trigger <- true, ", ""), ("    measures: [temperature]\n", ""))
    assert values["scan_req_state"] == ("initial",)
    assert values["temperature"] == (5,)
    assert values["scan_box.state"] == ("initial", "disabled", "executing", "timedout")


_COUNTS = """\
  more:
    g: count {order} && box_is_scanned == true
    a: [count += 1]
"""


@pytest.mark.parametrize(("order", "values"), [("< 2", (0, 1, 2)), ("> 0", (0,)), ("== 0", (0, 1, 2))])
def test_adding_goes_on_where_its_guard_can_hold(order: str, values: tuple[int, ...]) -> None:
    more = _COUNTS.format(order=order)
    assert _cell(("automatic_transitions:\n", f"automatic_transitions:\n{more}"))["count"] == values


def test_adding_reaches_every_multiple_in_a_large_domain() -> None:
    model = read_model("""
behavior_model: counter
variables:
  up: {domain: 0..65535, initial: 1}
  down: {domain: -100..100, initial: 100}
operations:
  tick:
    pre: {g: true, a: [up += 3, down -= 7]}
    post: {g: true}
""")
    values = possible_values(model)
    assert values["up"] == tuple(range(1, 65_536, 3))
    assert values["down"] == tuple(range(-96, 101, 7))


def test_what_is_copied_has_to_be_in_the_domain() -> None:
    more = "automatic_transitions:\n  copy: {g: box_is_scanned == true, a: [count <- temperature]}\n"
    assert _cell(("automatic_transitions:\n", more))["count"] == (0, 1, 2)


def test_a_transition_is_taken_only_if_all_its_actions_fit(wording: Wording) -> None:
    copies = "  copy: {g: true, a: [count <- temperature, light <- red]}\n"
    model = scan_cell(
        ("automatic_transitions:\n", f"automatic_transitions:\n{copies}"), ("    measures: [temperature]\n", "")
    )
    assert possible_values(model)["light"] == ("green",)
    reasons = _ruled_out(model)
    assert [*reasons] == ["automatic/copy"]
    wording(_shown(reasons))


def test_an_operation_never_executes_whose_guard_needs_a_value_that_never_comes(wording: Wording) -> None:
    reasons = _ruled_out(scan_cell(("light != red", "light == red")))
    states = [f"scan_box/{state}" for state in ("executing", "failed", "timedout", "completed")]
    assert {*reasons} == {*states, "automatic/scan_failed"}
    assert len({reasons[state] for state in states}) == 1
    wording(_shown(reasons))


def test_an_operation_never_completes_whose_postcondition_cannot_hold(wording: Wording) -> None:
    model = scan_cell(("gr: scan_req_state == succeeded", "gr: scan_req_state == succeeded && light in {red, blue}"))
    reasons = _ruled_out(model)
    assert [*reasons] == ["scan_box/completed"]
    wording(_shown(reasons))


def test_conjuncts_that_exclude_each_other_are_reported_together(wording: Wording) -> None:
    model = scan_cell(("gr: scan_req_state == succeeded", "gr: temperature < 3 && temperature > 4"))
    reasons = _ruled_out(model)
    assert [*reasons] == ["scan_box/completed"]
    wording(_shown(reasons))


def test_a_guard_that_holds_in_no_state_is_reported(wording: Wording) -> None:
    never = "!(count == 0 || count == 1 || count == 2)"
    model = scan_cell(("gr: light != red", f'gr: "light != red && {never}"'))
    why = _ruled_out(model)["scan_box/executing"]
    assert "count != 0 && count != 1 && count != 2" in why
    wording(why)


def test_what_holds_but_never_when_it_is_looked_at_is_reported(wording: Wording) -> None:
    other = "operations:\n  other: {pre: {g: true}, post: {g: true}}\n"
    model = scan_cell(("operations:\n", other), ("light != red", "current.name == other"))
    why = _ruled_out(model)["scan_box/executing"]
    assert "current.name == other" in why
    wording(why)


def test_a_way_to_fail_that_cannot_be_taken_is_named(wording: Wording) -> None:
    model = scan_cell(("g: scan_req_state == failed && current", "g: light == blue && current"))
    reasons = _ruled_out(model)
    assert {*reasons} == {"scan_box/failed", "automatic/scan_failed"}
    assert reasons["scan_box/failed"].startswith("scan_failed ")
    wording(_shown(reasons))


def test_an_automatic_transition_that_changes_nothing_is_never_taken(wording: Wording) -> None:
    same = "automatic_transitions:\n  same: {g: light == green, a: [light <- green]}\n"
    reasons = _ruled_out(scan_cell(("automatic_transitions:\n", same)))
    assert [*reasons] == ["automatic/same"]
    wording(_shown(reasons))


def test_automatic_transitions_have_their_turn_when_a_run_has_ended() -> None:
    bell = "automatic_transitions:\n  bell: {g: plan.state == completed, a: [light <- blue]}\n"
    model = scan_cell(("automatic_transitions:\n", bell))
    assert possible_values(model)["light"] == ("green", "blue")
    assert _ruled_out(model) == {}


def test_what_the_structure_rules_out_is_ruled_out_by_the_values_too(wording: Wording) -> None:
    model = scan_cell(
        ("    deadline: 10 seconds\n", ""),
        ("    timedout: [scan_req_trigger <- false]\n", ""),
        ("a: [current.state <- failed, ", "a: ["),
    )
    reasons = _ruled_out(model)
    assert [*reasons] == ["scan_box/failed", "scan_box/timedout"]
    wording(_shown(reasons))


@pytest.mark.longer
def test_a_guard_that_is_too_much_to_search_counts_as_one_that_can_hold() -> None:
    model = read_model("""
behavior_model: large
variables:
  left: {domain: 0..4000, initial: 0, random: any}
  right: {domain: 0..4000, initial: 0, random: any}
  lamp: {domain: bool, initial: false}
operations:
  wait: {pre: {g: true}, post: {g: true}}
automatic_transitions:
  light: {g: left < right && left > right, a: [lamp <- true]}
""")
    assert possible_values(model)["lamp"] == (False, True)
