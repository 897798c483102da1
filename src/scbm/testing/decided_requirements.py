"""What is known of each requirement beside the cases that check it: the answer of the last closing in all runs."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.model.requirements import BUILT_IN_NAMES, BuiltIn
from scbm.model.sources import undeclared
from scbm.model.visible_text import counted
from scbm.testing.continuations.unjudged import Unjudged

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

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


class OtherPlans(Struct, frozen=True):
    """What is known of a requirement in runs with other plans than those of the planner, which do not violate it.

    Attributes:
        case: the name of a case with such plans that violates it; empty if none does.
        reason: how the case violates it, or why it is not known whether such a run does.
        file: the file of the case, if closing has written one.
        is_kept: whether the store has a case of this name.
    """

    case: str = ""
    reason: str = ""
    file: str = ""
    is_kept: bool = False

    @property
    def words(self) -> str:
        """What is known, as the end of a sentence; empty if no case violates it."""
        return f"; with other plans violated by {self.case}" if self.case else ""

    @property
    def stored_words(self) -> str:
        """The same in a report of a store, with the place of the case."""
        return f"{self.words}{_place_of(self.file, is_kept=self.is_kept)}" if self.case else ""

    @property
    def long_words(self) -> str:
        """What is known, with the reason, as the end of a sentence."""
        if self.case:
            return f"{self.stored_words}: {self.reason}"
        return f"; not decided with other plans: {self.reason}"


def _place_of(file: str, *, is_kept: bool) -> str:
    """Return the place of a case that closing names, where it is not in the store."""
    if is_kept:
        return ""
    return f" ({file})" if file else " (not in this store: add `--out` to `scbm close`)"


class KnownDecision(Struct, frozen=True):
    """The answer of the last closing of a model about one requirement.

    Attributes:
        name: its name; of a requirement of the command line its sentence.
        is_built_in: whether it is a built-in requirement; one of the user may be called alike.
        status: the answer.
        reason: where it holds, how the case violates it, or why it is open.
        case: the name of the case that violates it; empty for none.
        undeclared: as in `words_of_undeclared`; empty if the answer does not rest on such variables.
        file: the file of the case, if it has one.
        other_plans: what is known of other plans; `None` if there is no more to say.
        is_kept: whether the store has a case of this name.
    """

    name: str
    is_built_in: bool
    status: RequirementStatus
    reason: str
    case: str = ""
    undeclared: tuple[str, ...] = ()
    file: str = ""
    other_plans: OtherPlans | None = None
    is_kept: bool = False

    @property
    def words(self) -> str:
        """The answer in few words."""
        if self.case:
            return f"violated by {self.case}{_place_of(self.file, is_kept=self.is_kept)}"
        others = "" if self.other_plans is None else self.other_plans.stored_words
        return f"{_WORDS[self.status]}{words_of_undeclared(self.undeclared)}{others}"

    @property
    def long_words(self) -> str:
        """The answer with its reason."""
        if self.case:
            return f"{self.words}: {self.reason}"
        others = "" if self.other_plans is None else self.other_plans.long_words
        return f"{_WORDS[self.status]}: {self.reason}{words_of_undeclared(self.undeclared)}{others}"


def words_of_undeclared(names: Sequence[str], says: str = "if {} can") -> str:
    """Return the condition under which a requirement holds, as the end of a sentence; empty without one.

    Args:
        names: variables without `source` that the model assigns, so that they count as inputs. The requirement is
            violated if only the model changes them.
        says: the beginning of the condition.
    """
    if not names:
        return ""
    listed = f"`{'`, `'.join(names)}`"
    they, have, them = ("it", "has", "it") if len(names) == 1 else ("they", "have", "them")
    return (
        f", {says.format(listed)} be changed from outside: {they} {have} no `source`; write `source: state` if only "
        f"the model changes {them}"
    )


class CheckedRequirement(Struct, frozen=True):
    """A requirement with the number of cases that check it, and the answer of closing.

    Attributes:
        name: its name; of a requirement of the command line its sentence.
        is_built_in: as in `KnownDecision`.
        cases: how many cases check it.
        unjudged: how many other cases there are for which reason.
        decision: the answer; `None` if the model was not closed with `--requirements` and `--store`.
        off: why the model switches it off; empty if it does not.
        undeclared: variables without `source` that the model assigns; cases are judged as if they were inputs.
        is_asked: whether the command line has given it.
    """

    name: str
    is_built_in: bool
    cases: int
    unjudged: Mapping[Unjudged, int] = {}
    decision: KnownDecision | None = None
    off: str = ""
    undeclared: tuple[str, ...] = ()
    is_asked: bool = False

    @property
    def is_notable(self) -> bool:
        """Whether there is more to say of it than that each finished case checks it."""
        return bool(self.off or self.undeclared or any(why is not Unjudged.NO_RUN for why in self.unjudged))

    @property
    def words(self) -> str:
        """What is known of it, in few words."""
        if self.off:
            return f"off: {self.off}"
        if Unjudged.SINGLE_GOALS in self.unjudged:
            return f"not judged, as {Unjudged.SINGLE_GOALS.words}"
        return f"{self._case_words}; {'not decided' if self.decision is None else self.decision.words}"

    @property
    def long_words(self) -> str:
        """What is known of it, with the reason of the answer."""
        return self.words if self.decision is None else f"{self._case_words}; {self.decision.long_words}"

    @property
    def _case_words(self) -> str:
        reasons = ", ".join(f"{count} as {why.words}" for why, count in self.unjudged.items())
        rests = words_of_undeclared(self.undeclared, "as if {} could") if self.decision is None else ""
        return f"checked in {counted(self.cases, 'case')}{f' (not in {reasons})' if reasons else ''}{rests}"


def checked_requirements(
    model: BehaviorModel,
    decisions: Iterable[KnownDecision],
    cases: int,
    unjudged: Mapping[Unjudged, int],
    asked: Mapping[str, tuple[int, int]],
) -> tuple[CheckedRequirement, ...]:
    """Return what is known of the requirements of a model, its own first, then those of the command line.

    Args:
        model: the model.
        decisions: the answers of the last closing of the same model.
        cases: how many cases there are.
        unjudged: how many of them `non_blocking` does not judge for which reason.
        asked: the sentences of the command line, each with the number of cases that it was given for, and with how many
            of these are no run.
    """
    known = {(each.name, each.is_built_in): each for each in decisions if each.status is not RequirementStatus.OFF}
    no_run = Unjudged.NO_RUN
    no_runs: dict[Unjudged, int] = {no_run: unjudged[no_run]} if no_run in unjudged else {}
    own = [
        CheckedRequirement(each.name, False, cases - sum(no_runs.values()), no_runs, known.get((each.name, False)))
        for each in model.requirements
    ]
    for sentence, (count, without) in asked.items():
        left_out = {no_run: without} if without else {}
        decision = known.get((sentence, False))
        own.append(CheckedRequirement(sentence, False, count - without, left_out, decision, is_asked=True))
    return (*own, *_checked_built_ins(model, known, cases, unjudged, no_runs))


def _checked_built_ins(
    model: BehaviorModel,
    known: Mapping[tuple[str, bool], KnownDecision],
    cases: int,
    unjudged: Mapping[Unjudged, int],
    no_runs: Mapping[Unjudged, int],
) -> Iterator[CheckedRequirement]:
    off = dict(model.requirements_off)
    for name in (*BUILT_IN_NAMES, *model.requirements_on):
        is_blocking = name == BuiltIn.NON_BLOCKING
        if model.resources or is_blocking or name in off or (name, True) in known:
            others = unjudged if is_blocking else no_runs
            rests_on = _judged_as_inputs(name, model)
            judged = cases - sum(others.values())
            yield CheckedRequirement(name, True, judged, others, known.get((name, True)), off.get(name, ""), rests_on)


def _judged_as_inputs(name: str, model: BehaviorModel) -> tuple[str, ...]:
    """Return the variables without `source` on which the judgement of cases by a built-in requirement may rest."""
    found = undeclared(model)
    if not found or name == BuiltIn.NON_BLOCKING:
        return found
    if name == BuiltIn.NO_ORPHAN:
        ended = [resource.trigger for resource in model.resources]
    else:
        ended = [resource.request_state for resource in model.resources] if name == BuiltIn.READY_AGAIN else []
    resets = (each for each in model.automatic_transitions if any(a.target in ended for a in each.running_actions))
    read = dict.fromkeys(name for each in resets for name in each.running_guard.reads())
    return tuple(each for each in found if each in read)
