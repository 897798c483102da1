"""A set as the argument of a certificate: nodes that compare values of variables, instead of bits."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from msgspec.structs import astuple

from scbm.model import PlanSet
from scbm.proofcheck import RequirementSetsArgument, SetsArgument

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.closing.symbolic.decision_diagrams import Diagram
    from scbm.closing.symbolic.reached_sets import ReachedSet
    from scbm.closing.symbolic.run_space import RunSpace
    from scbm.model import GoalOrder


def sets_argument(found: ReachedSet, goals: GoalOrder, watched: Sequence[Diagram] = ()) -> SetsArgument:
    """Return the argument of a set; with the sets in which requirements are watched, one about requirements."""
    canonical = found.plans
    layers, choices = ((), ()) if canonical is None else (canonical.layers, tuple(canonical.choices.values()))
    nodes = _ValueNodes(found.space, (found.reached, found.dead, *layers, *choices, *watched))
    numbers = iter(nodes.numbers)
    reached, dead = next(numbers), next(numbers)
    listed = [tuple(islice(numbers, len(each))) for each in (layers, choices, watched)]
    plans = PlanSet.ANY if canonical is None else PlanSet.CANONICAL
    argument = SetsArgument(tuple(found.space.variables), tuple(nodes.nodes), reached, dead, goals, plans, *listed[:2])
    return RequirementSetsArgument(*astuple(argument), watched=listed[2]) if watched else argument


class _ValueNodes:
    """The nodes of some sets, each after those that it leads to.

    Attributes:
        nodes: the nodes.
        numbers: the numbers of the sets.
    """

    def __init__(self, space: RunSpace, sets: Sequence[Diagram]) -> None:
        self._space = space
        self._variables = list(space.variables.values())
        self._level_of = {bit: level for level, each in enumerate(self._variables) for bit in each.bits}
        levels = self._levels(sets)
        known = {space.manager.false: 0, space.manager.true: 1}
        self.nodes: list[tuple[int, ...]] = []
        numbers: dict[tuple[int, ...], int] = {}
        for level in reversed(range(len(levels))):
            for diagram, parts in levels[level].items():
                node = (level, *(known[part] for part in parts))
                if len(dict.fromkeys(node[1:])) == 1:
                    known[diagram] = node[1]  # the bits differ in codes of no value
                    continue
                if node not in numbers:
                    self.nodes.append(node)
                    numbers[node] = len(self.nodes) + 1
                known[diagram] = numbers[node]
        self.numbers = tuple(known[each] for each in sets)

    def _levels(self, sets: Sequence[Diagram]) -> list[dict[Diagram, tuple[Diagram, ...]]]:
        """Return for each variable the sets that compare it first, each with what is left for each of its values."""
        manager = self._space.manager
        found: list[dict[Diagram, tuple[Diagram, ...]]] = [{} for _ in self._variables]
        todo: list[dict[Diagram, None]] = [{} for _ in self._variables]

        def add(diagram: Diagram) -> None:
            if diagram not in (manager.false, manager.true):
                todo[self._level_of[diagram.var]][diagram] = None

        for each in sets:
            add(each)
        for level, variable in enumerate(self._variables):
            for diagram in todo[level]:
                parts = tuple(_parts(diagram, variable.bits, len(variable.values)))
                found[level][diagram] = parts
                for part in parts:
                    add(part)
        return found


def _parts(diagram: Diagram, bits: Sequence[str], count: int) -> list[Diagram]:
    """Return what is left of a set for each of the first `count` values of some bits, which are the first it compares.

    To follow the nodes takes a third of the time of `let`.
    """
    if not bits:
        return [diagram]
    low = high = diagram
    if diagram.var == bits[0]:
        low, high = (~diagram.low, ~diagram.high) if diagram.negated else (diagram.low, diagram.high)
    half = 1 << len(bits) - 1
    return [*_parts(low, bits[1:], min(half, count)), *(_parts(high, bits[1:], count - half) if count > half else ())]
