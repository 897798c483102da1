"""The changes from outside at settled moments, on packed states (semantics 9.2, 9.4, 9.5).

Some variables change freely. Environment transitions change others where their guards hold. Other users occupy shared
resources, and leave them.
"""

from __future__ import annotations

from itertools import product
from math import prod
from typing import TYPE_CHECKING

from scbm.closing.runs.situations import Happening, HappeningKind, TooManyRepliesError
from scbm.model import EnvironmentTransition, Resource
from scbm.model.sources import FreeGroup

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Sequence

    from scbm.cases.trace import Changes
    from scbm.closing.runs.run_graph import Relevance
    from scbm.model import Value
    from scbm.model.sources import OutsideGroup
    from scbm.running import Program

_MAX_CHOICES = 4_096
"""Maximum number of combinations of values that one message can carry."""


class OutsideChanges:
    """The changes from outside of one model; false if there are none."""

    def __init__(self, groups: Sequence[OutsideGroup], program: Program, relevance: Relevance) -> None:
        """Prepare the changes that can influence a run. Raises `TooManyRepliesError`.

        Args:
            groups: what changes from outside; empty for a closed world.
            program: the compiled model.
            relevance: the variables that states keep.
        """
        self._relevance = relevance
        names = relevance.names
        self._free: dict[Happening, tuple[int, int]] = {}
        for group in groups:
            if isinstance(group, FreeGroup):
                self._add(group)
        acting = [each.name for each in groups if isinstance(each, EnvironmentTransition) and _acts_on(each, names)]
        self._guarded = tuple(step for step in program.environment if step.name in acting)
        shared = [each.name for each in groups if isinstance(each, Resource)]
        self._shared = tuple(line for line in program.shared if line.resource.name in shared)
        self._bits = dict(self._free)

    def _add(self, group: FreeGroup) -> None:
        values = [(name, known) for name, known in group.values if name in self._relevance.names]
        for changes in choices(values):
            if changes:
                happening = Happening(HappeningKind.OUTSIDE, measured=changes)
                self._free[happening] = self._relevance.packing.assignment(dict(changes))

    def __bool__(self) -> bool:
        return bool(self._free or self._guarded or self._shared)

    def following(self, state: int, in_flight: Collection[int]) -> Iterator[tuple[Happening, int]]:
        """Yield the changes that are possible in a packed state and make a difference, each with the state afterwards.

        Args:
            state: the packed state, in which the runner is settled.
            in_flight: the resources with a request of the controller in flight, by number.
        """
        for happening, (keep, bits) in self._free.items():
            after = state & keep | bits
            if after != state:
                yield happening, after
        for step in self._guarded:
            moved = step.update(state) if step.test(state) else None
            if moved is not None and (moved ^ state) & self._relevance.mask:
                yield self._named(step.name, state, moved & self._relevance.mask)
        for line in self._shared:
            if line.number not in in_flight:
                for after in line.used_by_others(state):
                    yield self._named(line.resource.name, state, after)

    def _named(self, name: str, state: int, after: int) -> tuple[Happening, int]:
        changes = self._relevance.packing.changes(state, after)
        return Happening(HappeningKind.OUTSIDE, name, measured=changes), after

    def bits(self, happening: Happening) -> tuple[int, int]:
        """Return `(keep, bits)` of a change."""
        if happening not in self._bits:
            self._bits[happening] = self._relevance.packing.assignment(dict(happening.measured))
        return self._bits[happening]


def _acts_on(transition: EnvironmentTransition, names: Collection[str]) -> bool:
    return any(action.target in names for action in transition.actions)


def choices(values: Sequence[tuple[str, tuple[Value, ...]]]) -> Iterator[Changes]:
    """Yield each choice of values of some variables, the empty one first. Raises `TooManyRepliesError`."""
    if prod(len(known) + 1 for _, known in values) > _MAX_CHOICES:
        raise TooManyRepliesError
    for chosen in product(*((None, *known) for _, known in values)):
        yield tuple((name, value) for (name, _), value in zip(values, chosen, strict=True) if value is not None)
