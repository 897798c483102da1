"""Results of mutants as a store keeps them, and what they say about the obligations that cases visit (decision 52)."""

from __future__ import annotations

import json
from collections import Counter
from hashlib import sha256
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import asdict, replace

from scbm import __version__
from scbm.cases.coverage import NO_MUTANTS, AssertedObligations, AssertionEvidence, MutantNotice, MutantStatus
from scbm.files import write_model
from scbm.model.json_reader import convert_json, read_json

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Sequence

    from scbm.cases.coverage import Obligations
    from scbm.model import BehaviorModel

KEY_BYTES = 16

_MAX_LIMITS_CHARACTERS = 10_000
"""The maximum length of limits as text, which are some numbers; a store that holds a longer text is damaged."""

VERDICTS = "verdicts"
"""The oracle of `scbm test`: the verdicts of the cases as they are."""

RECORDED = "recorded"
"""The oracle `--oracle recorded`: verdicts of the cases, each with the recorded result of the original."""

OPERATORS_VERSION = 2
"""The version of the mutation operators. A new operator raises it, and so does a change after which an operator makes
other mutants of some model, or gives them other names: results of the operators before do not count any more.
"""

MADE_BY = f"scbm {__version__}, operators {OPERATORS_VERSION}"
"""The versions that decide the results of mutants beside models and cases. Results of other versions do not count."""

_STRENGTH = (MutantStatus.UNDECIDED, MutantStatus.SURVIVED, MutantStatus.EQUIVALENT, MutantStatus.KILLED)
"""The statuses, the one first that gives way to all others where results of several suites are added up."""


class MutatedSuite(Struct, frozen=True):
    """A suite that is run against mutants of a model.

    Attributes:
        basis: identifies the model, with its planner and with what changes from outside.
        oracle: `VERDICTS` or `RECORDED`.
        cases: the keys of the cases in ascending order, those of failing cases included.
        mutants: the number of mutants of the model.
        started: when the last command that ran it began, in UTC.
        made_by: the versions of scbm and of the mutation operators.
    """

    basis: str
    oracle: str
    cases: tuple[bytes, ...]
    mutants: int
    started: str
    made_by: str = MADE_BY

    @property
    def key(self) -> bytes:
        """The identity of the suite: 16 bytes of a SHA-256."""
        text = json.dumps([self.basis, self.oracle, self.made_by, [case.hex() for case in self.cases]])
        return sha256(text.encode()).digest()[:KEY_BYTES]


class StoredMutant(Struct, frozen=True):
    """The result of one mutant.

    Attributes:
        name: its name.
        status: its status.
        case: the name of the first case that killed it; empty if none did.
        reason: why that case failed, or why the mutant is undecided, or its witness does not kill it.
        runs: the number of cases that were run.
        skipped: the number of cases whose run could not differ.
        belongs: the obligations that it belongs to, as bits.
        noticed: of these the ones that a case visits which kills it.
        limits: the limits of the search for a proof or a witness, as text; `None` if there was no search.
        witness: the witness as YAML; `None` if there is none.
        is_benign: whether it breaks no requirement in the run of the witness that the original keeps there.
        is_killable: whether the witness fails on it.
    """

    name: str
    status: MutantStatus
    case: str
    reason: str
    runs: int
    skipped: int
    belongs: int
    noticed: int
    limits: str | None = None
    witness: str | None = None
    is_benign: bool = False
    is_killable: bool = False

    def decided_by(self, other: StoredMutant) -> StoredMutant:
        """Return this result of a mutant that no case killed with the decision of another suite about it."""
        decision = replace(self, status=other.status, reason=other.reason, limits=other.limits, witness=other.witness)
        return replace(decision, is_benign=other.is_benign, is_killable=other.is_killable)

    @property
    def notice(self) -> MutantNotice:
        """The answer of this result about obligations."""
        return MutantNotice(self.belongs, self.noticed, self.status)

    @property
    def rank(self) -> tuple[object, ...]:
        """A total order of results of one mutant in one suite; of two the greater one is kept."""
        is_decided = self.limits is not None
        return is_decided, _STRENGTH.index(self.status), self.limits or "", json.dumps(asdict(self), sort_keys=True)


