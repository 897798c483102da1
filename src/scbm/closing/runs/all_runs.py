"""All runs of a model without injections: one graph for each goal, and the states in which guards are evaluated."""

from __future__ import annotations

from functools import cached_property
from itertools import chain
from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.closing.counted_activity import CountedActivity
from scbm.closing.distinguished_values import distinguished_groups
from scbm.closing.proofs.possible_values import ValueSets, possible_values
from scbm.closing.runs.run_graph import MAX_STEPS_EACH, RunExploration, RunGraph, initial_states
from scbm.model import Constant, Equal, GoalOrder, PlanSet, Reference
from scbm.model.predicates import all_needed
from scbm.model.variables import CURRENT_NAME
from scbm.planning import DEFAULT_PLANNER, Planner
from scbm.running import Program
from scbm.running.untimed.noted_steps import NotedSteps
from scbm.running.untimed.plan_queues import AnyPlanQueues, CanonicalQueues
from scbm.running.untimed.projected_steps import ProjectedSteps
from scbm.running.untimed.relevance import Relevance
from scbm.running.untimed.rest_visits import MOST_RESTS
from scbm.running.untimed.run_answers import SATISFICING_SHARE, RunAnswers
from scbm.running.untimed.situations import TooManyRepliesError, TooManyRestsError, Visits
from scbm.running.untimed.watched_steps import WatchedSteps

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from scbm.closing.runs.run_graph import Start
    from scbm.model import BehaviorModel, Predicate, Value
    from scbm.running.untimed.plan_queues import PlanQueues
    from scbm.running.untimed.run_steps import RunSteps


class CloseLimits(Struct, frozen=True):
    """The limits of closing. None is a time: the same model is decided alike on every machine.

    Attributes:
        situations: the maximum number of situations of runs, over all goals together.
        starts: the maximum number of combinations of random values that are enumerated for initial states.
        planning: the maximum number of states of the world that are expanded to plan for one goal, where planning for
            all of them at once is not possible.
        candidates: the maximum number of cases that are tried for one obligation whose walk did not lead to it.
        beyond: the maximum number of situations of the guided search, where not all situations were explored.
        random: the maximum number of random cases that are drawn where the runs are not few.
        changes: the maximum number of changed cases that are run after them, for the obligations that are still open.
    """

    situations: int = 300_000
    starts: int = 100_000
    planning: int = 200_000
    candidates: int = 100
    beyond: int = 100_000
    random: int = 1_000
    changes: int = 2_000


_INTERRUPTED = "closing was interrupted"


class RunScope(Struct, frozen=True):
    """Which runs are explored.

    Attributes:
        is_open: whether something outside the model changes variables at settled moments.
        goals: whether each run has one goal, or goals follow each other.
        plans: the plans that the runner may get. For others than canonical plans the planner of the model makes no
            difference.
        keeps_all: whether states keep all variables, also those that cannot influence a run of the model.
        takes_classes: whether what changes freely takes one value of each class that guards and goals distinguish; then
            the runs lead to cases, and prove nothing.
        keeps_notes: whether edges have notes about what happens to operations and requests.
        watched: the predicates whose truth in each state is noted, too. Then a runner at rest is a situation also after
            the runs of single goals.
    """

    is_open: bool = False
    goals: GoalOrder = GoalOrder.SINGLE
    plans: PlanSet = PlanSet.CANONICAL
    keeps_all: bool = False
    keeps_notes: bool = False
    takes_classes: bool = False
    watched: tuple[Predicate, ...] = ()


