"""Coverage that outlives a run: a store keeps what each case visited, and unites what several runs did.

Above `testing`, whose results it keeps; the one room that knows SQLite. `docs/coverage-store.md` describes the file.
"""

from scbm.storing.history import Drawn, History, Recipe, Run, Source, StoredCase, Written, digest_of, key_of

__all__ = [
    "Drawn",
    "History",
    "Recipe",
    "Run",
    "Source",
    "StoredCase",
    "Written",
    "digest_of",
    "key_of",
]
