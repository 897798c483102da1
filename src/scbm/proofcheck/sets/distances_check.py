"""Checks how far predicted states are from the goal, and which operation canonical plans choose in them.

A certificate lists layers: the states from which the goal is 0, 1, 2, … operations away. They are right if the goal
holds in the states of layer 0 and in no others, an operation leads from each other one to the next layer, and none
leads nearer, or to a state that is neither in a layer nor dead. The choice is right if it leads to the next layer and
no operation before it in the model does.

A solver takes long for that. So for each operation the diagrams before and after it are followed together, from the
first variable to the last one, each combination of their nodes once.
"""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.proofcheck.certificate import MAX_CHANGES, CertificateFlaw, predicted_name
from scbm.proofcheck.guarded_parts import GuardedRule

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from scbm.model import Action, BehaviorModel, Operation, Predicate, Transition, Value
    from scbm.proofcheck.certificate import SetsArgument

_END = 0
"""The number of what is left of a change when all its variables are compared."""


class _JointSets:
    """Some sets that are followed together. A state is what is left of each of them.

    Attributes:
        first: the state before any variable is compared.
        levels: for each state the number of the variable that it compares next.
    """

    def __init__(self, argument: SetsArgument, numbers: Iterable[int]) -> None:
        self._nodes = argument.nodes
        self._last = len(argument.variables)
        self._numbers: dict[tuple[tuple[int, int], ...], int] = {}
        self._parts: list[tuple[tuple[int, int], ...]] = []
        self._following: list[tuple[int, ...] | None] = []
        self.levels: list[int] = []
        self.first = self._state(enumerate(numbers))

    def _state(self, parts: Iterable[tuple[int, int]]) -> int:
        """Return the number of a state; empty sets are left out."""
        kept = tuple((index, number) for index, number in parts if number)
        if kept not in self._numbers:
            self._numbers[kept] = len(self._parts)
            self._parts.append(kept)
            self._following.append(None)
            self.levels.append(min((self._level(number) for _, number in kept), default=self._last))
        return self._numbers[kept]

    def _level(self, number: int) -> int:
        return self._nodes[number - 2][0] if number > 1 else self._last

    def after(self, state: int, level: int, value: int) -> int:
        """Return the state after a variable has got a value, both by number."""
        if self.levels[state] != level:
            return state
        following = self._following[state]
        if following is None:
            following = self._following[state] = tuple(self._all_after(state, level))
        return following[value]

    def _all_after(self, state: int, level: int) -> Iterator[int]:
        parts = self._parts[state]
        nodes = [self._nodes[number - 2] if self._level(number) == level else None for _, number in parts]
        count = next(len(node) for node in nodes if node is not None)
        for value in range(1, count):
            pairs = zip(parts, nodes, strict=True)
            yield self._state((index, number if node is None else node[value]) for (index, number), node in pairs)

    def members(self, state: int) -> tuple[int, ...]:
        """Return the numbers of the sets that are left, each from 0 on in the order in which they were given."""
        return tuple(index for index, _ in self._parts[state])

    def is_empty(self, state: int) -> bool:
        """Return whether no set is left."""
        return not self._parts[state]


class _ChangeNode(Struct, frozen=True):
    """A node of a diagram of pairs: values of a variable before and after an operation, by number.

    Attributes:
        level: the number of the variable.
        pairs: the pairs, each with the number of the node that is compared next.
    """

    level: int
    pairs: tuple[tuple[int, int, int], ...]


def _names_of(transition: Transition) -> Iterator[str]:
    """Yield the variables that the planner reads and changes for a transition."""
    yield from transition.g.reads()
    for action in transition.a:
        yield from (*action.reads(), action.target)


