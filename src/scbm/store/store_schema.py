"""The tables of a store. `docs/reference/coverage-store.md` describes every column; a change is a new version."""

from __future__ import annotations

APPLICATION_ID = 0x5343424D
"""`SCBM` in ASCII; SQLite keeps it in the header of the file."""

VERSION = 2
"""The version of these tables, which SQLite keeps in the header as `user_version`."""

TABLES = (
    """CREATE TABLE model (
        id INTEGER PRIMARY KEY,
        digest TEXT NOT NULL UNIQUE,
        name TEXT NOT NULL,
        text TEXT NOT NULL,
        is_current INTEGER NOT NULL
    )""",
    """CREATE TABLE obligation (
        bit INTEGER PRIMARY KEY,
        name TEXT NOT NULL UNIQUE,
        counts INTEGER NOT NULL
    )""",
    """CREATE TABLE source (
        id INTEGER PRIMARY KEY,
        digest TEXT NOT NULL UNIQUE,
        path TEXT NOT NULL,
        text TEXT NOT NULL
    )""",
    """CREATE TABLE run (
        id INTEGER PRIMARY KEY,
        token TEXT NOT NULL UNIQUE,
        started TEXT NOT NULL,
        command TEXT NOT NULL,
        model INTEGER NOT NULL REFERENCES model,
        source INTEGER NOT NULL REFERENCES source,
        visited BLOB NOT NULL,
        cases INTEGER NOT NULL,
        failed INTEGER NOT NULL,
        is_finished INTEGER NOT NULL,
        nodes TEXT
    )""",
    """CREATE TABLE setting (
        id INTEGER PRIMARY KEY,
        options TEXT NOT NULL UNIQUE
    )""",
    """CREATE TABLE test_case (
        key BLOB PRIMARY KEY,
        name TEXT NOT NULL,
        goal TEXT NOT NULL,
        model INTEGER NOT NULL REFERENCES model,
        run INTEGER NOT NULL REFERENCES run,
        position INTEGER NOT NULL,
        setting INTEGER NOT NULL REFERENCES setting,
        seed TEXT,
        number INTEGER,
        text TEXT,
        path TEXT,
        ended TEXT NOT NULL,
        failures TEXT,
        ended_ns INTEGER NOT NULL,
        requests INTEGER NOT NULL,
        visited BLOB NOT NULL,
        log BLOB
    ) WITHOUT ROWID""",
    # the half of the byte that has the bit, as a hexadecimal digit, as a number, shifted; blobs know no arithmetic
    """CREATE VIEW visit AS
        SELECT test_case.name AS test_case, obligation.name AS obligation
        FROM test_case JOIN obligation
        WHERE ((instr(
            '0123456789ABCDEF',
            substr(hex(substr(test_case.visited, obligation.bit / 8 + 1, 1)), 1 + (obligation.bit % 8 < 4), 1)
        ) - 1) >> (obligation.bit % 4)) & 1""",
)

FROM_VERSION_1 = (
    "ALTER TABLE run ADD COLUMN nodes TEXT",
    "ALTER TABLE test_case ADD COLUMN log BLOB",
)
"""What makes the tables of version 1, which did not tell runs over nodes from simulated ones, those of version 2."""

VERSION_1_AS_2 = (
    "CREATE TEMP VIEW run AS SELECT *, NULL AS nodes FROM main.run",
    "CREATE TEMP VIEW test_case AS SELECT *, NULL AS log FROM main.test_case",
)
"""What shows the one as the other to a single connection: names of its own stand before those of the file."""
