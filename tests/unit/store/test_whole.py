"""A store after half a write, in another order, and copied: tests that mutants of the package called for."""

from __future__ import annotations

import shutil
import sqlite3
from contextlib import ExitStack
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases import Network
from scbm.cases.trace import End
from scbm.files import write_model
from scbm.model import InputError, Slug
from scbm.store import (
    Drawn,
    ModelSource,
    StoredRun,
    combine_stores,
    digest_of,
    key_of,
    network_words,
    read_history,
    write_store,
)
from scbm.store.store_tables import Tables
from scbm.testing import Failure, FailureKind, Verdict
from support.stores import a_run, cell, results, store

NEW = "operations:\n  first:\n    pre: {g: count == 0}\n    post: {g: true}\n"


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "cov.db"


def _breaking(*_: object, **__: object) -> None:
    raise ZeroDivisionError


def test_an_error_within_an_addition_leaves_nothing_of_it(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store(path, 1, results(1, 2))
    before = read_history(path)
    monkeypatch.setattr(Tables, "add_to_run", _breaking)
    with pytest.raises(ZeroDivisionError):
        store(path, 1, results(2, 1))
    assert read_history(path) == before


def test_an_error_while_a_store_is_made_leaves_none(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Tables, "put_run", _breaking)
    with pytest.raises(ZeroDivisionError):
        store(path, 1, results(1, 1))
    assert list(path.parent.iterdir()) == []


def test_an_empty_store_stays_while_another_process_has_it_open(path: Path) -> None:
    with ExitStack() as first:
        first.enter_context(write_store(path, cell(), a_run(1, cell())))
        with write_store(path, cell(), a_run(2, cell())) as writer:
            first.close()
            for recipe, result in results(1, 1):
                writer.add(1, recipe, result)
    assert len(read_history(path).cases) == 1


def test_while_someone_writes_the_file_is_in_write_ahead_mode(path: Path) -> None:
    with write_store(path, cell(), a_run(1, cell())):
        assert Path(f"{path}-wal").exists()


def test_the_database_of_someone_else_is_not_replaced(path: Path, tmp_path: Path) -> None:
    store(path, 1, results(1, 2))
    other = tmp_path / "other.db"
    with sqlite3.connect(other) as connection:
        connection.execute("CREATE TABLE arc (x)")
    connection.close()
    before = other.read_bytes()
    with pytest.raises(InputError) as caught:
        combine_stores([path], other)
    assert caught.value.diagnostics[0].slug is Slug.NOT_A_STORE
    assert other.read_bytes() == before


@pytest.mark.parametrize("truncated", ["write", "combine"])
def test_a_writer_refuses_what_is_damaged_inside(path: Path, truncated: str, tmp_path: Path) -> None:
    store(path, 1, results(1, 15))
    content = bytearray(path.read_bytes())
    content[4096 * 2 : 4096 * 2 + 64] = b"\xff" * 64
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        store(path, 2, []) if truncated == "write" else combine_stores([path], tmp_path / "all.db")
    assert caught.value.diagnostics[0].slug is Slug.STORE_DAMAGED


def _run_of(token: int, moment: int) -> StoredRun:
    source = ModelSource("cell.yaml", write_model(cell()))
    return StoredRun(f"{token:032x}", f"2026-11-21T12:00:00.{moment:06d}Z", f"scbm test {token}", source)


def test_runs_are_in_the_order_in_which_they_were_added(path: Path) -> None:
    for token, moment in ((3, 1), (9, 2), (2, 2), (1, 3)):
        with write_store(path, cell(), _run_of(token, moment)) as writer:
            writer.add(1, *results(1, 1)[0])
    assert [int(run.id, 16) for run in read_history(path).runs] == [3, 9, 2, 1]
    with write_store(path, cell(), _run_of(1, 3)) as writer:
        assert writer.before is not None
        assert int(writer.before.id, 16) == 2


def test_copies_of_a_store_in_the_middle_of_a_run_are_united_with_it(path: Path, tmp_path: Path) -> None:
    pairs = [(r, replace(d, visited=1 << n, verdict=_failed())) for n, (r, d) in enumerate(results(1, 3))]
    store(path, 1, pairs[:1])
    early = Path(shutil.copy(path, tmp_path / "early.db"))
    with write_store(path, cell(), a_run(1, cell())) as writer:
        for position, pair in enumerate(pairs[1:], start=2):
            writer.add(position, *pair)
    whole = read_history(path)
    assert (whole.runs[0].cases, whole.runs[0].failed, whole.runs[0].visited) == (3, 3, 0b111)
    for order in ([early, path], [path, early]):
        assert combine_stores(order, tmp_path / "all.db").history == whole


def _failed() -> Verdict:
    return Verdict(End.REACHED, (Failure(FailureKind.REQUIREMENT, "safe", "it was not"),))


def test_why_a_case_failed_is_kept(path: Path) -> None:
    (recipe, result), (other, passed) = results(1, 2)
    history = read_history(store(path, 1, [(recipe, replace(result, verdict=_failed())), (other, passed)]))
    assert history.cases[0].verdict == _failed()
    assert history.failed == history.cases[:1]
    with sqlite3.connect(path) as connection:
        reported = connection.execute("SELECT failures FROM test_case ORDER BY position").fetchall()
    connection.close()
    assert reported == [('[["requirement", "safe", "it was not"]]',), (None,)]


@pytest.mark.parametrize(
    "changes",
    [
        {"seed": 2},
        {"number": 2},
        {"network": "drawn"},
        {"requirements": (("safe", "never count == 1"),)},
        {"requirements": (("safe", "never count == 2"),)},
        {"time_limit_ns": 1},
    ],
)
def test_all_that_decides_a_random_case_is_in_its_key(changes: dict[str, object]) -> None:
    recipe = Drawn(1, 1)
    digest = digest_of(cell())
    assert key_of(replace(recipe, **changes), digest) != key_of(recipe, digest)
    assert key_of(recipe, "other") != key_of(recipe, digest)


def test_a_plain_network_is_not_a_drawn_one() -> None:
    assert network_words(Network()) == ""
    assert network_words(None) == "drawn"


def test_across_edits_obligations_go_by_their_names_in_cases_and_in_runs(tmp_path: Path) -> None:
    """A new operation in front gives each obligation another bit; an edited automatic transition does not go over."""
    edited = cell(("operations:\n", NEW), ("scan_req_state == failed && current.state", "current.state"))
    one = store(tmp_path / "1.db", 1, results(1, 12))
    two = store(tmp_path / "2.db", 2, [(r, replace(d, visited=0)) for r, d in results(2, 1)], edited)
    combined = combine_stores([one, two], tmp_path / "all.db", across_edits=True)
    before, after = read_history(one), combined.history
    lost = [name for name in before.obligations.names(before.coverage.visited) if name.startswith("automatic/")]
    names = [name for name in before.obligations.names(before.coverage.visited) if name not in lost]
    assert lost
    assert sorted(after.obligations.names(after.coverage.visited)) == sorted(names)
    assert sorted(after.obligations.names(after.runs[0].visited)) == sorted(names)
    assert [str(d.obligation) for _, dropped in combined.dropped for d in dropped] == lost
    with sqlite3.connect(tmp_path / "all.db") as connection:
        assert connection.execute("SELECT sum(is_current) FROM model").fetchone() == (1,)
    connection.close()
