"""Adds to a store: a run case by case, and the results of mutants one by one. Each is committed at once.

`begin_run` draws a random id. This module is the only one of the store that reads a clock.
"""

from __future__ import annotations

from contextlib import contextmanager
from datetime import UTC, datetime
from typing import TYPE_CHECKING
from uuid import uuid4

from msgspec import Struct
from msgspec.structs import replace

from scbm.cases.coverage import (
    NO_MUTANTS,
    AssertionEvidence,
    Coverage,
    LiftedStatuses,
    MutantStatus,
    Obligations,
    Statuses,
)
from scbm.cases.trace import End
from scbm.files import digest_of
from scbm.model import Slug
from scbm.model.visible_text import shell_word
from scbm.planning import planner_of_random_runs
from scbm.store.history import ModelSource, StoredRun, key_of, sayable
from scbm.store.history_reader import NO_OTHERS, decisions_in, visits_under_other_objects
from scbm.store.model_edits import difference, has_other_objects
from scbm.store.mutant_tables import MutantTables
from scbm.store.packed_logs import MAX_LOG_BYTES, packed_log
from scbm.store.store_file import (
    has_tables,
    make_tables,
    open_for_writing,
    problem,
    show_current_model,
    show_model,
    snapshot,
    store_errors,
    transaction,
    understood,
)
from scbm.store.store_tables import CaseRow, RunCaseRow, Tables, VisitTotals, time_text
from scbm.store.stored_evidence import StoredDecision
from scbm.store.stored_mutants import basis_of, find_evidence

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from scbm.cases.coverage import Figure
    from scbm.model import BehaviorModel, PlannerIdentity, Waiver
    from scbm.store.history import Recipe
    from scbm.store.smallest_cases import SmallestCase
    from scbm.store.store_tables import ModelRow
    from scbm.store.stored_evidence import StoredCertificate
    from scbm.store.stored_mutants import MutatedSuite, StoredMutant
    from scbm.testing import CaseResult
    from scbm.testing.decided_requirements import KnownDecision


def begin_run(
    command: Sequence[str],
    model_path: str,
    model_text: str,
    nodes: str | None = None,
    waivers: Sequence[Waiver] = (),
) -> StoredRun:
    """Return a new run with a unique id and the current time.

    Args:
        command: the arguments of the command line.
        model_path: the path of the model file, as reports show it.
        model_text: the content of the model file.
        nodes: a description of the nodes that run the cases; `None` for simulation.
        waivers: the waivers that count in the run.
    """
    source = ModelSource(sayable(model_path), model_text)
    words = sayable(" ".join(map(shell_word, command)))
    return StoredRun(uuid4().hex, time_now(), words, source, nodes=nodes, waivers=tuple(waivers))


def time_now() -> str:
    """Return the current time in UTC, as stores have it."""
    return time_text(datetime.now(UTC))


_MAX_NS = 2**63 - 1


@contextmanager
def write_store(path: Path, model: BehaviorModel, run: StoredRun) -> Iterator[StoreWriter]:
    """Open a store, or create it, and add a run of a model to it.

    Several processes may add to one store at the same time. A run is stored with its first case, and marked as
    finished when the block ends without an error.

    Raises:
        InputError: the file is not a store, is damaged, of another version, of another model, or cannot be written.
    """
    with open_for_writing(path) as connection:
        writer = StoreWriter(connection, path, model, run)
        yield writer
        writer.finish()


