"""`scbm mutate --store`: takes results of mutants from a coverage store, and adds new ones at once (decision 52)."""

from __future__ import annotations

import json
from contextlib import contextmanager
from typing import TYPE_CHECKING

from msgspec.structs import asdict, replace

from scbm.cases.coverage import MutantStatus
from scbm.cli.campaigns.store_keeper import recipe_of
from scbm.model.visible_text import counted
from scbm.mutation.distinct_mutants import mutants_of
from scbm.mutation.mutant_results import MutantResult
from scbm.planning import planner_of_random_runs
from scbm.store import (
    RECORDED,
    VERDICTS,
    MutantWriter,
    MutatedSuite,
    StoredMutant,
    basis_of,
    digest_of,
    key_of,
    network_words,
    read_limits,
    time_now,
    write_mutants,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path

    from scbm.closing import CloseLimits
    from scbm.model import BehaviorModel, Requirement
    from scbm.mutation.mutants import Mutant
    from scbm.testing.suite import Suite


@contextmanager
def keeping_mutants(path: Path, suite: Suite, limits: CloseLimits | None, *, records: bool) -> Iterator[MutantKeeper]:
    """Return a keeper for the results of mutants of a suite. Raise `InputError` if the store cannot be used.

    Args:
        path: the store.
        suite: the cases, with the model.
        limits: the limits for deciding about mutants that no case killed; `None` does not decide about them.
        records: whether a case also fails if it does something else than on the model.
    """
    model = suite.model
    oracle = RECORDED if records else VERDICTS
    count = sum(1 for _ in mutants_of(model))
    mutated = MutatedSuite(basis_of(model), oracle, _case_keys(suite), count, time_now())
    with write_mutants(path, model, mutated) as writer:
        words = None if limits is None else json.dumps(asdict(limits), sort_keys=True)
        yield MutantKeeper(writer, model, words, suite.requirements)


def _case_keys(suite: Suite) -> tuple[bytes, ...]:
    """Return the keys that a store gives to the cases of a suite, in ascending order."""
    digest, words = digest_of(suite.model), network_words(suite.network)
    planner = planner_of_random_runs(suite.model).words
    recipes = (recipe_of(case, None, suite.by_name, words, suite.model) for case in suite.work.cases())
    return tuple(sorted(dict.fromkeys(key_of(recipe, digest, planner) for recipe in recipes)))


class MutantKeeper:
    """Gives the results of mutants that a store has, and adds new ones.

    Attributes:
        added: the names of the mutants whose results were added or changed.
    """

    def __init__(
        self, writer: MutantWriter, model: BehaviorModel, limits: str | None, requirements: Sequence[Requirement]
    ) -> None:
        self._writer = writer
        self._model = model
        self._limits = limits
        self._sentences = [requirement.sentence for requirement in requirements]
        self.added: dict[str, None] = {}

    @property
    def known_in_words(self) -> str:
        """The number of results that the store has for this suite, as a sentence."""
        count = len(self._writer.known)
        return f"the results of {counted(count, 'mutant')}" if count else "no result of these cases"

    def ran(self, mutants: Iterable[Mutant]) -> dict[str, MutantResult]:
        """Return what the cases did on those of some mutants that the store has, by their names.

        Decisions about mutants that no case killed are left out.
        """
        known = self._writer.known
        return {m.name: self._ran(known[m.name], m) for m in mutants if m.name in known}

    def _ran(self, stored: StoredMutant, mutant: Mutant) -> MutantResult:
        if stored.status is not MutantStatus.KILLED:
            stored = replace(
                stored, status=MutantStatus.UNDECIDED, reason="", witness=None, is_benign=False, is_killable=False
            )
        return MutantResult.of_stored(stored, mutant, self._model)

    def decided(self, result: MutantResult) -> MutantResult | None:
        """Return the result of a mutant that no case killed with the decision in the store; `None` if it has none.

        A decision under larger limits counts, too: it was looked for at least as long. A witness counts if it was
        judged by the same requirements.
        """
        wanted = self._limits or ""
        known = self._writer.decisions.get(result.mutant.name, {})
        larger = [stored for limits, stored in known.items() if wanted and _covers(limits, wanted)]
        stored = known.get(wanted) or max(larger, key=lambda each: each.rank, default=None)
        if stored is None:
            return None
        decided = result.stored(self._model).decided_by(stored)
        found = MutantResult.of_stored(decided, result.mutant, self._model)
        if found.witness is not None and [each.sentence for each in found.witness.requirements] != self._sentences:
            return None
        self._add(decided)
        return found

    def add(self, result: MutantResult, *, is_decided: bool) -> None:
        """Add a result. Raise `InputError` if the store cannot be written.

        Args:
            result: the result.
            is_decided: whether a proof or a witness was looked for.
        """
        self._add(result.stored(self._model, self._limits if is_decided else None))

    def _add(self, stored: StoredMutant) -> None:
        known = self._writer.known.get(stored.name)
        if known == stored:
            return
        self._writer.add(stored)
        self._writer.known[stored.name] = stored
        self.added[stored.name] = None


def _covers(known: str, wanted: str) -> bool:
    """Return whether no limit of `known` is smaller than in `wanted`; both are texts of limits."""
    have, need = read_limits(known), read_limits(wanted)
    return have.keys() == need.keys() and all(have[name] >= need[name] for name in need)
