"""The content of reports about mutants: the results with their suite, by operator and by entry of the model."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import Decision, MutantStatus
from scbm.cases.coverage.assumptions import assumptions
from scbm.mutation.mutant_results import MutantCounts
from scbm.mutation.mutants import WHOLE_ENTRIES
from scbm.mutation.mutation_operators import MUTATIONS
from scbm.planning import planner_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.cases import Case
    from scbm.files import Places
    from scbm.model import BehaviorModel
    from scbm.mutation.mutant_results import MutantResult
    from scbm.mutation.mutants import Mutant


BENIGN = "breaks no requirement"
"""The words of reports for a mutant whose witness violates no requirement that the model satisfies there."""


class MutationSummary(Struct, frozen=True):
    """The results of mutants of one model.

    Attributes:
        model: the model.
        file: its file.
        places: where its parts are written.
        suite: the suite in words.
        cases: the number of cases that can kill: they pass on the model.
        failing: the names of the other cases.
        results: the results, operator by operator.
        command: the command of the campaign.
        ended_early: how far the campaign was when the user interrupted it; empty if it is complete.
    """

    model: BehaviorModel
    file: str
    places: Places
    suite: str
    cases: int
    failing: tuple[str, ...]
    results: tuple[MutantResult, ...]
    command: str
    ended_early: str = ""

    @property
    def counts(self) -> MutantCounts:
        """The statuses of all mutants."""
        return MutantCounts.of(self.results)

    @property
    def benign(self) -> int:
        """The number of mutants that survived and break no requirement in their witness that the model keeps there."""
        return sum(result.is_benign for result in self.results)

    @property
    def assumptions(self) -> tuple[str, ...]:
        """The assumptions of proofs of equivalence, one sentence each; empty without proofs."""
        if not self.counts.of_status(MutantStatus.EQUIVALENT):
            return ()
        planner = planner_of(self.model).name
        found = assumptions(self.model, [Decision.EXCLUDED], planner=planner)  # they are about the plans of its runs
        return (*found, "No injection forces a state.")

    @property
    def runs(self) -> int:
        """The number of runs of a case on a mutant."""
        return sum(result.runs for result in self.results)

    @property
    def skipped(self) -> int:
        """The number of runs that were left out, as they cannot differ from those on the original."""
        return sum(result.skipped for result in self.results)

    def by_operator(self) -> dict[str, MutantCounts]:
        """Return the statuses of the mutants of each operator that made some, in the order of `MUTATIONS`."""
        found = self._grouped(lambda result: result.mutant.operator)
        return {name: found[name] for name in MUTATIONS if name in found}

    def by_entry(self) -> dict[str, MutantCounts]:
        """Return the statuses of the mutants of each operation and each other entry, in the order of the file."""
        found = self._grouped(lambda result: result.mutant.owner)
        return dict(sorted(found.items(), key=lambda item: self._lines[item[0]]))

    @property
    def witnesses(self) -> tuple[tuple[Case, tuple[str, ...]], ...]:
        """The witnesses that pass on the model, those that kill a mutant first, each with a comment in lines.

        The comment names the mutants that it kills, and those that it only shows, with the differences.
        """
        found: dict[str, tuple[Case, list[str]]] = {}
        for kills, head in (
            (True, "fails on these mutants of the model:"),
            (False, "passes on these mutants, until it has an expectation that they break:"),
        ):
            for result in self.not_killed:
                witness = result.witness
                if witness is not None and result.is_killable is kills and (kills or witness.recorded is not None):
                    comment = found.setdefault(witness.name, (witness, []))[1]
                    comment += [] if head in comment else [head]
                    name = result.mutant.name
                    comment += [name] if kills else [f"{name}:", f"  {result.reason}"]
        return tuple((case, tuple(lines)) for case, lines in found.values())

    @property
    def not_killed(self) -> tuple[MutantResult, ...]:
        """The results of mutants that survived or are undecided, in the order of the file."""
        missed = (MutantStatus.SURVIVED, MutantStatus.UNDECIDED)
        return tuple(sorted((r for r in self.results if r.status in missed), key=self._position))

    def line(self, result: MutantResult) -> int:
        """Return the line of the changed part in the model file."""
        return self.places.find(result.mutant.path)[0].line

    @property
    def _lines(self) -> dict[str, int]:
        found: dict[str, int] = {}
        for result in self.results:
            line = self.places.find(result.mutant.path[:2])[0].line
            found.setdefault(result.mutant.owner, line)
        return found

    def _position(self, result: MutantResult) -> tuple[int, int]:
        place = self.places.find(result.mutant.path)[0]
        return place.line, place.column

    def _grouped(self, key: Callable[[MutantResult], str]) -> dict[str, MutantCounts]:
        groups: dict[str, list[MutantResult]] = {}
        for result in self.results:
            groups.setdefault(key(result), []).append(result)
        return {name: MutantCounts.of(group) for name, group in groups.items()}


def change_in_words(mutant: Mutant) -> str:
    """Return what a mutant changes in one line, with the part: `pre.g: drop robot_at == box_a`."""
    part = mutant.parts[0]
    return mutant.change if part in WHOLE_ENTRIES else f"{part}: {mutant.change}"
