"""Coverage that outlives a run: a store keeps what each case visited, and unites what several runs did.

Above `testing`, whose results it keeps; the one room that knows SQLite. `docs/coverage-store.md` describes the file.
"""

from scbm.notation import digest_of
from scbm.storing.beginning import begin_run
from scbm.storing.combining import Combined, combine_stores
from scbm.storing.edits import Dropped
from scbm.storing.history import Drawn, History, Recipe, Run, Source, StoredCase, Written, key_of, sayable
from scbm.storing.reading import read_history
from scbm.storing.recipes import drawn_recipe, network_words, written_recipe
from scbm.storing.replays import Replays
from scbm.storing.writer import StoreWriter, write_store

__all__ = [
    "Combined",
    "Drawn",
    "Dropped",
    "History",
    "Recipe",
    "Replays",
    "Run",
    "Source",
    "StoreWriter",
    "StoredCase",
    "Written",
    "begin_run",
    "combine_stores",
    "digest_of",
    "drawn_recipe",
    "key_of",
    "network_words",
    "read_history",
    "sayable",
    "write_store",
    "written_recipe",
]
