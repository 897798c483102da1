"""The parts of the library: each alone in a model is free of doubts, and can be tested and closed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

import scbm
from conftest import Ran
from scbm.files import read_model
from scbm.testing import RandomCases, Tester

GOALS = {
    "conveyor": "p.item == exit",
    "door": "p.bolt == locked",
    "emergency_stop": "done == true",
    "gripper": "p.jaws == closed",
    "light_curtain": "done == true",
    "packml": "p.mode_state == complete",
}
"""What can be reached with each part."""


def model_with(part: str) -> str:
    return f"""\
behavior_model: cell
parts: {{p: {{use: "scbm:{part}"}}}}
variables: {{done: {{domain: bool, initial: false}}}}
operations: {{finish: {{pre: {{g: done == false}}, post: {{g: true, a: [done <- true]}}}}}}
goals: {{reached: "{GOALS[part]}", finished: done == true}}
may_end: [aborted]
"""


def test_the_list_is_that_of_the_library() -> None:
    folder = Path(scbm.__file__).parent / "files" / "parts"
    assert sorted(path.stem for path in folder.glob("*.yaml")) == sorted(GOALS)


@pytest.mark.parametrize("part", GOALS)
def test_random_cases_with_a_part_pass(part: str) -> None:
    model = read_model(model_with(part))
    tester = Tester(model)
    verdicts = [tester.execute(case).verdict for case in RandomCases(model).first(20, 1)]
    assert all(verdict.passed for verdict in verdicts), verdicts


@pytest.mark.slow
@pytest.mark.parametrize("part", GOALS)
def test_every_obligation_of_a_part_is_decided(part: str, scbm: Callable[..., Ran], tmp_path: Path) -> None:
    (tmp_path / "cell.yaml").write_text(model_with(part), encoding="utf-8")
    assert scbm("close", tmp_path / "cell.yaml", "--out", tmp_path / "closed").code == 0
