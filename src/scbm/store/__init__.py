"""Coverage that outlives a run: a store keeps what each case visited, and unites what several runs did.

Above `testing`, whose results it keeps; only this package uses SQLite. `docs/reference/coverage-store.md` describes
the file.
"""

from typing import TYPE_CHECKING

from scbm.files import digest_of
from scbm.model.lazy_exports import lazy_exports

if TYPE_CHECKING:
    from scbm.store.history import (
        Drawn,
        History,
        ModelSource,
        ObligationChange,
        Recipe,
        RunComparison,
        StoredCase,
        StoredRun,
        VerdictChange,
        Written,
        key_of,
        sayable,
    )
    from scbm.store.history_reader import read_history
    from scbm.store.model_edits import Dropped
    from scbm.store.replays import Replays, drawn_recipe, network_words, written_recipe
    from scbm.store.run_comparison import compare_runs, earlier_runs
    from scbm.store.smallest_cases import SmallestCase
    from scbm.store.store_union import Combined, combine_stores
    from scbm.store.store_writer import (
        MutantWriter,
        StoreFigures,
        StoreWriter,
        begin_run,
        keep_decisions,
        keep_smallest,
        refuse_store,
        time_now,
        write_mutants,
        write_store,
    )
    from scbm.store.stored_evidence import StoredCertificate
    from scbm.store.stored_mutants import (
        OPERATORS_VERSION,
        RECORDED,
        VERDICTS,
        MutatedSuite,
        StoredMutant,
        StoredMutation,
        basis_of,
        read_limits,
    )

__all__ = [
    "OPERATORS_VERSION",
    "RECORDED",
    "VERDICTS",
    "Combined",
    "Drawn",
    "Dropped",
    "History",
    "ModelSource",
    "MutantWriter",
    "MutatedSuite",
    "ObligationChange",
    "Recipe",
    "Replays",
    "RunComparison",
    "SmallestCase",
    "StoreFigures",
    "StoreWriter",
    "StoredCase",
    "StoredCertificate",
    "StoredMutant",
    "StoredMutation",
    "StoredRun",
    "VerdictChange",
    "Written",
    "basis_of",
    "begin_run",
    "combine_stores",
    "compare_runs",
    "digest_of",
    "drawn_recipe",
    "earlier_runs",
    "keep_decisions",
    "keep_smallest",
    "key_of",
    "network_words",
    "read_history",
    "read_limits",
    "refuse_store",
    "sayable",
    "time_now",
    "write_mutants",
    "write_store",
    "written_recipe",
]

__getattr__ = lazy_exports(
    __name__,
    {
        "history": (
            "Drawn History ModelSource ObligationChange Recipe RunComparison StoredCase StoredRun VerdictChange"
            " Written key_of sayable"
        ),
        "history_reader": "read_history",
        "model_edits": "Dropped",
        "replays": "Replays drawn_recipe network_words written_recipe",
        "run_comparison": "compare_runs earlier_runs",
        "smallest_cases": "SmallestCase",
        "store_union": "Combined combine_stores",
        "store_writer": (
            "MutantWriter StoreFigures StoreWriter begin_run keep_decisions keep_smallest refuse_store "
            "time_now write_mutants write_store"
        ),
        "stored_evidence": "StoredCertificate",
        "stored_mutants": (
            "OPERATORS_VERSION RECORDED VERDICTS MutatedSuite StoredMutant StoredMutation basis_of read_limits"
        ),
    },
)
