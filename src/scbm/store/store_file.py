"""Open a store file, report errors of the file in one line each, and let writers share it (decision 20)."""

from __future__ import annotations

import sqlite3
from contextlib import closing, contextmanager, suppress
from os.path import lexists
from typing import TYPE_CHECKING

from scbm.files import open_input
from scbm.model import Diagnostic, InputError, Place, Slug, refuse_other_version
from scbm.store import store_schema

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from scbm.cases.coverage import Obligations

_PATIENCE_S = 60
"""Timeout of a writer that waits for the lock of another, whose transactions take milliseconds."""

_START = b"SQLite format 3\0"

NO_RUN = "no run has added anything to this store"
ADD_RUNS = "`scbm test MODEL --store FILE` adds to it"
"""The message and the remedy for a store without cases."""


@contextmanager
def open_for_reading(path: Path, *, is_exclusive: bool = False) -> Iterator[sqlite3.Connection]:
    """Open a store that has at least one run. Raises `InputError` if the file is missing, damaged or not a store.

    Args:
        path: the file.
        is_exclusive: whether to lock out all other processes until it is closed, as it is going to be replaced.
    """
    with store_errors(path):
        _refuse_other_files(path, must_exist=True)
        connection = _connect(path)
        try:
            if is_exclusive:
                _lock_exclusively(connection, path)
            with snapshot(connection):
                if not has_tables(connection, path):
                    raise problem(Slug.STORE_EMPTY, path, NO_RUN, ADD_RUNS)
                _refuse_cut_off(connection, path)
                _refuse_damage(connection, path)
                show_current_model(connection)
                yield connection
            _set_journal(connection, "DELETE")  # a writer that was killed has left it in write-ahead mode
        finally:
            _close(connection)


@contextmanager
def open_for_writing(path: Path) -> Iterator[sqlite3.Connection]:
    """Open a store, or create an empty database. Raises `InputError` if the file is damaged or not a store.

    While a writer is open, the file is in write-ahead mode: transactions are quick, and none waits for a disk.
    A new file that nothing was added to is removed in the end, for example on a disk that is full.
    """
    with store_errors(path):
        _refuse_other_files(path, must_exist=False)
        is_new = not lexists(path)
        connection = _connect(path)
    try:
        with store_errors(path):
            _prepare(connection, path)
            if not lexists(path):  # see `_remove_empty`
                message = "another process removed this store, which was empty, while it was opened"
                raise problem(Slug.STORE_UNUSABLE, path, message, "run the command again")
        yield connection
    finally:
        _set_journal(connection, "DELETE")
        _close(connection)
        if is_new:
            _remove_empty(path)


def _prepare(connection: sqlite3.Connection, path: Path) -> None:
    with snapshot(connection):
        has_tables(connection, path)  # refuses a file of another program before anything is written
        _refuse_cut_off(connection, path)
    with transaction(connection):
        pass  # fails here if the file is read-only
    _set_journal(connection, "WAL")
    connection.execute("PRAGMA synchronous = NORMAL")
    _refuse_damage(connection, path)


def make_tables(connection: sqlite3.Connection, path: Path) -> None:
    """Create the tables if there are none; to be called in the transaction that fills them."""
    if has_tables(connection, path):
        return
    for statement in store_schema.creation():
        connection.execute(statement)


def show_current_model(connection: sqlite3.Connection) -> None:
    """Present the rows of the current model as if it were the only one, until the current transaction ends."""
    for statement in store_schema.views_of_a_model():
        connection.execute(statement)


def show_model(connection: sqlite3.Connection, digest: str, obligations: Obligations) -> None:
    """Present the rows of one model of a store as if it were the only one; to be called after `show_current_model`.

    Args:
        connection: the store.
        digest: the digest of the model; a store without it has no rows then.
        obligations: its obligations.
    """
    connection.execute("UPDATE shown SET digest = ?", (digest,))
    connection.execute("DELETE FROM other_obligation")
    is_current = connection.execute("SELECT is_current FROM main.model WHERE digest = ?", (digest,)).fetchone()
    if is_current is None or not is_current[0]:
        connection.executemany(
            "INSERT INTO other_obligation (bit, name, counts) VALUES (?, ?, ?)",
            [(bit, str(obligation), obligation.counts) for bit, obligation in enumerate(obligations)],
        )


