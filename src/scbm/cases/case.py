"""A test case: the inputs that decide a run, and the results that it expects (semantics 7.1)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from scbm.cases.network import Network

if TYPE_CHECKING:
    from scbm.cases.coverage import Obligation
    from scbm.cases.injections import Injection
    from scbm.cases.reactions import OutcomeRule
    from scbm.cases.trace import End
    from scbm.model import Predicate, Requirement, State


@dataclass(frozen=True, slots=True)
class Expectations:
    """The results that a case expects; an attribute that is empty or `None` expects nothing.

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
    """The random streams that a case draws from: those of case `number` (from 1) of the campaign with this seed."""

    seed: int
    number: int = 1


@dataclass(frozen=True, slots=True)
class CaseLimits:
    """The limits of a run; for `None` the caller of the simulation chooses the limit.

    Attributes:
        time_ns: maximum time for which a goal is pursued, in nanoseconds.
        plans: maximum number of plans for a goal.
    """

    time_ns: int | None = None
    plans: int | None = None


@dataclass(frozen=True, slots=True)
class RecordedRun:
    """The result of the run that a case was saved from.

    Attributes:
        end: how the run ended.
        trace: the SHA-256 of its trace as text, in hexadecimal digits.
    """

    end: str
    trace: str


@dataclass(frozen=True, slots=True)
class Case:
    """One test case. A choice that it leaves open has its default, or is drawn if it has an origin (decision 11).

    Attributes:
        name: its name in reports.
        goal: the name of the goal, or its predicate if it has no name.
        predicate: the goal as a predicate.
        initial: the state in which the run begins.
        outcomes: the reactions of resources and network to requests.
        injections: the injections, in the order in which they are armed.
        network: how messages travel where `outcomes` does not decide it.
        limits: the limits of the run.
        requirements: requirements beside those of the model.
        expect: the expected results.
        origin: the random streams for choices that the case leaves open; `None` draws nothing.
        recorded: the result of the run that the case was saved from.
    """

    name: str
    goal: str
    predicate: Predicate
    initial: State
    outcomes: tuple[OutcomeRule, ...] = ()
    injections: tuple[Injection, ...] = ()
    network: Network = _PERFECT
    limits: CaseLimits = CaseLimits()
    requirements: tuple[Requirement, ...] = ()
    expect: Expectations = _NOTHING
    origin: Origin | None = None
    recorded: RecordedRun | None = None
