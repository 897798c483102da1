"""The reports of verbs fit the terminal; only commands to copy and texts of the user may be longer."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Ran

EXAMPLES = Path("examples")
BEFORE = str(EXAMPLES / "robot_in_the_air" / "before.yaml")
GRIPPER = str(EXAMPLES / "gripper" / "cell.yaml")
LAMPS = str(Path("tests") / "models" / "valid" / "handshakes.yaml")
REPORTS = (
    ("check", BEFORE),
    ("plan", BEFORE, "--goal", "item_a_delivered"),
    pytest.param(("check", str(EXAMPLES / "dual_cnc" / "lifted.yaml")), marks=pytest.mark.longer),
    ("test", BEFORE, "--cases", "3"),
    ("test", BEFORE, "--cases", "3", "--missing"),
    ("test", BEFORE, "--cases", "1", "--fail-under", "executing=100"),
    ("close", GRIPPER),
    ("explain", GRIPPER, "grip/disabled"),
    pytest.param(("close", BEFORE), marks=pytest.mark.slow),
    pytest.param(("explain", BEFORE, "robot_move_to_home"), marks=pytest.mark.slow),
    pytest.param(("explain", BEFORE, "gripper_open/disabled"), marks=pytest.mark.slow),
    pytest.param(("mutate", LAMPS, "--cases", "2"), marks=pytest.mark.slow),
)


def _too_long(ran: Ran, columns: int) -> list[str]:
    """Return the lines that are longer than the terminal, except for commands alone on their lines, and for cases."""
    lines = [line for line in (*ran.out.splitlines(), *ran.err.splitlines()) if len(line) > columns]
    lines = [line for line in lines if not line.startswith("initial: {")]  # of the text of a case file
    return [line for line in lines if not line.strip().startswith("scbm ") or "   " in line.strip()]


@pytest.fixture(params=[60, 80])
def columns(request: pytest.FixtureRequest, scbm: object, monkeypatch: pytest.MonkeyPatch) -> int:  # noqa: ARG001 - `scbm` unsets the variable
    """Return the width of the terminal, which the environment says."""
    width: int = request.param
    monkeypatch.setenv("COLUMNS", str(width))
    return width


@pytest.mark.usefixtures("shared_closings")
@pytest.mark.parametrize("arguments", REPORTS, ids=" ".join)
def test_a_report_fits_the_terminal_but_for_commands(
    arguments: tuple[str, ...], columns: int, scbm: Callable[..., Ran]
) -> None:
    ran = scbm(*arguments)
    assert ran.out
    assert _too_long(ran, columns) == []


@pytest.mark.longer
def test_the_reports_of_a_store_fit_the_terminal(columns: int, scbm: Callable[..., Ran], tmp_path: Path) -> None:
    store = str(tmp_path / "st.db")
    scbm("test", BEFORE, "--cases", "3", "--store", store)
    for options in ([], ["--missing"], ["--contexts"]):
        assert _too_long(scbm("report", store, *options), columns) == []
