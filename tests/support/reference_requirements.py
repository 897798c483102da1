"""Requirements in all runs, decided by the second interpreter: slow, on plain dicts, from the semantics alone.

Each state after a record counts (7.3), so the ends of runs are walked cancellation by cancellation (5.7).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from enum import Enum
from typing import NamedTuple, TypeAlias

from scbm.model import BehaviorModel
from scbm.model.requirements import AfterAlways, Always, Before, LeadsTo, Never, RequirementForm
from support.reference_runs import Rules, Run, Values

_MOST_AUTOMATIC = 1_000


class Way(Enum):
    """Why one moment follows another."""

    ORDINARY = "an event that a continuation may have"
    OUTSIDE = "a change from outside"
    DEADLINE = "a deadline passes"
    FAILURE = "a failed reply"
    LIMIT = "a limit ends the run"


class Step(NamedTuple):
    """What an event leads to: the states on the way, where the run is then, and what happened.

    `answers` is the resource that replies, or `plan`.
    """

    states: tuple[Values, ...]
    after: Run
    way: Way
    reached: str = ""
    answers: str = ""


Targets: TypeAlias = Mapping[object, Sequence[tuple[object, Step]]]
"""For each moment the moments that follow, each with the step."""


class RequirementRules(Rules):
    """The runs of one model, with all states on the way."""

    def __init__(self, model: BehaviorModel, reads: Iterable[str] = ()) -> None:
        super().__init__(model)
        self._also = dict.fromkeys(reads)

    def place(self, run: Run) -> object:
        """What matters of a moment, with the variables that are asked about."""
        return (self.key(run), tuple(run.values[name] for name in self._also))

    @property
    def outside(self) -> list[str]:
        """9.1: inputs and published values."""
        published = [name for resource in self.model.resources for name in self._published(resource)]
        return [*self._inputs, *published]

    def first_steps(self) -> Iterator[Step]:
        """The steps in which the runner starts."""
        for run in self.beginnings():
            yield from self._paths(run, (run.values,), Way.ORDINARY)

    def next_steps(self, run: Run) -> Iterator[Step]:
        """The steps from a settled moment."""
        if run.is_stuck:
            return
        for after in self.after_changes(run):
            yield from self._paths(after, (after.values,), Way.OUTSIDE)
        if run.goal:
            for after, way, answers in self._pursued(run):
                ended = self._last_states(run, after) if not after.goal else (after.values,)
                yield from (step._replace(answers=answers) for step in self._paths(after, ended, way))
        elif not run.is_last:
            for goal in self._goals:
                after = run._replace(goal=goal, is_last=self._is_single).having({"plan.state": "planning"})
                yield from self._paths(after, (after.values,), Way.ORDINARY)

    def _pursued(self, run: Run) -> Iterator[tuple[Run, Way, str]]:
        yield self._ended(run, "aborted"), Way.LIMIT, ""
        if run.asked is not None:
            status, plan = self._plan(run.goal, run.asked)
            after = self._answered(run, status, plan)
            yield after, Way.ORDINARY if after.goal else Way.LIMIT, "plan"
        for resource in self.model.resources:
            if resource.name in run.in_flight:
                for after in self._replies(run, resource):
                    is_good = after.values[resource.request_state] == "succeeded"
                    yield after, Way.ORDINARY if is_good else Way.FAILURE, resource.name
        for after in self._deadline(run):
            yield after, Way.DEADLINE, ""
        if run.unsolvable is not None and not run.in_flight and run.asked is None:
            yield self._ended(run, "unsolvable"), Way.ORDINARY, ""

    def _paths(self, run: Run, states: tuple[Values, ...], way: Way) -> Iterator[Step]:
        """The settlings of a run, with their states; several, as a limit of plans may end a run or not."""
        todo = [(run, states, 0, way, "")]
        while todo:
            now, path, taken, how, reached = todo.pop()
            transition = self._automatic(now)
            if transition is not None and taken == _MOST_AUTOMATIC:
                if now.goal:
                    todo += [(e, (*path, *s), 0, how, reached) for e, s in self._livelocked(now)]
                else:
                    yield Step(path, now._replace(is_stuck=True), how, reached)
                continue
            if transition is not None:
                after = self._take_automatic(now, transition)
                todo.append((after, (*path, after.values), taken + 1, how, reached))
                continue
            following = self._steps(now)
            if not following:
                yield Step(path, now, how, reached)
            for number, after in enumerate(following):
                is_limit = number > 0  # the second possibility where a plan is asked for
                has_reached = bool(now.goal) and not after.goal and after.values["plan.state"] == "completed"
                ended = self._last_states(now, after) if now.goal and not after.goal else (after.values,)
                goal = now.goal if has_reached else reached
                todo.append((after, (*path, *ended), taken if after.goal else 0, Way.LIMIT if is_limit else how, goal))

    def _livelocked(self, run: Run) -> Iterator[tuple[Run, tuple[Values, ...]]]:
        after = self._ended(run, "aborted")
        yield after, self._last_states(run, after)

    def _last_states(self, run: Run, ended: Run) -> tuple[Values, ...]:
        """The states at the end of a run: after each cancellation, and after the end."""
        states, values = [], run.values
        for name in run.in_flight:
            resource = self._resources[name]
            values = {**values, resource.trigger: False, resource.request_state: "initial"}
            states.append(values)
        return (*states, ended.values)

    def waits(self, run: Run) -> bool:
        """Whether only a limit, a reply or a change from outside can follow."""
        if not run.goal or run.asked is not None or any(True for _ in self._deadline(run)):
            return False
        return run.unsolvable is None or bool(run.in_flight)

    def go_round(self, steps: Sequence[tuple[Run, Step]]) -> bool:
        """Whether runs can take all of these steps again and again, and nothing is awaited all the way round (7.13)."""
        if all(run.asked is not None for run, _ in steps) and not any(step.answers == "plan" for _, step in steps):
            return False
        has_timer = all(any(True for _ in self._deadline(run)) for run, _ in steps)
        ended = (step.way is Way.DEADLINE or self._passes(step, "current.name", "none") for _, step in steps)
        if has_timer and not any(ended):
            return False
        return not any(
            all(name in run.in_flight for run, _ in steps)
            and not any(step.answers == name or self._passes(step, each.request_state, "initial") for _, step in steps)
            for name, each in self._resources.items()
        )

    @staticmethod
    def _passes(step: Step, name: str, value: str) -> bool:
        return any(values[name] == value for values in step.states)

    @staticmethod
    def may_repeat(run: Run, step: Step) -> bool:
        """Whether a round may have a step: within a run, no request fails or times out, and no limit comes."""
        is_timeout = step.way is Way.DEADLINE and bool(run.in_flight)
        return bool(run.goal and step.after.goal) and step.way not in {Way.LIMIT, Way.FAILURE} and not is_timeout


def violated_by_some_run(model: BehaviorModel, sentence: RequirementForm, most: int) -> bool | None:
    """Whether some run violates a requirement; `None` if there are more than `most` moments.

    For `leads to` these are runs that end, wait or go round while q is due.
    """
    rules = RequirementRules(model, sentence.reads())
    due: dict[object, list[tuple[object, Run, Step]]] = {}
    seen: dict[object, None] = {}
    todo: deque[tuple[Run, bool]] = deque()
    steps: Iterable[Step] = rules.first_steps()
    memory, goal, is_started, run = False, "", False, Run({})
    while True:
        for step in steps:
            after, is_violated = _followed(sentence, memory, step.states)
            is_pursued = bool(goal) or (is_started and step.way is not Way.OUTSIDE)
            is_end = is_pursued and not step.after.goal and step.way is not Way.LIMIT
            if is_violated or (isinstance(sentence, LeadsTo) and after and (is_end or rules.waits(step.after))):
                return True
            key = (rules.place(step.after), after)
            stays = isinstance(sentence, LeadsTo) and memory and not any(map(sentence.effect.holds, step.states))
            if stays and goal and rules.may_repeat(run, step):
                due.setdefault((rules.place(run), memory), []).append((key, run, step))
            if key not in seen:
                seen[key] = None
                todo.append((step.after, after))
        if len(seen) > most:
            return None
        if not todo:
            return _goes_round(rules, due)
        run, memory = todo.popleft()
        goal, is_started = run.goal, True
        steps = rules.next_steps(run)


def _goes_round(rules: RequirementRules, due: Mapping[object, Sequence[tuple[object, Run, Step]]]) -> bool:
    """Whether runs can go round with q due; `due` has the steps in which it stays due."""
    reached = {key: _closure(key, due) for key in due}
    groups = {key: [other for other in reached[key] if key in reached.get(other, ())] for key in due}
    for group in groups.values():
        steps = [(run, step) for key in group for target, run, step in due[key] if target in group]
        if steps and rules.go_round(steps):
            return True
    return False


def _closure(key: object, due: Mapping[object, Sequence[tuple[object, Run, Step]]]) -> dict[object, None]:
    seen: dict[object, None] = {}
    todo = [key]
    while todo:
        new = [target for target, _, _ in due.get(todo.pop(), ()) if target not in seen]
        seen |= dict.fromkeys(new)
        todo += new
    return seen


def _followed(sentence: RequirementForm, memory: bool, states: Iterable[Values]) -> tuple[bool, bool]:  # noqa: FBT001 - a state
    """What is remembered after some states, and whether one of them violates the sentence."""
    for values in states:
        match sentence:
            case Always(predicate):
                is_violated = not predicate.holds(values)
            case Never(predicate):
                is_violated = predicate.holds(values)
            case Before(first, second):
                memory = memory or first.holds(values)
                is_violated = not memory and second.holds(values)
            case AfterAlways(start, predicate, stop):
                memory = (memory or start.holds(values)) and not stop.holds(values)
                is_violated = memory and not predicate.holds(values)
            case LeadsTo(cause, effect):
                memory = (memory or cause.holds(values)) and not effect.holds(values)
                is_violated = False
            case _:
                raise ValueError(sentence)
        if is_violated:
            return memory, True
    return memory, False


def blocked_goals(model: BehaviorModel, most: int) -> tuple[str, ...] | None:
    """The goals that plain runs leave reachable and some run does not (7.12); `None` beyond `most` moments."""
    rules = RequirementRules(model)
    runs: dict[object, Run] = {}
    steps: dict[object, list[Step]] = {}
    starts: list[tuple[object, bool]] = []
    todo: deque[Run] = deque()

    def found(run: Run) -> object:
        key = rules.place(run)
        if key not in runs:
            runs[key] = run
            todo.append(run)
        return key

    nominal = {name: model.nominal_state[name] for name in rules.outside}
    for step in rules.first_steps():
        is_nominal = all(step.states[0][name] == value for name, value in nominal.items())
        starts.append((found(step.after), is_nominal))
    while todo:
        run = todo.popleft()
        steps[rules.place(run)] = listed = list(rules.next_steps(run))
        for step in listed:
            found(step.after)
        if len(runs) > most:
            return None
    targets = {key: [(rules.place(step.after), step) for step in listed] for key, listed in steps.items()}
    plain_starts = [key for key, is_nominal in starts if is_nominal] or [key for key, _ in starts]
    plain = _reachable(plain_starts, targets, _is_plain, runs)
    history = _reachable([key for key, _ in starts], targets, _is_of_history, runs)
    lost = []
    for goal, _ in model.goals:
        reaching = _reaching(goal, targets)
        is_open = all(key in reaching for key in plain if not runs[key].goal and not runs[key].is_stuck)
        rests = (key for key in history if not runs[key].goal and not runs[key].is_stuck)
        if is_open and any(key not in reaching for key in rests):
            lost.append(goal)
    return tuple(lost)


def _is_plain(run: Run, step: Step) -> bool:
    return step.way is Way.ORDINARY or (step.way is Way.DEADLINE and not run.in_flight)


def _is_of_history(_: Run, step: Step) -> bool:
    return step.way is not Way.LIMIT


def _reachable(
    starts: Iterable[object], targets: Targets, follows: Callable[[Run, Step], bool], runs: Mapping[object, Run]
) -> dict[object, None]:
    seen = dict.fromkeys(starts)
    todo = list(seen)
    while todo:
        key = todo.pop()
        for target, step in targets[key]:
            if follows(runs[key], step) and target not in seen:
                seen[target] = None
                todo.append(target)
    return seen


def _reaching(goal: str, targets: Targets) -> dict[object, None]:
    before: dict[object, list[object]] = {}
    todo: list[object] = []
    for key, listed in targets.items():
        for target, step in listed:
            if step.way in {Way.ORDINARY, Way.OUTSIDE, Way.DEADLINE}:
                before.setdefault(target, []).append(key)
                todo += [key] if step.reached == goal else []
    seen = dict.fromkeys(todo)
    while todo:
        new = [key for key in before.get(todo.pop(), ()) if key not in seen]
        seen |= dict.fromkeys(new)
        todo += new
    return seen
