"""Which facts of a PDDL problem exclude each other: the synthesis of mutual-exclusion invariants.

Source: M. Helmert, *Concise finite-domain representations for PDDL planning tasks*, Artificial Intelligence 173 (2009),
section 5. An *invariant candidate* is a set of fluents. Some of their parameters are keys, and at most one parameter of
each fluent is counted. Objects for the keys select a *group* of facts. The candidate is an invariant if each group has
at most one true fact: initially, and after each action that was applied where each group has at most one.

For `at(part, zone)` and `held(part, gripper)` the key is the part; the zone and the gripper are counted. A part is in
one zone, or in one gripper.

The proof is incomplete, as the one of the paper: what cannot be proved is left out, and nothing false is returned.
"""

from __future__ import annotations

from collections import Counter, deque
from itertools import combinations, permutations
from typing import TYPE_CHECKING, NamedTuple

from msgspec import Struct, field

from scbm.files.expansion.lifted_entries import has_choice
from scbm.files.expansion.object_formulas import EqualityFormula, ObjectTerm, TableFormula
from scbm.pddl.pddl_task import InvariantPart

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from unified_planning.model import Action, Effect, FNode, Problem, TimeInterval, Timing
    from unified_planning.model.types import Type

    from scbm.files.expansion.object_formulas import Formula
    from scbm.pddl.pddl_task import FactInvariant

MAX_CANDIDATES = 300
"""Maximum number of candidates for one parameter of a fluent. Known domains need fewer than 20."""


class Term(NamedTuple):
    """An argument of a fluent: a parameter of an action, a variable of a quantifier, or an object.

    Attributes:
        kind: `parameter`, `variable` or `object`.
        name: its name in the problem.
        objects: the names of all objects that it can stand for.
        copy: 1 in the second instance of a quantified effect, which is compared with the first one.
    """

    kind: str
    name: str
    objects: frozenset[str]
    copy: int = 0


class FluentAtom(NamedTuple):
    """A fluent with its arguments."""

    fluent: str
    terms: tuple[Term, ...]


class RequiredAtom(NamedTuple):
    """An atom that has to be true at the start of an action, or at its end."""

    atom: FluentAtom
    at_end: bool


class AtomChange(Struct, frozen=True):
    """One effect of an action on one fluent.

    Attributes:
        fluent: the fluent.
        atom: the fluent with its arguments; `None` if an argument is not a plain term.
        adds: whether it can make the atom true; it makes it false otherwise.
        at_end: whether it happens at the end of a durative action.
        condition: under which condition; `None` means always.
        required: the atoms of which the condition says that they are true.
        quantified: the variables that the effect is repeated for.
    """

    fluent: str
    atom: FluentAtom | None
    adds: bool
    at_end: bool
    condition: FNode | None
    required: tuple[FluentAtom, ...]
    quantified: frozenset[str]


class ActionSummary(Struct):
    """The part of an action that the proof reads.

    Attributes:
        required: the atoms that its conditions require to be true.
        unequal: the pairs of terms that its conditions require to be different.
        tables: the terms of the facts that it requires and that no action changes, each with the rows that hold.
        changes: its effects.
    """

    required: list[RequiredAtom] = field(default_factory=list)
    unequal: list[tuple[Term, Term]] = field(default_factory=list)
    tables: list[tuple[tuple[Term, ...], Mapping[tuple[str, ...], None]]] = field(default_factory=list)
    changes: list[AtomChange] = field(default_factory=list)


class ProvedInvariants(NamedTuple):
    """The invariants that were found for a problem.

    Attributes:
        all: the invariants.
        exclusive: for boolean fluents, the index of a parameter whose values exclude each other.
    """

    all: tuple[FactInvariant, ...]
    exclusive: dict[str, int]


