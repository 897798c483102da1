"""What a suite has exercised, by SCBM-IAS and by its rivals (protocol, Predictors)."""

from __future__ import annotations

from functools import reduce
from typing import TYPE_CHECKING

from kill_matrix import ASPECTS
from suites import visited_by

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from kill_matrix import CaseFacts
    from suites import Suite

    Predictor = Callable[[Suite, Sequence[CaseFacts], Mapping[str, int]], int]

SCBM_IAS = "SCBM-IAS"


def masks_of(obligations: Sequence[str]) -> dict[str, int]:
    """Return for each aspect, and for `taken` and `queued`, the bits of its obligations."""
    masks = dict.fromkeys((*ASPECTS, "taken", "queued"), 0)
    for index, name in enumerate(obligations):
        masks["taken" if name.startswith("automatic/") else name.rpartition("/")[2]] |= 1 << index
    return masks


def _visited(suite: Suite, facts: Sequence[CaseFacts], _masks: Mapping[str, int]) -> int:
    return visited_by(suite, facts).bit_count()


def _of(aspect: str) -> Predictor:
    return lambda suite, facts, masks: (visited_by(suite, facts) & masks[aspect]).bit_count()


def _completed(suite: Suite, facts: Sequence[CaseFacts], _masks: Mapping[str, int]) -> int:
    return reduce(lambda seen, number: seen | facts[number].completed, suite, 0).bit_count()


def _event_pairs(suite: Suite, facts: Sequence[CaseFacts], _masks: Mapping[str, int]) -> int:
    return reduce(lambda seen, number: seen | facts[number].event_pairs, suite, 0).bit_count()


def _state_pairs(suite: Suite, facts: Sequence[CaseFacts], _masks: Mapping[str, int]) -> int:
    return reduce(lambda seen, number: seen | facts[number].state_pairs, suite, 0).bit_count()


PREDICTORS: dict[str, Predictor] = {
    SCBM_IAS: _visited,
    "operations completed": _completed,
    **{f"{aspect} alone": _of(aspect) for aspect in ASPECTS},
    "automatic transitions alone": _of("taken"),
    "edges of runs, by states": _state_pairs,
    "edges of runs, by events": _event_pairs,
}
"""Counts: the share of a constant number has the same rank."""

AFTERWARDS: dict[str, Predictor] = {
    "SCBM-IAS without failed": lambda suite, facts, masks: (visited_by(suite, facts) & ~masks["failed"]).bit_count(),
}
"""Predictors that were tried after the results were seen; no hypothesis is about them."""
