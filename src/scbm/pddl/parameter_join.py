"""Joins the parameters of an action along tables, equal and unequal objects, and facts that exclude each other."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct
from msgspec.structs import replace

from scbm.files.expansion.lifted_entries import has_choice
from scbm.files.expansion.object_formulas import EqualityFormula, Formula, ObjectTerm, TableFormula
from scbm.pddl.pddl_reader import negated
from scbm.pddl.pddl_task import FALSE, PddlFormula

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from scbm.files.expansion.object_formulas import Choice
    from scbm.pddl.pddl_task import Fact

TermPair = tuple[PddlFormula, PddlFormula]


class Exclusion(Struct, frozen=True):
    """Two facts that do not hold together where some terms are equal, unless other terms are equal, too.

    Attributes:
        equal: the pairs of terms that select one group of facts.
        unless: the pairs of terms that make both one fact; `None` if the facts are never one.
    """

    equal: tuple[TermPair, ...]
    unless: tuple[TermPair, ...] | None


class ParameterJoin:
    """Decides whether conditions hold for some choice of objects.

    A condition that reads numbers or changing facts holds for all objects, unless it contradicts another one.
    """

    def __init__(
        self,
        tables: Mapping[str, Mapping[Fact, None]],
        simplified: Callable[[PddlFormula], PddlFormula],
        exclusions: Callable[[PddlFormula, PddlFormula], Iterator[Exclusion]],
    ) -> None:
        """Take the rows of the facts that no action changes, and what simplifies and excludes other conditions."""
        self._tables = tables
        self._simplified = simplified
        self._exclusions = exclusions

    def admits(
        self, objects: Mapping[str, Sequence[str]], conditions: Sequence[PddlFormula], *, facts: bool = True
    ) -> bool:
        """Return whether conditions hold for some objects of the parameters, as far as that is decided.

        Args:
            objects: the objects of each parameter.
            conditions: the conjuncts of the condition.
            facts: whether facts that exclude each other count; otherwise only tables and equal objects do.
        """
        if FALSE in conditions:
            return False
        joined = [formula for each in conditions for formula in self._formulas(each)]
        if facts:
            literals = [fact for each in conditions if (fact := _fact_of(each)) is not None]
            joined += [formula for pair in combinations(literals, 2) for formula in self._apart(*pair)]
        return has_choice(objects, joined)

    def _formulas(self, condition: PddlFormula) -> Iterator[Formula]:
        """Yield what has to hold for a condition to hold; nothing for a fact that actions change."""
        literal = _fact_of(condition)
        inner = negated(condition) if condition.kind == "not" else condition
        if literal is not None and literal.fact.name not in self._tables:
            return
        if literal is not None and literal.holds:
            yield TableFormula([_term(each) for each in condition.parts], self._tables[condition.name])
        elif inner.kind == "equals" and all(map(_is_object, inner.parts)):
            left, right = map(_term, inner.parts)
            yield EqualityFormula(left, right, equal=inner is condition)
        else:
            yield _PossibleFormula(condition, self._simplified)

    def _apart(self, first: _Literal, second: _Literal) -> Iterator[Formula]:
        """Yield what has to hold for two literals to hold together."""
        if first.holds and second.holds:
            found = self._exclusions(first.fact, second.fact)
        elif first.holds != second.holds and first.fact.name == second.fact.name:
            found = iter([Exclusion(tuple(zip(first.fact.parts, second.fact.parts, strict=True)), None)])
        else:
            return
        for each in found:
            if each.unless is not None and all(a == b for a, b in each.equal):
                yield from (EqualityFormula(_term(a), _term(b), equal=True) for a, b in each.unless)
            else:
                yield _ApartFormula(each)


class _PossibleFormula(Formula):
    """A condition that holds for a choice of objects unless static facts make it false."""

    is_static = True

    def __init__(self, condition: PddlFormula, simplified: Callable[[PddlFormula], PddlFormula]) -> None:
        self.parameters = frozenset(parameters_of(condition))
        self._condition = condition
        self._simplified = simplified

    def ground(self, choice: Choice) -> bool:
        """Return whether the condition is not false."""
        binding = {name: PddlFormula("object", name=each) for name, each in choice.items()}
        return self._simplified(substituted(self._condition, binding)) != FALSE


class _ApartFormula(Formula):
    """Two facts do not exclude each other."""

    is_static = True

    def __init__(self, exclusion: Exclusion) -> None:
        self._equal = [(_term(a), _term(b)) for a, b in exclusion.equal]
        self._unless = None if exclusion.unless is None else [(_term(a), _term(b)) for a, b in exclusion.unless]
        terms = [term for pair in (*self._equal, *(self._unless or ())) for term in pair]
        self.parameters = frozenset(term.name for term in terms if term.is_parameter)

    def ground(self, choice: Choice) -> bool:
        """Return whether the facts can hold together."""
        if any(a.object_in(choice) != b.object_in(choice) for a, b in self._equal):
            return True
        return self._unless is not None and all(a.object_in(choice) == b.object_in(choice) for a, b in self._unless)


class _Literal(NamedTuple):
    """A fact about parameters and objects, and whether it holds or not."""

    fact: PddlFormula
    holds: bool


def _fact_of(condition: PddlFormula) -> _Literal | None:
    """Return a condition as a literal; `None` for others."""
    fact = condition.parts[0] if condition.kind == "not" else condition
    is_fact = fact.kind == "fluent" and all(map(_is_object, fact.parts))
    return _Literal(fact, fact is condition) if is_fact else None


def _is_object(term: PddlFormula) -> bool:
    return term.kind in {"parameter", "object"}


def _term(term: PddlFormula) -> ObjectTerm:
    return ObjectTerm(term.name, is_parameter=term.kind == "parameter")


def parameters_of(formula: PddlFormula) -> set[str]:
    """Return the parameters that a formula reads, without the variables of its quantifiers."""
    own = {formula.name} if formula.kind == "parameter" else set()
    return own.union(*map(parameters_of, formula.parts)) - {name for name, _ in formula.variables}


def substituted(formula: PddlFormula, binding: Mapping[str, PddlFormula]) -> PddlFormula:
    """Return a formula with parameters replaced by other terms."""
    if formula.kind == "parameter":
        return binding.get(formula.name, formula)
    if formula.variables:
        binding = {name: term for name, term in binding.items() if name not in dict(formula.variables)}
    return replace(formula, parts=tuple(substituted(part, binding) for part in formula.parts))
