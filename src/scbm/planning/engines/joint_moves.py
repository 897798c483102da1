"""Moves with their parts joined: one condition on the state before, and what each variable is after, as a table."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model import Action, Add, Assign, Constant, Domain, Packing, StateSpace, Value
from scbm.planning.engines.conditions import Condition, Image, all_of, fits, restricted, through

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from scbm.planning.engines.transition_system import Move, TransitionSystem


@dataclass(frozen=True, slots=True)
class Write:
    """A variable that a step sets.

    Attributes:
        variable: its position in the space.
        source: the variable before the step that decides.
        table: for each value of the source the index of the new value; `None` where the step cannot be taken.
    """

    variable: int
    source: int
    table: tuple[int | None, ...]


@dataclass(frozen=True, slots=True)
class JointMove:
    """A move as one step.

    Attributes:
        index: which move of the system it is.
        guard: the states, before it, in which it can be taken.
        writes: what it sets, each variable once, in the order of the space.
    """

    index: int
    guard: Condition
    writes: tuple[Write, ...]


def steps_of(system: TransitionSystem) -> tuple[JointMove, ...]:
    """The steps of all moves, over the whole domains of the system's variables."""
    packing = Packing(system.space)
    return tuple(_step(index, move, packing) for index, move in enumerate(system.moves))


def restricted_step(step: JointMove, values: Sequence[tuple[int, ...]]) -> JointMove:
    """The same step where variables have only those values that they ever have, which are numbered anew."""
    writes = (_restricted_write(write, values) for write in step.writes)
    return JointMove(
        step.index, restricted(step.guard, values), tuple(write for write in writes if not _is_idle(write))
    )


def identity(space: StateSpace) -> dict[str, Image]:
    """Every variable as it is before any action."""
    return {v.name: Image(position, tuple(range(len(v.domain)))) for position, v in enumerate(space)}


def _step(index: int, move: Move, packing: Packing) -> JointMove:
    images = identity(packing.space)
    conditions: list[Condition] = []
    for part in move.parts:
        conditions.append(through(packing.normal_form(part.guard), images))
        written = {action.target: _image(action, images, packing.space) for action in part.actions}
        conditions.extend(map(fits, written.values()))
        images = {**images, **written}
    writes = (_write(position, images[v.name]) for position, v in enumerate(packing.space))
    return JointMove(index, all_of(conditions), tuple(write for write in writes if not _is_idle(write)))


def _image(action: Action, images: dict[str, Image], space: StateSpace) -> Image:
    """What the target is behind the action, which reads what the variables are before it."""
    target = space[action.target].domain
    if isinstance(action, Add):
        image = images[action.target]
        moved = (None if index is None else int(target.values[index]) + action.amount for index in image.table)
        return Image(image.source, _located(moved, target))
    assert isinstance(action, Assign)  # noqa: S101 - for the reader: there are two kinds of actions
    if isinstance(action.source, Constant):
        image = images[action.target]
        return Image(image.source, (target.index(action.source.constant),) * len(image.table))
    image, source = images[action.source.name], space[action.source.name].domain
    values = (None if index is None else source.values[index] for index in image.table)
    return Image(image.source, _located(values, target))


def _located(values: Iterable[Value | None], domain: Domain) -> tuple[int | None, ...]:
    """The index of each value, where it is inside the domain."""
    return tuple(None if value is None or value not in domain else domain.index(value) for value in values)


def _write(variable: int, image: Image) -> Write:
    return Write(variable, image.source, image.table)


def _is_idle(write: Write) -> bool:
    return write.variable == write.source and all(new in (None, old) for old, new in enumerate(write.table))


def _restricted_write(write: Write, values: Sequence[tuple[int, ...]]) -> Write:
    renumbered = {old: new for new, old in enumerate(values[write.variable])}
    table = (write.table[old] for old in values[write.source])
    return Write(write.variable, write.source, tuple(None if i is None else renumbered.get(i) for i in table))
