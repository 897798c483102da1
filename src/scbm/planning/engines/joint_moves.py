"""Moves with their parts joined: one guard on the state before, and a table for each variable that is set."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.model.normal_form import NormalForm, all_of, normal_form
from scbm.model.packing import ValueTable, value_table
from scbm.planning.engines.substitution import composed, identity_tables, inside_domain, restricted, substitute

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scbm.model import StateSpace
    from scbm.planning.engines.transition_system import Move, TransitionSystem


@dataclass(frozen=True, slots=True)
class JointMove:
    """A move as one step.

    Attributes:
        index: the place of the move in its system.
        guard: the states before the move in which it is enabled.
        writes: the table of each variable that is set, in the order of the space.
    """

    index: int
    guard: NormalForm
    writes: tuple[ValueTable, ...]


def joint_moves(system: TransitionSystem) -> tuple[JointMove, ...]:
    """Return all moves of a system, joined, over the whole domains of its variables."""
    return tuple(_joined(index, move, system.space) for index, move in enumerate(system.moves))


def restricted_move(move: JointMove, values: Sequence[tuple[int, ...]]) -> JointMove:
    """Return the move for variables that keep only these of their values, which are numbered anew."""
    writes = tuple(_restricted_table(write, values) for write in move.writes)
    return JointMove(move.index, restricted(move.guard, values), _without_identities(writes))


def _joined(index: int, move: Move, space: StateSpace) -> JointMove:
    tables = list(identity_tables(space))
    conditions: list[NormalForm] = []
    for part in move.parts:
        conditions.append(substitute(normal_form(part.guard, space), tables))
        written = [composed(value_table(action, space), tables) for action in part.actions]
        conditions.extend(map(inside_domain, written))
        for table in written:
            tables[table.target] = table
    return JointMove(index, all_of(conditions), _without_identities(tables))


def _without_identities(tables: Sequence[ValueTable]) -> tuple[ValueTable, ...]:
    return tuple(table for table in tables if not table.is_identity)


def _restricted_table(table: ValueTable, values: Sequence[tuple[int, ...]]) -> ValueTable:
    renumbered = {old: new for new, old in enumerate(values[table.target])}
    indices = (table.indices[old] for old in values[table.source])
    kept = tuple(None if index is None else renumbered.get(index) for index in indices)
    return ValueTable(table.target, table.source, kept)