@contextmanager
def transaction(connection: sqlite3.Connection) -> Iterator[None]:
    """Run a write transaction: all of it is committed or none, even if the process is killed in between."""
    connection.execute("BEGIN IMMEDIATE")
    try:
        yield
        connection.execute("COMMIT")
    except BaseException:
        if connection.in_transaction:  # a full disk has ended it already
            connection.execute("ROLLBACK")
        raise


@contextmanager
def snapshot(connection: sqlite3.Connection) -> Iterator[None]:
    """Run a read transaction: all queries see one snapshot of the store, whatever other processes write."""
    connection.execute("BEGIN")
    try:
        yield
    finally:
        if connection.in_transaction:
            connection.execute("ROLLBACK")  # nothing was written to the file


def _lock_exclusively(connection: sqlite3.Connection, path: Path) -> None:
    """Lock a store for one connection until that is closed. Raises `sqlite3.Error` if another process keeps it open.

    A writer whose store is replaced would not find its run again, and lose its cases.
    """
    has_tables(connection, path)  # refuses a file of another program before anything is written
    connection.execute("PRAGMA locking_mode = EXCLUSIVE")
    connection.execute("PRAGMA journal_mode = DELETE")
    connection.execute("BEGIN EXCLUSIVE")
    connection.execute("COMMIT")  # the lock stays


def overwrite(content: sqlite3.Connection, target: sqlite3.Connection, path: Path) -> None:
    """Copy a database into a store that is locked exclusively, in one transaction. Raises `InputError`."""
    with store_errors(path):
        if target.in_transaction:
            target.execute("COMMIT")
        content.backup(target)


def replace_store(content: sqlite3.Connection, path: Path) -> None:
    """Copy a database into a store that is not open, or does not exist yet. Raises `InputError`."""
    with store_errors(path):
        _refuse_other_files(path, must_exist=False)
        is_new = not lexists(path)
        target = _connect(path)
        try:
            _lock_exclusively(target, path)
            overwrite(content, target, path)
        finally:
            _close(target)
            if is_new:
                _remove_empty(path)


def problem(slug: Slug, path: Path, message: str, remedy: str | None = None) -> InputError:
    """Return the error for one problem of a store."""
    return InputError([Diagnostic(slug, message, Place(str(path)), remedy)])


