"""The engines that find proofs about obligations, and how many obligations each of them decided.

An engine is named by the kind of argument in the certificates of its proofs.
"""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

ENGINE_WORDS = {
    "structure": "facts of the model",
    "values": "possible values",
    "sets": "a set of situations",
    "runs": "the graph of runs",
}
"""What the proofs of engines come from, as reports write it; any other engine is called by its name."""


def engine_words(engine: str) -> str:
    """Return what the proofs of an engine come from."""
    return ENGINE_WORDS.get(engine, f"`{engine}`")


def count_engines(engines: Iterable[str | None]) -> dict[str, int]:
    """Return the number of obligations of each engine that decided some, in the order of `ENGINE_WORDS`."""
    counts = Counter(engine for engine in engines if engine is not None)
    return {
        engine: counts[engine] for engine in (*ENGINE_WORDS, *sorted(counts.keys() - ENGINE_WORDS)) if counts[engine]
    }


def engine_counts_in_words(counts: Mapping[str, int]) -> str:
    """Return `10 by facts of the model, 6 by a set of situations`; empty without proofs."""
    return ", ".join(f"{count} by {engine_words(engine)}" for engine, count in counts.items())
