"""Combines stores: the result depends neither on their order nor on repetitions (decision 20).

Of several models the last one counts, and those of the same lifted model keep their own cases (decision 55).
"""

from __future__ import annotations

import sqlite3
from contextlib import ExitStack, closing
from functools import cached_property
from os.path import realpath
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import Obligations
from scbm.model import Slug
from scbm.store.history_reader import StoreTotals, other_models, read_history, totals_in
from scbm.store.model_edits import Dropped, ModelEdit, difference, has_other_objects
from scbm.store.mutant_tables import MutantTables
from scbm.store.store_file import (
    make_tables,
    open_for_reading,
    overwrite,
    problem,
    replace_store,
    show_current_model,
    show_model,
    snapshot,
    store_errors,
    transaction,
    understood,
)
from scbm.store.store_tables import ModelRow, Tables

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence
    from pathlib import Path

    from scbm.model import BehaviorModel
    from scbm.store.history import History


class Combined(Struct, frozen=True, dict=True):
    """The result of uniting stores.

    Attributes:
        path: the new store.
        totals: its figures.
        dropped: for each store of an earlier version of the model, what its cases visited and does not count any more.
        apart: the stores of the same lifted model under other objects.
        left_out: the number of cases of each store that ran under other objects on an earlier version of the model.
    """

    path: Path
    totals: StoreTotals
    dropped: tuple[tuple[Path, tuple[Dropped, ...]], ...]
    apart: tuple[Path, ...] = ()
    left_out: tuple[tuple[Path, int], ...] = ()

    @cached_property
    def history(self) -> History:
        """The content of the new store, all of it in memory."""
        return read_history(self.path)


class _OpenStore(Struct, frozen=True):
    """A store to unite, as it was opened.

    Attributes:
        path: its file.
        connection: shows its rows; of several models those of one.
        current: its current model.
    """

    path: Path
    connection: sqlite3.Connection
    current: ModelRow

    def parts(self) -> Iterator[ModelRow]:
        """Yield the models with cases of their own, the current one first; each is shown as it is yielded."""
        yield self.current
        for row in other_models(self.connection, self.current.digest):
            show_model(self.connection, row.digest, Obligations.of(row.model()))
            yield row
        show_model(self.connection, self.current.digest, Obligations.of(self.current.model()))


def combine_stores(paths: Sequence[Path], target: Path, *, across_edits: bool = False) -> Combined:
    """Unite stores into one, which replaces a store that is there; it may be one of them.

    Args:
        paths: at least one store.
        target: where the union is written to, all of it or nothing.
        across_edits: whether stores of other models are taken; the last one has the model that counts then.

    Raises:
        InputError: one is no store that can be read, or is of another model, or the target cannot be written.
    """
    places = {realpath(path): path for path in reversed(paths)}  # a store counts once, at its last place
    with ExitStack() as stack:
        opened: dict[str, sqlite3.Connection] = {}
        for place, path in reversed(places.items()):
            is_exclusive = place == realpath(target)
            opened[place] = stack.enter_context(open_for_reading(path, is_exclusive=is_exclusive))
        stores = [
            _OpenStore(places[place], each, _current(places[place], Tables(each))) for place, each in opened.items()
        ]
        model = stores[-1].current.model()
        if not across_edits:
            _refuse_other_models(stores, model)
        with closing(sqlite3.connect("", isolation_level=None)) as united:  # a file of SQLite's own, gone when closed
            make_tables(united, target)
            union = _Union(united, model, stores[-1].current.digest, is_across=across_edits)
            with transaction(united):
                Tables(united).put_model(model)
                for each in stores:
                    union.add(each)
            with snapshot(united):
                show_current_model(united)
                totals = totals_in(united)
            own = opened.get(realpath(target))
            if own is None:
                replace_store(united, target)
            else:
                overwrite(united, own, target)
    return Combined(target, totals, tuple(union.dropped), tuple(union.apart), tuple(union.left_out.items()))


def _current(path: Path, tables: Tables) -> ModelRow:
    with store_errors(path), understood(path):
        return next(row for row in tables.models() if row.is_current)


def _refuse_other_models(stores: Sequence[_OpenStore], model: BehaviorModel) -> None:
    last = stores[-1]
    for store in stores:
        row = store.current
        if row.digest == last.current.digest or has_other_objects(row.object_lists, model):
            continue
        message = f"this store is of another model than {last.path}: {difference(row.name, row.text, model)}"
        remedy = f"with --across-edits, visits that are still valid count for the model of {last.path}"
        raise problem(Slug.STORE_OTHER_MODEL, store.path, message, remedy)


