"""What is known of each requirement beside the cases that check it: the answer of the last closing in all runs."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.model.requirements import BUILT_IN_NAMES
from scbm.model.visible_text import counted

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.model import BehaviorModel


class RequirementStatus(StrEnum):
    """The answer of closing about a requirement."""

    HOLDS = "holds"
    HOLDS_CANONICAL = "holds_canonical"
    HOLDS_PLANNER = "holds_planner"
    """It holds under the plans of another planner than the canonical one."""
    VIOLATED = "violated"
    UNDECIDED = "undecided"
    CASES_ONLY = "cases_only"
    OFF = "off"


_WORDS = {
    RequirementStatus.HOLDS: "holds",
    RequirementStatus.HOLDS_CANONICAL: "holds under canonical plans",
    RequirementStatus.HOLDS_PLANNER: "holds under the plans of this planner",
    RequirementStatus.VIOLATED: "violated",
    RequirementStatus.UNDECIDED: "undecided",
    RequirementStatus.CASES_ONLY: "judged by cases",
    RequirementStatus.OFF: "off",
}


class KnownDecision(Struct, frozen=True):
    """The answer of the last closing of a model about one requirement.

    Attributes:
        name: its name.
        is_built_in: whether it is a built-in requirement; one of the user may be called alike.
        status: the answer.
        reason: where it holds, how the case violates it, or why it is open.
        case: the name of the case that violates it; empty for none.
        undeclared: as in `words_of_undeclared`; empty if the answer does not rest on such variables.
    """

    name: str
    is_built_in: bool
    status: RequirementStatus
    reason: str
    case: str = ""
    undeclared: tuple[str, ...] = ()

    @property
    def words(self) -> str:
        """The answer in few words."""
        if self.case:
            return f"violated by {self.case}"
        return f"{_WORDS[self.status]}{words_of_undeclared(self.undeclared)}"


def words_of_undeclared(names: Sequence[str]) -> str:
    """Return the condition under which a requirement holds, as the end of a sentence; empty without one.

    Args:
        names: variables without `source` that the model assigns, so that they count as inputs. The requirement is
            violated if only the model changes them.
    """
    if not names:
        return ""
    listed = f"`{'`, `'.join(names)}`"
    they, have, them = ("it", "has", "it") if len(names) == 1 else ("they", "have", "them")
    return (
        f", if {listed} can be changed from outside: {they} {have} no `source`; write `source: state` if only the "
        f"model changes {them}"
    )


class CheckedRequirement(Struct, frozen=True):
    """A requirement with the number of cases that check it, and the answer of closing.

    Attributes:
        name: its name.
        is_built_in: as in `KnownDecision`.
        cases: how many cases check it.
        decision: the answer; `None` if the model was not closed with `--requirements` and `--store`.
    """

    name: str
    is_built_in: bool
    cases: int
    decision: KnownDecision | None

    @property
    def words(self) -> str:
        """What is known of it, in few words."""
        answer = "not decided" if self.decision is None else self.decision.words
        return f"checked in {counted(self.cases, 'case')}; {answer}"


def checked_requirements(
    model: BehaviorModel, decisions: Iterable[KnownDecision], cases: int
) -> tuple[CheckedRequirement, ...]:
    """Return what is known of the requirements of a model, and of the built-in ones that were decided.

    Args:
        model: the model.
        decisions: the answers of the last closing of the same model.
        cases: how many cases there are; each checks all of these requirements.
    """
    return tuple(_checked(model, {(each.name, each.is_built_in): each for each in decisions}, cases))


def _checked(
    model: BehaviorModel, known: dict[tuple[str, bool], KnownDecision], cases: int
) -> Iterator[CheckedRequirement]:
    for requirement in model.requirements:
        yield CheckedRequirement(requirement.name, False, cases, known.get((requirement.name, False)))
    off = [name for name, _ in model.requirements_off]
    for name in (*BUILT_IN_NAMES, *model.requirements_on):
        if (name, True) in known and name not in off and known[name, True].status is not RequirementStatus.OFF:
            yield CheckedRequirement(name, True, cases, known[name, True])
