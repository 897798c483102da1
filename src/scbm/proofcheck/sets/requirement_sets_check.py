"""Checks that no state of runs in a set violates requirements of the user (`RequirementSetsArgument`).

No step of a run leaves the set; that is checked as for claims about obligations. For each claim the certificate has a
second set, in which the requirement is watched: all situations of the first one in which a state can violate it, since
it does not depend on what was before them. The check is an induction again: the situations in which this begins are in
the second set, each step leads from it into it, or to a state that ends this, and no state in it violates the claim.

The states of a run are its situations, and those while it ends: its requests in flight are cancelled one after the
other (semantics 5, 7.3). Here any of them may be cancelled.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.model import Not, RequestState, Truth
from scbm.model.requirements import AfterAlways, Always, Before, Never
from scbm.proofcheck.certificate import (
    PHASE,
    CertificateFlaw,
    ClaimedRequirement,
    RequirementSetsArgument,
    SetPhase,
    request_name,
)
from scbm.proofcheck.sets.set_views import SituationView, ValueLiterals
from scbm.proofcheck.sets.sets_check import SetCheck, flaws_of_set

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model import BehaviorModel, Predicate
    from scbm.model.requirements import RequirementForm
    from scbm.proofcheck.sets.set_steps import SetStep


class _WatchedSentence(NamedTuple):
    """When a state violates a sentence.

    Attributes:
        begins: the predicate of the states from which on it can be violated; `None` for the first states of runs alone.
        violates: the predicate of the states that violate it from then on.
        ends: the predicate of the states in which this ends; they do not violate it.
    """

    begins: Predicate | None
    violates: Predicate
    ends: Predicate


def _watched(sentence: RequirementForm) -> _WatchedSentence | None:
    """Return when a state violates a sentence; `None` for forms that no state alone violates."""
    match sentence:
        case Always(predicate):
            return _WatchedSentence(Truth(True), Not(predicate), Truth(False))
        case Never(predicate):
            return _WatchedSentence(Truth(True), predicate, Truth(False))
        case Before(first, second):
            return _WatchedSentence(None, second, first)
        case AfterAlways(start, predicate, stop):
            return _WatchedSentence(start, Not(predicate), stop)
        case _:
            return None


def check_requirement_sets(
    claimed: Sequence[ClaimedRequirement], argument: RequirementSetsArgument, model: BehaviorModel
) -> Iterator[CertificateFlaw]:
    """Yield the flaws of the claims and the shape, or else of the sets."""
    sentences = {each.name: each.sentence for each in model.requirements}
    asked = {str(claim): None if claim.is_built_in else _watched(sentences[claim.name]) for claim in claimed}
    flaws = [
        CertificateFlaw(f"claim {claim}", "no certificate of this kind proves it")
        for claim, sentence in asked.items()
        if sentence is None
    ]
    if len(argument.watched) != len(claimed):
        flaws.append(CertificateFlaw("the watched sets", "they are not one for each claim"))
    elif not max(argument.watched) < len(argument.nodes) + 2:
        flaws.append(CertificateFlaw("the watched sets", "they are no nodes"))
    yield from flaws
    if not flaws:
        read = [name for claim in claimed for name in sentences[claim.name].reads()]
        yield from flaws_of_set(_RequirementSetsCheck, list(asked), argument, model, read)


class _RequirementSetsCheck(SetCheck):
    """The questions about a set in which requirements are watched."""

    def flaws(self, claimed: Sequence[str]) -> Iterator[CertificateFlaw]:
        """Yield all flaws."""
        argument = self._argument
        assert isinstance(argument, RequirementSetsArgument)  # noqa: S101 - other certificates have another check
        yield from self._wrong_steps(())
        self._effects_of = [(step, self._effects(step)) for step in self._steps.steps()]
        self._prepare_views()
        sentences = {str(ClaimedRequirement(each.name)): _watched(each.sentence) for each in self._model.requirements}
        for claim, number in zip(claimed, argument.watched, strict=True):
            sentence = sentences[claim]
            assert sentence is not None  # noqa: S101 - other claims are refused before
            yield from self._violations(f"claim {claim}", sentence, number)
            if number != argument.reached:  # else this is what was checked of the set
                yield from self._not_watched(claim, sentence, number)
        self._clauses.close()

    def _prepare_views(self) -> None:
        """Prepare the views of a situation, of the one after it, and of two states while a run ends in between."""
        clauses, model = self._clauses, self._model
        self._world = SituationView.of_world(self._before, model, clauses)
        self._following = SituationView.of_world(self._after, model, clauses)
        some, more = ({resource.name: clauses.new() for resource in model.resources} for _ in range(2))
        for name in some:
            clauses.add(-some[name], more[name])
            clauses.add(-more[name], self._before[request_name(name)][True])
        self._ending, self._ending_later = (
            SituationView.of_world(self._cancelled(each), model, clauses) for each in (some, more)
        )
        self._is_run = -self._before[PHASE][SetPhase.PLANNED]
        self._stays_run = -self._after[PHASE][SetPhase.PLANNED]

    def _cancelled(self, cancelled: Mapping[str, int]) -> dict[str, ValueLiterals]:
        """Return the values in a situation after some requests are cancelled, each where its literal holds."""
        found = dict(self._before)
        for resource in self._model.resources:
            literal = cancelled[resource.name]
            cleared = ((resource.trigger, False), (resource.request_state, RequestState.INITIAL.value))
            for name, becomes in cleared:
                kept = {value: self._clauses.all_of((each, -literal)) for value, each in self._before[name].items()}
                found[name] = {**kept, becomes: self._clauses.any_of((self._before[name][becomes], literal))}
        return found

    def _violates(self, sentence: _WatchedSentence, view: SituationView) -> list[int]:
        return [view.holds(sentence.violates), -view.holds(sentence.ends)]

    def _violations(self, claim: str, sentence: _WatchedSentence, number: int) -> Iterator[CertificateFlaw]:
        """Yield a flaw if a state in a watched set violates the sentence, and for each end in which one does."""
        inside = [self._in_set, self._sets_before.inside(number)]
        if self._clauses.can_hold([*inside, self._is_run, *self._violates(sentence, self._world)]):
            yield CertificateFlaw(claim, f"a situation violates it: {self._shown(self._before)}")
        for step, _ in self._ends():
            if self._clauses.can_hold([*inside, step.where, *self._violates(sentence, self._ending)]):
                yield CertificateFlaw(claim, f"{step.what} violates it from {self._shown(self._before)}")

    def _not_watched(self, claim: str, sentence: _WatchedSentence, number: int) -> Iterator[CertificateFlaw]:
        """Yield the flaws of a watched set: a situation in which watching begins is not in it, or steps leave it."""
        where, can_hold = f"the watched set of {claim}", self._clauses.can_hold
        leaves = [self._sets_after.outside(number), self._stays_run, -self._following.holds(sentence.ends)]
        if sentence.begins is None:
            if can_hold([self._begins(), *leaves]):
                yield CertificateFlaw(where, f"a first situation is not in it: {self._shown(self._after)}")
        else:
            begins = [self._world.holds(sentence.begins), -self._world.holds(sentence.ends)]
            if can_hold([self._in_set, self._is_run, *begins, self._sets_before.outside(number)]):
                yield CertificateFlaw(where, f"a situation is not in it: {self._shown(self._before)}")
            yield from self._begun_at_ends(claim, sentence, leaves)
        for step, effects in self._effects_of:
            if can_hold([self._in_set, self._sets_before.inside(number), step.where, *effects, *leaves]):
                before, after = self._shown(self._before), self._shown(self._after)
                yield CertificateFlaw(where, f"{step.what} leads from {before} out of it, to {after}")

    def _begun_at_ends(
        self, claim: str, sentence: _WatchedSentence, leaves: Sequence[int]
    ) -> Iterator[CertificateFlaw]:
        """Yield the flaws of ends of runs in which watching begins: in them, or in the situation after them."""
        assert sentence.begins is not None  # noqa: S101 - as the caller knows
        begins = [self._ending.holds(sentence.begins), -self._ending.holds(sentence.ends)]
        for step, effects in self._ends():
            known = [self._in_set, step.where, *begins]
            if self._clauses.can_hold([*known, *self._violates(sentence, self._ending_later)]):
                yield CertificateFlaw(f"claim {claim}", f"{step.what} violates it from {self._shown(self._before)}")
            if self._clauses.can_hold([*known, *effects, *leaves]):
                after = self._shown(self._after)
                yield CertificateFlaw(f"the watched set of {claim}", f"{step.what} leads out of it, to {after}")

    def _ends(self) -> Iterator[tuple[SetStep, Sequence[int]]]:
        return (each for each in self._effects_of if each[0].ends_run)
