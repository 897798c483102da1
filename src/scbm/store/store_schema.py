"""The tables of a store (`TABLES`) and their version.

Each column is declared once: SQL and inserted values follow.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from msgspec import Struct

from scbm.store.smallest_cases import smallest_text
from scbm.store.stored_evidence import excuses_text, hazards_text, waivers_text

if TYPE_CHECKING:
    from collections.abc import Callable

APPLICATION_ID = 0x5343424D
"""`SCBM` in ASCII; SQLite keeps it in the header of the file."""

TABLES_VERSION = 19
"""The version of the tables, which SQLite keeps in the header as `user_version`. Each change of them increments it."""


class StoreColumn(Struct, frozen=True):
    """A column of a table.

    Attributes:
        name: its name.
        type: its SQL type, with constraints.
        comment: what it holds.
        value: what a new row gets, from its `CaseRow` or `Run`; `None` for columns that `store_tables` fills itself.
    """

    name: str
    type: str
    comment: str
    value: Callable[[Any], object] | None = None


class StoreTable(Struct, frozen=True):
    """A table.

    Attributes:
        comment: what its rows are.
        columns: in their order.
        without_rowid: whether rows are kept in the order of their primary key.
        primary_key: the columns of the primary key, if there are several.
    """

    comment: str
    columns: tuple[StoreColumn, ...]
    without_rowid: bool = False
    primary_key: tuple[str, ...] = ()

    @property
    def computed(self) -> dict[str, Callable[[Any], object]]:
        """The columns whose values are computed from a row, by their names."""
        return {column.name: column.value for column in self.columns if column.value is not None}

    def statement(self, name: str) -> str:
        """Return the SQL that makes the table."""
        lines = [f"{column.name} {column.type}" for column in self.columns]
        lines += [f"PRIMARY KEY ({', '.join(self.primary_key)})"] if self.primary_key else []
        columns = ",\n".join(f"        {line}" for line in lines)
        return f"CREATE TABLE {name} (\n{columns}\n    ){' WITHOUT ROWID' if self.without_rowid else ''}"


TABLES: dict[str, StoreTable] = {
    "model": StoreTable(
        "The models on which cases were run: the current one, those of the same lifted model under other objects, and"
        " earlier ones after combining across edits.",
        (
            StoreColumn("id", "INTEGER PRIMARY KEY", "the number of the row"),
            StoreColumn(
                "digest", "TEXT NOT NULL UNIQUE", "SHA-256 of the model without `runs`, as certificates have it"
            ),
            StoreColumn("name", "TEXT NOT NULL", "the name of the model"),
            StoreColumn(
                "text", "TEXT NOT NULL", "the model without bindings, planner and waivers, as `scbm` writes it"
            ),
            StoreColumn("is_current", "INTEGER NOT NULL", "1 for the current model, else 0"),
            StoreColumn(
                "lifted",
                "TEXT",
                "JSON, if the model file has parameters: a list of section, name, and the entry that the part was"
                " expanded from",
            ),
            StoreColumn(
                "objects",
                "TEXT",
                "JSON, if the model file has types: the SHA-256 of the lifted model (`lifted`), the objects of each"
                " type (`types`), the `parents` of subtypes, and `tables` with columns and rows",
            ),
            StoreColumn(
                "obligations_of",
                "TEXT",
                "the digest of the model whose obligations the sets of its cases mean: its own, or after combining"
                " across edits that of the edited model",
            ),
        ),
    ),
    "obligation": StoreTable(
        "The obligations of the current model.",
        (
            StoreColumn("bit", "INTEGER PRIMARY KEY", "the place of the obligation in sets, from 0"),
            StoreColumn("name", "TEXT NOT NULL UNIQUE", "`OPERATION/ASPECT`, or `automatic/TRANSITION`"),
            StoreColumn("counts", "INTEGER NOT NULL", "1 if it counts in the figure, 0 for `queued`"),
        ),
    ),
    "source": StoreTable(
        "Model files as they were, with comments and layout, to mark their lines.",
        (
            StoreColumn("id", "INTEGER PRIMARY KEY", "the number of the row"),
            StoreColumn("digest", "TEXT NOT NULL UNIQUE", "SHA-256 of path and text"),
            StoreColumn("path", "TEXT NOT NULL", "the file, as the command line named it"),
            StoreColumn("text", "TEXT NOT NULL", "the content of the file"),
        ),
    ),
    "run": StoreTable(
        "Commands that added cases.",
        (
            StoreColumn("id", "INTEGER PRIMARY KEY", "the number of the row"),
            StoreColumn("token", "TEXT NOT NULL UNIQUE", "32 hexadecimal digits, unique among all runs"),
            StoreColumn("started", "TEXT NOT NULL", "when the run began, UTC, as `2026-11-21T12:00:00.000000Z`"),
            StoreColumn("command", "TEXT NOT NULL", "the command line"),
            StoreColumn("model", "INTEGER NOT NULL REFERENCES model", "the model that was tested: a row of `model`"),
            StoreColumn("source", "INTEGER NOT NULL REFERENCES source", "the file of that model: a row of `source`"),
            StoreColumn(
                "visited", "BLOB NOT NULL", "the set of obligations that the cases of the run visited together"
            ),
            StoreColumn("cases", "INTEGER NOT NULL", "the number of cases that the run has added so far"),
            StoreColumn("failed", "INTEGER NOT NULL", "the number of these cases that failed"),
            StoreColumn(
                "is_finished",
                "INTEGER NOT NULL",
                "1 if the run has ended; 0 if it is running, was killed, or lost a case",
            ),
            StoreColumn("nodes", "TEXT", "where its cases ran, such as `over DDS domain 0`; null for simulation"),
            StoreColumn(
                "planner",
                "TEXT",
                "the planner: name, version and the limits that were set, as in `greedy 1, max_length 50`",
                value=lambda run: run.planner,
            ),
            StoreColumn(
                "order_time",
                "TEXT",
                "the place of the run among others, as a time: just after the run that was added before it; null if"
                " that place is `started`",
                value=lambda run: run.order_time,
            ),
            StoreColumn(
                "waivers",
                "TEXT",
                "JSON, if there were any: its waivers, each with `obligation`, `reason`, `author`, `date`, `expires`,"
                " and `lifted` if it stands for all instances of an entry",
                value=lambda run: waivers_text(run.waivers),
            ),
        ),
    ),
    "setting": StoreTable(
        "The options of the command line beside cases.",
        (
            StoreColumn("id", "INTEGER PRIMARY KEY", "the number of the row"),
            StoreColumn(
                "options",
                "TEXT NOT NULL UNIQUE",
                "JSON: `network` of random cases as in `--network`, `drawn`, or empty; `requirements`, each"
                " with name and text; `time_limit_ns` or null; `real` only over nodes: the names of the real"
                " resources; `moves_inputs` only with `--inputs drawn`: true; `goals` only where random"
                " cases can have several: their largest number",
            ),
        ),
    ),
    "test_case": StoreTable(
        "Cases, each once.",
        (
            StoreColumn("key", "BLOB PRIMARY KEY", "16 bytes of the SHA-256 of model and case"),
            StoreColumn("name", "TEXT NOT NULL", "the name of the case; several cases can have the same"),
            StoreColumn("goal", "TEXT NOT NULL", "the name of its goal, or its predicate"),
            StoreColumn(
                "model", "INTEGER NOT NULL REFERENCES model", "the model on which it was run: a row of `model`"
            ),
            StoreColumn("run", "INTEGER NOT NULL REFERENCES run", "the latest run that had the case: a row of `run`"),
            StoreColumn("position", "INTEGER NOT NULL", "its place in that run, from 1"),
            StoreColumn(
                "setting",
                "INTEGER NOT NULL REFERENCES setting",
                "the options of the command line beside it: a row of `setting`",
            ),
            StoreColumn("seed", "TEXT", "of a random case: the seed, in decimal digits"),
            StoreColumn("number", "INTEGER", "of a random case: its number, from 1"),
            StoreColumn("text", "TEXT", "of a written case: the case as YAML"),
            StoreColumn(
                "path",
                "TEXT",
                "of a written case: its file, as the command line named it; of a case that a pytest test"
                " created, the file of the test, which ends in `.py`",
            ),
            StoreColumn("ended", "TEXT NOT NULL", "the end of its run, such as `reached`"),
            StoreColumn("failures", "TEXT", "JSON, if it failed: a list of kind, subject and message"),
            StoreColumn("ended_ns", "INTEGER NOT NULL", "the duration of its run, in nanoseconds of the run"),
            StoreColumn("requests", "INTEGER NOT NULL", "the number of requests that it sent"),
            StoreColumn("visited", "BLOB NOT NULL", "the set of obligations that it visited"),
            StoreColumn(
                "forced",
                "BLOB",
                "of `visited` the set of obligations that it visited only after its state was forced; null for none",
            ),
            StoreColumn(
                "excuses",
                "TEXT",
                "JSON, if goals were missed and excused: a list of the reasons, each `fault`, `may_end`,"
                " `input` or `expected`",
                value=lambda case: excuses_text(case.verdict.excuses),
            ),
            StoreColumn(
                "excluded",
                "INTEGER",
                "over nodes: the number of values that drivers sent and the model excludes; null for simulation",
                value=lambda case: None if case.recipe.real is None else case.excluded,
            ),
            StoreColumn(
                "hazards",
                "TEXT",
                "JSON, of a simulated case with hazards at devices: a list of `kind` (`overlap` or `unawaited`),"
                " `resource`, `request`, `begin_ns`, `end_ns` and `other`; `json_array_length` counts them",
                value=lambda case: hazards_text(case.hazards),
            ),
            StoreColumn(
                "unjudged",
                "TEXT",
                "why `non_blocking` does not judge the case: `single_goals`, `drawn_plans`, `external_planner`,"
                " `other_goals`, `force`, `limit`, `livelock` or `too_long`; null if it does, or is off",
                value=lambda case: case.unjudged,
            ),
            StoreColumn(
                "smallest",
                "TEXT",
                "JSON, of a case whose failures were made smaller: a list of `kind` and `subject` of the failure, the"
                " smallest case as YAML (`text`) and its file (`path`), its `operations` and `choices`, those before"
                " (`operations_before`, `choices_before`), and the choices that matter (`matters`)",
                value=lambda case: smallest_text(case.smallest),
            ),
            StoreColumn(
                "log",
                "BLOB",
                "of a run over nodes: its log, compressed as by zlib, at most 256 MiB when unpacked; null for"
                " simulation",
            ),
        ),
        without_rowid=True,
    ),
    "run_case": StoreTable(
        "What came of each case in each run that had it; `test_case` has the latest run alone.",
        (
            StoreColumn("run", "INTEGER NOT NULL REFERENCES run", "the run: a row of `run`"),
            StoreColumn("test_case", "BLOB NOT NULL REFERENCES test_case", "the case: a row of `test_case`"),
            StoreColumn("failed", "INTEGER NOT NULL", "1 if the case failed in that run, else 0"),
            StoreColumn("visited", "BLOB NOT NULL", "the set of obligations that it visited in that run"),
        ),
        without_rowid=True,
        primary_key=("run", "test_case"),
    ),
    "certificate": StoreTable(
        "Certificates that were sound when they were added.",
        (
            StoreColumn("key", "BLOB PRIMARY KEY", "16 bytes of the SHA-256 of `text`, before it was compressed"),
            StoreColumn("model", "INTEGER NOT NULL REFERENCES model", "the model that it is about: a row of `model`"),
            StoreColumn("name", "TEXT NOT NULL", "its file, as the command line named it"),
            StoreColumn(
                "checked_by", "TEXT NOT NULL", "the version of `scbm` that checked it; another version checks it again"
            ),
            StoreColumn("claims", "TEXT NOT NULL", "JSON: a list of obligation, status and reason"),
            StoreColumn("text", "BLOB NOT NULL", "the certificate, compressed as by zlib"),
        ),
        without_rowid=True,
    ),
    "decision": StoreTable(
        "The answers of the last `scbm close --requirements` about the requirements of models.",
        (
            StoreColumn("key", "BLOB PRIMARY KEY", "16 bytes of the SHA-256 of model, planner, goals, kind and name"),
            StoreColumn("model", "INTEGER NOT NULL REFERENCES model", "the model that was closed: a row of `model`"),
            StoreColumn("planner", "TEXT NOT NULL", "the name of the planner of its runs; `drawn` for drawn plans"),
            StoreColumn("goals", "TEXT NOT NULL", "how many goals its runs have: `single` or `sequence`"),
            StoreColumn(
                "name", "TEXT NOT NULL", "the name of the requirement; of one that `--require` gave, its sentence"
            ),
            StoreColumn("is_built_in", "INTEGER NOT NULL", "1 for a built-in requirement, else 0"),
            StoreColumn(
                "status",
                "TEXT NOT NULL",
                "`holds`, `holds_canonical`, `holds_planner`, `violated`, `undecided`, `cases_only` or `off`",
            ),
            StoreColumn("reason", "TEXT NOT NULL", "where it holds, how the case violates it, or why it is open"),
            StoreColumn("test_case", "TEXT NOT NULL", "the name of the case that violates it, or empty"),
            StoreColumn(
                "undeclared",
                "TEXT NOT NULL",
                "the variables without `source` that have to change from outside for it to hold: names with"
                " blanks between them, or empty",
            ),
            StoreColumn("file", "TEXT NOT NULL", "the file of this case, as closing wrote or read it, or empty"),
            StoreColumn(
                "other_plans",
                "TEXT",
                "JSON, if it is not known to hold with any plans: of a case with other plans than the planner's that"
                " violates it `case`, its `file`, and how (`reason`); without one why that is not decided (`reason`)",
            ),
            StoreColumn("closed", "TEXT NOT NULL", "when the model was closed, as `started` of `run`"),
        ),
        without_rowid=True,
    ),
    "mutation": StoreTable(
        "Suites that were run against mutants.",
        (
            StoreColumn("key", "BLOB PRIMARY KEY", "16 bytes of the SHA-256 of the columns `basis` to `cases`"),
            StoreColumn("model", "INTEGER NOT NULL REFERENCES model", "the model: a row of `model`"),
            StoreColumn(
                "basis", "TEXT NOT NULL", "SHA-256 of the model with its planner and what changes from outside"
            ),
            StoreColumn("oracle", "TEXT NOT NULL", "what judges its cases: `verdicts` or `recorded`"),
            StoreColumn("made_by", "TEXT NOT NULL", "the versions of `scbm` and of the mutation operators"),
            StoreColumn("cases", "BLOB NOT NULL", "the keys of its cases, 16 bytes each, in ascending order"),
            StoreColumn(
                "mutants",
                "INTEGER NOT NULL",
                "the number of mutants of the model; a suite with fewer results is not whole",
            ),
            StoreColumn("started", "TEXT NOT NULL", "when the last command that added to it began, as in `run`"),
        ),
        without_rowid=True,
    ),
    "mutant": StoreTable(
        "The results of mutants.",
        (
            StoreColumn("key", "BLOB PRIMARY KEY", "16 bytes of the SHA-256 of the suite and the name"),
            StoreColumn("mutation", "BLOB NOT NULL REFERENCES mutation", "the suite: a row of `mutation`"),
            StoreColumn("name", "TEXT NOT NULL", "the name of the mutant"),
            StoreColumn("status", "TEXT NOT NULL", "`killed`, `equivalent`, `survived` or `undecided`"),
            StoreColumn("test_case", "TEXT NOT NULL", "the name of the first case that killed it, or empty"),
            StoreColumn("reason", "TEXT NOT NULL", "why that case failed, or why the mutant is undecided, or empty"),
            StoreColumn("runs", "INTEGER NOT NULL", "the number of cases that were run on it"),
            StoreColumn("skipped", "INTEGER NOT NULL", "the number of cases whose run could not differ"),
            StoreColumn(
                "belongs", "BLOB NOT NULL", "the set of obligations that it belongs to, without zero bytes at its end"
            ),
            StoreColumn(
                "noticed", "BLOB NOT NULL", "of these the set of obligations that a case visits which kills it"
            ),
            StoreColumn("limits", "TEXT", "JSON: the limits of the search for a proof or a witness; null without one"),
            StoreColumn("witness", "TEXT", "the witness of a survivor as YAML; else null"),
            StoreColumn("is_benign", "INTEGER NOT NULL", "1 if it breaks no requirement there that the model keeps"),
            StoreColumn("is_killable", "INTEGER NOT NULL", "1 if the witness fails on it"),
        ),
        without_rowid=True,
    ),
}
"""The tables by name, each behind those that it refers to."""

# the half of the byte that has the bit, as a hexadecimal digit, as a number, shifted; blobs know no arithmetic
_VIEW = """CREATE VIEW visit AS
    SELECT test_case.name AS test_case, obligation.name AS obligation
    FROM test_case JOIN obligation JOIN model ON model.id = test_case.model
    WHERE obligations_of = (SELECT digest FROM model WHERE is_current)
    AND ((instr(
        '0123456789ABCDEF',
        substr(hex(substr(test_case.visited, obligation.bit / 8 + 1, 1)), 1 + (obligation.bit % 8 < 4), 1)
    ) - 1) >> (obligation.bit % 4)) & 1"""


def creation() -> list[str]:
    """Return the SQL that makes the tables and the view."""
    header = (f"PRAGMA application_id = {APPLICATION_ID}", f"PRAGMA user_version = {TABLES_VERSION}")
    return [*header, *(table.statement(name) for name, table in TABLES.items()), _VIEW]


_OF_MODEL = "IN (SELECT id FROM main.model WHERE obligations_of = (SELECT digest FROM shown))"
_SHOWN = {
    "model": f"WHERE id {_OF_MODEL}",
    "run": f"WHERE model {_OF_MODEL}",
    "test_case": f"WHERE model {_OF_MODEL}",
    "run_case": "WHERE run IN (SELECT id FROM run)",
    "certificate": f"WHERE model {_OF_MODEL}",
    "decision": f"WHERE model {_OF_MODEL}",
    "mutation": f"WHERE model {_OF_MODEL}",
    "obligation": (
        "WHERE (SELECT digest FROM shown) = (SELECT digest FROM main.model WHERE is_current)"
        " UNION ALL SELECT * FROM other_obligation"
    ),
}
"""The rows of each table that belong to the shown model."""


def views_of_a_model() -> list[str]:
    """Return the SQL that shows the rows of one model, which is the current one there, to a connection that only reads.

    Its digest is in the temporary table `shown`. The names of a connection stand before those of the file.
    """
    return [
        "CREATE TEMP TABLE shown (digest TEXT)",
        "INSERT INTO shown SELECT digest FROM main.model WHERE is_current",
        "CREATE TEMP TABLE other_obligation (bit INTEGER, name TEXT, counts INTEGER)",
        *map(_view, _SHOWN),
    ]


def _view(table: str) -> str:
    is_shown = "digest = (SELECT digest FROM shown) AS is_current"
    columns = ", ".join(is_shown if each.name == "is_current" else each.name for each in TABLES[table].columns)
    return f"CREATE TEMP VIEW {table} AS SELECT {columns} FROM main.{table} {_SHOWN[table]}"  # noqa: S608 - our own names
