"""From a store to all that it holds."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases.coverage import Obligations
from scbm.files import read_model
from scbm.store.history import History, StoredCase
from scbm.store.store_file import open_for_reading, understood
from scbm.store.store_tables import Tables

if TYPE_CHECKING:
    from pathlib import Path


def read_history(path: Path) -> History:
    """All that a store holds. Raises `InputError` if it is not a store, is empty, damaged, or newer than this scbm."""
    with open_for_reading(path) as connection, understood(path):
        return history_in(Tables(connection))


def history_in(tables: Tables) -> History:
    """The same, of tables that are open. Raises `ValueError` and others for rows that scbm does not write."""
    current = next(row for row in tables.models() if row.is_current)
    runs = tables.runs()
    order = {row.id: index for index, row in enumerate(runs)}
    model = read_model(current.text, current.name)
    if not tables.says_obligations_of(Obligations.of(model)):
        raise ValueError("other obligations than those of the model")
    left_out = tables.outdated()
    cases = [
        StoredCase(
            row.key, row.name, row.recipe, row.goal, order[row.run], row.position,
            row.verdict, row.ended_ns, row.requests, row.visited, row.model != current.id, row.log,
        )
        for row in tables.cases()
        if row.key not in left_out
    ]  # fmt: skip
    if any(case.is_over_nodes and runs[case.run].run.nodes is None for case in cases):
        raise ValueError("a case over nodes of a run that was over none")
    cases.sort(key=lambda case: (case.run, case.position, case.key))
    return History(model, tuple(row.run for row in runs), tuple(cases), len(left_out))
