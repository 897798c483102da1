"""The engines that find proofs about obligations, and how many obligations each of them decided."""

from __future__ import annotations

from collections import Counter
from enum import StrEnum
from typing import TYPE_CHECKING, assert_never

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


class ProofEngine(StrEnum):
    """An engine; its value is the kind of argument in the certificates of its proofs."""

    STRUCTURE = "structure"
    VALUES = "values"
    SETS = "sets"
    RUNS = "runs"

    @property
    def words(self) -> str:
        """What the proofs come from, as reports write it."""
        match self:
            case ProofEngine.STRUCTURE:
                return "facts of the model"
            case ProofEngine.VALUES:
                return "possible values"
            case ProofEngine.SETS:
                return "a set of situations"
            case ProofEngine.RUNS:
                return "the graph of runs"
        assert_never(self)


def count_engines(engines: Iterable[ProofEngine | None]) -> dict[ProofEngine, int]:
    """Return the number of obligations of each engine that decided some, in the order of `ProofEngine`."""
    counts = Counter(engines)
    return {engine: counts[engine] for engine in ProofEngine if counts[engine]}


def engine_counts_in_words(counts: Mapping[ProofEngine, int]) -> str:
    """Return `10 by facts of the model, 6 by a set of situations`; empty without proofs."""
    return ", ".join(f"{count} by {engine.words}" for engine, count in counts.items())
