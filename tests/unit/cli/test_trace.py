"""`scbm trace`: what it writes, what it says, and what is wrong."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Protocol

import pytest
from mcap.reader import make_reader

from support.wording import Wording, diagnostic_heads

MODEL = "examples/robot_in_the_air/before.yaml"
CASE = "examples/robot_in_the_air/cases/delivery_against_all_odds.yaml"
SCANS = "case: scans\ngoal: item_a_scanned\ninitial: {robot_at: toolbox_scanner}\n"


class Ran(Protocol):
    code: int
    out: str
    err: str


Scbm = Callable[..., Ran]


def ended_ns(path: Path) -> int:
    """When the run that a file shows ended."""
    (metadata,) = make_reader(BytesIO(path.read_bytes()), validate_crcs=True).iter_metadata()
    return int(metadata.metadata["simulated_ns"])


def count_of(path: Path) -> int:
    """How many messages or events are in a file."""
    if path.suffix == ".mcap":
        return sum(1 for _ in make_reader(BytesIO(path.read_bytes()), validate_crcs=True).iter_messages())
    return len(json.loads(path.read_text(encoding="utf-8"))["traceEvents"])


def test_it_writes_both_formats_and_says_so(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    perfetto, mcap = tmp_path / "run.json", tmp_path / "run.mcap"
    ran = scbm("trace", CASE, "--perfetto", perfetto, "--mcap", mcap)
    assert (ran.code, ran.err) == (0, "")
    first, *files = ran.out.splitlines()
    wording(first)
    assert [line.split()[:2] for line in files] == [[str(path), str(count_of(path))] for path in (perfetto, mcap)]
    wording(files)


def test_it_is_the_run_of_replay(scbm: Scbm, tmp_path: Path) -> None:
    scbm("trace", CASE, "--mcap", tmp_path / "run.mcap")
    report = json.loads(scbm("replay", CASE, "--json").out)
    assert ended_ns(tmp_path / "run.mcap") == round(report["simulated_seconds"] * 1e9)


def test_a_drawn_case_is_the_run_of_run(scbm: Scbm, tmp_path: Path) -> None:
    options = (MODEL, "--seed", 3, "--case", 5, "--network", "drawn", "--time-limit", "20 min")
    report = json.loads(scbm("run", *options, "--json").out)
    assert scbm("trace", *options, "--mcap", tmp_path / "run.mcap").code == 0
    assert ended_ns(tmp_path / "run.mcap") == round(report["simulated_seconds"] * 1e9)


def test_json_says_what_was_written(scbm: Scbm, tmp_path: Path) -> None:
    perfetto, mcap = tmp_path / "run.json", tmp_path / "run.mcap"
    ran = scbm("trace", MODEL, "--case", 6, "--seed", 1, "--perfetto", perfetto, "--mcap", mcap, "--json")
    assert json.loads(ran.out) == {
        "format_version": 1,
        "model": "robot_in_the_air",
        "case": "seed-1-case-6",
        "verdict": "reached",
        "passed": True,
        "is_real_run": False,
        "simulated_seconds": 15.555291,
        "written": [
            {"format": "perfetto", "file": str(perfetto), "events": count_of(perfetto)},
            {"format": "mcap", "file": str(mcap), "messages": count_of(mcap)},
        ],
    }


def test_a_case_that_fails_is_written_all_the_same(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    ran = scbm("trace", "tests/models/fails_at_run/livelock.yaml", "--case", 1, "--perfetto", tmp_path / "run.json")
    assert ran.code == 0
    wording(ran.out.splitlines()[0])


def test_the_model_and_requirements_of_the_command_line_count(scbm: Scbm, tmp_path: Path) -> None:
    case = tmp_path / "scans.yaml"
    case.write_text(SCANS, encoding="utf-8")
    out = tmp_path / "run.mcap"
    assert scbm("trace", case, "--mcap", out).code == 2
    assert scbm("trace", case, "--model", MODEL, "--mcap", out, "--require", "never scanned_a == true").code == 0
    summary = make_reader(BytesIO(out.read_bytes())).get_summary()
    assert summary is not None
    assert "/requirements/required_1" in [channel.topic for channel in summary.channels.values()]


@pytest.mark.parametrize(
    ("arguments", "head"),
    [
        ((CASE,), "scbm trace: error[bad-option]"),
        ((CASE, "--perfetto", "nowhere/run.json"), "--perfetto: error[bad-option]"),
        ((CASE, "--mcap", "docs"), "--mcap: error[bad-option]"),
        ((CASE, "--mcap", "x/../y", "--perfetto", "y"), "--mcap: error[bad-option]"),
        ((CASE, "--mcap", "y", "--seed", 1), "--seed: error[bad-option]"),
        ((CASE, "--mcap", "y", "--network", "drawn"), "--network: error[bad-option]"),
        ((MODEL, "--mcap", "y", "--case", 1, "--model", MODEL), "--model: error[bad-option]"),
        ((MODEL, "--mcap", "y"), f"{MODEL}:4:1: error[wrong-shape]"),
        ((CASE, "--mcap", "y", "--case", 1), f"{CASE}:2:1: error[wrong-shape]"),
        (("none.yaml", "--mcap", "y"), "none.yaml: error[file-missing]"),
    ],
    ids=[
        "no-format", "no-directory", "a-directory", "one-file-twice", "seed", "network", "model-twice", "no-case",
        "no-model", "no-file",
    ],
)  # fmt: skip
def test_what_is_wrong_is_reported(scbm: Scbm, arguments: tuple[object, ...], head: str, wording: Wording) -> None:
    ran = scbm("trace", *arguments)
    assert (ran.code, ran.out) == (2, "")
    assert diagnostic_heads(ran.err) == [head]
    wording(ran.err)
    assert not Path("y").exists()


def test_without_the_package_mcap_the_message_names_the_command_that_installs_it(
    scbm: Scbm, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in [
        name for name in sys.modules if name == "scbm.reports.run.mcap_trace" or name.partition(".")[0] == "mcap"
    ]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setitem(sys.modules, "mcap", None)
    ran = scbm("trace", CASE, "--mcap", tmp_path / "run.mcap")
    assert (ran.code, diagnostic_heads(ran.err)) == (2, ["--mcap: error[bad-option]"])
    assert "pip install 'scbm[trace]'" in ran.err
    assert scbm("trace", CASE, "--perfetto", tmp_path / "run.json").code == 0


def test_neither_the_case_nor_the_model_is_replaced(scbm: Scbm, tmp_path: Path, wording: Wording) -> None:
    model, case, link = tmp_path / "model.yaml", tmp_path / "case.yaml", tmp_path / "link.yaml"
    model.write_bytes(Path(MODEL).read_bytes())
    case.write_text(f"model: model.yaml\n{SCANS}", encoding="utf-8")
    link.hardlink_to(model)
    before = [path.read_bytes() for path in (model, case)]
    for arguments, options in (
        ((case, "--perfetto", case, "--mcap", link), ["--perfetto", "--mcap"]),
        ((model, "--case", 1, "--perfetto", link), ["--perfetto"]),
    ):
        ran = scbm("trace", *arguments)
        assert (ran.code, ran.out) == (2, "")
        assert diagnostic_heads(ran.err) == [f"{option}: error[bad-option]" for option in options]
        wording(ran.err)
    assert [path.read_bytes() for path in (model, case)] == before