def proved_invariants(problem: Problem, objects: Mapping[str, frozenset[str]] | None = None) -> ProvedInvariants:
    """Return invariants of the boolean fluents that have parameters and that actions make true.

    A parameter is exclusive if, for any binding of the other parameters, at most one of its values makes the fluent
    true in all states that sequences of actions reach. If several parameters of a fluent are, the last one is returned.
    Parameters with a single object are left out: they have the property, but a variable for their values says nothing.

    Args:
        problem: the problem.
        objects: the objects of each type, where a type has more than the problem knows.
    """
    proof = _InvariantProof(problem, objects or {})
    found: dict[FactInvariant, None] = {}
    exclusive: dict[str, int] = {}
    for fluent in problem.fluents:
        if fluent.arity and proof.can_count(fluent.name):
            several = [index for index, parameter in enumerate(fluent.signature) if proof.has_choice(parameter.type)]
            for counted in (None, *several):
                proved = dict.fromkeys(proof.invariants(fluent.name, counted))
                found |= proved
                if counted is not None and proved:
                    exclusive[fluent.name] = counted
    return ProvedInvariants(tuple(found), exclusive)


class _InvariantProof:
    """The proofs about the fluents of one problem."""

    def __init__(self, problem: Problem, objects: Mapping[str, frozenset[str]]) -> None:
        self._problem = problem
        self._objects = {**objects}
        self._readable = not (problem.timed_effects or len(problem.actions) != len(_plain_actions(problem)))
        self._actions = [self._summary(action) for action in _plain_actions(problem)] if self._readable else []
        self._arities = {fluent.name: fluent.arity for fluent in problem.fluents if fluent.type.is_bool_type()}
        self._facts = self._initial_facts()
        self._read_tables()

    def can_count(self, fluent: str) -> bool:
        """Return whether the fluent is boolean, false by default, and made true by an action."""
        added = (change.fluent == fluent for action in self._actions for change in action.changes if change.adds)
        return self._readable and fluent in self._facts and any(added)

    def has_choice(self, kind: Type) -> bool:
        """Return whether a type of parameters has two objects or more."""
        return kind.is_user_type() and len(self._objects_of(kind)) > 1

    def invariants(self, fluent: str, counted: int | None) -> Iterator[FactInvariant]:
        """Search for invariants with a fluent; `counted` is its parameter that is counted, if there is one."""
        keys = tuple(index for index in range(self._arities[fluent]) if index != counted)
        first: FactInvariant = (InvariantPart(fluent, keys, counted),)
        if not self._holds_initially(first):
            return  # more fluents can only add more facts
        seen, queue = {first}, deque([first])
        while queue:
            candidate = queue.popleft()
            refined = self._refinements(candidate)
            if refined is None:
                yield candidate
            for each in refined or ():
                if each not in seen and len(seen) < MAX_CANDIDATES and self._holds_initially(each):
                    seen.add(each)
                    queue.append(each)

    # reading the problem

    def _initial_facts(self) -> dict[str, list[tuple[str, ...]]]:
        """Return the true facts of each boolean fluent whose default is false."""
        defaults = self._problem.fluents_defaults
        facts: dict[str, list[tuple[str, ...]]] = {
            fluent.name: []
            for fluent in self._problem.fluents
            if fluent.name in self._arities and fluent in defaults and defaults[fluent].is_false()
        }
        for atom, value in self._problem.explicit_initial_values.items():
            if not value.is_false() and atom.fluent().name in facts:
                facts[atom.fluent().name].append(tuple(argument.object().name for argument in atom.args))
        return facts

    def _objects_of(self, kind: Type) -> frozenset[str]:
        if kind.name not in self._objects:
            self._objects[kind.name] = frozenset(one.name for one in self._problem.objects(kind))
        return self._objects[kind.name]

    def _term(self, node: FNode) -> Term | None:
        if node.is_object_exp():
            name = node.object().name
            return Term("object", name, frozenset((name,)))
        if node.is_parameter_exp() and node.parameter().type.is_user_type():
            return Term("parameter", node.parameter().name, self._objects_of(node.parameter().type))
        if node.is_variable_exp() and node.variable().type.is_user_type():
            return Term("variable", node.variable().name, self._objects_of(node.variable().type))
        return None

    def _atom(self, node: FNode) -> FluentAtom | None:
        terms = [term for term in map(self._term, node.args) if term is not None]
        return FluentAtom(node.fluent().name, tuple(terms)) if len(terms) == len(node.args) else None

    def _atoms(self, conditions: Iterable[FNode]) -> tuple[FluentAtom, ...]:
        atoms = (self._atom(part) for part in _conjuncts(conditions) if part.is_fluent_exp())
        return tuple(atom for atom in atoms if atom is not None)

    def _read_tables(self) -> None:
        changed = {change.fluent for action in self._actions for change in action.changes}
        rows = {name: dict.fromkeys(facts) for name, facts in self._facts.items() if name not in changed}
        for action in self._actions:
            atoms = [need.atom for need in action.required if need.atom.fluent in rows]
            action.tables += [(atom.terms, rows[atom.fluent]) for atom in atoms]

    def _summary(self, action: Action) -> ActionSummary:
        summary = ActionSummary()
        for condition, at_end in _conditions(action):
            summary.required += [RequiredAtom(atom, at_end) for atom in self._atoms((condition,))]
            summary.unequal += self._inequalities((condition,))
        for effect, at_end in _effects(action):
            summary.changes.append(self._change(effect, at_end=at_end))
        return summary

    def _inequalities(self, conditions: Iterable[FNode]) -> Iterator[tuple[Term, Term]]:
        for part in _conjuncts(conditions):
            if part.is_not() and part.arg(0).is_equals():
                one, other = map(self._term, part.arg(0).args)
                if one is not None and other is not None:
                    yield one, other

    def _change(self, effect: Effect, *, at_end: bool) -> AtomChange:
        condition = None if effect.condition.is_true() else effect.condition
        return AtomChange(
            fluent=effect.fluent.fluent().name,
            atom=self._atom(effect.fluent),
            adds=not effect.value.is_false(),
            at_end=at_end,
            condition=condition,
            required=() if condition is None else self._atoms((condition,)),
            quantified=frozenset(variable.name for variable in effect.forall),
        )

    # checking a candidate

    def _holds_initially(self, candidate: FactInvariant) -> bool:
        groups: Counter[tuple[str, ...]] = Counter()
        for part in candidate:
            if part.fluent not in self._facts:
                return False
            groups.update(tuple(fact[key] for key in part.keys) for fact in self._facts[part.fluent])
        return all(true == 1 for true in groups.values())

    def _refinements(self, candidate: FactInvariant) -> list[FactInvariant] | None:
        """Return `None` if the candidate is an invariant; otherwise larger candidates that may be invariants."""
        parts = {part.fluent: part for part in candidate}
        for action in self._actions:
            added = [change for change in action.changes if change.adds and change.fluent in parts]
            if any(change.atom is None for change in added) or _adds_too_much(action, added, parts):
                return []
            for change in added:
                if not _is_balanced(action, change, parts):
                    return [tuple(sorted((*candidate, part))) for part in _balancing_parts(action, change, parts)]
        return None


