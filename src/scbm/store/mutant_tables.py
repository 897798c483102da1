"""Reads and writes the rows of a store about mutants. Of two rows for one mutant the one with a decision stays."""

from __future__ import annotations

from hashlib import sha256
from typing import TYPE_CHECKING

from scbm.cases.coverage import MutantStatus
from scbm.store.stored_mutants import KEY_BYTES, MutatedSuite, StoredMutant, StoredMutation, read_limits

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Iterable

_COLUMNS = "name, status, test_case, reason, runs, skipped, belongs, noticed, limits, witness, is_benign, is_killable"


class MutantTables:
    """The tables `mutation` and `mutant` of one store, which has its model."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection

    def mutations(self) -> tuple[StoredMutation, ...]:
        """Return all suites with their results, in the order of their keys.

        Raises `ValueError` and others for foreign rows.
        """
        rows = self._connection.execute(
            "SELECT key, basis, oracle, made_by, cases, mutants, started FROM mutation ORDER BY key"
        )
        return tuple(_mutation(row, self.results(row[0])) for row in rows.fetchall())

    def has_mutations(self) -> bool:
        """Return whether there is any suite."""
        count: int = self._connection.execute("SELECT count(*) FROM mutation").fetchone()[0]
        return count > 0

    def results(self, key: bytes) -> tuple[StoredMutant, ...]:
        """Return the results of the suite with a key, in the order of their names."""
        query = f"SELECT {_COLUMNS} FROM mutant WHERE mutation = ? ORDER BY name"  # noqa: S608 - our own columns
        return tuple(map(_result, self._connection.execute(query, (key,))))

    def put_mutation(self, suite: MutatedSuite, model: int) -> None:
        """Add a suite; if it is there, the later beginning counts."""
        self._connection.execute(
            "INSERT INTO mutation (key, model, basis, oracle, made_by, cases, mutants, started)"
            " VALUES (?, ?, ?, ?, ?, ?, ?, ?)"
            " ON CONFLICT (key) DO UPDATE SET started = max(started, excluded.started)",
            (
                *(suite.key, model, suite.basis, suite.oracle, suite.made_by),
                *(b"".join(suite.cases), suite.mutants, suite.started),
            ),
        )

    def put_results(self, suite: bytes, results: Iterable[StoredMutant]) -> None:
        """Add results of a suite. If a mutant has one, the one of the higher rank stays."""
        for result in results:
            key = sha256(suite + result.name.encode()).digest()[:KEY_BYTES]
            query = f"SELECT {_COLUMNS} FROM mutant WHERE key = ?"  # noqa: S608 - our own columns
            known = self._connection.execute(query, (key,)).fetchone()
            if known is None or _result(known).rank < result.rank:
                self._connection.execute(
                    f"INSERT OR REPLACE INTO mutant (key, mutation, {_COLUMNS})"  # noqa: S608 - our own columns
                    " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                    (key, suite, *_row(result)),
                )


def _row(result: StoredMutant) -> tuple[object, ...]:
    return (
        *(result.name, result.status.value, result.case, result.reason, result.runs, result.skipped),
        *(_bytes(result.belongs), _bytes(result.noticed), result.limits, result.witness),
        *(result.is_benign, result.is_killable),
    )


def _bytes(bits: int) -> bytes:
    return bits.to_bytes((bits.bit_length() + 7) // 8, "little")


def _result(row: tuple[object, ...]) -> StoredMutant:
    name, status, case, reason, runs, skipped, belongs, noticed, limits, witness, is_benign, is_killable = row
    return StoredMutant(
        *(_text(name), MutantStatus(_text(status)), _text(case), _text(reason), _number(runs), _number(skipped)),
        *(_bits(belongs), _bits(noticed), _limits(limits), _text_or_none(witness)),
        *(bool(is_benign), bool(is_killable)),
    )


def _mutation(row: tuple[object, ...], results: tuple[StoredMutant, ...]) -> StoredMutation:
    key, basis, oracle, made_by, cases, mutants, started = row
    if not isinstance(cases, bytes) or len(cases) % KEY_BYTES:
        raise ValueError("these are no keys of cases")
    keys = tuple(cases[begin : begin + KEY_BYTES] for begin in range(0, len(cases), KEY_BYTES))
    suite = MutatedSuite(_text(basis), _text(oracle), keys, _number(mutants), _text(started), _text(made_by))
    if suite.key != key:
        raise ValueError("this is the key of another suite")
    return StoredMutation(suite, results)


def _text(value: object) -> str:
    """Return a text of a row. Raise `ValueError` if it is none, as after damage."""
    if not isinstance(value, str):
        raise ValueError("this is no text")  # noqa: TRY004 - it is data
    return value


def _text_or_none(value: object) -> str | None:
    return None if value is None else _text(value)


def _limits(value: object) -> str | None:
    """Return limits of a row as text; `None` if there are none. Raise `ValueError` if the text has no limits."""
    text = _text_or_none(value)
    if text is not None:
        read_limits(text)
    return text


def _number(value: object) -> int:
    """Return a number of a row. Raise `ValueError` if it is none."""
    if not isinstance(value, int):
        raise ValueError("this is no number")  # noqa: TRY004 - it is data
    return value


def _bits(value: object) -> int:
    """Return a set of a row. Raise `ValueError` if it is none."""
    if not isinstance(value, bytes):
        raise ValueError("this is no set")  # noqa: TRY004 - it is data
    return int.from_bytes(value, "little")