def _connect(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(path, timeout=_PATIENCE_S, isolation_level=None)


def _remove_empty(path: Path) -> None:
    """Remove a closed store that this process made if it has no tables, unless another process writes to it.

    A writer has a file beside the store from when it has opened the store. One that opens it right now finds that the
    store is gone.
    """
    if any(lexists(f"{path}{ending}") for ending in ("-wal", "-journal")):
        return
    with suppress(sqlite3.Error, OSError, InputError):  # the error that matters is reported by then
        uri = f"{path.absolute().as_uri()}?immutable=1"  # works on a disk that is full, too
        with closing(sqlite3.connect(uri, uri=True, isolation_level=None)) as connection:
            is_filled = has_tables(connection, path)
        if not is_filled:
            path.unlink()


def _close(connection: sqlite3.Connection) -> None:
    try:
        connection.close()
    except sqlite3.Error:  # the error that matters is reported by then
        return


def _set_journal(connection: sqlite3.Connection, mode: str) -> None:
    """Switch the journal mode if no other process uses the file; all modes are safe, some are slower."""
    try:
        connection.execute(f"PRAGMA journal_mode = {mode}")
    except sqlite3.Error:
        return


def _refuse_other_files(path: Path, *, must_exist: bool) -> None:
    """Raise `InputError` unless the first bytes are those of SQLite, which must not open other files."""
    try:
        with open_input(path) as stream:
            start = stream.read(len(_START))
    except FileNotFoundError:
        if must_exist:
            remedy = "`scbm test MODEL --store FILE` makes one"
            raise problem(Slug.FILE_MISSING, path, "there is no such file", remedy) from None
        if not path.parent.is_dir():
            message = f"this store cannot be made: there is no directory `{path.parent}`"
            raise problem(Slug.STORE_UNUSABLE, path, message) from None
        return
    except IsADirectoryError:
        raise problem(Slug.FILE_IS_DIRECTORY, path, "this is a directory, and a store is a file") from None
    if start and start != _START:
        raise _not_a_store(path)


def _not_a_store(path: Path) -> InputError:
    remedy = "a store is made by `scbm test MODEL --store FILE`"
    return problem(Slug.NOT_A_STORE, path, "this is not a coverage store", remedy)


def has_tables(connection: sqlite3.Connection, path: Path) -> bool:
    """Return whether the store has tables; an empty database has none. Raises `InputError` for other databases."""
    application = connection.execute("PRAGMA application_id").fetchone()[0]
    is_empty = connection.execute("SELECT count(*) FROM sqlite_schema").fetchone()[0] == 0
    if is_empty and not application:
        return False
    if application != store_schema.APPLICATION_ID:
        raise _not_a_store(path)
    remedy = "remove it or name another file, and run the cases again: `scbm test MODEL --store FILE`"
    version = connection.execute("PRAGMA user_version").fetchone()[0]
    refuse_other_version("coverage store", version, store_schema.TABLES_VERSION, Place(str(path)), remedy)
    return True


def _refuse_cut_off(connection: sqlite3.Connection, path: Path) -> None:
    """Raise `InputError` if the end of the file is missing; SQLite forgives a part of the last page.

    To be called in a transaction, which keeps writers away meanwhile. In write-ahead mode the rest may be in the file
    beside this one.
    """
    if connection.execute("PRAGMA journal_mode").fetchone()[0] == "wal":
        return
    (pages,), (size,) = (connection.execute(f"PRAGMA {what}").fetchone() for what in ("page_count", "page_size"))
    has = path.stat().st_size
    if has < pages * size:
        raise _damaged(path, f"it should have {pages * size} bytes and has {has}")


def _refuse_damage(connection: sqlite3.Connection, path: Path) -> None:
    """Raise `InputError` if parts of the file do not fit each other."""
    found = connection.execute("PRAGMA quick_check(1)").fetchone()[0]
    if found != "ok":
        raise _damaged(path, found)


def _damaged(path: Path, detail: str) -> InputError:
    remedy = "the cases can be run again, or it can be taken from a backup"
    words = " ".join(detail.split()).removeprefix("*** in database main *** ")
    return problem(Slug.STORE_DAMAGED, path, f"this store is damaged or cut off: {words}", remedy)


@contextmanager
def understood(path: Path) -> Iterator[None]:
    """Turn errors of rows that no scbm writes into `InputError`: the file is damaged, or another program wrote it."""
    try:
        yield
    except InputError as error:
        if error.diagnostics[0].place.file == str(path):
            raise  # an error of the store itself
        raise _damaged(path, "it has rows that scbm does not write") from None
    except (ValueError, TypeError, LookupError, AttributeError, StopIteration):
        raise _damaged(path, "it has rows that scbm does not write") from None


_DAMAGE = (sqlite3.SQLITE_ERROR, sqlite3.SQLITE_CORRUPT, sqlite3.SQLITE_NOTADB)
"""Error codes of SQLite for missing tables, inconsistent parts and pages that are not of a database."""


@contextmanager
def store_errors(path: Path) -> Iterator[None]:
    """Turn errors of SQLite and the file system into `InputError`."""
    try:
        yield
    except sqlite3.Error as error:
        if getattr(error, "sqlite_errorcode", sqlite3.SQLITE_ERROR) in _DAMAGE:
            raise _damaged(path, str(error)) from None
        raise problem(Slug.STORE_UNUSABLE, path, f"this store cannot be used: {error}") from None
    except UnicodeDecodeError:
        raise _damaged(path, "a text in it is not UTF-8") from None
    except OSError as error:
        reason = (error.strerror or str(error)).lower()
        raise problem(Slug.STORE_UNUSABLE, path, f"this store cannot be used: {reason}") from None