def _plain_actions(problem: Problem) -> list[Action]:
    """Return the actions without functions in Python and without delayed effects."""
    return [action for action in problem.actions if _is_plain(action)]


def _is_plain(action: Action) -> bool:
    timed = getattr(action, "simulated_effects", {}) or getattr(action, "simulated_effect", None) is not None
    known = type(action).__name__ in {"InstantaneousAction", "DurativeAction"}
    timings = [*getattr(action, "conditions", ()), *getattr(action, "effects", ())] if _is_durative(action) else []
    return known and not timed and not any(_is_delayed(timing) for timing in timings)


def _is_durative(action: Action) -> bool:
    return type(action).__name__ == "DurativeAction"


def _is_delayed(timing: Timing | TimeInterval) -> bool:
    ends = [end for end in (getattr(timing, "lower", None), getattr(timing, "upper", None)) if end is not None]
    return any(end.delay != 0 or end.is_global() for end in ends or [timing])


def _conditions(action: Action) -> Iterator[tuple[FNode, bool]]:
    """Yield each condition of an action, and whether it is about the end of the action only."""
    if not _is_durative(action):
        for condition in action.preconditions:
            yield condition, False
        return
    for interval, conditions in action.conditions.items():
        for condition in conditions:
            yield condition, not interval.lower.is_from_start()


