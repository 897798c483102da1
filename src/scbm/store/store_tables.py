"""Reads and writes the rows of a store. Where a row exists already, the two are united; in which order does not matter.

`read_history` reads all that a store holds.
"""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from hashlib import sha256
from typing import TYPE_CHECKING, Any, TypeAlias

from msgspec import Struct
from msgspec.structs import asdict, replace

from scbm.cases.coverage import (
    Obligations,
)
from scbm.cases.trace import End
from scbm.files import digest_of, read_model, write_model
from scbm.model import GoalOrder, LiftedOrigin, ObjectLists, PlannerChoice, PlannerIdentity
from scbm.model.json_reader import convert_json, read_json
from scbm.store.history import Drawn, ModelSource, Recipe, StoredRun, Written
from scbm.store.packed_logs import unpacked_log
from scbm.store.smallest_cases import SmallestCase, read_smallest_text, smallest_text
from scbm.store.store_schema import TABLES
from scbm.store.stored_evidence import (
    StoredCertificate,
    StoredDecision,
    other_plans_text,
    read_certificate_row,
    read_excuses_text,
    read_hazards_text,
    read_other_plans_text,
    read_waivers_text,
)
from scbm.testing import Failure, FailureKind, Unjudged, Verdict
from scbm.testing.decided_requirements import KnownDecision, RequirementStatus

if TYPE_CHECKING:
    import sqlite3
    from collections.abc import Iterator, Sequence

    from scbm.model import BehaviorModel
    from scbm.running.simulation.device_hazards import Hazard


_CASE_COLUMNS = (
    "key, name, goal, model, run, position, setting, seed, number, text, path,"
    " ended, failures, ended_ns, requests, visited, log, forced"
)

ADD_CASES = "`scbm test MODEL CASES --store FILE` adds cases; `scbm mutate` with the same cases lists the mutants"
"""The remedy for a store that has results of mutants alone."""

_MAX_ORIGINS_CHARACTERS = 64 * 1024 * 1024
"""The maximum length of the origins of a model; a store that holds longer ones is damaged."""

_MAX_JSON_CHARACTERS = 16 * 1024 * 1024
"""The maximum length of a JSON text in a column; a store that holds a longer one is damaged."""

_NEXT = timedelta(microseconds=1)
"""Between the order times of two runs, at least."""

Row: TypeAlias = tuple[Any, ...]


class ModelRow(Struct, frozen=True):
    """A model that cases of a store were run on."""

    id: int
    digest: str
    name: str
    text: str
    is_current: bool
    lifted: str | None
    objects: str | None
    obligations_of: str

    def model(self) -> BehaviorModel:
        """Return the model. Raise `InputError`, `ValueError` and others for a text that scbm does not write."""
        return replace(read_model(self.text, self.name), origins=_origins(self.lifted), objects=self.object_lists)

    @property
    def object_lists(self) -> ObjectLists | None:
        """The objects of the model file; `None` if it has none. Raises `ValueError` and others for other texts."""
        return None if self.objects is None else _objects(self.objects)


class RunRow(Struct, frozen=True):
    """A run as it stands in the table: `model` is the id of a row there."""

    id: int
    model: int
    run: StoredRun


class CaseRow(Struct, frozen=True):
    """A case as it stands in the table: `model`, `run` are ids of rows there; the rest is as in `StoredCase`."""

    key: bytes
    name: str
    goal: str
    model: int
    run: int
    position: int
    recipe: Recipe
    verdict: Verdict
    ended_ns: int
    requests: int
    visited: int
    log: bytes | None
    forced: int = 0
    excluded: int = 0
    smallest: tuple[SmallestCase, ...] = ()
    hazards: tuple[Hazard, ...] = ()
    unjudged: Unjudged | None = None


class RunCaseRow(Struct, frozen=True):
    """What came of a case in one run: `run` is the id of a row there, `key` and `name` are those of the case."""

    run: int
    key: bytes
    name: str
    failed: bool
    visited: int


