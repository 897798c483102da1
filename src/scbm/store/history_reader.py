"""Reads what a store holds: the cases of its current model, and the visits of the same lifted model."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import Coverage, LiftedStatuses, ObjectListVisits, Obligations, Statuses, Unnamed, bits_of
from scbm.files import digest_of
from scbm.model import PlannerIdentity, Slug
from scbm.planning import planner_of_random_runs
from scbm.store.history import History, StoredCase, label_of
from scbm.store.mutant_tables import MutantTables
from scbm.store.store_file import open_for_reading, problem, show_model, understood
from scbm.store.store_tables import ADD_CASES, ModelRow, Tables
from scbm.store.stored_mutants import mutations_in_words

if TYPE_CHECKING:
    import sqlite3
    from pathlib import Path

    from scbm.model import BehaviorModel, GoalOrder
    from scbm.testing.decided_requirements import KnownDecision


_DECISIONS = "answers of `scbm close` about requirements"

NO_OTHERS: tuple[ObjectListVisits, ...] = ()
"""The visits under other objects of a store with one model."""


def read_history(path: Path) -> History:
    """Return the content of a store. Raises `InputError` if it is none, or empty, damaged, or of another version."""
    with open_for_reading(path) as connection, understood(path):
        tables = Tables(connection)
        if all(row.run.is_earlier for row in tables.runs()):
            mutations = MutantTables(connection).mutations()
            has_decisions = any(True for _ in tables.decisions())
            found = _DECISIONS if has_decisions and not mutations else mutations_in_words(mutations)
            raise problem(Slug.STORE_EMPTY, path, f"this store has no cases yet, only {found}", ADD_CASES)
        history = replace(history_in(tables), mutations=MutantTables(connection).mutations())
        return replace(history, others=visits_under_other_objects(connection, history.model))


def history_in(tables: Tables) -> History:
    """Return the content of open tables. Raises `ValueError` and others for rows that scbm does not write."""
    current = next(row for row in tables.models() if row.is_current)
    runs = tables.runs()
    order = {row.id: index for index, row in enumerate(runs)}
    model = current.model()
    if not tables.says_obligations_of(Obligations.of(model)):
        raise ValueError("other obligations than those of the model")
    left_out = tables.outdated()
    cases = [
        StoredCase(
            row.key, row.name, row.recipe, row.goal, order[row.run], row.position,
            row.verdict, row.ended_ns, row.requests, row.visited, row.model != current.id, row.log, row.forced,
            row.excluded, row.smallest, row.hazards, row.unjudged,
        )
        for row in tables.cases()
        if row.key not in left_out
    ]  # fmt: skip
    if any(case.is_over_nodes and runs[case.run].run.nodes is None for case in cases):
        raise ValueError("a case over nodes of a run that was over none")
    cases.sort(key=lambda case: (case.run, case.position, case.key))
    certificates = tuple(certificate for _, certificate in tables.certificates())
    runs_of = tuple(row.run for row in runs)
    history = History(model, runs_of, tuple(cases), len(left_out), certificates)
    planners = [row.run.planner for row in runs if not row.run.is_earlier]
    planner = PlannerIdentity.parse(planners[-1]) if planners else planner_of_random_runs(model)
    return replace(history, decisions=decisions_in(tables, current.id, planner.name, model.runs.goals))


def decisions_in(tables: Tables, current: int, planner: str, goals: GoalOrder) -> tuple[KnownDecision, ...]:
    """Return the answers of the last closing about these runs of a model; `current` is the id of its row."""
    about = (current, planner, goals)
    return tuple(each.decision for of, each in tables.decisions() if (of, each.planner, each.goals) == about)


class StoreTotals(Struct, frozen=True):
    """The figures of a store, in memory that does not grow with its number of cases.

    Attributes:
        model: the model.
        runs: the number of runs.
        cases: the number of cases that count.
        coverage: what they visited; only the first visitor of each obligation has a name there.
        lifted: the statuses of lifted obligations, as visits alone decide them; `None` for a model without parameters.
    """

    model: BehaviorModel
    runs: int
    cases: int
    coverage: Coverage
    lifted: LiftedStatuses | None = None


def totals_in(connection: sqlite3.Connection) -> StoreTotals:
    """Return the figures of an open store. Raise `ValueError` and others for rows that scbm does not write.

    To be called after `show_current_model`.
    """
    tables = Tables(connection)
    current = next(row for row in tables.models() if row.is_current)
    model = current.model()
    obligations = Obligations.of(model)
    if not tables.says_obligations_of(obligations):
        raise ValueError("other obligations than those of the model")
    left_out = tables.outdated()
    rest, cases, union = [0] * len(obligations.all), 0, 0
    first: list[tuple[bytes, str, int]] = []
    for key, name, visited in tables.visits():
        if key in left_out:
            continue
        cases += 1
        if visited & ~union:
            first.append((key, name, visited))
            union |= visited
        else:
            for bit in bits_of(visited):
                rest[bit] += 1
    names = dict.fromkeys((name for _, name, _ in first), 0)
    for key, name, _ in tables.visits():
        if name in names and key not in left_out:
            names[name] += 1
    named = tuple((label_of(name, key, names[name]), visited) for key, name, visited in first)
    coverage = Coverage(obligations, named, Unnamed(cases - len(first), tuple(rest)))
    others = visits_under_other_objects(connection, model)
    lifted = LiftedStatuses.of(model, Statuses.of(coverage, forced=tables.totals().forced), others)
    return StoreTotals(model, len(tables.runs()), cases, coverage, lifted)


def other_models(connection: sqlite3.Connection, digest: str) -> tuple[ModelRow, ...]:
    """Return the models of a store that have cases of their own, without the one with a digest.

    They are in the order of their objects. To be called after `show_current_model`.
    """
    rows = connection.execute(
        "SELECT id, digest, name, text, is_current, lifted, objects, obligations_of FROM main.model"
        " WHERE digest != ? AND objects IS NOT NULL AND digest = obligations_of"
        " ORDER BY objects, digest",
        (digest,),
    )
    return tuple(ModelRow(*row) for row in rows)


def visits_under_other_objects(connection: sqlite3.Connection, model: BehaviorModel) -> tuple[ObjectListVisits, ...]:
    """Return what the cases of the same lifted model visited under other objects (semantics 8.7).

    Afterwards the store shows `model` again. Raise `ValueError` and others for rows that scbm does not write.
    """
    digest = digest_of(model)
    if model.objects is None:
        return NO_OTHERS
    found: list[ObjectListVisits] = []
    for row in other_models(connection, digest):
        if row.object_lists is None or row.object_lists.lifted != model.objects.lifted:
            continue
        other = row.model()
        show_model(connection, row.digest, Obligations.of(other))
        totals = Tables(connection).totals()
        if totals.cases:
            found.append(ObjectListVisits.of(other, totals.cases, totals.visited, totals.forced))
    show_model(connection, digest, Obligations.of(model))
    return tuple(found)
