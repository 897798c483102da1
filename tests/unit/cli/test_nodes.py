"""What command lines say of nodes, and the logs that they save."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest

from scbm.cli.node_options import read_domain, read_time_scale
from scbm.errors import InputError
from support.models import SCAN_CELL


@pytest.mark.parametrize(
    ("text", "scale"), [("20", 20), ("0.5", Fraction(1, 2)), (" 1/3 ", Fraction(1, 3)), (".25", Fraction(1, 4))]
)
def test_a_time_scale_is_a_fraction(text: str, scale: Fraction) -> None:
    assert read_time_scale(text) == scale


@pytest.mark.parametrize(
    "text", ["", "0", "-1", "1/0", "nan", "inf", "1e99999999", "10001", "1/10001", "9" * 5_000, "¹"]
)
def test_what_is_no_factor_of_time_is_refused_at_once(text: str) -> None:
    with pytest.raises(InputError, match="is not a factor between 0 and 10000"):
        read_time_scale(text)


@pytest.mark.parametrize("named", ["x", "-1", "¹", "9" * 5_000])
def test_a_domain_of_the_environment_that_is_no_number_is_refused(named: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("ROS_DOMAIN_ID", named)
    with pytest.raises(InputError, match="which is no number"):
        read_domain(None)
    assert read_domain(7) == 7


def test_the_log_of_each_run_is_saved_whole_and_shows_the_run_again(scbm: Callable[..., Any], tmp_path: Path) -> None:
    model, logs = tmp_path / "model.yaml", tmp_path / "logs"
    model.write_text(SCAN_CELL, encoding="utf-8")
    over_loopback = ("test", model, "--cases", 2, "--transport", "loopback", "--time-scale", 20, "--logs", logs)
    scbm(*over_loopback)
    saved = sorted(logs.iterdir())
    assert [path.name for path in saved] == ["seed-0-case-1.log", "seed-0-case-2.log"]
    for path in saved:
        assert scbm("replay", path).err == ""
    before, other = saved[0].read_bytes(), tmp_path / "other.log"
    other.hardlink_to(saved[0])
    scbm(*over_loopback)
    assert saved[0].read_bytes() != before  # it has other times
    assert other.read_bytes() == before  # nobody who reads it sees half of one and half of the other


def test_logs_that_cannot_be_saved_are_told_of_once_and_the_report_goes_on(
    scbm: Callable[..., Any], tmp_path: Path
) -> None:
    model, logs = tmp_path / "model.yaml", tmp_path / "logs"
    model.write_text(SCAN_CELL, encoding="utf-8")
    logs.write_text("a file", encoding="utf-8")
    ran = scbm("test", model, "--cases", 2, "--transport", "loopback", "--time-scale", 20, "--logs", logs)
    assert ran.code == 2
    assert ran.err.count("cannot save logs here") == 1
    assert "SCBM-IAS" in ran.out
    assert logs.read_text(encoding="utf-8") == "a file"
