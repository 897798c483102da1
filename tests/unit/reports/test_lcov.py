"""Tracefiles: accepted by `lcov` and `genhtml` as they are installed, of version 1 or 2."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Aspect
from scbm.files import read_model
from scbm.reports.ci.lcov import lcov_info
from scbm.store import History, ModelSource, StoredRun
from support.histories import EXAMPLE, history_of

MODELS = Path(__file__).parents[2] / "models/valid"
NEVER_STARTED = """\
behavior_model: m
variables: {}
operations:
  go:
    pre: {g: true}
    post: {g: true}
"""


def tool(name: str) -> str:
    path = shutil.which(name)
    if path is not None:
        return path
    if os.environ.get("SCBM_ALL_TOOLS") == "1":
        pytest.fail(f"there is no {name}, and SCBM_ALL_TOOLS=1 says that it is there")
    pytest.skip(f"there is no {name}")


def beside_the_model(history: History, directory: Path) -> Path:
    """A directory as CI has it: the model where it was, and the tracefile."""
    model = directory / history.source.path
    model.parent.mkdir(parents=True, exist_ok=True)
    model.write_text(history.source.text, encoding="utf-8")
    (directory / "cov.info").write_text(lcov_info(history), encoding="utf-8")
    return directory


def run(directory: Path, *command: str) -> str:
    """What a tool says; it must not complain of anything."""
    result = subprocess.run(command, cwd=directory, capture_output=True, text=True, check=False)
    assert result.returncode == 0, result.stderr
    assert not re.search(r"error|warning", result.stderr, re.IGNORECASE), result.stderr
    return result.stdout


def disabled_only(model: str = NEVER_STARTED) -> History:
    """A history with one case, in which the only operation was disabled and never started."""
    history = history_of(EXAMPLE / "before.yaml", 1)
    read = read_model(model)
    source = ModelSource("m.yaml", model)
    stored = History(read, (StoredRun("0" * 32, "2026-11-21T12:00:00.000000Z", "scbm test", source),), ())
    visited = stored.obligations.bit_of("go", Aspect.DISABLED)
    return replace(stored, cases=(replace(history.cases[0], visited=visited),))


HISTORIES: dict[str, Callable[[], History]] = {
    "example": lambda: history_of(EXAMPLE / "before.yaml", 20),
    "anchors": lambda: relative(history_of(MODELS / "anchors.yaml", 20)),
    "one line": lambda: relative(history_of(MODELS / "json.yaml", 3)),
    "no operations": lambda: relative(history_of(MODELS / "quotes.yaml", 1)),
    "disabled only": disabled_only,
}


def relative(history: History) -> History:
    """The history of a model that lies in the directory of the command."""
    (last,) = history.runs
    source = ModelSource(Path(history.source.path).name, history.source.text)
    return replace(history, runs=(replace(last, source=source),))


@pytest.mark.peer
def test_lcov_counts_the_figure_as_branches(tmp_path: Path) -> None:
    lcov = tool("lcov")
    directory = beside_the_model(history_of(EXAMPLE / "before.yaml", 20), tmp_path)
    is_first = "version 1." in run(directory, lcov, "--version")
    branches = ("--rc", "lcov_branch_coverage=1") if is_first else ("--branch-coverage",)
    summary = run(directory, lcov, *branches, "--summary", "cov.info")
    assert re.search(r"branches\.*: 46\.5% \(40 of 86 branches\)", summary)
    assert re.search(r"functions\.*: 77\.3% \(17 of 22 functions\)", summary)
    assert re.search(r"lines\.*: 71\.1% \(150 of 211 lines\)", summary)


@pytest.mark.parametrize("name", [name for name in HISTORIES if name != "no operations"])
@pytest.mark.peer
def test_genhtml_shows_the_model(name: str, tmp_path: Path) -> None:
    genhtml = tool("genhtml")
    history = HISTORIES[name]()
    directory = beside_the_model(history, tmp_path)
    printed = run(directory, genhtml, "--branch-coverage", "--output-directory", "html", "cov.info")
    figure = history.coverage.figure
    assert f"({figure.visited} of {figure.of} branches)" in printed
    page = next((directory / "html").rglob("*.gcov.html")).read_text(encoding="utf-8")
    assert history.model.operations[0].name in page


@pytest.mark.parametrize("name", HISTORIES)
def test_the_sums_are_those_of_the_lines(name: str) -> None:
    records = [line.partition(":")[::2] for line in lcov_info(HISTORIES[name]()).splitlines()]
    sums = {key: int(value) for key, value in records if key in ("LF", "LH", "BRF", "BRH", "FNF", "FNH")}
    hits = [int(value.split(",")[1]) for key, value in records if key == "DA"]
    branches = [value.split(",")[3] for key, value in records if key == "BRDA"]
    functions = [int(value.split(",")[0]) for key, value in records if key == "FNDA"]
    assert (sums["LF"], sums["LH"]) == (len(hits), sum(count > 0 for count in hits))
    assert (sums["BRF"], sums["BRH"]) == (len(branches), sum(count not in ("0", "-") for count in branches))
    assert (sums["FNF"], sums["FNH"]) == (len(functions), sum(count > 0 for count in functions))
    assert records[0][0] == "TN"
    assert records[-1][0] == "end_of_record"


@pytest.mark.parametrize("name", HISTORIES)
def test_a_line_with_branches_was_executed_if_and_only_if_one_of_them_was(name: str) -> None:
    """What LCOV 2 demands of every file, and calls inconsistent otherwise."""
    records = [line.partition(":")[::2] for line in lcov_info(HISTORIES[name]()).splitlines()]
    hits = {value.split(",")[0]: int(value.split(",")[1]) for key, value in records if key == "DA"}
    taken: dict[str, bool] = {}
    for number, _, _, count in (value.split(",") for key, value in records if key == "BRDA"):
        taken[number] = taken.get(number, False) or count not in ("0", "-")
        assert (count == "-") is (hits[number] == 0)
    assert taken == {number: hits[number] > 0 for number in taken}


def test_a_branch_that_was_visited_executes_its_line() -> None:
    text = lcov_info(disabled_only())
    assert [line for line in text.splitlines() if line.startswith("BRDA:5,")] == [
        "BRDA:5,0,0,0",
        "BRDA:5,0,1,0",
        "BRDA:5,0,2,1",
        "BRDA:5,0,3,0",
    ]
    assert "DA:5,1\n" in text


def test_the_name_of_the_test_has_nothing_that_lcov_does_not_allow() -> None:
    history = history_of(EXAMPLE / "before.yaml", 1)
    dotted = replace(history, model=replace(history.model, name="cell.left-1"))
    assert lcov_info(dotted).startswith("TN:cell_left_1\n")