class VisitTotals(Struct, frozen=True):
    """The union of the visits of the cases of a store.

    Attributes:
        cases: the number of cases that count.
        visited: the obligations that they visited, as bits.
        forced: those of them that they visited only after states were forced, as bits.
    """

    cases: int
    visited: int
    forced: int


class Tables:
    """The tables of one store."""

    def __init__(self, connection: sqlite3.Connection) -> None:
        self._connection = connection
        self._width = 0
        self._settings: dict[object, int] = {}

    # what is read

    def models(self) -> tuple[ModelRow, ...]:
        """All models; one of them is the current one. Raises `ValueError` for foreign rows."""
        rows = self._connection.execute(
            "SELECT id, digest, name, text, is_current, lifted, objects, obligations_of FROM model ORDER BY id"
        )
        return tuple(
            ModelRow(id_, digest, name, text, bool(current), _text_or_none(lifted), _text_or_none(objects), _text(of))
            for id_, digest, name, text, current, lifted, objects, of in rows
        )

    def runs(self) -> tuple[RunRow, ...]:
        """All runs, in the order in which they were added. Raises `ValueError` and others for foreign rows."""
        count = self._obligations()
        rows = self._connection.execute(
            "SELECT run.id, model, is_current, token, started, command, path, source.text,"
            " visited, cases, failed, is_finished, nodes, planner, order_time, waivers"
            " FROM run JOIN source ON source.id = run.source JOIN model ON model.id = run.model"
            " ORDER BY coalesce(order_time, started), token"
        )
        return tuple(
            RunRow(
                id_,
                model,
                StoredRun(
                    _text(token),
                    _moment(began),
                    _text(command),
                    ModelSource(_text(path), _text(text)),
                    _known(visited, count),
                    _number(cases),
                    _number(failed),
                    is_earlier=not current,
                    is_finished=bool(finished),
                    nodes=_text_or_none(more[0]),
                    planner=str(PlannerIdentity.parse(_text(more[1]))),
                    order_time=None if more[2] is None else _moment(more[2]),
                    waivers=read_waivers_text(more[3]),
                ),
            )
            for id_, model, current, token, began, command, path, text, visited, cases, failed, finished, *more in rows
        )

    def cases(self) -> Iterator[CaseRow]:
        """All cases, in the order of their keys. Raises `ValueError` and others for foreign rows."""
        count = self._obligations()
        settings = {
            id_: _options(text) for id_, text in self._connection.execute("SELECT id, options FROM setting ORDER BY id")
        }
        more = "excuses, excluded, smallest, hazards, unjudged"
        rows = self._connection.execute(f"SELECT {_CASE_COLUMNS}, {more} FROM test_case ORDER BY key")  # noqa: S608 - our own
        for row in rows:
            key, name, goal, model, run, position, setting, seed, number, text, path, *result = row
            recipe = _recipe(settings[setting], seed, number, text, path)
            ended, failures, ended_ns, requests, visited, log, forced, excuses, *others = result
            excluded, smallest, hazards, unjudged = others
            verdict = Verdict(End(ended), _failures(failures), read_excuses_text(excuses))
            bits = _known(visited, count)
            _refuse_another_log(log, recipe)
            yield CaseRow(
                key, _text(name), _text(goal), model, run, _number(position), recipe,
                verdict, _number(ended_ns), _number(requests), bits, log, _known(forced or b"", count),
                _number(excluded or 0), read_smallest_text(smallest), read_hazards_text(hazards),
                None if unjudged is None else Unjudged(unjudged),
            )  # fmt: skip

    def run_cases(self) -> Iterator[RunCaseRow]:
        """Yield what came of each case in each run. Raise `ValueError` for foreign rows."""
        count = self._obligations()
        rows = self._connection.execute(
            "SELECT run_case.run, key, name, failed, run_case.visited"
            " FROM run_case JOIN test_case ON key = test_case ORDER BY run_case.run, key"
        )
        for run, key, name, failed, visited in rows:
            yield RunCaseRow(run, key, _text(name), bool(_number(failed)), _known(visited, count))

    def certificates(self) -> Iterator[tuple[int, StoredCertificate]]:
        """Yield each certificate with the id of its model, in the order of their names."""
        rows = self._connection.execute(
            "SELECT model, is_current, certificate.name, certificate.text, checked_by, claims"
            " FROM certificate JOIN model ON model.id = certificate.model ORDER BY certificate.name, key"
        )
        for model, is_current, name, packed, checked_by, claims in rows:
            row = (_text(name), packed, _text(checked_by), _text(claims))
            yield model, read_certificate_row(row, is_earlier=not is_current)

    def decisions(self) -> Iterator[tuple[int, StoredDecision]]:
        """Yield each answer about a requirement with the id of its model, in the order of their names."""
        rows = self._connection.execute(
            "SELECT model, planner, goals, name, is_built_in, status, reason, test_case, undeclared, file, other_plans,"
            " closed FROM decision ORDER BY name, is_built_in, key"
        )
        for model, planner, goals, name, is_built_in, status, reason, case, undeclared, file, others, closed in rows:
            texts = _text(name), bool(is_built_in), RequirementStatus(status), _text(reason), _text(case)
            other_plans = read_other_plans_text(others)
            if other_plans is not None:
                other_plans = replace(other_plans, is_kept=self._has_case(other_plans.case))
            more = tuple(_text(undeclared).split()), _text(file), other_plans, self._has_case(_text(case))
            yield model, StoredDecision(KnownDecision(*texts, *more), _text(planner), GoalOrder(goals), _moment(closed))

    def _has_case(self, name: str) -> bool:
        """Return whether there is a case with a name."""
        return bool(name) and self._connection.execute(
            "SELECT EXISTS (SELECT 1 FROM test_case WHERE name = ?)", (name,)
        ).fetchone() == (1,)

    def visits(self) -> Iterator[tuple[bytes, str, int]]:
        """Yield key, name and visited obligations of each case, in the order of runs and of positions in them.

        Raises `ValueError` and others for foreign rows.
        """
        count = self._obligations()
        rows = self._connection.execute(
            "SELECT key, name, test_case.visited, log IS NOT NULL AND nodes IS NULL"
            " FROM test_case JOIN run ON run.id = test_case.run ORDER BY started, token, position, key"
        )
        for key, name, visited, is_nowhere in rows:
            if is_nowhere:
                raise ValueError("a case over nodes of a run that was over none")
            yield key, _text(name), _known(visited, count)

    def outdated(self) -> frozenset[bytes]:
        """The keys of written cases of which a later run has another version: of the same file, model and options."""
        rows = self._connection.execute(
            "SELECT key FROM (SELECT key, row_number() OVER ("
            " PARTITION BY test_case.model, setting, path, name"
            " ORDER BY coalesce(order_time, started) DESC, token DESC, position DESC, key)"
            " AS age FROM test_case JOIN run ON run.id = test_case.run"
            " WHERE text IS NOT NULL AND path NOT GLOB '*.py') WHERE age > 1"
        )
        return frozenset(key for (key,) in rows)

    def says_obligations_of(self, obligations: Obligations) -> bool:
        """Whether the bits of sets mean these obligations."""
        rows = self._connection.execute("SELECT bit, name, counts FROM obligation ORDER BY bit")
        return list(rows) == [(bit, str(o), int(o.counts)) for bit, o in enumerate(obligations)]

    def _obligations(self) -> int:
        count: int = self._connection.execute("SELECT count(*) FROM obligation").fetchone()[0]
        return count

    def totals(self) -> VisitTotals:
        """Return how many cases count, and what they visited together."""
        left_out = self.outdated()
        cases = union = freely = 0
        rows = self._connection.execute("SELECT visited, forced, count(*) FROM test_case GROUP BY visited, forced")
        if left_out:
            rows = self._connection.execute("SELECT visited, forced, 1, key FROM test_case")
        for visited, forced, count, *key in rows:
            if not key or key[0] not in left_out:
                cases += count
                union |= _set(visited)
                freely |= _set(visited) & ~_set(forced or b"")
        return VisitTotals(cases, union, union & ~freely)

    # what is written

    def put_model(self, model: BehaviorModel, *, keeps_current: bool = False) -> int:
        """Add a model, and make it the current one, with its obligations; return its id.

        Args:
            model: the model.
            keeps_current: whether another current model stays the current one.
        """
        digest, obligations = digest_of(model), Obligations.of(model)
        current = next((row.digest for row in self.models() if row.is_current), digest)
        becomes_current = digest == current or not keeps_current
        if becomes_current:
            if current != digest:
                self._connection.execute("UPDATE model SET is_current = 0")
                self._connection.execute("DELETE FROM obligation")
            self._put_obligations(obligations)
        self.use(obligations)
        meaning = replace(model.unbound, planner=PlannerChoice(), waivers=())  # each run has its own
        lifted, objects = _origins_text(model), _objects_text(model)
        id_ = self.put_model_row(
            ModelRow(0, digest, model.name, write_model(meaning), becomes_current, lifted, objects, digest)
        )
        if not keeps_current:  # the file can have changed without the digest: the latest one counts
            self._connection.execute("UPDATE model SET text = ? WHERE id = ?", (write_model(meaning), id_))
        if objects is not None:
            self._connection.execute("UPDATE model SET objects = ? WHERE id = ?", (objects, id_))
        return id_

    def put_model_row(self, row: ModelRow) -> int:
        """Add a model by its row, such as that of another store; return its id here."""
        self._connection.execute(
            "INSERT INTO model (digest, name, text, is_current, lifted, objects, obligations_of)"
            " VALUES (?, ?, ?, ?, ?, ?, ?)"
            " ON CONFLICT (digest) DO UPDATE SET is_current = max(is_current, excluded.is_current),"
            " text = max(text, excluded.text),"
            " lifted = coalesce(max(lifted, excluded.lifted), lifted, excluded.lifted),"
            " objects = coalesce(max(objects, excluded.objects), objects, excluded.objects)",
            (row.digest, row.name, row.text, row.is_current, row.lifted, row.objects, row.obligations_of),
        )
        return self._id("model", "digest", row.digest)

    def use(self, obligations: Obligations) -> None:
        """Write the sets of cases and runs as those of a model with these obligations."""
        self._width = (len(obligations.all) + 7) // 8

    def _put_obligations(self, obligations: Obligations) -> None:
        self._connection.executemany(
            "INSERT OR IGNORE INTO obligation (bit, name, counts) VALUES (?, ?, ?)",
            [(bit, str(obligation), obligation.counts) for bit, obligation in enumerate(obligations)],
        )

    def put_run(self, run: StoredRun, model: int) -> int:
        """Adds a run of a model, or what is known of it now; gives its id. Of two totals the larger is the later."""
        values = (run.id, run.started, run.command, model, self._put_source(run.source), self._bytes(run.visited))
        row = self._connection.execute("SELECT id, visited FROM run WHERE token = ?", (run.id,)).fetchone()
        if row is None:
            self._connection.execute(
                "INSERT INTO run (token, started, command, model, source, visited, cases, failed, is_finished, nodes)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (*values, run.cases, run.failed, run.is_finished, run.nodes),
            )
        else:
            self._connection.execute(
                "UPDATE run SET visited = ?, cases = max(cases, ?), failed = max(failed, ?),"
                " is_finished = max(is_finished, ?) WHERE id = ?",
                (self._bytes(run.visited | _set(row[1])), run.cases, run.failed, run.is_finished, row[0]),
            )
        self._compute("run", "token", run.id, run)
        return self._id("run", "token", run.id)

    def _put_source(self, source: ModelSource) -> int:
        digest = sha256(f"{source.path}\0{source.text}".encode()).hexdigest()
        self._connection.execute(
            "INSERT OR IGNORE INTO source (digest, path, text) VALUES (?, ?, ?)", (digest, source.path, source.text)
        )
        return self._id("source", "digest", digest)

    def put_certificate(self, certificate: StoredCertificate, model: int) -> None:
        """Adds a certificate of a model. If it is there, the check by the later version counts."""
        row = (certificate.name, certificate.checked_by, certificate.claims_text, certificate.packed)
        self._connection.execute(
            "INSERT INTO certificate (key, model, name, checked_by, claims, text) VALUES (?, ?, ?, ?, ?, ?)"
            " ON CONFLICT (key) DO UPDATE SET"
            " claims = CASE WHEN excluded.checked_by > checked_by THEN excluded.claims ELSE claims END,"
            " name = min(name, excluded.name), checked_by = max(checked_by, excluded.checked_by)",
            (certificate.key, model, *row),
        )

    def put_decision(self, stored: StoredDecision, model: int, digest: str) -> None:
        """Add an answer about a requirement of a model. If there is one, the later closing counts."""
        decision = stored.decision
        parts = (digest, stored.planner, stored.goals, str(decision.is_built_in), decision.name)
        key = sha256("\0".join(parts).encode()).digest()[:16]
        self._connection.execute(
            "INSERT INTO decision (key, model, planner, goals, name, is_built_in, status, reason, test_case,"
            " undeclared, file, other_plans, closed) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)"
            " ON CONFLICT (key) DO UPDATE SET status = excluded.status, reason = excluded.reason,"
            " test_case = excluded.test_case, undeclared = excluded.undeclared, file = excluded.file,"
            " other_plans = excluded.other_plans, closed = excluded.closed WHERE excluded.closed > closed",
            (
                *(key, model, stored.planner, stored.goals.value, decision.name, decision.is_built_in),
                *(decision.status.value, decision.reason, decision.case, " ".join(decision.undeclared)),
                *(decision.file, other_plans_text(decision.other_plans), stored.closed),
            ),
        )

    def order_time(self, run: StoredRun) -> str | None:
        """Return the order time of a run, which is added now if it is new; `None` if `started` is behind all others."""
        known = self._connection.execute("SELECT order_time FROM run WHERE token = ?", (run.id,)).fetchone()
        if known is not None:
            return None if known[0] is None else _moment(known[0])
        query = "SELECT max(coalesce(order_time, started)) FROM run"
        (last,) = self._connection.execute(query).fetchone()
        return None if last is None or last < run.started else time_text(datetime.fromisoformat(last) + _NEXT)

    def newest_start(self) -> str | None:
        """Return the latest time at which a run began, by its clock; `None` without runs."""
        (newest,) = self._connection.execute("SELECT max(started) FROM run").fetchone()
        return None if newest is None else _moment(newest)

    def add_to_run(self, run: int, visited: int, *, failed: bool) -> None:
        """Counts one more case of a run."""
        before = self._connection.execute("SELECT visited FROM run WHERE id = ?", (run,)).fetchone()[0]
        self._connection.execute(
            "UPDATE run SET visited = ?, cases = cases + 1, failed = failed + ? WHERE id = ?",
            (self._bytes(visited | _set(before)), failed, run),
        )

    def put_smallest(self, run: str, name: str, smallest: Sequence[SmallestCase]) -> None:
        """Add the smallest cases to the case of a run, by their id and name."""
        self._connection.execute(
            "UPDATE test_case SET smallest = ? WHERE name = ? AND run = (SELECT id FROM run WHERE token = ?)",
            (smallest_text(smallest), name, run),
        )

    def finish_run(self, run: int) -> None:
        """Notes that a run came to its end."""
        self._connection.execute("UPDATE run SET is_finished = 1 WHERE id = ?", (run,))

    def put_case(self, case: CaseRow) -> None:
        """Adds a case. If it is there, what both visited counts, and else what the later run says."""
        query = (
            "SELECT test_case.visited, forced, coalesce(order_time, started), token, position FROM test_case"
            " JOIN run ON run.id = test_case.run WHERE key = ?"
        )
        known = self._connection.execute(query, (case.key,)).fetchone()
        if known is None:
            self._insert(case)
            self._compute("test_case", "key", case.key, case)
            return
        visited, forced, *before = known
        freely = _set(visited) & ~_set(forced or b"") | case.visited & ~case.forced
        union = _set(visited) | case.visited
        row = (self._bytes(union), self._some_bytes(union & ~freely), case.key)
        self._connection.execute("UPDATE test_case SET visited = ?, forced = ? WHERE key = ?", row)
        query = "SELECT coalesce(order_time, started), token FROM run WHERE id = ?"
        moment = self._connection.execute(query, (case.run,)).fetchone()
        if (*moment, case.position) > tuple(before):
            self._update(case)
            self._compute("test_case", "key", case.key, case)

    def put_run_case(self, row: RunCaseRow) -> None:
        """Add what came of a case in one run, united with what is known of it there."""
        query = "SELECT failed, visited FROM run_case WHERE run = ? AND test_case = ?"
        failed, visited = self._connection.execute(query, (row.run, row.key)).fetchone() or (False, b"")
        values = (row.run, row.key, row.failed or failed, self._bytes(row.visited | _set(visited)))
        self._connection.execute("REPLACE INTO run_case (run, test_case, failed, visited) VALUES (?, ?, ?, ?)", values)

    def _insert(self, case: CaseRow) -> None:
        recipe = case.recipe
        if isinstance(recipe, Written):
            how: Row = (self._setting("", recipe), None, None, recipe.text, recipe.path)
        else:
            how = (self._setting(recipe.network, recipe), str(recipe.seed), recipe.number, None, None)
        place = (case.key, case.name, case.goal, case.model, case.run, case.position)
        result = (*_ended(case), self._bytes(case.visited), case.log, self._some_bytes(case.forced))
        marks = ", ".join("?" * len((*place, *how, *result)))
        self._connection.execute(
            f"INSERT INTO test_case ({_CASE_COLUMNS}) VALUES ({marks})",  # noqa: S608 - our own columns
            (*place, *how, *result),
        )

    def _update(self, case: CaseRow) -> None:
        path = case.recipe.path if isinstance(case.recipe, Written) else None
        self._connection.execute(
            "UPDATE test_case SET run = ?, position = ?, path = ?,"
            " ended = ?, failures = ?, ended_ns = ?, requests = ?, log = ? WHERE key = ?",
            (case.run, case.position, path, *_ended(case), case.log, case.key),
        )

    def _compute(self, table: str, key: str, value: object, row: CaseRow | StoredRun) -> None:
        """Fill the columns of a row whose values are computed from it."""
        for column, compute in TABLES[table].computed.items():
            statement = f"UPDATE {table} SET {column} = ? WHERE {key} = ?"  # noqa: S608 - our own columns
            self._connection.execute(statement, (compute(row), value))

    def _setting(self, network: str, recipe: Recipe) -> int:
        """Return the id of the options of the command line for a case."""
        moves_inputs, goals = (recipe.moves_inputs, recipe.goals) if isinstance(recipe, Drawn) else (False, 1)
        options = (network, recipe.requirements, recipe.time_limit_ns, recipe.real, moves_inputs, goals)
        if options not in self._settings:
            given: dict[str, object] = {"network": network}
            given |= {"requirements": recipe.requirements, "time_limit_ns": recipe.time_limit_ns}
            given |= {} if recipe.real is None else {"real": recipe.real}
            given |= {"moves_inputs": True} if moves_inputs else {}
            given |= {} if goals == 1 else {"goals": goals}
            text = json.dumps(given, ensure_ascii=False)
            self._connection.execute("INSERT OR IGNORE INTO setting (options) VALUES (?)", (text,))
            self._settings[options] = self._id("setting", "options", text)
        return self._settings[options]

    def _id(self, table: str, column: str, value: str) -> int:
        row = self._connection.execute(f"SELECT id FROM {table} WHERE {column} = ?", (value,))  # noqa: S608 - our own
        found: int = row.fetchone()[0]
        return found

    def _bytes(self, bits: int) -> bytes:
        return bits.to_bytes(self._width, "little")

    def _some_bytes(self, bits: int) -> bytes | None:
        """Return a set; `None` for the empty one."""
        return self._bytes(bits) if bits else None


