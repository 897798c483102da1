"""What is possible where only a set of values is known for each variable."""

from __future__ import annotations

import pytest

from scbm.files import read_model
from scbm.model import Value
from scbm.proofcheck.values_check import Possible, all_possible

STORE = """
behavior_model: store
variables:
  low: {domain: 0..3, initial: 0, random: [2], source: state}
  high: {domain: 0..3, initial: 1, source: state}
  total: {domain: 2..4, initial: 3, source: state}
  size: {domain: 0..3, initial: 0}
resources:
  eye: {measures: {size: [1, 2]}}
operations:
  look:
    pre: {g: true, gr: low == 0, a: [eye_req_trigger <- true]}
    post: {g: true}
    failed: {g: high == 1}
automatic_transitions:
  up: {g: high == 0, a: [low += 1]}
  at_the_end: {g: low == 3, a: [low += 1]}
  copy: {g: high == 1, a: [low <- high]}
  gives_up: {g: low == 0, a: [current.state <- failed]}
  add: {g: current.name == none, a: [total <- low + high]}
  add_least: {g: low == 1 && high == 1, a: [total <- low + high]}
  add_greatest: {g: low == 3 && high == 1, a: [total <- low + high]}
  add_too_little: {g: low == 0 && high == 1, a: [total <- low + high]}
goals: {done: size == 2}
"""


def possible(**sets: tuple[Value, ...]) -> dict[str, list[Possible]]:
    """The steps by what they visit, or by their names. Variables have their initial values, but for some."""
    model = read_model(STORE)
    given = {name.replace("__", "."): values for name, values in sets.items()}
    found: dict[str, list[Possible]] = {}
    for step in all_possible({v.name: given.get(v.name, (v.initial,)) for v in model.running_space}, model):
        for name in (step.what, *map(str, step.visits)):
            found.setdefault(name, []).append(step)
    return found


def current(*states: str) -> dict[str, tuple[Value, ...]]:
    return {"look__state": states, "current__state": states}


def values_of(name: str, steps: list[Possible]) -> list[Value]:
    return [value for step in steps for each, value in step.gives if each == name]


def test_a_run_begins_with_random_and_nominal_values() -> None:
    assert values_of("low", possible()["the beginning of a run"]) == [2, 0]


def test_a_reply_measures_what_the_resource_sends() -> None:
    steps = possible(eye_req_trigger=(False, True))["a request to eye"]
    assert values_of("size", steps) == [1, 2]


@pytest.mark.parametrize("state", ["initial", "disabled"])
def test_an_operation_starts_from_the_states_before_its_start(state: str) -> None:
    assert "look/executing" in possible(**current(state))
    assert "look/executing" not in possible(**current(state), low=(1,))


def test_an_executing_operation_completes_or_fails() -> None:
    steps = possible(**current("executing"), low=(1,))
    assert {"look/completed", "look/failed"} <= steps.keys()
    assert "look/executing" not in steps
    assert "automatic/gives_up" not in possible(**current("executing"), high=(2,), low=(1,))
    assert "look/failed" not in possible(**current("executing"), high=(2,), low=(1,))


def test_an_automatic_transition_fails_the_operation_that_executes() -> None:
    (step,) = possible(**current("executing"))["automatic/gives_up"]
    assert [str(each) for each in step.visits] == ["automatic/gives_up", "look/failed"]
    assert "automatic/gives_up" not in possible()


def test_an_operation_is_in_a_state_that_all_its_variables_have() -> None:
    assert "look/completed" not in possible(look__state=("executing",))
    assert "look/completed" not in possible(current__state=("executing",))


def test_counting_changes_a_variable_within_its_domain() -> None:
    (step, *_) = possible(high=(0,))["automatic/up"]
    assert step.gives == (("low", 1),)
    assert "automatic/up" not in possible(high=(0,), low=(3,))
    assert "automatic/at_the_end" not in possible(low=(0, 3))


def test_what_is_copied_is_what_the_guard_lets_through() -> None:
    assert values_of("low", possible(high=(1, 3))["automatic/copy"])[:1] == [1]
    assert 3 not in values_of("low", possible(high=(1, 3))["automatic/copy"])


def test_a_sum_of_two_variables_stays_within_its_domain() -> None:
    sums = possible(low=(0, 1, 3), high=(1, 3))
    assert sorted(values_of("total", sums["automatic/add"])[:2]) == [2, 4]
    assert values_of("total", sums["automatic/add_least"])[0] == 2
    assert values_of("total", sums["automatic/add_greatest"])[0] == 4
    assert "automatic/add_too_little" not in sums


def test_a_transition_is_taken_while_no_operation_is_current() -> None:
    assert "automatic/add" in possible(low=(1,), current__name=("none",))


def test_a_guard_that_is_too_large_to_check_may_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    assert "automatic/up" not in possible()
    monkeypatch.setattr("scbm.proofcheck.valuations.MAX_STEPS", 0)
    assert "automatic/up" in possible()
