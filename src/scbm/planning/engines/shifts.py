"""Steps as shifts: all states that agree in what a step sets and reads lead equally far away.

A step has stages, one after the other. Each sets variables that no other one sets or reads, so their order does not
matter; and a stage needs as many shifts as there are ways to set its variables, where one stage for all would need the
product.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from math import prod
from typing import TYPE_CHECKING, TypeAlias

from scbm.model.normal_form import NormalForm, all_of, allowed_values, any_of, indices_of, one_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from scbm.model.packing import ValueTable
    from scbm.planning.engines.joint_moves import JointMove
    from scbm.planning.engines.masks import Masks
    from scbm.planning.engines.reduced_system import StateCodes

    Shifts: TypeAlias = tuple[dict[int, NormalForm], ...]


@dataclass(frozen=True, slots=True)
class ShiftStage:
    """Some variables that a step sets, all those among them that depend on each other.

    Attributes:
        writes: what it sets.
        choices: for every variable that it sets or reads the values that the guard of the step lets it have.
    """

    writes: tuple[ValueTable, ...]
    choices: Mapping[int, tuple[int, ...]]

    @property
    def combinations(self) -> int:
        """In how many ways the variables can be before the stage."""
        return prod(map(len, self.choices.values()))

    def joined(self, other: ShiftStage) -> ShiftStage:
        """Both at once."""
        return ShiftStage((*self.writes, *other.writes), {**self.choices, **other.choices})

    def shifts(self, layout: StateCodes) -> dict[int, NormalForm]:
        """For each distance that codes are moved by, which of those that the guard lets in are moved so far."""
        found: dict[int, list[NormalForm]] = {}
        for before in self._assignments():
            if (shift := self._shift(before, layout)) is not None:
                chosen = (one_of(v, 1 << value, layout.counts[v]) for v, value in before.items() if self._is_open(v))
                found.setdefault(shift, []).append(all_of(chosen))
        return {shift: any_of(conditions) for shift, conditions in found.items()}

    def _assignments(self) -> Iterator[dict[int, int]]:
        for values in product(*self.choices.values()):
            yield dict(zip(self.choices, values, strict=True))

    def _shift(self, before: Mapping[int, int], layout: StateCodes) -> int | None:
        shift = 0
        for write in self.writes:
            after = write.indices[before[write.source]]
            if after is None:
                return None
            shift += (after - before[write.target]) * layout.strides[write.target]
        return shift

    def _is_open(self, variable: int) -> bool:
        """Whether the guard leaves the variable a choice."""
        return len(self.choices[variable]) > 1


class ShiftedStep:
    """A step on sets of states: for each stage masks, and how far the states under them are shifted.

    Attributes:
        index: which move of the system it is.
    """

    def __init__(self, step: JointMove, shifts: Shifts, layout: StateCodes, masks: Masks) -> None:
        self.index = step.index
        self._step = step
        self._layout = layout
        self._stages = tuple(
            tuple((masks.of(condition), shift) for shift, condition in stage.items()) for stage in shifts
        )

    def after(self, states: int) -> int:
        """Where the step leads from these states."""
        for shifts in self._stages:
            found = 0
            for mask, shift in shifts:
                if moved := states & mask:
                    found |= _shifted(moved, shift)
            states = found
        return states

    def target(self, code: int) -> int:
        """Where the step leads from one state in which it can be taken."""
        coordinates = self._layout.coordinates(code)
        moved = list(coordinates)
        for write in self._step.writes:
            after = write.indices[coordinates[write.source]]
            assert after is not None  # noqa: S101 - where a table has nothing the step cannot be taken
            moved[write.target] = after
        return self._layout.code(tuple(moved))

    def before(self, states: int) -> int:
        """Where the step leads into these states from."""
        for shifts in reversed(self._stages):
            found = 0
            for mask, shift in shifts:
                found |= _shifted(states, -shift) & mask
            states = found
        return states


def _shifted(states: int, shift: int) -> int:
    return states << shift if shift >= 0 else states >> -shift


def shifts_of(step: JointMove, layout: StateCodes) -> Shifts:
    """The shifts of each stage of a step; the first stage also asks for its guard."""
    first, *others = (stage.shifts(layout) for stage in stages_of(step, layout))
    return ({shift: all_of((step.guard, condition)) for shift, condition in first.items()}, *others)


def stages_of(step: JointMove, layout: StateCodes) -> tuple[ShiftStage, ...]:
    """The stages of a step, at least one; the first has all that needs no shifts of its own."""
    ready = ShiftStage((), {})
    stages = [ShiftStage(tuple(writes), _choices(step, writes, layout)) for writes in _connected(step.writes)]
    for stage in stages:
        if stage.combinations == 1:
            ready = ready.joined(stage)
    others = [stage for stage in stages if stage.combinations != 1]
    if not others:
        return (ready,)
    return (ready.joined(others[0]), *others[1:])


def _choices(step: JointMove, writes: Sequence[ValueTable], layout: StateCodes) -> dict[int, tuple[int, ...]]:
    variables = dict.fromkeys(variable for write in writes for variable in (write.target, write.source))
    everything = {variable: (1 << layout.counts[variable]) - 1 for variable in variables}
    return {variable: indices_of(bits & allowed_values(step.guard, variable)) for variable, bits in everything.items()}


def _connected(writes: Sequence[ValueTable]) -> list[list[ValueTable]]:
    """The writes in groups that name no variable in common."""
    groups: list[list[ValueTable]] = []
    for write in writes:
        near = [group for group in groups if any(_share(write, other) for other in group)]
        groups = [group for group in groups if group not in near]
        groups.append([*(other for group in near for other in group), write])
    return groups


def _share(one: ValueTable, other: ValueTable) -> bool:
    return one.target in (other.target, other.source) or one.source in (other.target, other.source)
