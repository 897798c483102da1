"""The content of a coverage store: a model, its runs, and the visits of each case. A value, without I/O."""

from __future__ import annotations

from collections import Counter
from functools import cached_property
from hashlib import sha256
from json import dumps
from typing import TYPE_CHECKING, TypeAlias

from msgspec import Struct

from scbm.cases.coverage import Coverage, LiftedStatuses, Obligations, Statuses
from scbm.cases.trace import End
from scbm.model import FIRST_PLANNER
from scbm.store.stored_mutants import find_evidence
from scbm.testing import Unjudged
from scbm.testing.decided_requirements import checked_requirements

if TYPE_CHECKING:
    from scbm.cases.coverage import AssertionEvidence, ObjectListVisits, Obligation
    from scbm.model import BehaviorModel, Waiver
    from scbm.running.simulation.device_hazards import Hazard
    from scbm.store.smallest_cases import SmallestCase
    from scbm.store.stored_evidence import StoredCertificate
    from scbm.store.stored_mutants import StoredMutation
    from scbm.testing import Excuse, Verdict
    from scbm.testing.decided_requirements import CheckedRequirement, KnownDecision


_KEY_BYTES = 16


class ModelSource(Struct, frozen=True):
    """A model file as it was when it was tested.

    Attributes:
        path: where it was, as the command line named it.
        text: its content, with comments and layout.
    """

    path: str
    text: str


class StoredRun(Struct, frozen=True):
    """One run of a command that tested cases.

    Attributes:
        id: 32 hexadecimal digits that no other run has.
        started: when it began, as `2026-11-21T17:38:00.123456Z`; texts so sort by time.
        command: the command line.
        source: the model file.
        visited: what its cases visited, as bits, whether or not a later run had the same cases.
        cases: how many it ran.
        failed: how many of these failed.
        is_earlier: whether it tested an earlier version of the model.
        is_finished: whether it came to its end.
        nodes: where its cases ran, in words: `over DDS domain 0`; `None` for simulation.
        planner: the name and the version of the planner.
        waivers: the waivers that counted in it, those of the model file and those beside it.
        order_time: its place among the runs, as a time, if that is not `started`: a store orders runs by when they were
            added, whatever the clock said.
    """

    id: str
    started: str
    command: str
    source: ModelSource
    visited: int = 0
    cases: int = 0
    failed: int = 0
    is_earlier: bool = False
    is_finished: bool = False
    nodes: str | None = None
    planner: str = str(FIRST_PLANNER)
    order_time: str | None = None
    waivers: tuple[Waiver, ...] = ()


class Written(Struct, frozen=True):
    """A case from a file, or from a test.

    Attributes:
        text: the case as YAML.
        path: the file, as the command line named it.
        requirements: name and sentence of the requirements that the command line added.
        time_limit_ns: the time limit of the command line, for a case without its own; `None` for none.
        real: if it ran over nodes, the resources that were real, in the order of the model; `None` in simulation.
    """

    text: str
    path: str
    requirements: tuple[tuple[str, str], ...] = ()
    time_limit_ns: int | None = None
    real: tuple[str, ...] | None = None

    @property
    def is_of_test(self) -> bool:
        """Whether a test in Python made it, so that no file of cases has it."""
        return self.path.endswith(".py")


class Drawn(Struct, frozen=True):
    """A random case: what it was drawn from.

    Attributes:
        seed: the seed of its campaign.
        number: its number there, from 1.
        network: network faults in the syntax of `--network`; `drawn` for new ones in each case; empty for none.
        requirements: name and sentence of the requirements beside those of the model.
        time_limit_ns: the time limit of the command line; `None` for none.
        real: as of a written one.
        moves_inputs: whether inputs and published values without environment transitions are moved (`--inputs drawn`).
        goals: the largest number of goals that it could have drawn (`--goals`).
    """

    seed: int
    number: int
    network: str = ""
    requirements: tuple[tuple[str, str], ...] = ()
    time_limit_ns: int | None = None
    real: tuple[str, ...] | None = None
    moves_inputs: bool = False
    goals: int = 1


Recipe: TypeAlias = Written | Drawn
"""The data that determine a case of a model, and whether it ran over nodes or in simulation."""


