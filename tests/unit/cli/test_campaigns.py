"""Campaigns in simulation that a user interrupts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from scbm.cases import Case
from scbm.testing import Execution, Tester

FAILS = "tests/models/fails_at_run/livelock.yaml"


@pytest.fixture
def interrupted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Interrupt the third case; return the names of the cases that were begun."""
    begun: list[str] = []
    execute = Tester.execute

    def interrupt(self: Tester, case: Case, most_records: int | None = None) -> Execution:
        begun.append(case.name)
        if len(begun) == 3:
            raise KeyboardInterrupt
        return execute(self, case, most_records)

    monkeypatch.setattr(Tester, "execute", interrupt)
    return begun


def test_the_cases_that_were_done_are_reported_and_nothing_more_is_run(
    scbm: Callable[..., Any], interrupted: list[str], tmp_path: Path
) -> None:
    saved, failures = tmp_path / "saved", tmp_path / "failures"
    ran = scbm("test", FAILS, "--cases", 9, "--save", saved, "--failures", failures)
    not_saved = f"scbm: nothing is saved in {saved}: that comes behind the last case\n"
    assert (ran.code, ran.err) == (130, f"scbm: interrupted after 2 of 9 cases\n{not_saved}")
    assert "2 random cases of seed 0: 2 livelock; 2 failed\n  Interrupted after 2 of 9 cases\n" in ran.out
    assert interrupted == [f"seed-0-case-{number}" for number in (1, 2, 3)]
    assert [path.name for path in tmp_path.rglob("*")] == ["failures", "last-failed.json"]
    assert f"again: scbm run {FAILS} --seed 0 --case 1" in ran.out


@pytest.mark.usefixtures("interrupted")
@pytest.mark.parametrize(
    ("written", "told"),
    [(1, "1 written case and 1 random case of seed 0"), (2, "2 written cases"), (4, "2 written cases")],
)
def test_only_cases_that_were_run_are_counted(
    scbm: Callable[..., Any], tmp_path: Path, written: int, told: str
) -> None:
    model = "examples/robot_in_the_air/before.yaml"
    saved = tmp_path / "saved"
    saved.mkdir()
    for number in range(written):
        drawn = f"case: scans_{number}\ngoal: item_a_scanned\ndrawn: {{seed: 4}}\n"
        (saved / f"scans_{number}.yaml").write_text(drawn, encoding="utf-8")
    ran = scbm("test", model, saved, "--cases", 5)
    assert f", {told}: 2 reached\n  Interrupted after 2 of {written + 5} cases\n" in ran.out