class _PlannedChanges:
    """What one operation changes, by the planner's rules (3.3), as a diagram of pairs.

    Attributes:
        first: the number of the first node; `None` if the operation is never enabled.
        nodes: the nodes; the one with number `_END` compares nothing.
    """

    def __init__(self, operation: Operation, model: BehaviorModel, levels: Mapping[str, int], last: int) -> None:
        """Prepare the diagram. Raises `OverflowError` if the operation reads too many values.

        Args:
            operation: the operation.
            model: the model.
            levels: the numbers of the variables that plans depend on.
            last: the number after those of all variables.
        """
        self.nodes = [_ChangeNode(last, ())]
        self._known: dict[_ChangeNode, int] = {}
        self._levels = levels
        parts = (operation.pre, operation.post)
        named = dict.fromkeys(name for part in parts for name in _names_of(part))
        self._names = sorted((name for name in named if name in levels), key=levels.__getitem__)
        domains = [model.space[name].domain.values for name in self._names]
        if prod(map(len, domains)) > MAX_CHANGES:
            raise OverflowError
        at_rest = {v.name: v.initial for v in model.running_space if v.role.is_runner}
        rules = [self._rule(operation.name, part.g, part.a, model) for part in parts]
        rows = []
        for values in product(*domains):
            after: dict[str, Value] | None = {**at_rest, **dict(zip(self._names, values, strict=True))}
            for rule in rules:
                after = after and rule.taken(after)
            if after is not None:
                pairs = zip(self._names, domains, values, strict=True)
                rows.append(tuple((known.index(old), known.index(after[name])) for name, known, old in pairs))
        self.first: int | None = self._node(rows, 0) if rows else None

    def _rule(self, name: str, guard: Predicate, actions: Sequence[Action], model: BehaviorModel) -> GuardedRule:
        kept = tuple(action for action in actions if action.target in self._levels)
        return GuardedRule(name, guard, kept, tuple(model.space[action.target].domain for action in kept))

    def _node(self, rows: Sequence[tuple[tuple[int, int], ...]], depth: int) -> int:
        """Return the number of the node for rows that agree in all variables before."""
        if depth == len(self._names):
            return _END
        groups: dict[tuple[int, int], list[tuple[tuple[int, int], ...]]] = {}
        for row in rows:
            groups.setdefault(row[depth], []).append(row)
        pairs = tuple((*pair, self._node(group, depth + 1)) for pair, group in groups.items())
        node = _ChangeNode(self._levels[self._names[depth]], pairs)
        if node not in self._known:
            self._known[node] = len(self.nodes)
            self.nodes.append(node)
        return self._known[node]


class DistancesCheck:
    """The check of the layers and choices of a set under canonical plans, as far as operations change states."""

    def __init__(self, argument: SetsArgument, model: BehaviorModel, sizes: Sequence[int]) -> None:
        """`sizes` has the number of values of each variable of the argument."""
        self._argument = argument
        self._model = model
        self._sizes = sizes
        self._levels = {name: level for level, name in enumerate(argument.variables)}
        self._layers = _JointSets(argument, argument.layers)
        self._layers_or_dead = _JointSets(argument, (*argument.layers, argument.dead))

    def flaws(self) -> Iterator[CertificateFlaw]:
        """Yield at most one flaw for each operation."""
        predicted = {name: self._levels.get(predicted_name(name)) for name in self._model.space.names}
        levels = {name: level for name, level in predicted.items() if level is not None}
        for number, operation in enumerate(self._model.operations):
            try:
                changes = _PlannedChanges(operation, self._model, levels, len(self._sizes))
            except OverflowError:
                yield CertificateFlaw("the layers", f"{operation.name} reads too many values to check them")
                continue
            choices = _JointSets(self._argument, self._argument.choices[: number + 1])
            for here, there, chosen in self._ends(changes, choices):
                flaw = self._flaw(number, here, there, choices.members(chosen))
                if flaw is not None:
                    yield CertificateFlaw("the layers", f"{operation.name} {flaw}")
                    break

    def _ends(self, changes: _PlannedChanges, choices: _JointSets) -> Iterator[tuple[int, int, int]]:
        """Yield the last states: of the layers before a change, of layers and dead states after it, of the choices."""
        layers, others, nodes = self._layers, self._layers_or_dead, changes.nodes
        if changes.first is None:
            return
        todo = [(changes.first, layers.first, others.first, choices.first)]
        seen, last = dict.fromkeys(todo), len(self._sizes)
        while todo:
            change, here, there, chosen = todo.pop()
            own = nodes[change].level
            level = min(own, layers.levels[here], others.levels[there], choices.levels[chosen])
            if level >= last:
                yield here, there, chosen
                continue
            pairs = nodes[change].pairs if own == level else [(v, v, change) for v in range(self._sizes[level])]
            for before, after, rest in pairs:
                left = layers.after(here, level, before)
                if not layers.is_empty(left):
                    found = (rest, left, others.after(there, level, after), choices.after(chosen, level, before))
                    if found not in seen:
                        seen[found] = None
                        todo.append(found)

    def _flaw(self, operation: int, here: int, there: int, choices: Sequence[int]) -> str | None:
        """Return what is wrong with states before and after an operation; `None` if nothing is.

        `choices` are the operations up to this one that are chosen there.
        """
        before, after = self._layers.members(here), self._layers_or_dead.members(there)
        if len(before) != 1 or len(after) != 1:
            return "leads from or to a state that is not in one layer alone"
        following = before[0] - 1
        if after[0] < following:
            return "leads nearer than to the next layer"
        if after[0] != following:
            return "is chosen where it does not lead to the next layer" if operation in choices else None
        return None if choices else "leads to the next layer where a later operation is chosen"
