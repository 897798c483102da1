"""A test case: everything that decides a run (semantics 7.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scbm.model import Predicate, State
    from scbm.running import Injection
    from scbm.simulating import Reaction


@dataclass(frozen=True, slots=True)
class Origin:
    """Which draw made a case: case `number` (from 1) of the campaign with this seed."""

    seed: int
    number: int


@dataclass(frozen=True, slots=True)
class Case:
    """One case.

    Attributes:
        name: what reports call it.
        goal: the goal's name, or its predicate if it has none.
        predicate: what is to be reached.
        initial: the state of the world at the beginning.
        reactions: what resources do with the requests, in order; `None` if it is still to be drawn from `origin`.
        injections: what the tester injects.
        origin: the draw that made the case, if one did.
    """

    name: str
    goal: str
    predicate: Predicate
    initial: State
    reactions: tuple[Reaction, ...] | None = None
    injections: tuple[Injection, ...] = ()
    origin: Origin | None = None