def _effects(action: Action) -> Iterator[tuple[Effect, bool]]:
    """Yield each effect of an action, and whether it happens at the end."""
    if not _is_durative(action):
        for effect in action.effects:
            yield effect, False
        return
    for timing, effects in action.effects.items():
        for effect in effects:
            yield effect, not timing.is_from_start()


def _conjuncts(conditions: Iterable[FNode]) -> Iterator[FNode]:
    for condition in conditions:
        if condition.is_and():
            yield from _conjuncts(condition.args)
        else:
            yield condition


# too heavy: two facts of one group become true


def _adds_too_much(action: ActionSummary, added: list[AtomChange], parts: Mapping[str, InvariantPart]) -> bool:
    """Return whether an instance of the action can make two different facts of one group true."""
    atoms = [change.atom for change in added if change.atom is not None]
    pairs = list(combinations(atoms, 2))
    pairs += [
        (change.atom, _copied(change.atom, change.quantified))
        for change in added
        if change.atom is not None and change.quantified
    ]
    pairs += [
        (one.atom, _copied(other.atom, other.quantified))
        for one, other in combinations(added, 2)
        if one.atom is not None and other.atom is not None and other.quantified
    ]
    return any(_can_meet(action, one, other, parts) for one, other in pairs)


def _copied(atom: FluentAtom, quantified: frozenset[str]) -> FluentAtom:
    terms = (
        term._replace(copy=1) if term.kind == "variable" and term.name in quantified else term for term in atom.terms
    )
    return FluentAtom(atom.fluent, tuple(terms))


def _can_meet(action: ActionSummary, one: FluentAtom, other: FluentAtom, parts: Mapping[str, InvariantPart]) -> bool:
    """Return whether two added atoms can be different facts of the same group, in an applicable instance."""
    equal = _EqualTerms(action, [*one.terms, *other.terms])
    for left, right in zip(_keys(one, parts), _keys(other, parts), strict=True):
        equal.join(left, right)
    if not _is_applicable(action, equal, parts):
        return False
    return one.fluent != other.fluent or not all(map(equal.are_equal, one.terms, other.terms))


def _is_applicable(action: ActionSummary, equal: _EqualTerms, parts: Mapping[str, InvariantPart]) -> bool:
    """Return whether an action with equal terms may be applied, where each group has one true fact at most.

    Two required facts of one group are one fact, so that their terms are equal, too.
    """
    counted = [need for need in action.required if need.atom.fluent in parts]
    size = -1
    while size != (size := equal.size):
        for one, other in combinations(counted, 2):
            keys = zip(_keys(one.atom, parts), _keys(other.atom, parts), strict=True)
            if one.at_end == other.at_end and all(equal.are_equal(left, right) for left, right in keys):
                if one.atom.fluent != other.atom.fluent:
                    return False
                for left, right in zip(one.atom.terms, other.atom.terms, strict=True):
                    equal.join(left, right)
    return equal.have_objects()


def _keys(atom: FluentAtom, parts: Mapping[str, InvariantPart]) -> tuple[Term, ...]:
    return tuple(atom.terms[key] for key in parts[atom.fluent].keys)