class AllRuns:
    """The graphs of all runs.

    Attributes:
        program: the compiled model.
        planner: the planner of all runs, which is that of the model.
        relevance: the variables by which situations differ.
        visits: the meaning of the bits of visits.
        scope: which runs these are.
        goals: whether each run has one goal, or goals follow each other.
        plans: the plans that the runner may get.
        starts: the initial states, the nominal one first.
        graphs: one graph for each goal; one for all where goals follow each other.
        evaluated: for each goal the packed states in which guards were evaluated, those after ends included.
        asked: for each goal the packed states in which a plan was asked for.
        answers: the answers of the planner.
        stopped: why the exploration is incomplete, as a sentence; `None` if it is complete.
        other_planner: the planner of the model if that is not the canonical one. Then these are its runs, and they
            prove nothing.
        option: the option of `scbm close` that raises the limit that ended the exploration, if there is one.
        is_interrupted: whether the user ended the exploration.
    """

    def __init__(  # noqa: PLR0913 - what is explored, how far, and who is interested
        self,
        model: BehaviorModel,
        limits: CloseLimits,
        progress: Callable[[str], None],
        scope: RunScope = RunScope(),
        *,
        until: int = 0,
        explores: bool = True,
        may_go_on: bool = False,
        only_proves: bool = False,
        planner: Planner | None = None,
        program: Program | None = None,
    ) -> None:
        """Explore all runs.

        Args:
            model: the model.
            limits: the limits of the exploration.
            progress: called with a description of each phase as it begins.
            scope: which runs.
            until: bits of visits: the exploration ends when it has visited all of them. 0 for no such end.
            explores: whether to explore anything; if not, that counts as interrupted.
            may_go_on: whether `within` may go on where a limit of situations ends the exploration.
            only_proves: whether the runs are of no use unless all are explored.
            planner: a planner of the model; by default a new one.
            program: the compiled model, if it is compiled.
        """
        self.model = model
        self.program = program or Program(model)
        self.scope = scope
        self._classes: Mapping[str, tuple[Value, ...]] = {}
        if scope.takes_classes:
            classes = distinguished_groups(model)
            self._classes = dict(chain.from_iterable(group.values for group in classes))
            self.program.give(classes)
        self.goals, self.plans = scope.goals, scope.plans
        self.planner = planner or (Planner.of(model) if scope.plans is PlanSet.CANONICAL else Planner(model))
        watched = dict.fromkeys(name for predicate in scope.watched for name in predicate.reads())
        self.relevance = Relevance(model, self.program.packing, also=watched, keeps_all=scope.keeps_all)
        self.visits = Visits(model)
        self._canonical_queues = CanonicalQueues(operation.name for operation in model.operations)
        self._queues: dict[Predicate, PlanQueues] = {}
        self.starts: Sequence[Start] = ()
        self.graphs: tuple[RunGraph, ...] = ()
        self.evaluated: tuple[Mapping[int, None], ...] = ()
        self.asked: tuple[Sequence[int], ...] = ()
        self.answers = RunAnswers(self.planner, self.program, limits.planning)
        self.stopped: str | None = None
        self.option: str | None = None
        self.is_interrupted = False
        self._limits = limits
        self._until = until
        self._progress = progress
        self._may_go_on = may_go_on
        self._only_proves = only_proves
        self._explorations: list[tuple[RunExploration, Sequence[RunSteps]]] = []
        self.other_planner = None if self.planner.name == DEFAULT_PLANNER else self.planner.name
        if explores:
            self._explore(limits, progress)
        else:
            self.stopped, self.is_interrupted = _INTERRUPTED, True

    @property
    def proves(self) -> bool:
        """Whether nothing but what these runs visit can be visited; the checker can find canonical plans alone."""
        return self.stopped is None and self.other_planner is None

    @property
    def may_grow(self) -> bool:
        """Whether a higher limit of situations would continue the exploration."""
        return any(not graph.complete and not graph.planning_too_large for graph in self.graphs)

    @property
    def beyond(self) -> int:
        """The number of situations that were found beyond the limit, where the exploration may go on."""
        return sum(exploration.beyond for exploration, _ in self._explorations)

    @property
    def situations(self) -> int:
        """The number of explored situations."""
        return sum(len(graph.positions) for graph in self.graphs)

    @property
    def planned(self) -> int:
        """The work of planning so far, as a number of states (`Policy.planned`)."""
        return self.answers.planned

    @property
    def plannable(self) -> tuple[tuple[str, Predicate], ...]:
        """The goals whose plans are found within the limits, as far as is known."""
        return tuple(graph.goal for graph in self.graphs if not graph.planning_too_large)

    @cached_property
    def observed(self) -> Mapping[int, None]:
        """The packed states in which guards were evaluated."""
        return dict.fromkeys(chain.from_iterable(self.evaluated))

    @property
    def visited(self) -> int:
        """The obligations that runs visit, as bits of `Visits`."""
        visited = 0
        for graph in self.graphs:
            visited |= graph.visits
        return visited

    @property
    def cut_off(self) -> int:
        """The obligations that runs visit only if a limit of plans ends them."""
        cut_off = 0
        for graph in self.graphs:
            for _, _, visits in graph.cut_offs:
                cut_off |= visits
        return cut_off

    def _explore(self, limits: CloseLimits, progress: Callable[[str], None]) -> None:
        try:
            complete = True
            if not self._explorations:
                self.starts, complete = initial_states(
                    self.program, self.relevance, limits.starts, is_open=self.scope.is_open, values=self._classes
                )
            if not complete:
                self.stopped = f"there are more than {limits.starts:,} combinations of initial values"
            if self.planner.entry.is_external:
                self.stopped = f"the planner {self.planner.name} is another program, so runs are tried and not explored"
            elif self.goals is GoalOrder.SEQUENCE:
                self._explore_sequences(limits, progress)
            else:
                self._explore_goals(limits, progress)
        except TooManyRepliesError:
            self.stopped = "a reply has too many combinations of measured values"
        except TooManyRestsError:
            self.stopped = f"the runner at rest can be in more than {MOST_RESTS:,} states"
        except KeyboardInterrupt:
            self.stopped, self.is_interrupted = _INTERRUPTED, True
        if not (self._may_go_on and self.may_grow) or self.is_interrupted:
            self._explorations.clear()

    @property
    def _is_planning_too_large(self) -> bool:
        return any(graph.planning_too_large for graph in self.graphs)

    def within(
        self, limits: CloseLimits, *, only_proves: bool = False, until: int | None = None, may_go_on: bool = False
    ) -> AllRuns:
        """Return the runs explored within higher limits; go on with what is explored where that comes to the same.

        Args:
            limits: the limits.
            only_proves: whether the runs are of no use unless all are explored.
            until: bits of visits at which the exploration ends, some of those that were given; by default all of them.
            may_go_on: whether `within` may go on once more.
        """
        self._until = self._until if until is None else until
        if self._explorations and not self._is_planning_too_large:
            for exploration, _ in self._explorations:
                exploration.end_at(self._until)
            self._may_go_on, self._only_proves = may_go_on, only_proves
            self.graphs, self.evaluated, self.asked, self.stopped, self.option = (), (), (), None, None
            self._explore(limits, self._progress)
            if self._limits.planning == limits.planning or not self._is_planning_too_large:
                return self
        return AllRuns(
            self.model,
            limits,
            self._progress,
            self.scope,
            until=self._until,
            may_go_on=may_go_on,
            only_proves=only_proves,
            planner=self.planner,
            program=self.program,
        )

    def _explore_goals(self, limits: CloseLimits, progress: Callable[[str], None]) -> None:
        left = limits.situations
        for number, (name, goal) in enumerate(self.model.goals, start=1):
            which = f"exploring the runs to {name} (goal {number} of {len(self.model.goals)})"
            progress(which)
            if number > len(self._explorations):
                self._add_exploration(((name, goal),), [self.steps(goal)], is_single=True)
            graph = self._explored(number - 1, left, _Counted(which, left, progress))
            left -= len(graph.positions)
            self._note_end(graph, name, limits)

    def _explore_sequences(self, limits: CloseLimits, progress: Callable[[str], None]) -> None:
        which = f"exploring sequences of the {len(self.model.goals)} goals"
        progress(which)
        if not self._explorations:
            steps = [self.steps(goal, number) for number, (_, goal) in enumerate(self.model.goals)]
            self._add_exploration(self.model.goals, steps)
        graph = self._explored(0, limits.situations, _Counted(which, limits.situations, progress))
        self._note_end(graph, "one of the goals", limits)

    def _add_exploration(
        self, goals: tuple[tuple[str, Predicate], ...], steps: Sequence[RunSteps], *, is_single: bool = False
    ) -> None:
        exploration = RunExploration(
            goals,
            steps,
            self.starts,
            until=self._until,
            is_single=is_single,
            keeps_notes=self.scope.keeps_notes or bool(self.scope.watched),
        )
        self._explorations.append((exploration, steps))

    def _explored(self, number: int, most: int, counted: _Counted) -> RunGraph:
        """Return the graph of an exploration with at most so many situations, and note it."""
        exploration, steps = self._explorations[number]
        graph = exploration.explore(most, counted.count, may_go_on=self._may_go_on, only_complete=self._only_proves)
        self.graphs = (*self.graphs, graph)
        self.evaluated = (*self.evaluated, *(each.evaluated for each in steps))
        self.asked = (*self.asked, *(each.asked for each in steps))
        return graph

    def _note_end(self, graph: RunGraph, goal: str, limits: CloseLimits) -> None:
        """Note why the exploration of a graph ended early, if it did."""
        if graph.planning_too_large:
            self.stopped, self.option = self._too_large(goal, limits), "--max-planning"
        elif not graph.complete and self._until and not self._until & ~(self.visited | self.cut_off):
            self.stopped = "everything that is left to decide is visited by runs"
        elif graph.has_too_many_steps:
            self.stopped = f"runs have more than {MAX_STEPS_EACH} steps for each situation that may be explored"
            self.option = "--max-states"
        elif not graph.complete:
            noun = "situation" if limits.situations == 1 else "situations"
            self.stopped = f"runs can be in more than {limits.situations:,} {noun}"
            self.option = "--max-states"

    def _too_large(self, name: str, limits: CloseLimits) -> str:
        if self.other_planner is None:
            return f"planning for {name} would expand more than {limits.planning:,} states of the world"
        most = limits.planning // SATISFICING_SHARE
        return f"the planner {self.other_planner} would evaluate more than {most:,} states to plan all runs to {name}"

    def steps(self, goal: Predicate, number: int = 0) -> RunSteps:
        """Return the steps of the runs for a goal, which has this number where goals follow each other."""
        watched = self.scope.watched
        kind = WatchedSteps if watched else NotedSteps if self.scope.keeps_notes else ProjectedSteps
        steps = kind(
            self.program,
            self.relevance,
            self.visits,
            goal,
            self.answers.to(goal),
            self.queues(goal),
            number=number,
            is_open=self.scope.is_open,
            is_sequence=self.goals is GoalOrder.SEQUENCE or bool(watched),
        )
        steps.read_goal(goal)
        return steps.watch(watched) if isinstance(steps, WatchedSteps) else steps

    def queues(self, goal: Predicate) -> PlanQueues:
        """Return what is left of plans to a goal whose steps were asked for."""
        if self.plans is PlanSet.CANONICAL:
            return self._canonical_queues
        if goal not in self._queues:
            policy = self.answers.policy(goal)
            self._queues[goal] = AnyPlanQueues(
                policy.task.packing,
                self.answers.translation(goal).translate,
                policy.plan,
                policy.task.successors,
                self.planner.problem(goal).is_goal,
                self._limits.planning,
            )
        return self._queues[goal]

    def planned_names(self, goal: Predicate) -> tuple[str, ...]:
        """Return the variables of queues that are states; none for canonical plans."""
        if self.plans is PlanSet.CANONICAL:
            return ()
        return tuple(v.name for v in self.answers.policy(goal).task.packing.space if not v.role.is_runner)