class StoredMutation(Struct, frozen=True):
    """A suite with the results of its mutants."""

    suite: MutatedSuite
    results: tuple[StoredMutant, ...]

    @property
    def is_whole(self) -> bool:
        """Whether each mutant of the model has a result."""
        return len(self.results) == self.suite.mutants


def basis_of(model: BehaviorModel) -> str:
    """Return what identifies a model for mutants: all but its bindings, its waivers, comments and layout."""
    return sha256(write_model(replace(model.unbound, waivers=())).encode()).hexdigest()


_SHOWN = (MutantStatus.KILLED, MutantStatus.SURVIVED, MutantStatus.EQUIVALENT, MutantStatus.UNDECIDED)
"""The statuses in the order of reports."""


def mutations_in_words(mutations: Sequence[StoredMutation]) -> str:
    """Return the results of mutants of the suite that was run last, in words, and the number of other suites."""
    last = max(mutations, key=lambda each: (each.suite.started, each.suite.key))
    counts = Counter(result.status for result in last.results)
    words = ", ".join(f"{counts[status]} {status}" for status in _SHOWN)
    of_all = "" if last.is_whole else f" of {last.suite.mutants}"
    more = len(mutations) - 1
    others = f", and those of {more} earlier suite{'s' * (more > 1)}" if more else ""
    keys = len(last.suite.cases)
    cases = f"{keys} case{'s' * (keys != 1)}"
    return f"results of `scbm mutate`: {len(last.results)}{of_all} mutants with {cases}: {words}{others}"


def read_limits(text: str) -> dict[str, int]:
    """Return the limits in the text of a row. Raise `JsonError` for another text, as after damage of a store."""
    return convert_json(read_json(text, _MAX_LIMITS_CHARACTERS), dict[str, int])


def find_evidence(
    mutations: Sequence[StoredMutation],
    cases: Collection[bytes],
    obligations: Obligations,
    visited: int,
    basis: str | None = None,
) -> AssertionEvidence:
    """Return the answers that results of mutants give for the obligations that cases visit, or why they give none.

    Args:
        mutations: the results of a store.
        cases: the keys of the cases.
        obligations: the obligations of the model.
        visited: those that the cases visit, as bits.
        basis: identifies the model; `None` for the one that was mutated last.
    """
    if not mutations:
        return AssertionEvidence(None, NO_MUTANTS)
    current = [each for each in mutations if each.suite.made_by == MADE_BY]
    if not current:
        return AssertionEvidence(None, "the results of `scbm mutate` in the store are of another version of scbm")
    judged = [each for each in current if each.suite.oracle == VERDICTS]
    if not judged:
        return AssertionEvidence(None, "the results of `scbm mutate` in the store are for `--oracle recorded`")
    wanted = frozenset(cases)
    within = [each for each in judged if wanted.issuperset(each.suite.cases)]
    for name in (basis,) if basis is not None else _bases(within):
        alike = [each for each in within if each.suite.basis == name]
        whole = [each for each in alike if each.is_whole]
        if len({key for each in whole for key in each.suite.cases}) == len(wanted) and whole:
            notices = _added_up(whole)
            return AssertionEvidence(AssertedObligations.of(obligations, visited, notices))
        if len(whole) < len(alike):
            return AssertionEvidence(None, "the results of `scbm mutate` for these cases do not have all mutants")
    return AssertionEvidence(None, "the results of `scbm mutate` in the store are not about exactly these cases")


def _bases(mutations: Iterable[StoredMutation]) -> tuple[str, ...]:
    """Return what identifies the mutated models, the one that was mutated last first."""
    ordered = sorted(mutations, key=lambda each: (each.suite.started, each.suite.basis), reverse=True)
    return tuple(dict.fromkeys(each.suite.basis for each in ordered))


def _added_up(mutations: Iterable[StoredMutation]) -> tuple[MutantNotice, ...]:
    """Return what several suites together say about each mutant."""
    found: dict[str, MutantNotice] = {}
    for result in (result for mutation in mutations for result in mutation.results):
        known = found.get(result.name, result.notice)
        status = max(known.status, result.status, key=_STRENGTH.index)
        found[result.name] = MutantNotice(known.belongs, known.noticed | result.noticed, status)
    return tuple(found.values())
