"""What only a process of its own can show: same bytes under every hash seed, and pipes that end early."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[3]
BEFORE = "examples/robot_in_the_air/before.yaml"


def _scbm(*arguments: str, hash_seed: int = 0, code: int = 0) -> bytes:
    environment = {**os.environ, "PYTHONHASHSEED": str(hash_seed)}
    command = [sys.executable, "-m", "scbm", *arguments]
    done = subprocess.run(command, cwd=ROOT, env=environment, check=False, stdout=subprocess.PIPE)
    assert done.returncode == code
    return done.stdout


@pytest.mark.slow
def test_a_campaign_is_the_same_bytes_under_every_hash_seed() -> None:
    reports = {_scbm("test", BEFORE, "--cases", "20", "--seed", "1", "--json", hash_seed=seed) for seed in (0, 1, 2)}
    assert len(reports) == 1


@pytest.mark.slow
def test_a_trace_is_the_same_bytes_under_every_hash_seed() -> None:
    runs = {_scbm("run", BEFORE, "--case", "3", "--seed", "1", "--json", hash_seed=seed) for seed in (0, 1, 2)}
    assert len(runs) == 1


@pytest.mark.slow
def test_saved_and_small_cases_are_the_same_bytes_under_every_hash_seed(tmp_path: Path) -> None:
    home = "always gantry_req_state == executing -> robot_at == home"
    written = []
    for seed in (0, 1, 2):
        out = tmp_path / str(seed)
        arguments = ("--cases", "12", "--seed", "3", "--network", "drawn", "--require", home)
        _scbm("test", BEFORE, *arguments, "--save", str(out), "--failures", str(out), hash_seed=seed, code=1)
        written.append([(path.name, path.read_bytes()) for path in sorted(out.iterdir())])
    assert len(written[0]) == 14  # twelve cases, a small one, and the record of what failed
    assert written[0] == written[1] == written[2]


@pytest.mark.slow
def test_a_reader_that_has_seen_enough_is_no_fault() -> None:
    command = [sys.executable, "-m", "scbm", "run", BEFORE, "--case", "1", "--json"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.read(1)
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait() == 0


@pytest.mark.slow
def test_a_closed_pipe_does_not_look_like_failed_tests() -> None:
    command = [sys.executable, "-m", "scbm", "run", BEFORE, "--case", "1"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        process.stdout.close()
        assert process.wait() == 0


@pytest.mark.slow
@pytest.mark.parametrize("more", [(), ("--json",)])
def test_a_closed_pipe_does_not_hide_that_tests_failed(more: tuple[str, ...], tmp_path: Path) -> None:
    failing = ("test", BEFORE, "--require", "never robot_at == agv", "--failures", str(tmp_path), *more)
    command = [sys.executable, "-m", "scbm", *failing]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        process.stdout.close()
        assert process.stderr.read() == b""
        assert process.wait() == 1


@pytest.mark.slow
def test_a_closed_pipe_does_not_hide_that_the_input_is_wrong() -> None:
    command = [sys.executable, "-m", "scbm", "test", "nowhere.yaml"]
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        assert process.stderr is not None
        process.stderr.close()
        assert process.wait() == 2


@pytest.mark.slow
def test_an_output_that_is_not_utf8_is_no_fault() -> None:
    environment = {**os.environ, "PYTHONIOENCODING": "cp1252"}
    command = [sys.executable, "-m", "scbm", "test", BEFORE, "--cases", "2"]
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, check=False)
    assert (done.returncode, done.stderr) == (0, b"")
    assert b"SCBM-IAS" in done.stdout


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device here")
@pytest.mark.parametrize(
    "argument",
    [
        pytest.param("--version", id="when the buffer is flushed"),
        pytest.param("schema", id="when the buffer is full", marks=pytest.mark.slow),
    ],
)
def test_a_full_disk_is_reported_in_a_line(argument: str) -> None:
    command = [sys.executable, "-m", "scbm", argument]
    with Path("/dev/full").open("wb") as full:
        done = subprocess.run(command, cwd=ROOT, stdout=full, stderr=subprocess.PIPE, check=False)
    assert done.returncode == 2
    assert done.stderr == b"scbm: cannot write the output: no space left on device\n"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device here")
@pytest.mark.parametrize("is_all_full", [False, True], ids=["stderr", "both"])
@pytest.mark.parametrize(
    "arguments",
    [
        pytest.param(("check", "nowhere.yaml"), id="an error"),
        pytest.param(("nonsense",), id="no such verb", marks=pytest.mark.slow),
        pytest.param(("report", "nowhere.db", "--nonsense"), id="no such option", marks=pytest.mark.slow),
    ],
)
def test_what_cannot_be_written_to_a_full_disk_ends_with_2(arguments: tuple[str, ...], *, is_all_full: bool) -> None:
    with Path("/dev/full").open("wb") as full:
        out = full if is_all_full else subprocess.DEVNULL
        command = [sys.executable, "-m", "scbm", *arguments]
        assert subprocess.run(command, cwd=ROOT, stdout=out, stderr=full, check=False).returncode == 2


@pytest.mark.slow
@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no full device here")
def test_a_report_that_cannot_be_written_to_two_full_disks_ends_with_2() -> None:
    command = [sys.executable, "-m", "scbm", "test", BEFORE, "--cases", "2"]
    with Path("/dev/full").open("wb") as full:
        assert subprocess.run(command, cwd=ROOT, stdout=full, stderr=full, check=False).returncode == 2
