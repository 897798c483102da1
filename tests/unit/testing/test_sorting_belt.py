"""The example with a camera: what is planted into it is found by one command each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Ran
from scbm.files import load_model

Scbm = Callable[..., Ran]

CELL = Path(__file__).parents[3] / "examples" / "sorting_belt" / "cell.yaml"
WEAK_GUARD = ("part_at == camera && gate_at == seen && (seen", "part_at == camera && (seen")
FORGOTTEN_CLEAN_UP = (", camera_req_trigger <- false, blind_looks += 1]", ", blind_looks += 1]")
STALE_RESULT = ("[part_at <- camera, seen <- unknown, blind_looks <- 0]", "[part_at <- camera, blind_looks <- 0]")


@pytest.fixture
def planted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[tuple[str, str]], Path]:
    def write(change: tuple[str, str]) -> Path:
        text = CELL.read_text(encoding="utf-8")
        assert change[0] in text
        path = tmp_path / "planted.yaml"
        path.write_text(text.replace(*change), encoding="utf-8")
        load_model(path)
        return path

    monkeypatch.chdir(tmp_path)
    return write


def test_random_cases_of_the_example_pass(scbm: Scbm) -> None:
    assert scbm("test", CELL, CELL.parent / "cases", "--cases", "100", "--seed", "1").code == 0
    assert scbm("check", "--strict", CELL).code == 0


@pytest.mark.parametrize(
    ("change", "finding"),
    [
        (WEAK_GUARD, "each_part_goes_where_it_belongs is violated"),
        (FORGOTTEN_CLEAN_UP, "no_orphan is violated"),
        (STALE_RESULT, "each_part_is_looked_at is violated"),
    ],
)
def test_a_planted_mistake_is_found_by_random_cases(
    change: tuple[str, str], finding: str, scbm: Scbm, planted: Callable[[tuple[str, str]], Path]
) -> None:
    ran = scbm("test", planted(change), "--cases", "100", "--seed", "1")
    assert (ran.code, finding in ran.out) == (1, True)


def test_a_forgotten_clean_up_is_found_by_check(scbm: Scbm, planted: Callable[[tuple[str, str]], Path]) -> None:
    ran = scbm("check", "--strict", planted(FORGOTTEN_CLEAN_UP))
    assert (ran.code, "warning[request-not-cleared]" in ran.out) == (1, True)