class StoreWriter:
    """Adds the cases of one run.

    Attributes:
        before: the last run that was finished before this one began, as it was then; `None` if there was none.
        lost: how many cases were not added, as their runs were not finished.
        later_start: if the clock went back, the latest time at which an earlier run began by it; else `None`.
    """

    def __init__(self, connection: sqlite3.Connection, path: Path, model: BehaviorModel, run: StoredRun) -> None:
        self._connection = connection
        self._path = path
        self._model = model
        self._run = run
        self._digest = digest_of(model)
        self._obligations = Obligations.of(model)
        self._tables = Tables(connection)
        self._ids: tuple[int, int] | None = None
        self._certificates: tuple[StoredCertificate, ...] = ()
        self._is_whole = True
        self._keys: dict[bytes, None] | None = None
        self._visited = 0
        self.lost = 0
        with store_errors(path), understood(path), snapshot(connection):
            has_runs = has_tables(connection, path)
            self.before = self._last_finished() if has_runs else None
            newest = self._tables.newest_start() if has_runs else None
            if has_runs and MutantTables(connection).has_mutations():
                self._keys = {}
        # Another process may have begun since this run did, so the time now counts.
        self.later_start = newest if newest is not None and newest > max(run.started, time_now()) else None

    def _last_finished(self) -> StoredRun | None:
        """Return the last finished run of the model; raise `InputError` if the store is of another model."""
        refuse_another_model(self._path, self._tables.models(), self._model, self._digest)
        if not self._shows_own_model():
            return None
        runs = [row.run for row in self._tables.runs() if row.run.is_finished and row.run.id != self._run.id]
        return runs[-1] if runs else None

    def _shows_own_model(self) -> bool:
        """Present the rows of the model alone, to be called in a snapshot; return whether the store has the model."""
        is_known = any(row.digest == self._digest for row in self._tables.models())
        show_current_model(self._connection)
        show_model(self._connection, self._digest, self._obligations)
        return is_known

    def keep_certificates(self, certificates: Sequence[StoredCertificate]) -> None:
        """Add certificates of the model with the first case of the run."""
        self._certificates = tuple(certificates)

    def add(
        self,
        position: int,
        recipe: Recipe,
        result: CaseResult,
        log: str | None = None,
        planner: PlannerIdentity | None = None,
    ) -> None:
        """Add a case that has been run, or unite it with what is known of it.

        One whose run was not finished is not added, and then the run of all of them is not finished either.

        Args:
            position: its place in the run, from 1.
            recipe: what decides it.
            result: what came of it.
            log: of a run over nodes the text of its log.
            planner: the planner of a run over nodes, as its controller reported it; `None` for that of the model.

        Raises:
            InputError: the store cannot be written any more.
        """
        if result.verdict.end is End.LOST:
            self.lost += 1
            return
        self._is_whole = False
        if result.ended_ns > _MAX_NS:
            message = f"the run of `{result.case.name}` takes more than 292 years, which a store cannot hold"
            raise problem(Slug.STORE_UNUSABLE, self._path, message)
        packed = None if log is None else self._packed(result.case.name, log)
        with store_errors(self._path), understood(self._path), transaction(self._connection):
            planner = planner or planner_of_random_runs(self._model)
            ids = self._ids or self._begun(planner)
            key, case = key_of(recipe, self._digest, planner.words), result.case
            row = CaseRow(
                key, case.name, case.goal_names, *ids, position, recipe,
                result.verdict, result.ended_ns, result.requests, result.visited, packed, result.forced,
                result.excluded, hazards=result.hazards, unjudged=result.unjudged,
            )  # fmt: skip
            failed = not result.verdict.passed
            self._tables.put_case(row)
            self._tables.put_run_case(RunCaseRow(ids[1], key, case.name, failed, result.visited))
            self._tables.add_to_run(ids[1], result.visited, failed=failed)
        self._visited |= result.visited
        if self._keys is not None:
            self._keys[key] = None
        self._ids = ids
        self._is_whole = True

    def _packed(self, name: str, log: str) -> bytes:
        try:
            return packed_log(log)
        except ValueError:
            message = f"the log of `{name}` is larger than {MAX_LOG_BYTES // 1024**2} MiB, which a store cannot hold"
            raise problem(Slug.STORE_UNUSABLE, self._path, message) from None

    def _begun(self, planner: PlannerIdentity) -> tuple[int, int]:
        """Return the ids of the model and of the run, which are there then. To be called in a transaction."""
        make_tables(self._connection, self._path)
        refuse_another_model(self._path, self._tables.models(), self._model, self._digest)  # others may be faster
        model = self._tables.put_model(self._model)
        for certificate in self._certificates:
            self._tables.put_certificate(certificate, model)
        run = replace(self._run, planner=str(planner), order_time=self._tables.order_time(self._run))
        return model, self._tables.put_run(run, model)

    def finish(self) -> None:
        """Note that the run came to its end, if it has cases and all of them were added."""
        if self._ids is not None and self._is_whole and not self.lost:
            with store_errors(self._path), transaction(self._connection):
                self._tables.finish_run(self._ids[1])

    def decisions(self) -> tuple[KnownDecision, ...]:
        """Return the answers of the last closing of the model about requirements."""
        with store_errors(self._path), understood(self._path), snapshot(self._connection):
            if not has_tables(self._connection, self._path) or not self._shows_own_model():
                return ()
            current = next(row.id for row in self._tables.models() if row.digest == self._digest)
            planner, goals = planner_of_random_runs(self._model).name, self._model.runs.goals
            return decisions_in(self._tables, current, planner, goals)

    def evidence(self) -> AssertionEvidence:
        """Return what the store says about the obligations that the cases of the run visit, or why it says nothing.

        Only results of mutants count that were in the store when the run began.
        """
        if self._keys is None:
            return AssertionEvidence(None, NO_MUTANTS)
        with store_errors(self._path), understood(self._path), snapshot(self._connection):
            self._shows_own_model()
            mutations = MutantTables(self._connection).mutations()
        return find_evidence(mutations, self._keys, self._obligations, self._visited, basis_of(self._model))

    def totals(self) -> StoreFigures:
        """Return the figures of all cases of the store together, those of others that write included."""
        with store_errors(self._path), understood(self._path), snapshot(self._connection):
            totals, others = VisitTotals(0, 0, 0), NO_OTHERS
            if has_tables(self._connection, self._path):
                if self._shows_own_model():
                    totals = self._tables.totals()
                others = visits_under_other_objects(self._connection, self._model)
        coverage = Coverage(self._obligations, (("", totals.visited),))
        lifted = LiftedStatuses.of(self._model, Statuses.of(coverage, forced=totals.forced), others)
        return StoreFigures(totals.cases, coverage.figure, lifted)


