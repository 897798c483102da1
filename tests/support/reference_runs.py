"""A second interpreter of behavior models, written from the semantics alone: what runs visit, and what is no run.

It shares no code with the runner, the simulator, closing or the checker of proofs. States are plain dicts, nothing is
fast, and each rule names its number in docs/reference/semantics.md. Plans come from the real planner.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property
from itertools import chain, product
from typing import NamedTuple, TypeAlias

from scbm.cases.trace import (
    InjectionApplied,
    MeasurementReceived,
    OperationStepped,
    PlanAsked,
    PlanReceived,
    PutBack,
    Record,
    ReplyReceived,
    RequestCancelled,
    RequestSent,
    RunEnded,
    RunnerStarted,
    RunStarted,
    Trace,
)
from scbm.files import parse_predicate
from scbm.files.language.scope import Scope
from scbm.model import (
    Action,
    BehaviorModel,
    Constant,
    EnvironmentTransition,
    GoalOrder,
    Resource,
    Transition,
    Value,
    VariableSource,
)
from scbm.planning import Planner, Solved, Unsolvable

Values: TypeAlias = dict[str, Value]
Group: TypeAlias = dict[str, tuple[Value, ...]]
"""Variables that one source changes at one moment, each with the values that it can get."""

_MOST_AUTOMATIC = 1_000
"""Of one settling (5.1)."""


class Run(NamedTuple):
    """A moment of a run.

    Attributes:
        values: of all variables, those of the runner among them.
        goal: the name of the goal that is pursued; empty at rest.
        queue: the operations of the plan that are not completed, the current one first.
        in_flight: the resources with a request in flight.
        asked: what the planner reads of the state that a plan is awaited for; `None` if none is.
        unsolvable: what it read of the state for which it had no plan; `None` unless the run waits (5.6).
        plans: whether the run for this goal has asked for a plan.
        is_last: whether no goal follows.
        is_stuck: whether automatic transitions repeat at rest, so that nothing follows.
    """

    values: Values
    goal: str = ""
    queue: tuple[str, ...] = ()
    in_flight: tuple[str, ...] = ()
    asked: tuple[Value, ...] | None = None
    unsolvable: tuple[Value, ...] | None = None
    plans: bool = False
    is_last: bool = False
    is_stuck: bool = False

    def having(self, changes: Mapping[str, Value]) -> Run:
        """The run after these changes."""
        return self._replace(values={**self.values, **changes})

    def without_request(self, resource: str) -> Run:
        """The run without the request to this resource in flight."""
        return self._replace(in_flight=tuple(name for name in self.in_flight if name != resource))

    def differences(self, values: Mapping[str, Value]) -> Values:
        """The values that are not those of the run."""
        return {name: value for name, value in values.items() if self.values[name] != value}


class ReferenceVisits(NamedTuple):
    """What runs without force visit: the names of obligations, whether these are all, whether a run is a livelock."""

    names: frozenset[str]
    is_complete: bool
    has_livelock: bool


def reference_visits(model: BehaviorModel, most: int) -> ReferenceVisits:
    """What runs without force visit.

    Args:
        model: the model.
        most: the maximum number of moments; beyond it the answer is not complete.
    """
    rules = Rules(model)
    seen: dict[object, None] = {}
    todo: deque[Run] = deque()
    following = rules.beginnings()
    while len(seen) <= most:
        for settled in (each for after in following for each in rules.settled(after)):
            key = rules.key(settled)
            if key not in seen:
                seen[key] = None
                todo.append(settled)
            if len(seen) > most:
                break
        if not todo:
            return ReferenceVisits(frozenset(rules.visited), True, rules.has_livelock)
        following = rules.successors(todo.popleft())
    return ReferenceVisits(frozenset(rules.visited), False, rules.has_livelock)


def impossible_changes(model: BehaviorModel, trace: Trace) -> list[str]:
    """The changes from outside in a trace that no maker could make there; first of all its initial state.

    Injections that are marked as forced are not among them.
    """
    return WalkedTrace(model, trace.records).impossible


class Rules:
    """What can follow in the runs of one model."""

    def __init__(self, model: BehaviorModel) -> None:
        self.model = model
        self.visited: dict[str, None] = {}
        self.has_livelock = False
        self._planner = Planner(model)
        self._plans: dict[tuple[str, tuple[Value, ...]], tuple[str, tuple[str, ...]]] = {}
        self._goals = dict(model.goals)
        self._planned: dict[str, tuple[str, ...]] = {}
        self._operations = {operation.name: operation for operation in model.operations}
        self._domains = {variable.name: variable.domain for variable in model.running_space}
        self._rest = {variable.name: variable.initial for variable in model.running_space}
        self._is_single = model.runs.goals is GoalOrder.SINGLE
        self._resources = {resource.name: resource for resource in model.resources}

    # 5: what the runner does by itself

    def settled(self, run: Run) -> list[Run]:
        """Where micro-steps lead until none is left; several, as a limit of plans may end a run or not."""
        todo, found = [(run, 0)], []
        while todo:
            now, taken = todo.pop()
            transition = self._automatic(now)
            if transition is not None and taken == _MOST_AUTOMATIC:
                self.has_livelock = True
                if now.goal:
                    todo.append((self._ended(now, "aborted"), 0))
                else:
                    found.append(now._replace(is_stuck=True))
            elif transition is not None:
                todo.append((self._take_automatic(now, transition), taken + 1))
            else:
                after = self._steps(now)
                todo += [(each, taken if each.goal else 0) for each in after]
                found += [] if after else [now]
        return found

    def is_settled(self, run: Run) -> bool:
        """Whether no micro-step is left."""
        return self._automatic(run) is None and not self._steps(run)

    def _automatic(self, run: Run) -> Transition | None:
        """5.1: the first transition that is enabled and changes something."""
        for transition in self.model.automatic_transitions:
            changes = self._changes(run.values, transition)
            if changes is not None and any(run.values[name] != value for name, value in changes.items()):
                return transition
        return None

    def _take_automatic(self, run: Run, transition: Transition) -> Run:
        self._visit(f"automatic/{transition.name}")
        changes = self._changes(run.values, transition)
        assert changes is not None
        if any(name == "current.state" or name.removesuffix(".state") in self._operations for name in changes):
            current = str(run.values["current.name"])
            self._visit(f"{current}/failed")
            changes |= {"current.state": "failed", f"{current}.state": "failed"}
        return run.having(changes)

    def _steps(self, run: Run) -> list[Run]:
        """The micro-step after all automatic transitions: none if the run is settled, two where a limit is free."""
        if not run.goal:
            return []
        if run.values["plan.state"] == "aborted":
            return [self._ended(run, "aborted")]  # 5.2
        request = self._request(run)
        if request is not None:
            return [request]  # 5.3
        if run.values["current.state"] == "initial" and self._goals[run.goal].holds(run.values):
            return [self._ended(run, "completed")]  # 5.4
        return self._operation(run)  # 5.5

    def _request(self, run: Run) -> Run | None:
        """6.2: one request is sent, or else the first one in flight without a trigger is cancelled."""
        for resource in self.model.resources:
            if run.values[resource.trigger] is True and run.values[resource.request_state] == "initial":
                sent = run.without_request(resource.name)
                in_flight = (*sent.in_flight, resource.name)
                return sent._replace(in_flight=in_flight).having({resource.request_state: "executing"})
        for resource in (self._resources[name] for name in run.in_flight):
            if run.values[resource.trigger] is False:
                return run.without_request(resource.name).having({resource.request_state: "initial"})
        return None

    def _operation(self, run: Run) -> list[Run]:
        """5.5: the lifecycle of the current operation."""
        name, state = str(run.values["current.name"]), run.values["current.state"]
        if name == "none":
            return [self._moved(run, run.queue[0], "initial")] if run.queue else self._ask(run)
        operation = self._operations[name]
        if state in ("initial", "disabled"):
            changes = self._changes(run.values, operation.pre)
            if changes is not None:
                return [self._moved(run.having(changes), name, "executing")]
            return [self._moved(run, name, "disabled")] if state == "initial" else []
        if state == "executing":
            for target, transition in (("completed", operation.post), ("failed", operation.failed)):
                changes = None if transition is None else self._changes(run.values, transition)
                if changes is not None:
                    return [self._moved(run.having(changes), name, target)]
            return []
        return [self._left(run, run.queue[1:] if state == "completed" else ())]

    def _moved(self, run: Run, operation: str, state: str) -> Run:
        """The run with the current operation in another state."""
        if state != "initial":
            self._visit(f"{operation}/{state}")
        return run.having({"current.name": operation, "current.state": state, f"{operation}.state": state})

    def _left(self, run: Run, queue: tuple[str, ...]) -> Run:
        """The run without a current operation."""
        name = run.values["current.name"]
        changes = {} if name == "none" else {f"{name}.state": "initial"}
        return run._replace(queue=queue).having({"current.name": "none", "current.state": "initial", **changes})

    def _ask(self, run: Run) -> list[Run]:
        """A plan is asked for, unless one is awaited, or there was none for such a state (5.6)."""
        seen = self.seen(run)
        if run.asked is not None or run.unsolvable == seen:
            return []
        asks = run._replace(asked=seen, unsolvable=None, plans=True).having({"plan.state": "planning"})
        is_limited = run.plans and run.unsolvable is None
        return [asks, self._ended(run, "aborted")] if is_limited else [asks]

    def _ended(self, run: Run, plan_state: str) -> Run:
        """The run after an end: requests are cancelled, the operation is initial."""
        changes: Values = {"plan.state": plan_state}
        for resource in self.model.resources:
            changes[resource.trigger] = False
            if resource.name in run.in_flight or run.values[resource.request_state] != "executing":
                changes[resource.request_state] = "initial"
        ended = self._left(run, ()).having(changes)
        return ended._replace(goal="", in_flight=(), asked=None, unsolvable=None, plans=False)

    # what happens to the runner where it is settled

    def successors(self, run: Run) -> Iterator[Run]:
        """Everything that can happen in a run where it is settled; not settled again."""
        if run.is_stuck:
            return
        yield from self.after_changes(run)
        if run.goal:
            yield from self._in_pursuit(run)
        elif not run.is_last:
            for goal in self._goals:
                yield run._replace(goal=goal, is_last=self._is_single).having({"plan.state": "planning"})

    def _in_pursuit(self, run: Run) -> Iterator[Run]:
        yield self._ended(run, "aborted")  # the time limit
        if run.asked is not None:
            yield self._answered(run, *self._plan(run.goal, run.asked))
        for resource in self.model.resources:
            if resource.name in run.in_flight:
                yield from self._replies(run, resource)
        yield from self._deadline(run)
        if run.unsolvable is not None and not run.in_flight and run.asked is None:
            yield self._ended(run, "unsolvable")  # nothing is pending (5.6)

    def _answered(self, run: Run, status: str, plan: tuple[str, ...]) -> Run:
        answered = run._replace(asked=None)
        if status == Unsolvable.status:
            return answered._replace(unsolvable=run.asked)
        if status != Solved.status:
            return self._ended(run, "aborted")
        for name in plan:
            self._visit(f"{name}/queued")
        return answered._replace(queue=plan).having({"plan.state": "executing"})

    def _replies(self, run: Run, resource: Resource) -> Iterator[Run]:
        """6.2, 6.3: success and failure, each with some values that the resource measures."""
        group = {name: resource.sends(self.model.space[name]) for name in resource.measures}
        for changes in ({}, *_choices(group)):
            for state in ("succeeded", "failed"):
                yield run.without_request(resource.name).having({**changes, resource.request_state: state})

    def _deadline(self, run: Run) -> Iterator[Run]:
        """5.5: a deadline passes."""
        name = str(run.values["current.name"])
        operation = self._operations.get(name)
        if operation is None:
            return
        if run.values["current.state"] == "disabled" and operation.disabled_deadline_ns is not None:
            yield self._left(run, ())
        if run.values["current.state"] == "executing" and operation.deadline_ns is not None:
            changes = self._assigned(run.values, operation.timedout)
            if changes is None:
                yield self._ended(run, "aborted")  # a model error (2.4)
            else:
                yield self._moved(run.having(changes), name, "timedout")

    # 9: changes from outside

    def after_changes(self, run: Run) -> Iterator[Run]:
        """9.2, 9.4: what something outside the model makes of a settled run."""
        by_transitions = (self.change_by(transition, run.values) for transition in self.model.environment)
        free = (changes for group in self.groups for changes in _choices(group))
        for changes in chain(by_transitions, free):
            if changes is not None and run.differences(changes):
                yield run.having(changes)
        yield from self._other_users(run)

    def change_by(self, transition: EnvironmentTransition, values: Values) -> Values | None:
        """9.4: what an environment transition makes; `None` if it cannot fire."""
        return self._assigned(values, transition.actions) if transition.guard.holds(values) else None

    def _other_users(self, run: Run) -> Iterator[Run]:
        """9.5: another user comes or goes."""
        for resource in self.model.resources:
            other = {"initial": "executing", "executing": "initial"}.get(str(run.values[resource.request_state]))
            if resource.shared and resource.name not in run.in_flight and other is not None:
                yield run.having({resource.request_state: other})

    @cached_property
    def groups(self) -> list[Group]:
        """9.1, 9.2: what changes freely: each input, and what each resource publishes."""
        model = self.model
        by_transition = [action.target for each in model.environment for action in each.actions]
        groups: list[Group] = [{name: self._domains[name].values} for name in self._inputs if name not in by_transition]
        for resource in model.resources:
            names = [name for name in self._published(resource) if name not in by_transition]
            groups += [{name: resource.sends(model.space[name]) for name in names}] if names else []
        return groups

    def _published(self, resource: Resource) -> list[str]:
        """What a resource sends without a request: all that it measures, if the model never sends one."""
        never = all(a.target != resource.trigger or getattr(a, "source", 0) == _FALSE for a in self.model.actions)
        return list(dict.fromkeys((*resource.publishes, *(resource.measures if never else ()))))

    @cached_property
    def _inputs(self) -> list[str]:
        """9.1: declared, or read and changed by nothing but automatic transitions."""
        model = self.model
        known = [name for resource in model.resources for name in (*resource.measures, *resource.publishes)]
        for operation in model.operations:
            parts = [part for part in (operation.pre, operation.post, operation.failed) if part is not None]
            known += [action.target for part in parts for action in part.running_actions]
            known += [action.target for action in operation.timedout]
        inferred = [v for v in model.variables if v.source is None and v.name in self._read and v.name not in known]
        return [v.name for v in model.variables if v.source is VariableSource.INPUT or v in inferred]

    @cached_property
    def _read(self) -> dict[str, None]:
        """The variables that anything in a run reads."""
        model = self.model
        guards = [*(t.running_guard for t in model.transitions), *(t.guard for t in model.environment)]
        actions = [*model.actions, *(action for each in model.environment for action in each.actions)]
        readers = (*guards, *actions, *(goal for _, goal in model.goals))
        return dict.fromkeys(name for reader in readers for name in reader.reads())

    # 7.2: where runs begin

    def beginnings(self) -> Iterator[Run]:
        """All initial states, with a runner that has not settled."""
        for choices in self._initial_values:
            for chosen in product(*choices.values()):
                values = dict(zip(choices, chosen, strict=True))
                if self.model.initial_states.holds(values):
                    yield Run({**self._rest, **values})

    def goal_of(self, record: RunStarted) -> str:
        """The goal of a case, which need not be one of the model."""
        if record.goal not in self._goals:
            self._goals[record.goal] = parse_predicate(record.predicate, Scope.of(self.model))
        return record.goal

    def can_begin(self, values: Mapping[str, Value]) -> bool:
        """Whether a run begins in a state of the world."""
        if not self.model.initial_states.holds(values):
            return False
        return any(all(values[n] in known for n, known in each.items()) for each in self._initial_values)

    @cached_property
    def _initial_values(self) -> list[Group]:
        """The values in combinations of random values, and those around the nominal state."""
        free: dict[str, tuple[Value, ...]] = {}
        for group in self.groups:
            for name, values in group.items():
                free[name] = (*free.get(name, ()), *values, *self.model.space[name].random)
        random = {v.name: _once(free.get(v.name, v.random)) for v in self.model.space}
        nominal = {v.name: _once((v.initial, *free.get(v.name, ()))) for v in self.model.space}
        return [random, nominal]

    # small things

    def _changes(self, values: Values, transition: Transition) -> Values | None:
        """What a running transition changes (3.1); `None` if it cannot be taken."""
        if not (transition.g.holds(values) and transition.gr.holds(values)):
            return None
        changes = self._assigned(values, transition.running_actions)
        for name in changes or ():
            if name == "current.state" or name.removesuffix(".state") in self._operations:  # 1.3
                return changes if values[name] == "executing" else None
        return changes

    def _assigned(self, values: Values, actions: Iterable[Action]) -> Values | None:
        """2.3, 2.4: all right-hand sides read the state before; `None` if a domain would be left."""
        changes = {action.target: action.value(values) for action in actions}
        is_left = any(value not in self._domains[name] for name, value in changes.items())
        return None if is_left else changes

    def _visit(self, name: str) -> None:
        self.visited[name] = None

    def seen(self, run: Run) -> tuple[Value, ...]:
        """What the planner reads of a state (5.6)."""
        return tuple(run.values[name] for name in self._reads_to_plan(run.goal))

    def _reads_to_plan(self, goal: str) -> tuple[str, ...]:
        if goal not in self._planned:
            parts = [part for operation in self.model.operations for part in (operation.pre, operation.post)]
            readers = (self._goals[goal], *(part.g for part in parts), *(action for part in parts for action in part.a))
            read = dict.fromkeys(name for reader in readers for name in reader.reads())
            self._planned[goal] = tuple(name for name in read if name in self.model.space)
        return self._planned[goal]

    def _plan(self, goal: str, asked: tuple[Value, ...]) -> tuple[str, tuple[str, ...]]:
        """The answer of the planner, asked once for each problem."""
        if (goal, asked) not in self._plans:
            state = self._rest | dict(zip(self._reads_to_plan(goal), asked, strict=True))
            answer = self._planner.plan({name: state[name] for name in self.model.space.names}, self._goals[goal])
            self._plans[goal, asked] = (answer.status, answer.plan if isinstance(answer, Solved) else ())
        return self._plans[goal, asked]

    def key(self, run: Run) -> object:
        """Everything of a moment that matters for what follows."""
        values = tuple(run.values[name] for name in self._matters)
        return (values, *run[1:])

    @cached_property
    def _matters(self) -> dict[str, None]:
        """The variables that are read, or whose change makes an automatic transition possible (5.1)."""
        assigned = [a.target for transition in self.model.automatic_transitions for a in transition.running_actions]
        declared = {variable.name for variable in self.model.variables}
        return dict.fromkeys(n for n in self._rest if n in self._read or n in assigned or n not in declared)


_FALSE = Constant(False)


def _once(values: Iterable[Value]) -> tuple[Value, ...]:
    return tuple(dict.fromkeys(values))


def _choices(group: Group) -> Iterator[Values]:
    """Each choice of values for some of the variables of a group, at least one."""
    for chosen in product(*((None, *values) for values in group.values())):
        changes = {name: value for name, value in zip(group, chosen, strict=True) if value is not None}
        if changes:
            yield changes


class WalkedTrace:
    """The records of a trace, in which each change from outside is judged.

    Attributes:
        impossible: the initial state and the changes that no maker could make, but for those that are marked as forced.
        needlessly_forced: the changes that are marked as forced, and that some maker could make.
    """

    def __init__(self, model: BehaviorModel, records: Iterable[Record]) -> None:
        self.impossible: list[str] = []
        self.needlessly_forced: list[str] = []
        self._rules = Rules(model)
        self._run = Run({})
        for record in records:
            self._judge(record)
            self._run = self._after(record).having(dict(record.changes))

    def is_possible(self, changes: Mapping[str, Value], by: str) -> bool:
        """Whether an environment transition makes a change after the trace; a source of the variables if `by` is empty.

        Without values the question is whether the transition can fire.
        """
        makers = (each for each in self._rules.model.environment if each.name == by)
        made = [self._rules.change_by(each, self._run.values) for each in makers]
        runs = [self._run.having(each) for each in made if each is not None]
        after = runs if by else list(self._rules.after_changes(self._run))
        found = [self._run.differences(each.values) for each in after]
        wanted = self._run.differences(changes)
        return self._rules.is_settled(self._run) and (bool(found) if by and not changes else wanted in found)

    def _judge(self, record: Record) -> None:
        match record:
            case RunnerStarted():
                is_possible = self._rules.can_begin(dict(record.state))
            case MeasurementReceived(by=by, changes=changes) if by or changes:
                is_possible = self.is_possible(dict(record.measured), by)
            case InjectionApplied() | PutBack():
                is_possible = self._is_made(self._run, dict(record.changes))
                self.needlessly_forced += [str(record)] if record.forced and is_possible else []
                is_possible = is_possible or record.forced
            case _:
                is_possible = True
        self.impossible += [] if is_possible else [str(record)]

    def _is_made(self, run: Run, changes: Values) -> bool:
        """Whether changes that follow each other lead to these values, each where the run is settled (9.10)."""
        left = run.differences(changes)
        if not left or not self._rules.is_settled(run):
            return not left
        nearer = (
            each for each in self._rules.after_changes(run) if run.differences(each.values).items() <= left.items()
        )
        return any(self._is_made(each, left) for each in nearer)

    def _after(self, record: Record) -> Run:  # noqa: PLR0911 - one line for each kind of record
        run = self._run
        match record:
            case RunnerStarted():
                return Run(dict(record.state))
            case RunStarted():
                return run._replace(goal=self._rules.goal_of(record))
            case PlanAsked():
                return run._replace(asked=self._rules.seen(run), unsolvable=None, plans=True)
            case PlanReceived():
                unsolvable = run.asked if record.status == Unsolvable.status else None
                return run._replace(asked=None, unsolvable=unsolvable, queue=record.plan)
            case OperationStepped(target="initial"):
                return run._replace(queue=run.queue[1:] if record.source == "completed" else ())
            case RequestSent():
                return run._replace(in_flight=(*run.in_flight, record.resource))
            case RequestCancelled() | ReplyReceived():
                return run.without_request(record.resource)
            case RunEnded():
                return run._replace(goal="", queue=(), asked=None, unsolvable=None)
            case _:
                return run
