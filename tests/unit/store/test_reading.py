"""Files that are no store, or not whole: one clear line each, and never a traceback."""

from __future__ import annotations

import os
import random
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from scbm.model import Diagnostic, InputError, Slug
from scbm.store import combine_stores, read_history, write_store
from scbm.store.store_tables import CaseRow, Tables
from support.stores import a_run, cell, results, store
from support.wording import Wording


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return store(tmp_path / "cov.db", 1, results(1, 15))


def _complaint(path: Path) -> tuple[Slug, str]:
    with pytest.raises(InputError) as caught:
        read_history(path)
    (found,) = caught.value.diagnostics
    assert found.place.file == str(path)
    assert "\n" not in found.message
    return found.slug, found.message


def test_a_store_that_is_not_there(tmp_path: Path) -> None:
    assert _complaint(tmp_path / "cov.db")[0] is Slug.FILE_MISSING


def test_a_directory(tmp_path: Path) -> None:
    assert _complaint(tmp_path)[0] is Slug.FILE_IS_DIRECTORY


@pytest.mark.parametrize("content", [b"behavior_model: cell\n", b"\0" * 4096, b"PK\3\4", b"SQLite format 2\0"])
def test_not_a_store_at_all(path: Path, content: bytes, wording: Wording) -> None:
    path.write_bytes(content)
    slug, message = _complaint(path)
    assert slug is Slug.NOT_A_STORE
    wording(message)
    assert path.read_bytes() == content


def test_the_database_of_someone_else(path: Path) -> None:
    path.unlink()
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE file (id)")
    other.close()
    assert _complaint(path)[0] is Slug.NOT_A_STORE


def _refusal(use: Callable[[], object]) -> Diagnostic:
    with pytest.raises(InputError) as caught:
        use()
    (found,) = caught.value.diagnostics
    return found


@pytest.mark.parametrize("version", [0, 1, 17, 18, 20])
def test_a_store_of_another_version_is_refused_and_stays_as_it_is(path: Path, version: int, wording: Wording) -> None:
    with sqlite3.connect(path) as other:
        other.execute(f"PRAGMA user_version = {version}")
    other.close()
    before = path.read_bytes()
    new = store(path.with_name("new.db"), 1, results(1, 1))
    uses: list[Callable[[], object]] = [
        lambda: read_history(path),
        lambda: store(path, 2, results(1, 1)),
        lambda: combine_stores([new, path], path.with_name("all.db")),
        lambda: combine_stores([new], path),
    ]
    found = [_refusal(use) for use in uses]
    assert [(each.slug, str(each.place)) for each in found] == [(Slug.FORMAT_VERSION, str(path))] * len(uses)
    assert path.read_bytes() == before
    wording(found[0])


@pytest.mark.parametrize("content", [b"", None], ids=["no bytes", "no tables"])
def test_a_store_to_which_nothing_was_added(path: Path, content: bytes | None) -> None:
    path.write_bytes(b"")
    if content is None:
        with sqlite3.connect(path) as empty:
            empty.execute("PRAGMA journal_mode = WAL")
        empty.close()
    assert _complaint(path)[0] is Slug.STORE_EMPTY


def test_a_truncated_store_at_every_length(path: Path) -> None:
    """Wherever it is cut off: no traceback, and no part of it passes for the whole."""
    whole = path.read_bytes()
    lengths = [*range(1, 200, 7), *range(200, len(whole), 1013), len(whole) - 1]
    for length in lengths:
        path.write_bytes(whole[:length])
        slug, message = _complaint(path)
        assert slug in (Slug.STORE_DAMAGED, Slug.NOT_A_STORE), (length, message)
        assert (slug is Slug.NOT_A_STORE) == (length < 16), (length, message)


