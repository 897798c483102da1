"""What happens first in only one of two runs of a witness, in words; reports and files of witnesses have it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from conftest import Ran
from scbm.cases import Case
from scbm.files import read_model
from scbm.mutation.equivalence.witness_search import differ_only_in_payloads, first_difference
from scbm.testing import Execution, Tester
from support.wording import Wording

CELL = """behavior_model: cell
variables:
  at: {domain: [home, box], initial: home, source: state}
  light: {domain: [dark, lit], initial: dark, source: state}
resources:
  arm: {simulation: {latency: 1 s}}
operations:
  go:
    pre: {g: at == home && arm_req_state == initial, a: [arm_req_trigger <- true, light <- lit]}
    post:
      g: true
      gr: arm_req_state == succeeded
      a: [arm_req_trigger <- false, arm_req_state <- initial, at <- box, light <- dark]
goals: {there: at == box}
"""


def run(text: str) -> Execution:
    model = read_model(text)
    goal = model.goal("there")
    assert goal is not None
    return Tester(model).execute(Case("case", "there", goal, model.nominal_state))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            "light <- lit",
            "light <- dark",
            '"go executing, by start_go" at 0.000 s, where the model sets light = lit, and the mutant nothing else',
        ),
        (
            "latency: 1 s",
            "latency: 2 s",
            (
                '"reply 1 ← arm: succeeded" at 1.000 s on the model,'
                ' and "reply 1 ← arm: succeeded" at 2.000 s on the mutant'
            ),
        ),
    ],
)
def test_the_first_difference_has_event_time_and_values(old: str, new: str, words: str) -> None:
    assert old in CELL
    original = run(CELL)
    assert first_difference(original, run(CELL.replace(old, new)), original.case.initial) == words


def test_what_only_requests_carry_is_recognized() -> None:
    carrying = CELL.replace("arm: {", "arm: {request: [light], ")
    assert carrying != CELL
    original = run(carrying)
    assert differ_only_in_payloads(original, run(CELL))
    assert not differ_only_in_payloads(original, run(carrying.replace("light <- lit", "light <- dark")))


def test_a_run_that_ends_earlier_has_nothing_more(wording: Wording) -> None:
    original = run(CELL)
    cut = replace(original, trace=replace(original.trace, records=original.trace.records[:-1]))
    wording(first_difference(original, cut, original.case.initial))


def test_a_witness_that_passes_is_named_and_saved_with_its_difference(
    scbm: Callable[..., Ran], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("cell.yaml").write_text(CELL, encoding="utf-8")
    Path("case.yaml").write_text("case: case\nmodel: cell.yaml\ngoal: there\n", encoding="utf-8")
    out = scbm("mutate", "cell.yaml", "case.yaml", "--operators", "action-drop", "--witnesses", "found", "-j", "1").out
    words = " ".join(out.split())
    difference = '"go executing, by start_go" at 0.000 s, where the model sets light = lit, and the mutant nothing else'
    (file,) = (path for path in Path("found").iterdir() if difference in path.read_text(encoding="utf-8"))
    comments = (line for line in file.read_text(encoding="utf-8").splitlines() if line.startswith("#"))
    wording(line.replace(file.stem, "WITNESS") for line in comments)
    assert f": {difference}" in words.partition(f"{file.stem} ")[2]
    wording(words[words.index(file.stem) : words.index(difference)].replace(file.stem, "WITNESS"))