def _set(stored: bytes) -> int:
    return int.from_bytes(stored, "little")


def _origins_text(model: BehaviorModel) -> str | None:
    """Return the origins of the parts of a model as a column has them; `None` for a model without parameters."""
    origins = [(origin.section, origin.name, origin.lifted) for origin in model.origins]
    return json.dumps(origins, ensure_ascii=False) if origins else None


def _origins(text: str | None) -> tuple[LiftedOrigin, ...]:
    """Return the origins of the parts of a model. Raises `ValueError` and others for other texts."""
    if text is None:
        return ()
    return tuple(
        LiftedOrigin(*each)
        for each in convert_json(read_json(text, _MAX_ORIGINS_CHARACTERS), list[tuple[str, str, str]])
    )


def _objects_text(model: BehaviorModel) -> str | None:
    """Return the objects of a model file as a column has them; `None` for a file without types."""
    return None if model.objects is None else json.dumps(asdict(model.objects), ensure_ascii=False)


def _objects(text: str) -> ObjectLists:
    """Return the objects of a model file. Raises `ValueError` and others for other texts."""
    return convert_json(read_json(text, _MAX_ORIGINS_CHARACTERS), ObjectLists)


def _text(value: object) -> str:
    """Return the text of a column. Raises `ValueError` if it holds no text, as after damage."""
    if not isinstance(value, str):
        raise ValueError("this is no text")  # noqa: TRY004 - it is data
    return value


