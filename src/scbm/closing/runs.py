"""All runs of a model without injections: one graph for each goal, and what they visit together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from scbm.closing.graph import RunGraph, explore_runs
from scbm.closing.relevance import Relevance
from scbm.closing.situations import Queues, Steps, Visits
from scbm.closing.starts import initial_states
from scbm.planning import PlanLimits, Planner
from scbm.running import Program

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from scbm.closing.graph import Start
    from scbm.model import BehaviorModel, Predicate
    from scbm.planning import Answer, Policy


@dataclass(frozen=True, slots=True)
class CloseLimits:
    """How much may be looked at. Never a time: the same model is decided alike on every machine.

    Attributes:
        situations: of runs, over all goals together.
        starts: combinations of random values that are gone through for initial states.
        candidates: cases that are tried for one obligation that a walk did not bring about.
        beyond: situations that are looked at once more, nearest to what is missed first, where not all were explored.
    """

    situations: int = 300_000
    starts: int = 100_000
    candidates: int = 100
    beyond: int = 100_000


_PLANS = PlanLimits(length=10_000_000, expansions=10_000_000)
"""Plans of any length, however they are found. A planner that gives up earlier ends the run, as other limits do."""


class Runs:
    """The graphs.

    Attributes:
        program: the compiled model.
        planner: makes the plans of all runs.
        relevance: which variables tell situations apart.
        visits: what the bits of visits mean.
        starts: the initial states, the nominal one first.
        graphs: one for each goal.
        looked_at: the packed states in which guards were looked at.
        stopped: why not everything was explored, in words; `None` if everything was.
    """

    def __init__(self, model: BehaviorModel, limits: CloseLimits, progress: Callable[[str], None]) -> None:
        self.model = model
        self.program = Program(model)
        self.planner = Planner(model)
        self.relevance = Relevance(model, self.program.packing)
        self.visits = Visits(model)
        self.queues = Queues()
        self.starts: Sequence[Start] = ()
        self.graphs: tuple[RunGraph, ...] = ()
        self.looked_at: dict[int, None] = {}
        self._policies: dict[Predicate, Policy] = {}
        self.stopped: str | None = None
        self._explore(limits, progress)

    @property
    def situations(self) -> int:
        """How many situations were looked at."""
        return sum(len(graph.positions) for graph in self.graphs)

    @property
    def visited(self) -> int:
        """What runs visit, as bits of `Visits`."""
        visited = 0
        for graph in self.graphs:
            visited |= graph.visits
        return visited

    @property
    def cut_off(self) -> int:
        """What runs visit that a limit of plans cuts off."""
        cut_off = 0
        for graph in self.graphs:
            for _, _, visits in graph.cut_offs:
                cut_off |= visits
        return cut_off

    def _explore(self, limits: CloseLimits, progress: Callable[[str], None]) -> None:
        self.starts, complete = initial_states(self.model, self.program, self.relevance, limits.starts)
        if not complete:
            self.stopped = f"there are more than {limits.starts:,} combinations of initial values"
        left = limits.situations
        graphs = []
        for name, goal in self.model.goals:
            progress(f"exploring the runs to {name}")
            steps = self.steps(goal)
            graph = explore_runs((name, goal), steps, self.starts, left)
            graphs.append(graph)
            self.looked_at |= steps.looked_at
            left -= len(graph.positions)
            if not graph.complete:
                self.stopped = f"runs can be in more than {limits.situations:,} situations"
        self.graphs = tuple(graphs)

    def steps(self, goal: Predicate) -> Steps:
        """The steps of the runs for a goal."""
        if goal not in self._policies:
            self._policies[goal] = self.planner.policy(goal, _PLANS)
        plan = partial(_plan, _Translation(self.program, self._policies[goal]))
        return Steps(self.program, self.relevance, self.visits, self.program.test(goal), plan, self.queues)


class _Translation:
    """From the packed states of the runner to those of the planner."""

    def __init__(self, program: Program, policy: Policy) -> None:
        self.policy = policy
        fields = [field for field in policy.task.packing.fields if not field.variable.role.is_runner]
        rest = {variable.name: variable.initial for variable in program.packing.space}
        self._base = policy.task.pack(rest)
        for field in fields:
            self._base &= ~field.mask
        self._moves = tuple(
            (program.packing[field.variable.name].mask, program.packing[field.variable.name].shift, field.shift)
            for field in fields
        )

    def translate(self, state: int) -> int:
        """The state of the world as the planner packs it; the runner's variables are at rest."""
        packed = self._base
        for mask, source, target in self._moves:
            packed |= (state & mask) >> source << target
        return packed


def _plan(translation: _Translation, state: int) -> Answer:
    return translation.policy.plan(translation.translate(state))
