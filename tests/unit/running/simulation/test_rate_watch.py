"""Whether environment transitions act at times that their rates allow (semantics 7.2, 9.4)."""

from __future__ import annotations

import pytest

from scbm.files import read_case, read_model
from scbm.testing import RandomCases, Tester
from support.wording import Wording

CELL = """
behavior_model: cell
variables:
  stop: {domain: [released, pressed], initial: released}
  done: {domain: bool, initial: false}
resources:
  ram: {simulation: {latency: 30 s}}
operations:
  form: {request: ram, deadline: 60 s, guard: done == false, effects: [done <- true], timedout: [stop <- released]}
environment:
  push: {guard: stop == released, actions: [stop <- pressed], PUSH}
  pull: {guard: stop == pressed, actions: [stop <- released], after: {uniform: [2 s, 4 s]}}
goals: {done: done == true}
"""


def notes(push: str, *entries: str) -> tuple[str, ...]:
    model = read_model(CELL.replace("PUSH", push))
    text = "case: one\ngoal: done\nenvironment:\n" + "".join(f"  - {{{entry}}}\n" for entry in entries)
    return Tester(model).execute(read_case(text, model)).notes


@pytest.mark.parametrize(
    ("push", "entries", "left"),
    [
        ("after: 5 s", ("at: 5 s, by: push",), []),
        ("after: 5 s", ("at: 4 s, by: push",), ["push"]),
        ("after: 5 s", ("at: 5 s, by: push", "at: 8 s, by: pull"), []),
        ("after: 5 s", ("at: 5 s, by: push", "at: 6 s, by: pull", "at: 11 s, by: push"), ["pull"]),
        ("every: 5 s", ("at: 10 s, by: push",), []),
        ("every: 5 s", ("at: 7 s, by: push",), ["push"]),
        ("every: {exponential: 5 s}", ("at: 1 ms, by: push",), []),
        ("every: {uniform: [4 s, 5 s]}", ("at: 9 s, by: push",), []),
        ("every: {uniform: [4 s, 5 s]}", ("at: 6 s, by: push",), ["push"]),
    ],
)
def test_each_rate_that_a_run_leaves_is_named(
    push: str, entries: tuple[str, ...], left: list[str], wording: Wording
) -> None:
    found = notes(push, *entries)
    assert [note.split()[0] for note in found] == left
    for note in found:
        wording(note)


def test_drawn_and_recorded_runs_leave_no_rate() -> None:
    model = read_model(CELL.replace("PUSH", "every: {exponential: 5 s}"))
    tester = Tester(model)
    for case in RandomCases(model).first(20, 1):
        execution = tester.execute(case)
        assert execution.notes == ()
        assert tester.execute(execution.recorded_case).notes == ()
