"""Stores for tests: the runs of a model that a command line would have added."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

from scbm.cases import Case, Network
from scbm.files import write_model
from scbm.model import BehaviorModel
from scbm.store import ModelSource, Recipe, StoredRun, drawn_recipe, write_store
from scbm.testing import CaseResult, RandomCases, Tester
from support.models import scan_cell


def cell(*replacements: tuple[str, str]) -> BehaviorModel:
    """The scanning cell whose scanner fails every other time, with texts replaced."""
    measures = "    measures: [temperature]\n"
    simulation = "    simulation: {outcomes: {succeed: 0.5, fail: 0.5, timeout: 0}}\n"
    return scan_cell((measures, measures + simulation), *replacements, is_open=True)


def a_run(number: int, model: BehaviorModel, text: str | None = None) -> StoredRun:
    """A run that no other number gives, and that began after those of smaller numbers."""
    source = ModelSource("cell.yaml", write_model(model) if text is None else text)
    return StoredRun(f"{number:032x}", f"2026-11-21T12:00:00.{number:06d}Z", f"scbm test {number}", source)


@lru_cache
def results(seed: int, count: int, network: str = "") -> tuple[tuple[Recipe, CaseResult], ...]:
    """Cases of the scanning cell that were run, with their recipes."""
    model = cell()
    drawn = RandomCases(model, network=None if network == "drawn" else Network()).first(count, seed)
    return tuple((_recipe(case, network), result) for case, result in _run(model, drawn))


def _recipe(case: Case, network: str) -> Recipe:
    return drawn_recipe(case, network)


def _run(model: BehaviorModel, cases: Iterable[Case]) -> Iterable[tuple[Case, CaseResult]]:
    tester = Tester(model)
    return ((case, tester.execute(case).result) for case in cases)


def store(
    path: Path, number: int, pairs: Iterable[tuple[Recipe, CaseResult]], model: BehaviorModel | None = None
) -> Path:
    """Adds a run with these results to a store."""
    of = model or cell()
    with write_store(path, of, a_run(number, of)) as writer:
        for position, (recipe, result) in enumerate(pairs, start=1):
            writer.add(position, recipe, result)
    return path
