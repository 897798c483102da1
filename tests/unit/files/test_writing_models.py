"""Models as text: the written form of each valid model means the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.files import load_model, read_case, read_model, write_case, write_model

VALID = sorted((Path(__file__).parents[2] / "models" / "valid").glob("*.yaml"))


@pytest.mark.parametrize("file", VALID, ids=lambda file: file.stem)
def test_the_written_form_of_a_model_means_the_same(file: Path) -> None:
    model = load_model(file)
    assert read_model(write_model(model), str(file)) == model


TIMED = """behavior_model: m
variables: {a: {domain: bool, initial: false}}
resources: {r: {simulation: {latency: {uniform: [1500 ms, 2.25 s]}}}}
operations:
  work:
    deadline: 3.5 s
    pre: {g: a == false, a: [r_req_trigger <- true]}
    post: {g: true, a: [a <- true, r_req_trigger <- false]}
    timedout: [r_req_trigger <- false]
goals: {a: a == true}
requirements: {soon: a == true leads to a == true within 1.5 s}
"""


def test_models_and_cases_have_one_notation_of_durations() -> None:
    model = read_model(TIMED)
    text = write_model(model)
    for written in ("uniform: [1.5 s, 2.25 s]", "deadline: 3.5 s", "within 1.5 s"):
        assert written in text
    case = "case: c\ngoal: a\noutcomes: {r: [{outcome: succeed, after: 1500 ms}]}\n"
    case += "recorded: {end: reached, time: 1500 ms}\n"
    text = write_case(read_case(case, model), model, None)
    assert text.count("1.5 s") == 2
    assert read_case(text, model) == read_case(case, model)
