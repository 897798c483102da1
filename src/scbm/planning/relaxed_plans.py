"""The FF heuristic: how far a state is from the goal, as the length of a plan that deletes nothing (Hoffmann, 2001).

A fact is a value of a variable. A rule adds facts once all facts that it needs are reached; no fact is ever removed.
Guards become rules, too: a disjunction is an auxiliary fact with a free rule for each of its parts. Where the goal is
unreachable by the rules, no plan exists. A plan of the relaxation need not be a plan.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, assert_never

from msgspec import Struct

from scbm.model.normal_form import AllOf, AnyOf, OneOf, Pair, allowed_values, indices_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from scbm.model.normal_form import NormalForm
    from scbm.model.packing import Field, ValueTable
    from scbm.planning.engines.joint_moves import JointMove

_MAX_PAIRS = 10_000
"""Maximum number of pairs of values of a comparison of two variables; the heuristic ignores larger comparisons."""

_FREE = -1
"""Stands for the move of a rule that is part of a guard and costs nothing."""


class RelaxedPlan(Struct, frozen=True):
    """A plan of the relaxation from one state.

    Attributes:
        steps: the moves of the plan, in an order in which the relaxation can take them; a move may occur repeatedly.
        preferred: those of them that start the plan, each once.
        enabled: all moves that may be enabled in the state, each once; the relaxation leaves out no enabled move that
            can contribute to the goal.
    """

    steps: tuple[int, ...]
    preferred: tuple[int, ...]
    enabled: tuple[int, ...]


class RelaxedProblem:
    """The moves of a system and a goal, without deletions."""

    def __init__(self, moves: Sequence[JointMove], goal: NormalForm, fields: Sequence[Field]) -> None:
        """Make the rules; `fields` has the field of each variable in packed states."""
        rules = _Rules([len(field.variable.domain) for field in fields])
        self._goal = rules.goal(goal)
        for move in moves:
            rules.add_move(move)
        relevant = rules.relevant_to(self._goal)
        self._needs = [rules.needs[rule] for rule in relevant]
        self._adds = [rules.adds[rule] for rule in relevant]
        self._moves = [rules.moves[rule] for rule in relevant]
        self._counts = list(map(len, self._needs))
        self._always = rules.always
        self._users: list[list[int]] = [[] for _ in range(rules.facts)]
        for rule, needs in enumerate(self._needs):
            for fact in needs:
                self._users[fact].append(rule)
        self._readers = [(field.mask, field.shift, first) for field, first in zip(fields, rules.first, strict=True)]

    def plan(self, state: int) -> RelaxedPlan | None:
        """Return a plan of the relaxation from a packed state; `None` if no plan exists, not even a real one."""
        layer = [first + ((state & mask) >> shift) for mask, shift, first in self._readers]
        layer.append(self._always)
        reached = _ReachedFacts([None] * len(self._users), self._counts.copy(), [])
        for fact in layer:
            reached.supporters[fact] = _FREE
        enabled: int | None = None
        while layer:
            layer = self._next_layer(layer, reached)
            enabled = len(reached.order) if enabled is None else enabled
            if reached.supporters[self._goal] is not None:
                return self._extracted(reached, enabled)
        return None

    def _next_layer(self, layer: list[int], reached: _ReachedFacts) -> list[int]:
        """Apply the rules that need facts of a layer; return the new facts. Free rules add to the layer itself."""
        users, moves, adds = self._users, self._moves, self._adds
        supporters, missing, order = reached.supporters, reached.missing, reached.order
        following: list[int] = []
        for fact in layer:
            for rule in users[fact]:
                if missing[rule] > 1:
                    missing[rule] -= 1
                    continue
                if moves[rule] == _FREE:
                    target = layer
                else:
                    target = following
                    order.append(rule)
                for added in adds[rule]:
                    if supporters[added] is None:
                        supporters[added] = rule
                        target.append(added)
        return following

    def _extracted(self, reached: _ReachedFacts, enabled: int) -> RelaxedPlan:
        """Return the rules that support the goal and what they need; the first `enabled` rules start plans."""
        moves, needs = self._moves, self._needs
        pending, chosen = [self._goal], dict[int, None]()
        while pending:
            rule = reached.supporters[pending.pop()]
            if rule is not None and rule != _FREE and rule not in chosen:
                chosen[rule] = None
                pending += needs[rule]
        begins = reached.order[:enabled]
        steps = [moves[rule] for rule in reached.order if rule in chosen]
        preferred = dict.fromkeys(moves[rule] for rule in begins if rule in chosen)
        return RelaxedPlan(tuple(steps), tuple(preferred), tuple(dict.fromkeys(moves[rule] for rule in begins)))


class _ReachedFacts(Struct):
    """The facts that the rules have reached from one state.

    Attributes:
        supporters: for each reached fact the rule that added it, or `_FREE` for facts of the state.
        missing: for each rule the number of facts that it needs and that are not reached, at least 1.
        order: the rules of moves that were applied, in order.
    """

    supporters: list[int | None]
    missing: list[int]
    order: list[int]


class _Rules:
    """The rules while they are made.

    Attributes:
        first: for each variable the fact of its first value; the facts of its other values follow.
        facts: the number of facts.
        always: a fact of every state; rules without a condition need it.
        needs: the facts that each rule needs.
        adds: the facts that each rule adds.
        moves: the move of each rule, or `_FREE`.
    """

    def __init__(self, counts: Sequence[int]) -> None:
        self.first: list[int] = []
        self.facts = 0
        for count in counts:
            self.first.append(self.facts)
            self.facts += count
        self.needs: list[tuple[int, ...]] = []
        self.adds: list[tuple[int, ...]] = []
        self.moves: list[int] = []
        self.always = self._new_fact()
        self._counts = counts
        self._auxiliary: dict[NormalForm, int] = {}
        self._ignored: list[int] = []

    def _add(self, needs: tuple[int, ...], adds: tuple[int, ...], move: int = _FREE) -> None:
        self.needs.append(tuple(dict.fromkeys(needs)) or (self.always,))
        self.adds.append(adds)
        self.moves.append(move)

    def goal(self, form: NormalForm) -> int:
        """Return the fact that the goal holds."""
        fact = self._new_fact()
        needs = self._condition(form)
        if needs is not None:
            self._add(needs, (fact,))
        return fact

    def add_move(self, move: JointMove) -> None:
        """Add the rules of a move: one for what it sets to constants, and one for each value that it depends on."""
        needs = self._condition(move.guard)
        if needs is None:
            return
        constants: list[int] = []
        dependent: dict[int, dict[int, list[int]]] = {}
        for write in move.writes:
            images = list(_images(write, move.guard))
            if len({image for _, image in images}) == 1:
                constants.append(self.first[write.target] + images[0][1])
                continue
            cases = dependent.setdefault(write.source, {})
            for value, image in images:
                cases.setdefault(value, []).append(self.first[write.target] + image)
        if constants or not dependent:
            self._add(needs, tuple(constants), move.index)
        for source, cases in dependent.items():
            for value, facts in cases.items():
                self._add((*needs, self.first[source] + value), tuple(facts), move.index)

    def relevant_to(self, goal: int) -> list[int]:
        """Return the rules that add facts which the goal depends on, in order."""
        makers: list[list[int]] = [[] for _ in range(self.facts)]
        for rule, added in enumerate(self.adds):
            for fact in added:
                makers[fact].append(rule)
        compared = (range(self.first[v], self.first[v] + self._counts[v]) for v in dict.fromkeys(self._ignored))
        pending = [goal, *(fact for facts in compared for fact in facts)]
        found, seen = [False] * len(self.adds), set(pending)
        while pending:
            for rule in makers[pending.pop()]:
                if not found[rule]:
                    found[rule] = True
                    missing = [fact for fact in self.needs[rule] if fact not in seen]
                    seen.update(missing)
                    pending += missing
        return [rule for rule, is_found in enumerate(found) if is_found]

    def _condition(self, form: NormalForm) -> tuple[int, ...] | None:
        """Return facts that hold together where the form holds; `None` where it never holds."""
        match form:
            case bool():
                return () if form else None
            case OneOf(variable, allowed) if allowed.bit_count() == 1:
                return (self.first[variable] + allowed.bit_length() - 1,)
            case Pair() if len(form.left_values) * len(form.right_values) > _MAX_PAIRS:
                self._ignored += [form.left, form.right]
                return ()
            case OneOf() | AnyOf() | Pair():
                return (self._choice(form),)
            case AllOf(parts):
                needs: tuple[int, ...] = ()
                for part in parts:
                    more = self._condition(part)
                    if more is None:
                        return None
                    needs += more
                return needs
            case _:
                assert_never(form)

    def _choice(self, form: OneOf | AnyOf | Pair) -> int:
        """Return the auxiliary fact that some part of the form holds."""
        if form not in self._auxiliary:
            fact = self._auxiliary[form] = self._new_fact()
            for part in _parts(form):
                needs = self._condition(part)
                if needs is not None:
                    self._add(needs, (fact,))
        return self._auxiliary[form]

    def _new_fact(self) -> int:
        self.facts += 1
        return self.facts - 1


def _images(write: ValueTable, guard: NormalForm) -> Iterator[tuple[int, int]]:
    """Yield the values of the source that the guard allows, each with the value that the target then gets."""
    allowed = allowed_values(guard, write.source)
    for value, image in enumerate(write.indices):
        if image is not None and allowed >> value & 1:
            yield value, image


def _parts(form: OneOf | AnyOf | Pair) -> Iterator[NormalForm]:
    """Yield the parts of a disjunction, a literal or a comparison."""
    match form:
        case OneOf(variable, allowed, count):
            yield from (OneOf(variable, 1 << value, count) for value in indices_of(allowed))
        case AnyOf(parts):
            yield from parts
        case Pair():
            for value in range(len(form.left_values)):
                row = form.row(value)
                if row:
                    right = OneOf(form.right, row, len(form.right_values))
                    yield AllOf((OneOf(form.left, 1 << value, len(form.left_values)), right))
        case _:
            assert_never(form)
