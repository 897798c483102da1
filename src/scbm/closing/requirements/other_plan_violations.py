"""Cases with other plans than those of the planner that violate what holds under these (semantics 7.13)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.closing.requirements.violating_cases import RequirementKey, ViolatingCases, failure_of
from scbm.closing.scripts.case_plans import with_canonical_plans
from scbm.testing.decided_requirements import OtherPlans, RequirementStatus

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from scbm.closing.decisions import DecidedRequirement
    from scbm.closing.requirements.violation_search import ViolatingWalk
    from scbm.closing.runs.all_runs import AllRuns
    from scbm.model import BehaviorModel, Requirement

TOO_MANY = "runs with any plans are too many to explore"
_NOT_SHOWN = "a run with other plans violates it, and no simulated case that was tried shows it"


class OtherPlanViolations:
    """What runs with any plans do to requirements that no run with the plans of the planner violates.

    Attributes:
        cases: the cases that violate them.
    """

    def __init__(
        self, model: BehaviorModel, extra: Sequence[Requirement], most: int, progress: Callable[[str], None]
    ) -> None:
        """Know nothing yet; arguments as in `ViolatingCases`."""
        self.cases = ViolatingCases(with_canonical_plans(model), extra, most, progress, "-other-plans")
        self._unknown: dict[RequirementKey, str] = {}

    def leave_open(self, key: RequirementKey, reason: str = TOO_MANY) -> None:
        """Note why it is not known whether runs with any plans violate a requirement."""
        self._unknown[key] = reason

    def are_too_many(self, key: RequirementKey) -> bool:
        """Return whether it is open what runs with any plans do to a requirement, as they are too many."""
        return key not in self.cases and self._unknown.get(key) == TOO_MANY

    def rule_out(self, key: RequirementKey) -> None:
        """Note that no run with any plans violates a requirement."""
        self._unknown.pop(key, None)

    def show(self, runs: AllRuns, walks: Iterator[ViolatingWalk], keys: Sequence[RequirementKey]) -> None:
        """Run cases that follow walks with any plans until one violates each requirement."""
        self.cases.try_walks(runs, walks, keys)
        for key in keys:
            if key not in self.cases:
                self._unknown[key] = _NOT_SHOWN

    def show_drawn(
        self,
        runs: AllRuns,
        walks: Callable[[], Iterator[ViolatingWalk]],
        keys: Sequence[RequirementKey],
        cases: ViolatingCases,
    ) -> None:
        """Show violations in a model with drawn plans: by shortest plans in `cases`, else by longer ones."""
        wanted = [key for key in keys if key not in cases]
        cases.try_walks(runs, walks(), wanted)
        wanted = [key for key in wanted if key not in cases]
        self.show(runs, walks(), wanted)

    def added_to(self, decided: DecidedRequirement, taken: list[str]) -> DecidedRequirement:
        """Return a decision with what is known of other plans; `taken` are names of cases."""
        key = RequirementKey(decided.name, decided.is_built_in)
        if key in self.cases and (decided.holds or decided.status is RequirementStatus.UNDECIDED):
            execution, is_new = self.cases.smallest(key, taken)
            others = OtherPlans(execution.case.name, str(failure_of(key, execution)))
            return replace(decided, other_plans=others, other_execution=execution if is_new else None)
        if key in self._unknown and decided.holds:
            return replace(decided, other_plans=OtherPlans(reason=self._unknown[key]))
        return decided
