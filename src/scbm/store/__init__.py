"""Coverage that outlives a run: a store keeps what each case visited, and unites what several runs did.

Above `testing`, whose results it keeps; only this package uses SQLite. `docs/reference/coverage-store.md` describes
the file.
"""

from typing import TYPE_CHECKING

from scbm.files import digest_of
from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.store.history import Drawn, History, ModelSource, Recipe, StoredCase, StoredRun, Written, key_of, sayable
    from scbm.store.model_edits import Dropped
    from scbm.store.replays import Replays, drawn_recipe, network_words, written_recipe
    from scbm.store.store_tables import read_history
    from scbm.store.store_union import Combined, combine_stores
    from scbm.store.store_writer import StoreWriter, begin_run, write_store
    from scbm.store.stored_evidence import StoredCertificate

__all__ = [
    "Combined",
    "Drawn",
    "Dropped",
    "History",
    "ModelSource",
    "Recipe",
    "Replays",
    "StoreWriter",
    "StoredCase",
    "StoredCertificate",
    "StoredRun",
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

__getattr__ = lazy_exports(
    __name__,
    {
        "history": "Drawn History ModelSource Recipe StoredCase StoredRun Written key_of sayable",
        "model_edits": "Dropped",
        "replays": "Replays drawn_recipe network_words written_recipe",
        "store_tables": "read_history",
        "store_union": "Combined combine_stores",
        "stored_evidence": "StoredCertificate",
        "store_writer": "StoreWriter begin_run write_store",
    },
)