class StoredCase(Struct, frozen=True):
    """A case as a store keeps it.

    Attributes:
        key: its identity: a digest of model and recipe.
        name: its name; several cases of a store can have one, see `History.labels`.
        recipe: what decides it.
        goal: the name of its goal, or its predicate if it has none.
        run: the latest run that had it: an index into `History.runs`.
        position: its place in that run, from 1.
        verdict: how it ended, and why it failed if it did.
        ended_ns: how long its run took, in simulated time.
        requests: how many requests its run sent.
        visited: the obligations of the store's model that it visited, as bits.
        is_earlier: whether it was run on an earlier version of the model; it cannot be run again then.
        log: if it ran over nodes, the log of that, packed: see `packed_log`.
        forced: of the visited obligations those that it visited only after its state was forced, as bits.
        excluded: over nodes the number of values that drivers sent and the model excludes.
        smallest: the smallest cases that its run found for its failures; other cases with a failure have none.
        hazards: in simulation what devices did and the controller did not know.
        unjudged: why `non_blocking` does not judge it; `None` if it does, or is switched off.
    """

    key: bytes
    name: str
    recipe: Recipe
    goal: str
    run: int
    position: int
    verdict: Verdict
    ended_ns: int
    requests: int
    visited: int
    is_earlier: bool = False
    log: bytes | None = None
    forced: int = 0
    excluded: int = 0
    smallest: tuple[SmallestCase, ...] = ()
    hazards: tuple[Hazard, ...] = ()
    unjudged: Unjudged | None = None

    @property
    def is_over_nodes(self) -> bool:
        """Whether it ran over nodes: then the case alone does not give its run again."""
        return self.recipe.real is not None

    @property
    def is_lost(self) -> bool:
        """Whether its run was not finished, as a node was lost. What is not finished is in no store on disk."""
        return self.verdict.end is End.LOST

    @property
    def is_shown_again(self) -> bool:
        """Whether its run can be had again: in simulation of the case, over nodes of its log."""
        return not (self.is_earlier or self.is_lost)


class ObligationChange(Struct, frozen=True):
    """An obligation that only one of two runs visited.

    Attributes:
        obligation: the obligation.
        is_gained: whether the later run visited it.
        cases: the cases that visited it, as reports name them.
    """

    obligation: Obligation
    is_gained: bool
    cases: tuple[str, ...]


class VerdictChange(Struct, frozen=True):
    """A case that failed in one of two runs and not in the other.

    Attributes:
        case: the case, as reports name it.
        failed_then: whether it failed in the earlier run; `None` if it did not run there.
        failed_now: whether it failed in the later run; `None` if it did not run there.
        message: the first failure in the later run; empty for none.
    """

    case: str
    failed_then: bool | None
    failed_now: bool | None
    message: str = ""


class RunComparison(Struct, frozen=True):
    """The differences between the last run of a store and an earlier one.

    Attributes:
        now: the last run.
        then: the earlier run; `None` if the store has none that is finished.
        obligations: the obligations of the figure that only one of them visited, those of the last run first.
        verdicts: the cases that failed in one of them alone, those of the last run first.
    """

    now: StoredRun
    then: StoredRun | None = None
    obligations: tuple[ObligationChange, ...] = ()
    verdicts: tuple[VerdictChange, ...] = ()


