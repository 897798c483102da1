"""Several options with errors: a command reports all of them at once."""

from __future__ import annotations

from collections.abc import Callable

from conftest import Ran
from support.wording import diagnostic_heads

BEFORE = "examples/robot_in_the_air/before.yaml"


def _places(ran: Ran) -> list[str]:
    assert ran.code == 2
    return [head.partition(":")[0] for head in diagnostic_heads(ran.err)]


def test_all_wrong_options_of_a_campaign_are_reported(scbm: Callable[..., Ran]) -> None:
    wrong = ("--fail-under", "abc", "--network", "foo", "--require", "x ==", "--time-limit", "q", "--inputs", "all")
    assert _places(scbm("test", BEFORE, "--cases", 1, *wrong, "--plans", "zz")) == [
        "--fail-under", "--plans", "--network", "--require", "--time-limit", "--inputs",
    ]  # fmt: skip


def test_an_option_and_a_case_file_are_reported_together(scbm: Callable[..., Ran]) -> None:
    assert _places(scbm("test", BEFORE, "nothing.yaml", "--time-limit", "q")) == ["--time-limit", "nothing.yaml"]


def test_all_wrong_options_of_a_run_are_reported(scbm: Callable[..., Ran]) -> None:
    wrong = ("--goal", "x ==", "--network", "foo", "--require", "y", "--time-limit", "q", "--plans", "zz")
    assert _places(scbm("run", BEFORE, *wrong)) == ["--plans", "--network", "--require", "--time-limit", "--goal"]