class _EqualTerms:
    """Classes of terms that stand for the same object: a disjoint-set forest."""

    def __init__(self, action: ActionSummary, terms: Iterable[Term]) -> None:
        self._action = action
        self._parents: dict[Term, Term] = {}
        tables = (term for row, _ in action.tables for term in row)
        required = (term for need in action.required for term in need.atom.terms)
        self._terms = [*terms, *tables, *required, *(term for pair in action.unequal for term in pair)]
        only: dict[frozenset[str], Term] = {}
        for term in self._terms:
            if len(term.objects) == 1:
                self.join(only.setdefault(term.objects, term), term)

    @property
    def size(self) -> int:
        """The number of terms that are joined with another one."""
        return len(self._parents)

    def _root(self, term: Term) -> Term:
        while term in self._parents:
            term = self._parents[term]
        return term

    def join(self, one: Term, other: Term) -> None:
        one, other = self._root(one), self._root(other)
        if one != other:
            self._parents[one] = other

    def are_equal(self, one: Term, other: Term) -> bool:
        return self._root(one) == self._root(other)

    def have_objects(self) -> bool:
        """Return whether there are objects for all terms: those of the tables, and different ones where required."""
        common: dict[Term, frozenset[str]] = {}
        for term in self._terms:
            root = self._root(term)
            common[root] = common.get(root, root.objects) & term.objects
        names = {root: ObjectTerm(str(number), is_parameter=True) for number, root in enumerate(common)}
        formulas: list[Formula] = []
        for one, other in self._action.unequal:
            formulas.append(EqualityFormula(names[self._root(one)], names[self._root(other)], equal=False))
        for terms, rows in self._action.tables:
            formulas.append(TableFormula([names[self._root(term)] for term in terms], rows))
        return has_choice({names[root].name: sorted(objects) for root, objects in common.items()}, formulas)


# unbalanced: no fact of the group becomes false


def _is_balanced(action: ActionSummary, change: AtomChange, parts: Mapping[str, InvariantPart]) -> bool:
    """Return whether the group of an added atom has a required fact that becomes false, or the atom is true before."""
    assert change.atom is not None, "`_refinements` refuses atoms that cannot be read"  # noqa: S101 - for the type
    if change.atom in change.required or RequiredAtom(change.atom, at_end=False) in action.required:
        return True
    keys = _keys(change.atom, parts)
    return any(atom.fluent in parts and _keys(atom, parts) == keys for atom in _replaced(action, change))


def _replaced(action: ActionSummary, change: AtomChange) -> Iterator[FluentAtom]:
    """Yield the atoms that are true before the change, and false afterwards unless they are added again."""
    needs = [*action.required, *(RequiredAtom(atom, change.at_end) for atom in change.required)]
    for atom, at_end in needs:
        for deleted in action.changes:
            certain = deleted.condition is None or (
                deleted.condition == change.condition and deleted.at_end == change.at_end
            )
            in_time = (deleted.at_end, change.at_end) in {(False, False), (False, True), (True, True)}
            after = not at_end or (deleted.at_end and change.at_end)
            if deleted.atom == atom and not deleted.adds and certain and in_time and after:
                yield atom
                break


def _balancing_parts(
    action: ActionSummary, change: AtomChange, parts: Mapping[str, InvariantPart]
) -> Iterator[InvariantPart]:
    """Yield the fluents, with their keys, that balance the change if the candidate had them."""
    assert change.atom is not None, "`_refinements` refuses atoms that cannot be read"  # noqa: S101 - for the type
    keys = _keys(change.atom, parts)
    for atom in _replaced(action, change):
        indices = range(len(atom.terms))
        if atom.fluent in parts or not len(keys) <= len(indices) <= len(keys) + 1:
            continue
        for chosen in permutations(indices, len(keys)):
            if tuple(atom.terms[index] for index in chosen) == keys:
                rest = [index for index in indices if index not in chosen]
                yield InvariantPart(atom.fluent, chosen, rest[0] if rest else None)