@pytest.mark.slow
def test_bytes_that_were_changed_are_complained_of_or_read(path: Path) -> None:
    """SQLite has no checksums, so damage can go unnoticed; what it may not do is to end in a fault of scbm."""
    whole = path.read_bytes()
    chance = random.Random(1)
    complaints = 0
    for _ in range(120):
        damaged = bytearray(whole)
        begin = chance.randrange(100, len(whole))
        for place in range(begin, min(len(whole), begin + chance.choice([1, 4, 64]))):
            damaged[place] = chance.randrange(256)
        path.write_bytes(damaged)
        try:
            read_history(path)
        except InputError:
            complaints += 1
    assert complaints > 10


def test_a_damaged_store_is_not_combined_nor_added_to(path: Path, tmp_path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-4096])
    for attempt in (
        lambda: combine_stores([path], tmp_path / "all.db"),
        lambda: store(path, 2, results(1, 1)),
    ):
        with pytest.raises(InputError) as caught:
            attempt()
        assert caught.value.diagnostics[0].slug is Slug.STORE_DAMAGED
    assert not (tmp_path / "all.db").exists()


def test_reading_leaves_the_file_as_it_was(path: Path) -> None:
    before = path.read_bytes()
    read_history(path)
    assert path.read_bytes() == before
    assert [found.name for found in path.parent.iterdir()] == ["cov.db"]


def test_a_store_is_read_while_someone_writes(path: Path) -> None:
    model = cell()
    with write_store(path, model, a_run(2, model)) as writer:
        (recipe, result), *_ = results(2, 1)
        writer.add(1, recipe, result)
        assert len(read_history(path).cases) == 16


def test_a_view_reports_in_sql_what_was_visited(path: Path) -> None:
    history = read_history(path)
    with sqlite3.connect(path) as connection:
        rows = connection.execute("SELECT test_case, obligation FROM visit ORDER BY test_case, obligation").fetchall()
    connection.close()
    expected = [(case.name, name) for case in history.cases for name in history.obligations.names(case.visited)]
    assert rows == sorted(expected)


def test_what_is_read_is_of_one_moment(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A run that begins between two queries is in none of them."""
    cases = Tables.cases

    def cases_after_another_run(tables: Tables) -> Iterator[CaseRow]:
        store(path, 2, results(2, 2))
        return cases(tables)

    with write_store(path, cell(), a_run(3, cell())):  # in write-ahead mode no writer waits for a reader
        before = read_history(path)
        monkeypatch.setattr(Tables, "cases", cases_after_another_run)
        assert read_history(path) == before


@pytest.mark.parametrize(
    "change",
    [
        "UPDATE test_case SET visited = zeroblob(20) || x'01'",
        "UPDATE test_case SET visited = x'ffffffff'",
        "UPDATE run SET visited = x'ffffffff'",
        "UPDATE run SET started = 'yesterday'",
        "UPDATE run SET command = x'ff'",
        "UPDATE run SET cases = 'two'",
        "UPDATE source SET path = x'ff'",
        "UPDATE test_case SET name = x'ff'",
        "UPDATE test_case SET ended_ns = x'ff'",
        "UPDATE run SET planner = NULL",
        "UPDATE model SET obligations_of = NULL",
    ],
)
def test_rows_that_no_store_has_are_damage(path: Path, tmp_path: Path, change: str) -> None:
    """Else each report fails in its own way, some of them with a traceback."""
    with sqlite3.connect(path) as connection:
        connection.execute(change)
    connection.close()
    assert _complaint(path)[0] is Slug.STORE_DAMAGED
    with pytest.raises(InputError):
        combine_stores([path], tmp_path / "all.db")


def test_a_store_whose_writer_was_killed_is_one_plain_file_when_it_has_been_read(tmp_path: Path) -> None:
    """In write-ahead mode SQLite cannot open it from where nothing can be written."""
    path = tmp_path / "cov.db"
    child = os.fork()
    if not child:
        with write_store(path, cell(), a_run(1, cell())) as writer:
            writer.add(1, *results(1, 1)[0])
            os._exit(0)
    os.waitpid(child, 0)
    assert path.with_name("cov.db-wal").exists()
    read_history(path)
    assert [found.name for found in tmp_path.iterdir()] == ["cov.db"]
    assert path.read_bytes()[18:20] == bytes([1, 1]), "the versions of the format that the header asks for"