class _Union:
    """The union of stores while it is made.

    Attributes:
        dropped: as in `Combined`.
        apart: as in `Combined`.
        left_out: as in `Combined`, by the path of the store.
    """

    def __init__(self, united: sqlite3.Connection, model: BehaviorModel, digest: str, *, is_across: bool) -> None:
        self.dropped: list[tuple[Path, tuple[Dropped, ...]]] = []
        self.apart: list[Path] = []
        self.left_out: dict[Path, int] = {}
        self._united = united
        self._model = model
        self._digest = digest
        self._is_across = is_across

    def add(self, store: _OpenStore) -> None:
        """Add all rows of a store whose model is the same lifted model, and of its current model."""
        with store_errors(store.path), understood(store.path):
            for row in store.parts():
                self._add_part(store, row)

    def _add_part(self, store: _OpenStore, row: ModelRow) -> None:
        """Add the rows of one model of a store, which is shown."""
        if row.digest == self._digest:
            self._copy(store, row, None)
        elif row is store.current and self._is_across:
            edit = ModelEdit(row.model(), self._model)
            self.dropped.append((store.path, self._copy(store, row, edit)))
        elif self._is_same_lifted(row):
            self._copy(store, row, None)
            self.apart += [store.path] if row is store.current else []
        else:
            cases = Tables(store.connection).totals().cases
            self.left_out[store.path] = self.left_out.get(store.path, 0) + cases

    def _is_same_lifted(self, row: ModelRow) -> bool:
        own, other = self._model.objects, row.object_lists
        return own is not None and other is not None and own.lifted == other.lifted

    def _copy(self, store: _OpenStore, row: ModelRow, edit: ModelEdit | None) -> tuple[Dropped, ...]:
        """Add the shown rows of a store; return what is lost of them.

        Args:
            store: the store.
            row: the shown model.
            edit: the edit that leads to the model that counts; `None` if the cases keep their own obligations.
        """
        owner = self._digest if edit is not None else row.digest
        tables, union = Tables(store.connection), Tables(self._united)
        union.use(Obligations.of(self._model if edit is not None else row.model()))
        models = {}
        for each in tables.models():
            self._refuse_two_owners(store, each, owner)
            is_current = each.digest == self._digest
            models[each.id] = union.put_model_row(replace(each, is_current=is_current, obligations_of=owner))
        dropped = _add_runs(union, tables, models, edit)
        if edit is None:
            _add_mutations(MutantTables(self._united), MutantTables(store.connection), models[row.id])
        return dropped

    def _refuse_two_owners(self, store: _OpenStore, row: ModelRow, owner: str) -> None:
        """Raise `InputError` if cases of one model count for it in one store, and for an edited one in another."""
        known = self._united.execute("SELECT obligations_of FROM model WHERE digest = ?", (row.digest,)).fetchone()
        if known is not None and known[0] != owner:
            message = "cases of one model count for themselves in one of these stores, and across edits in another one"
            remedy = "combine them with --across-edits"
            raise problem(Slug.STORE_OTHER_MODEL, store.path, message, remedy)


def _add_mutations(union: MutantTables, tables: MutantTables, model: int) -> None:
    """Add the results of mutants of a model; its row in the union has the id `model`."""
    for mutation in tables.mutations():
        union.put_mutation(mutation.suite, model)
        union.put_results(mutation.suite.key, mutation.results)


def _add_runs(union: Tables, tables: Tables, models: dict[int, int], edit: ModelEdit | None) -> tuple[Dropped, ...]:
    """Add runs, certificates, decisions, and cases with their results in each run; return what an edit loses."""
    runs = {}
    for row in tables.runs():
        run = row.run if edit is None else replace(row.run, visited=edit.mapped(row.run.visited))
        runs[row.id] = union.put_run(run, models[row.model])
    for model, certificate in tables.certificates():
        union.put_certificate(certificate, models[model])
    digests = {row.id: row.digest for row in tables.models()}
    for model, decision in tables.decisions():
        union.put_decision(decision, models[model], digests[model])
    visited = 0
    for case in tables.cases():
        bits = case.visited if edit is None else edit.mapped(case.visited)
        forced = case.forced if edit is None else edit.mapped(case.forced)
        visited |= case.visited
        union.put_case(replace(case, model=models[case.model], run=runs[case.run], visited=bits, forced=forced))
    for each in tables.run_cases():
        bits = each.visited if edit is None else edit.mapped(each.visited)
        union.put_run_case(replace(each, run=runs[each.run], visited=bits))
    return () if edit is None else edit.dropped(visited)