def _text_or_none(value: object) -> str | None:
    return None if value is None else _text(value)


def _number(value: object) -> int:
    """Return the number of a column. Raises `ValueError` if it holds no number."""
    if not isinstance(value, int):
        raise ValueError("this is no number")  # noqa: TRY004 - it is data
    return value


def time_text(moment: datetime) -> str:
    """Return a time in UTC as stores have it. Such texts sort by time."""
    return moment.strftime("%Y-%m-%dT%H:%M:%S.%fZ")


def _moment(text: str) -> str:
    """Return the time at which a run began. Raises `ValueError` if the column holds no time."""
    datetime.fromisoformat(text)
    return text


def _known(stored: bytes, count: int) -> int:
    """A set of the obligations that there are. Raises `ValueError` if it has others."""
    bits = _set(stored)
    if bits >> count:
        raise ValueError(f"there are {count} obligations")
    return bits


def _ended(case: CaseRow) -> Row:
    return case.verdict.end.value, _failures_text(case.verdict), case.ended_ns, case.requests


def _failures_text(verdict: Verdict) -> str | None:
    if verdict.passed:
        return None
    return json.dumps([[f.kind.value, f.subject, f.message] for f in verdict.failures], ensure_ascii=False)


def _failures(text: str | None) -> tuple[Failure, ...]:
    if text is None:
        return ()
    written = convert_json(read_json(text, _MAX_JSON_CHARACTERS), list[tuple[FailureKind, str, str]])
    return tuple(Failure(kind, subject, message) for kind, subject, message in written)


class _WrittenSetting(Struct, frozen=True):
    """The options of a case as a row of `setting` has them in JSON."""

    network: str
    requirements: tuple[tuple[str, str], ...]
    time_limit_ns: int | None
    real: tuple[str, ...] | None = None
    moves_inputs: bool = False
    goals: int = 1


def _options(text: str) -> _WrittenSetting:
    return convert_json(read_json(text, _MAX_JSON_CHARACTERS), _WrittenSetting)


def _refuse_another_log(log: bytes | None, recipe: Recipe) -> None:
    """Raises `ValueError` if a case over nodes has no log that can be unpacked, or another case has one."""
    if (log is None) is not (recipe.real is None):
        raise ValueError("runs over nodes have logs, and no others")
    if log is not None:
        unpacked_log(log)


def _recipe(options: _WrittenSetting, seed: str | None, number: int, text: str | None, path: str) -> Recipe:
    added = (options.requirements, options.time_limit_ns, options.real)
    if text is not None:
        return Written(_text(text), _text(path), *added)
    drawn = (options.network, *added, options.moves_inputs, options.goals)
    return Drawn(int(seed or ""), _number(number), *drawn)
