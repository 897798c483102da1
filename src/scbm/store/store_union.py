"""Combines stores: the result depends neither on their order nor on repetitions (decision 20)."""

from __future__ import annotations

import sqlite3
from contextlib import ExitStack, closing
from dataclasses import dataclass, replace
from functools import cached_property
from os.path import realpath
from typing import TYPE_CHECKING

from scbm.model import Slug
from scbm.store.model_edits import Dropped, ModelEdit, difference
from scbm.store.mutant_tables import MutantTables
from scbm.store.store_file import (
    make_tables,
    open_for_reading,
    overwrite,
    problem,
    replace_store,
    store_errors,
    transaction,
    understood,
)
from scbm.store.store_tables import ModelRow, StoreTotals, Tables, read_history, totals_in

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from scbm.model import BehaviorModel
    from scbm.store.history import History


@dataclass(frozen=True)
class Combined:
    """What came of uniting stores.

    Attributes:
        path: the new store.
        totals: its figures.
        dropped: for each store of an earlier version of the model, what its cases visited and does not count any more.
    """

    path: Path
    totals: StoreTotals
    dropped: tuple[tuple[Path, tuple[Dropped, ...]], ...]

    @cached_property
    def history(self) -> History:
        """What the new store holds, all of it in memory."""
        return read_history(self.path)


def combine_stores(paths: Sequence[Path], target: Path, *, across_edits: bool = False) -> Combined:
    """Unites stores into one, which replaces a store that is there; it may be one of them.

    Args:
        paths: at least one store.
        target: where the union is written to, all of it or nothing.
        across_edits: whether stores of other models are taken; the last one has the model that counts then.

    Raises:
        InputError: one is no store that can be read, or is of another model, or the target cannot be written.
    """
    with ExitStack() as stack:
        opened: dict[str, sqlite3.Connection] = {}
        for path in paths:
            if (place := realpath(path)) not in opened:
                is_exclusive = place == realpath(target)
                opened[place] = stack.enter_context(open_for_reading(path, is_exclusive=is_exclusive))
        stores = [(path, Tables(opened[realpath(path)])) for path in paths]
        models = [_current(path, tables) for path, tables in stores]
        model = models[-1].model()
        if not across_edits:
            _refuse_other_models(paths, models, model)
        with closing(sqlite3.connect("", isolation_level=None)) as united:  # a file of SQLite's own, gone when closed
            make_tables(united)
            union = Tables(united)
            with transaction(united):
                id_ = union.put_model(model)
                edits = [None if row.digest == models[-1].digest else _edit(row, model) for row in models]
                dropped = [_add(union, *store, edit) for store, edit in zip(stores, edits, strict=True)]
                alike = (path for path, edit in zip(paths, edits, strict=True) if edit is None)
                for path in alike:
                    _add_mutations(MutantTables(united), path, MutantTables(opened[realpath(path)]), id_)
            totals = totals_in(union)
            own = opened.get(realpath(target))
            if own is None:
                replace_store(united, target)
            else:
                overwrite(united, own, target)
    lost = zip(paths, edits, dropped, strict=True)
    return Combined(target, totals, tuple((path, dropped) for path, edit, dropped in lost if edit is not None))


def _current(path: Path, tables: Tables) -> ModelRow:
    with store_errors(path), understood(path):
        return next(row for row in tables.models() if row.is_current)


def _edit(before: ModelRow, after: BehaviorModel) -> ModelEdit:
    return ModelEdit(before.model(), after)


def _refuse_other_models(paths: Sequence[Path], models: Sequence[ModelRow], model: BehaviorModel) -> None:
    for path, row in zip(paths, models, strict=True):
        if row.digest != models[-1].digest:
            how = difference(row.name, row.text, model)
            message = f"this store is of another model than {paths[-1]}: {how}"
            remedy = f"with --across-edits, what is unchanged goes over to the model of {paths[-1]}"
            raise problem(Slug.STORE_OTHER_MODEL, path, message, remedy)


def _add(union: Tables, path: Path, tables: Tables, edit: ModelEdit | None) -> tuple[Dropped, ...]:
    """Adds all rows of a store; gives what is lost of it."""
    with store_errors(path), understood(path):
        return _added(union, tables, edit)


def _add_mutations(union: MutantTables, path: Path, tables: MutantTables, model: int) -> None:
    """Adds the results of mutants of a store that has the model of the union."""
    with store_errors(path), understood(path):
        for mutation in tables.mutations():
            union.put_mutation(mutation.suite, model)
            union.put_results(mutation.suite.key, mutation.results)


def _added(union: Tables, tables: Tables, edit: ModelEdit | None) -> tuple[Dropped, ...]:
    models = {
        row.id: union.put_model_text(
            row.digest, row.name, row.text, is_current=row.is_current and edit is None, lifted=row.lifted
        )
        for row in tables.models()
    }
    runs = {}
    for row in tables.runs():
        run = row.run if edit is None else replace(row.run, visited=edit.mapped(row.run.visited))
        runs[row.id] = union.put_run(run, models[row.model])
    for model, certificate in tables.certificates():
        union.put_certificate(certificate, models[model])
    visited = 0
    for case in tables.cases():
        bits = case.visited if edit is None else edit.mapped(case.visited)
        forced = case.forced if edit is None else edit.mapped(case.forced)
        visited |= case.visited
        union.put_case(replace(case, model=models[case.model], run=runs[case.run], visited=bits, forced=forced))
    return () if edit is None else edit.dropped(visited)
