"""Macro-steps that are memoized and repeated do what their micro-steps do."""

from __future__ import annotations

import pytest

from scbm.files import load_model
from scbm.running import Runner
from scbm.testing import RandomCases, Tester
from support.histories import EXAMPLE


class _MicroStepRunner(Runner):
    """Takes one micro-step after the other, and memoizes no macro-steps."""

    def _take_macro_step(self) -> bool:
        return False


@pytest.mark.parametrize("name", ["before", "after"])
def test_a_campaign_gives_the_traces_that_micro_steps_give(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    model = load_model(EXAMPLE / f"{name}.yaml")
    cases = list(RandomCases(model).first(60, 1))
    tester = Tester(model)
    traces = [tester.execute(case).trace for case in cases]
    monkeypatch.setattr("scbm.running.simulation.simulator.Runner", _MicroStepRunner)
    assert [Tester(model).execute(case).trace for case in cases] == traces
