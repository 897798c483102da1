"""Uniting stores is commutative, associative and idempotent, and the figure is that of one run of all the cases."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.strategies import SearchStrategy
from msgspec.structs import replace

from scbm.cases.coverage import Coverage, Obligations
from scbm.cases.trace import End
from scbm.store import History, Recipe, combine_stores, read_history
from scbm.testing import CaseResult, Verdict
from support.profiles import examples
from support.stores import cell, results, store

Pairs = Sequence[tuple[Recipe, CaseResult]]

BITS = len(Obligations.of(cell()).all)


def pairs() -> SearchStrategy[Pairs]:
    """Some of eight cases, each with anything that may have come of it: real runs need not agree."""
    case = st.sampled_from(results(1, 8))
    ends = [end for end in End if end is not End.LOST]
    outcome = st.tuples(st.integers(0, 2**BITS - 1), st.sampled_from(ends), st.integers(0, 5))
    result = st.builds(
        lambda pair, o: (pair[0], replace(pair[1], visited=o[0], verdict=Verdict(o[1]), ended_ns=o[2])), case, outcome
    )
    return st.lists(result, min_size=1, max_size=5, unique_by=lambda pair: str(pair[0]))


def _combined(directory: Path, *paths: Path) -> Path:
    target = directory / f"{len(list(directory.iterdir()))}.db"
    combine_stores(paths, target)
    return target


def _seen(path: Path) -> History:
    return read_history(path)


@pytest.mark.slow
@examples(20)
@given(st.tuples(pairs(), pairs(), pairs()))
def test_stores_are_united_in_any_order_and_any_groups(drawn: tuple[Pairs, Pairs, Pairs]) -> None:
    with TemporaryDirectory() as name:
        directory = Path(name)
        a, b, c = (store(directory / f"s{number}", number, run) for number, run in enumerate(drawn))
        left = _seen(_combined(directory, _combined(directory, a, b), c))
        assert _seen(_combined(directory, a, _combined(directory, b, c))) == left
        assert _seen(_combined(directory, c, b, a)) == left
        assert _seen(_combined(directory, _combined(directory, c, a), _combined(directory, b, a), a, a)) == left
        assert _seen(_combined(directory, a, a)) == _seen(a)


@examples(20, usual=3)
@given(st.lists(pairs(), min_size=1, max_size=3))
def test_the_union_visits_what_one_run_of_all_the_cases_visits(runs: list[Pairs]) -> None:
    with TemporaryDirectory() as name:
        directory = Path(name)
        stores = [store(directory / f"s{number}", number, run) for number, run in enumerate(runs)]
        history = _seen(_combined(directory, *stores))
        total = Coverage(Obligations.of(cell()))
        for run in runs:
            total += Coverage(total.obligations, tuple((r.case.name, r.visited) for _, r in run))
        assert dict(history.coverage.cases) == dict(total.cases)
        assert history.coverage.figure == total.figure