class History(Struct, frozen=True, dict=True):
    """The content of a store.

    Attributes:
        model: the model.
        runs: in the order in which they were added, and after `combine` in that of their times.
        cases: in the order of their runs, and of their places there.
        outdated: how many cases are left out, as a later run had another version of their file.
        certificates: the certificates that were added, those of earlier versions of the model included.
        decided: the statuses of obligations, as the command line found them; `None` if visits alone decide them.
        mutations: the results of mutants.
        others: what cases of the same lifted model visited under other objects.
        decisions: the answers of the last closing about requirements.
        since: the last run compared with an earlier one; `None` if that was not asked for.
    """

    model: BehaviorModel
    runs: tuple[StoredRun, ...]
    cases: tuple[StoredCase, ...]
    outdated: int = 0
    certificates: tuple[StoredCertificate, ...] = ()
    decided: Statuses | None = None
    mutations: tuple[StoredMutation, ...] = ()
    others: tuple[ObjectListVisits, ...] = ()
    decisions: tuple[KnownDecision, ...] = ()
    since: RunComparison | None = None

    @property
    def requirements(self) -> tuple[CheckedRequirement, ...]:
        """What cases and closing say of requirements."""
        cases = [case for case in self.cases if not case.is_earlier]
        unjudged = Counter(case.unjudged for case in cases if case.unjudged is not None)
        own = [requirement.name for requirement in self.model.requirements]
        asked = {each.name: (0, 0) for each in self.decisions if not each.is_built_in and each.name not in own}
        for case in cases:
            for sentence in dict.fromkeys(sentence for _, sentence in case.recipe.requirements):
                count, without = asked.get(sentence, (0, 0))
                asked[sentence] = count + 1, without + (case.unjudged is Unjudged.NO_RUN)
        return checked_requirements(self.model, self.decisions, len(cases), unjudged, asked)

    @property
    def waivers(self) -> tuple[Waiver, ...]:
        """The waivers of the last run of this model."""
        return next(run.waivers for run in reversed(self.runs) if not run.is_earlier)

    @cached_property
    def statuses(self) -> Statuses:
        """The statuses of obligations; without certificates and waivers visits alone decide them."""
        return self.decided or Statuses.of(self.coverage, forced=self.forced)

    @cached_property
    def lifted(self) -> LiftedStatuses | None:
        """The statuses of lifted obligations; `None` for a model without parameters."""
        return LiftedStatuses.of(self.model, self.statuses, self.others)

    @cached_property
    def evidence(self) -> AssertionEvidence:
        """The answers of mutant results about the obligations that the cases visit."""
        return find_evidence(self.mutations, [case.key for case in self.cases], self.obligations, self.coverage.visited)

    @cached_property
    def forced(self) -> int:
        """The obligations that cases visit only after their states were forced, as bits."""
        freely = 0
        for case in self.cases:
            freely |= case.visited & ~case.forced
        return self.coverage.visited & ~freely

    @property
    def source(self) -> ModelSource:
        """The model file, as the last run of this model had it."""
        return next(run.source for run in reversed(self.runs) if not run.is_earlier)

    @cached_property
    def obligations(self) -> Obligations:
        """The obligations of the model."""
        return Obligations.of(self.model)

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """For each case its name; where several have one name, with the first digits of the key behind it."""
        names = Counter(case.name for case in self.cases)
        return tuple(label_of(case.name, case.key, names[case.name]) for case in self.cases)

    @cached_property
    def coverage(self) -> Coverage:
        """The coverage of the cases, which have their labels as names."""
        return Coverage(self.obligations, tuple(zip(self.labels, (c.visited for c in self.cases), strict=True)))

    @cached_property
    def visits(self) -> dict[Obligation, int]:
        """For each obligation the number of cases that visited it."""
        return self.coverage.visits()

    @property
    def failed(self) -> tuple[StoredCase, ...]:
        """The cases that failed."""
        return tuple(case for case in self.cases if not case.verdict.passed)

    @property
    def short(self) -> dict[Excuse, int]:
        """The number of goals that passing cases missed, by the reason."""
        found: dict[Excuse, int] = {}
        for excuse in (excuse for case in self.cases if case.verdict.is_short for excuse in case.verdict.excuses):
            found[excuse] = found.get(excuse, 0) + 1
        return found

    @property
    def short_count(self) -> int:
        """The number of cases that passed although they missed a goal."""
        return sum(case.verdict.is_short for case in self.cases)

    @property
    def hazards(self) -> tuple[tuple[str, Hazard], ...]:
        """The hazards at devices, each with the label of its case."""
        cases = zip(self.labels, self.cases, strict=True)
        return tuple((label, hazard) for label, case in cases for hazard in case.hazards)

    @property
    def ended_ns(self) -> int:
        """The total duration of all cases, in time of their runs: simulated, and over nodes."""
        return sum(case.ended_ns for case in self.cases)

    @property
    def over_nodes_ns(self) -> int:
        """The part of `ended_ns` over nodes."""
        return sum(case.ended_ns for case in self.cases if case.is_over_nodes)

    def where(self, case: StoredCase) -> str | None:
        """Return where the last run of a case took place, in words; `None` for simulation."""
        return self.runs[case.run].nodes if case.is_over_nodes else None


def label_of(name: str, key: bytes, count: int) -> str:
    """Return how reports name a case; `count` is how many cases of the store have its name."""
    return name if count == 1 else f"{name}.{key.hex()[:8]}"


def sayable(text: str) -> str:
    """Return a text as a store can keep it: bytes of a path that are no UTF-8 are written out, as Python does."""
    return text.encode(errors="backslashreplace").decode()


def key_of(recipe: Recipe, model_digest: str, planner: str = FIRST_PLANNER.name) -> bytes:
    """Return the key of a case: 16 bytes of the SHA-256 of its recipe, its model, and its planner with its limits.

    Where its file is does not matter, nor where its nodes met and how fast their time went. Defaults are left out. Keys
    are a part of the format: a change of them needs another version of the tables.
    """
    if isinstance(recipe, Written):
        parts: list[object] = ["written", recipe.text]
    else:
        parts = ["drawn", recipe.seed, recipe.number, recipe.network]
        parts += ["inputs"] if recipe.moves_inputs else []
        parts += [] if recipe.goals == 1 else ["goals", recipe.goals]
    parts += [recipe.requirements, recipe.time_limit_ns]
    parts += [] if recipe.real is None else [recipe.real]
    parts += [] if planner == FIRST_PLANNER.name else [planner]
    return sha256(dumps([model_digest, *parts]).encode()).digest()[:_KEY_BYTES]
