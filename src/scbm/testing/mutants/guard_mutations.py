"""Mutation operators for guards of operations and automatic transitions."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar

from scbm.model import conjunction
from scbm.testing.mutants.expression_edits import (
    conjuncts_of,
    other_thresholds,
    other_values,
    other_variables,
    with_negated_conjuncts,
    with_other_leaf,
    without_conjuncts,
)
from scbm.testing.mutants.model_parts import guards_of, transitions_of
from scbm.testing.mutants.mutation import Mutant, Mutation, line_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, StateSpace
    from scbm.testing.mutants.expression_edits import Leaf
    from scbm.testing.mutants.model_parts import TransitionPart


class DropConjunct(Mutation):
    """Leaves out one conjunct of a guard."""

    name = "guard-drop"
    group = "guards"
    summary = "a conjunct of a guard is left out"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each conjunct of each guard."""
        for guard in guards_of(model):
            for conjunct, kept in without_conjuncts(guard.value):
                yield self.of_part(guard, f"drop:{conjunct}", kept)


class NegateConjunct(Mutation):
    """Negates one conjunct of a guard."""

    name = "guard-negate"
    group = "guards"
    summary = "a conjunct of a guard is negated"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each conjunct of each guard."""
        for guard in guards_of(model):
            for each in with_negated_conjuncts(guard.value):
                yield self.of_part(guard, f"negate:{each.old}", each.whole, f"{each.old} → {each.new}")


class ComparisonMutation(Mutation):
    """Changes one comparison of a guard."""

    edit: ClassVar[str]

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each other form of each comparison of each guard."""
        space = model.running_space
        for guard in guards_of(model):
            for each in with_other_leaf(guard.value, lambda leaf: self.others(leaf, space)):
                yield self.of_part(guard, f"{self.edit}:{each.new}", each.whole, f"{each.old} → {each.new}")

    @abstractmethod
    def others(self, leaf: Leaf, space: StateSpace) -> Iterator[Leaf]:
        """Yield the other forms of a comparison."""


class OtherGuardValue(ComparisonMutation):
    """Compares with the next value of the domain."""

    name = "guard-value"
    group = "guards"
    summary = "a guard compares with the next value of the domain"
    edit = "value"

    def others(self, leaf: Leaf, space: StateSpace) -> Iterator[Leaf]:
        """Yield the comparison with each of its values replaced."""
        return other_values(leaf, space)


class OtherGuardVariable(ComparisonMutation):
    """Compares the next variable with the same domain."""

    name = "guard-variable"
    group = "guards"
    summary = "a guard compares the next variable that has the same domain"
    edit = "variable"

    def others(self, leaf: Leaf, space: StateSpace) -> Iterator[Leaf]:
        """Yield the comparison with each of its variables replaced."""
        return other_variables(leaf, space)


class OtherThreshold(ComparisonMutation):
    """Compares an integer with a threshold that is one less or one greater."""

    name = "guard-threshold"
    group = "guards"
    summary = "a guard compares an integer with one less or one more"
    edit = "threshold"

    def others(self, leaf: Leaf, space: StateSpace) -> Iterator[Leaf]:
        """Yield the comparison with both neighbours of its integer, as far as the domain goes."""
        return other_thresholds(leaf, space)


class MoveConjunct(Mutation):
    """Moves one conjunct from `g` to `gr`, or from `gr` to `g`."""

    name = "guard-move"
    group = "guards"
    summary = "a conjunct moves between `g` and `gr`, so the planner ignores it or sees it"

    def mutants(self, model: BehaviorModel) -> Iterator[Mutant]:
        """Yield a mutant for each conjunct of each transition that the planner reads."""
        for transition in transitions_of(model):
            if transition.is_planned:
                yield from self._moved(transition, "g", "gr")
                yield from self._moved(transition, "gr", "g")

    def _moved(self, part: TransitionPart, source: str, target: str) -> Iterator[Mutant]:
        old, new = part.guard(source), part.guard(target)
        for conjunct, kept in without_conjuncts(old.value):
            grown = conjunction((*conjuncts_of(new.value), conjunct))
            g, gr = (kept, grown) if source == "g" else (grown, kept)
            yield Mutant(
                name=f"{part.subject}/{old.part}/move:{conjunct}",
                operator=self.name,
                kind=part.kind,
                subject=part.subject,
                parts=(old.part, new.part),
                path=old.path,
                before=f"{line_of(old, old.value)}; {line_of(new, new.value)}",
                after=f"{line_of(old, kept)}; {line_of(new, grown)}",
                change=f"move {conjunct} to {new.part}",
                model=part.put(replace(part.transition, g=g, gr=gr)),
            )