def keep_smallest(path: Path, run: StoredRun, smallest: Mapping[str, Sequence[SmallestCase]]) -> None:
    """Add the smallest cases that were found after a run to its failed cases, by their names. Raise `InputError`."""
    with open_for_writing(path) as connection, store_errors(path), transaction(connection):
        for name, found in smallest.items():
            Tables(connection).put_smallest(run.id, name, found)


def keep_decisions(path: Path, model: BehaviorModel, decisions: Sequence[KnownDecision]) -> None:
    """Add the answers of closing about requirements to a store, or to a new one.

    Raises:
        InputError: the file is not a store, is damaged, of another version, of another model, or cannot be written.
    """
    with open_for_writing(path) as connection, store_errors(path), understood(path), transaction(connection):
        make_tables(connection, path)
        tables, digest = Tables(connection), digest_of(model)
        refuse_another_model(path, tables.models(), model, digest)
        row, closed = tables.put_model(model, keeps_current=True), time_now()
        planner, goals = planner_of_random_runs(model).name, model.runs.goals
        for each in decisions:
            tables.put_decision(StoredDecision(each, planner, goals, closed), row, digest)


def refuse_store(path: Path, model: BehaviorModel) -> None:
    """Raise `InputError` if `keep_decisions` cannot add the answers about a model to a store; a new one is not made."""
    with open_for_writing(path) as connection, store_errors(path), understood(path):
        if has_tables(connection, path):
            refuse_another_model(path, Tables(connection).models(), model, digest_of(model))


class StoreFigures(Struct, frozen=True):
    """The figures of all cases of a store.

    Attributes:
        cases: the number of cases of the model.
        figure: SCBM-IAS of them together.
        lifted: the statuses of lifted obligations, as visits alone decide them; `None` for a model without parameters.
    """

    cases: int
    figure: Figure
    lifted: LiftedStatuses | None


def refuse_another_model(path: Path, rows: Sequence[ModelRow], model: BehaviorModel, digest: str) -> None:
    """Raise `InputError` if a store is of another model, unless that is the same lifted model under other objects.

    Args:
        path: the store.
        rows: its models; none if it is empty.
        model: the model.
        digest: the digest of the model.
    """
    current = next((row for row in rows if row.is_current), None)
    if current is None or current.digest == digest:
        return
    own = next((row for row in rows if row.digest == digest), None)
    if own is None and has_other_objects(current.object_lists, model):
        return
    if own is not None and own.obligations_of == digest:  # it was added under its own objects before
        return
    message = f"this store is of another model than this one: {difference(current.name, current.text, model)}"
    remedy = (
        "use a store of its own; `scbm combine OLD NEW -o FILE --across-edits` keeps the visits that are still valid"
    )
    raise problem(Slug.STORE_OTHER_MODEL, path, message, remedy)


@contextmanager
def write_mutants(path: Path, model: BehaviorModel, suite: MutatedSuite) -> Iterator[MutantWriter]:
    """Open a store, or create it, to add results of mutants.

    Raises:
        InputError: the file is not a store, is damaged, of another version, of another model, or cannot be written.
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
                show_current_model(connection)
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
                make_tables(self._connection, self._path)
                models = Tables(self._connection)
                refuse_another_model(self._path, models.models(), self._model, digest_of(self._model))
                tables.put_mutation(self._suite, models.put_model(self._model, keeps_current=True))
            tables.put_results(self._suite.key, [result])
        self._is_begun = True
