"""A test case: everything that decides a run (semantics 7.1).

What a case expects to come of its run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cases.network import Network

if TYPE_CHECKING:
    from scbm.cases.coverage import Obligation
    from scbm.cases.injections import Injection
    from scbm.cases.reactions import Forced
    from scbm.cases.trace import End
    from scbm.model import Predicate, Requirement, State


@dataclass(frozen=True, slots=True)
class Expectations:
    """What must be true afterwards; what is empty or `None` is not asked.

    Attributes:
        verdict: how the run ends.
        plan: the operations of the first plan, all of them.
        order: operations that complete in this order; others may complete between them.
        final: predicates over the state at the end.
        visits: obligations that the run visits.
    """

    verdict: End | None = None
    plan: tuple[str, ...] | None = None
    order: tuple[str, ...] = ()
    final: tuple[Predicate, ...] = ()
    visits: tuple[Obligation, ...] = ()


_PERFECT = Network()
_NOTHING = Expectations()


@dataclass(frozen=True, slots=True)
class Origin:
    """Which streams of chance a case draws from: those of case `number` (from 1) of the campaign with this seed."""

    seed: int
    number: int = 1


@dataclass(frozen=True, slots=True)
class CaseLimits:
    """When the run is given up; `None` leaves it to whoever runs the case.

    Attributes:
        time_ns: how long the goal may be pursued.
        plans: how many plans may be asked for.
    """

    time_ns: int | None = None
    plans: int | None = None


@dataclass(frozen=True, slots=True)
class Recorded:
    """What came of the run that a case was saved from.

    Attributes:
        end: how it ended.
        trace: the SHA-256 of its trace as text, in hexadecimal digits.
    """

    end: str
    trace: str


@dataclass(frozen=True, slots=True)
class Case:
    """One case. What it does not say is plain, or drawn if it has an origin (decision 11).

    Attributes:
        name: what reports call it.
        goal: the goal's name, or its predicate if it has none.
        predicate: what is to be reached.
        initial: the state of the world at the beginning.
        outcomes: what resources and network do with requests.
        injections: what the tester injects, in the order in which they are armed.
        network: how the messages of resources travel, where the outcomes do not say it.
        limits: when the run is given up.
        requirements: requirements beside those of the model.
        expect: what must come of it.
        origin: the streams that everything is drawn from which the case leaves open; without one nothing is drawn.
        recorded: what came of the run that it was saved from.
    """

    name: str
    goal: str
    predicate: Predicate
    initial: State
    outcomes: tuple[Forced, ...] = ()
    injections: tuple[Injection, ...] = ()
    network: Network = _PERFECT
    limits: CaseLimits = CaseLimits()
    requirements: tuple[Requirement, ...] = ()
    expect: Expectations = _NOTHING
    origin: Origin | None = None
    recorded: Recorded | None = None