class _Counted:
    """Reports the number of explored situations."""

    def __init__(self, which: str, most: int, progress: Callable[[str], None]) -> None:
        self._which = which
        self._most = most
        self._progress = progress

    def count(self, positions: int) -> None:
        """Report so many situations."""
        self._progress(CountedActivity.of(self._which, positions, self._most, "situations"))


class ObservedStates:
    """The states in which the runner evaluates guards, micro-steps included.

    If they are too many, the values that the delete relaxation allows take their place.
    """

    def __init__(self, runs: AllRuns) -> None:
        self._runs = runs
        self._known: dict[Predicate, bool] = {}

    @property
    def are_known(self) -> bool:
        """Whether all states were explored."""
        return self._runs.proves

    def can_hold(self, predicate: Predicate) -> bool:
        """Return whether a predicate holds in one of the states; `True` also if that is unknown."""
        if predicate not in self._known:
            self._known[predicate] = self._holds(predicate)
        return self._known[predicate]

    def _holds(self, predicate: Predicate) -> bool:
        if not self.are_known:
            return self._values.can_hold(predicate)
        return any(map(self._runs.program.packing.test(predicate), self._candidates(predicate)))

    def where(self, predicate: Predicate) -> Iterator[Mapping[str, Value]]:
        """Yield the states in which a predicate holds, with all variables; irrelevant ones have any value."""
        packing = self._runs.program.packing
        return map(packing.values, filter(packing.test(predicate), self._candidates(predicate)))

    def _candidates(self, predicate: Predicate) -> Iterable[int]:
        """Return the states of the current operation that a predicate names as a conjunct; all if it names none."""
        for part in all_needed(predicate):
            match part:
                case Equal(Reference(name), Constant(operation)) if name == CURRENT_NAME:
                    return self._by_operation.get(operation, ())
        return self._runs.observed

    @cached_property
    def _by_operation(self) -> dict[Value, list[int]]:
        """The states of each current operation: most questions are about one."""
        packing = self._runs.program.packing
        found: dict[Value, list[int]] = {}
        for state in self._runs.observed:
            found.setdefault(packing.value(state, CURRENT_NAME), []).append(state)
        return found

    @cached_property
    def _values(self) -> ValueSets:
        model = self._runs.model
        return ValueSets(model.running_space, possible_values(model))
