"""Adding a run to a store, case by case. Each case is there as soon as it is added, whatever happens next."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from scbm.coverage import Figure, Obligations
from scbm.errors import Slug
from scbm.storing.database import make_tables, open_for_writing, problem, told, transaction
from scbm.storing.edits import difference
from scbm.storing.history import digest_of, key_of
from scbm.storing.tables import CaseRow, Tables

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Iterator
    from pathlib import Path

    from scbm.model import BehaviorModel
    from scbm.storing.history import Recipe, Run
    from scbm.testing import CaseResult

_MOST_NS = 2**63 - 1


@contextmanager
def write_store(path: Path, model: BehaviorModel, run: Run) -> Iterator[StoreWriter]:
    """A store to which a run of a model is added; it is made if there is none.

    Several processes may add to one store at the same time, also cases of one run.

    Raises:
        InputError: the file is not a store, is damaged, newer, of another model, or cannot be written.
    """
    with open_for_writing(path) as connection:
        yield StoreWriter(connection, path, model, run)


class StoreWriter:
    """Adds the cases of one run.

    Attributes:
        before: the last run that began before this one, as it was then; `None` if there was none.
    """

    def __init__(self, connection: sqlite3.Connection, path: Path, model: BehaviorModel, run: Run) -> None:
        self._connection = connection
        self._path = path
        self._digest = digest_of(model)
        self._obligations = Obligations.of(model)
        self._tables = Tables(connection)
        with told(path), transaction(connection):
            make_tables(connection)
            self._refuse_other_model(model)
            self._model = self._tables.put_model(model)
            others = [row.run for row in self._tables.runs() if row.run.id != run.id]
            self.before = others[-1] if others else None
            self._run = self._tables.put_run(run, self._model)

    def add(self, position: int, recipe: Recipe, result: CaseResult) -> None:
        """Adds a case that has been run, or unites it with what is known of it.

        Args:
            position: its place in the run, from 1.
            recipe: what decides it.
            result: what came of it.

        Raises:
            InputError: the store cannot be written any more.
        """
        if result.ended_ns > _MOST_NS:
            message = f"the run of `{result.case.name}` takes more than 292 years, which a store cannot hold"
            raise problem(Slug.STORE_UNUSABLE, self._path, message)
        key = key_of(recipe, self._digest)
        case = result.case
        row = CaseRow(
            key, case.name, case.goal, self._model, self._run, position, recipe,
            result.verdict, result.ended_ns, result.requests, result.visited,
        )  # fmt: skip
        with told(self._path), transaction(self._connection):
            self._tables.put_case(row)
            self._tables.add_to_run(self._run, result.visited, failed=not result.verdict.passed)

    def totals(self) -> tuple[int, Figure]:
        """How many cases the store has, and the figure of all of them together, those of others that write included."""
        with told(self._path):
            cases, visited = self._tables.totals()
        counted = self._obligations.counted
        return cases, Figure((visited & counted).bit_count(), counted.bit_count())

    def _refuse_other_model(self, model: BehaviorModel) -> None:
        known = next((row for row in self._tables.models() if row.is_current), None)
        if known is not None and known.digest != self._digest:
            message = f"this store is of another model than this one: {difference(known.name, known.text, model)}"
            remedy = (
                "use a store of its own; `scbm combine OLD NEW -o FILE --across-edits` takes over what is unchanged"
            )
            raise problem(Slug.STORE_OTHER_MODEL, self._path, message, remedy)
