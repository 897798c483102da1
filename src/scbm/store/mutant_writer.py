"""Adds the results of mutants to a store, each as soon as it is known, and gives those that it has (decision 52)."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from scbm.cases.coverage import Obligations
from scbm.files import digest_of
from scbm.store.mutant_tables import MutantTables
from scbm.store.store_file import (
    has_tables,
    make_tables,
    open_for_writing,
    show_as_newest,
    show_model,
    snapshot,
    store_errors,
    transaction,
    understood,
)
from scbm.store.store_tables import Tables
from scbm.store.store_writer import refuse_another_model
from scbm.testing.mutants import MutantStatus

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Iterator
    from pathlib import Path

    from scbm.model import BehaviorModel
    from scbm.store.stored_mutants import MutatedSuite, StoredMutant


@contextmanager
def write_mutants(path: Path, model: BehaviorModel, suite: MutatedSuite) -> Iterator[MutantWriter]:
    """Open a store, or create it, to add results of mutants.

    Raises:
        InputError: the file is not a store, is damaged, newer, of another model, or cannot be written.
    """
    with open_for_writing(path) as connection:
        yield MutantWriter(connection, path, model, suite)


class MutantWriter:
    """Adds the results of the mutants of one suite.

    Attributes:
        known: the results that the store has for this suite, by the names of the mutants.
        decisions: the results that the store has for mutants of the same model which no case killed, by their names and
            the limits of the search.
    """

    def __init__(self, connection: sqlite3.Connection, path: Path, model: BehaviorModel, suite: MutatedSuite) -> None:
        self._connection = connection
        self._path = path
        self._model = model
        self._suite = suite
        self._is_begun = False
        self.known: dict[str, StoredMutant] = {}
        self.decisions: dict[str, dict[str, StoredMutant]] = {}
        with store_errors(path), understood(path), snapshot(connection):
            if has_tables(connection, path):
                digest = digest_of(model)
                models = Tables(connection).models()
                refuse_another_model(path, models, model, digest)
                show_as_newest(connection)
                show_model(connection, digest, Obligations.of(model))
                if any(row.digest == digest for row in models):
                    self._read()

    def _read(self) -> None:
        for mutation in MutantTables(self._connection).mutations():
            suite = mutation.suite
            if suite.key == self._suite.key:
                self.known = {result.name: result for result in mutation.results}
            if (suite.basis, suite.made_by) == (self._suite.basis, self._suite.made_by):
                for result in mutation.results:
                    if result.limits is not None and result.status is not MutantStatus.KILLED:
                        self.decisions.setdefault(result.name, {})[result.limits] = result

    def add(self, result: StoredMutant) -> None:
        """Add a result, which is then in the store even if the process is killed. Raise `InputError`."""
        with store_errors(self._path), understood(self._path), transaction(self._connection):
            tables = MutantTables(self._connection)
            if not self._is_begun:
                make_tables(self._connection)
                models = Tables(self._connection)
                refuse_another_model(self._path, models.models(), self._model, digest_of(self._model))
                tables.put_mutation(self._suite, models.put_model(self._model, keeps_current=True))
            tables.put_results(self._suite.key, [result])
        self._is_begun = True
