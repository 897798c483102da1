"""The interpreter of certificates does what the runner does, and certificates hold exactly as long as they are true."""

from __future__ import annotations

import json
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product

import pytest
from hypothesis import assume, given, reject
from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.cases.coverage import Obligations, visited_by
from scbm.files import read_model
from scbm.model import (
    FIRST_PLANNER,
    BehaviorModel,
    GoalOrder,
    InputError,
    PlannerIdentity,
    PlanSet,
    Role,
    RunsDeclaration,
    Value,
)
from scbm.model.sources import changed_from_outside
from scbm.planning import Planner, Solved
from scbm.proofcheck import (
    Argument,
    Awaits,
    Certificate,
    Fact,
    GoalRuns,
    RunsArgument,
    Situation,
    StructureArgument,
    ValuesArgument,
    certificate_text,
    check_certificate,
    read_certificate,
)
from scbm.proofcheck.certificate import claimable_obligations
from scbm.proofcheck.checked_run import (
    CheckedStep,
    DeadlineEvent,
    Event,
    GivingUp,
    OutsideEvent,
    PlannerAnswer,
    ReplyEvent,
)
from scbm.proofcheck.interpreter import Interpreter
from scbm.proofcheck.runs_check import check_variables, initial_states
from scbm.proofcheck.values_check import all_possible, check_values
from scbm.running import (
    AskPlan,
    CancelRequest,
    ChangeResource,
    GoalGiven,
    Measured,
    PlanAnswered,
    PlanStatus,
    Program,
    ReplyArrived,
    RunFinished,
    Runner,
    RunnerOptions,
    SendRequest,
    TimePassed,
)
from scbm.running import Event as RunnerEvent
from support.mutations import CHARACTERS, MUTATIONS, check_diagnostics, malformed
from support.profiles import examples
from support.strategies import running_models

CELL = """
behavior_model: cell
variables:
  at: {domain: [a, b, c], initial: a, random: [a, b]}
  flag: {domain: bool, initial: false, random: any}
  count: {domain: 0..2, initial: 0}
  note: {domain: [x, y], initial: x}
resources:
  r: {measures: [note]}
  s: {measures: [flag]}
goals:
  at_c: at == c
  at_b: at == b && note == x
operations:
"""
START_AND_END = [("a", "b"), ("b", "c"), ("c", "a"), ("a", "c")]
RARELY = {  # what operations have now and then, by the place where they have it
    "gr": ["flag == true", "count != 2", "s_req_state != executing", "plan.state == executing && note == x"],
    "ar": ["count += 1", "note <- y", "s_req_trigger <- true", "flag <- false", "plan.state <- aborted"],
    "timedout": ["", "count += 1", "plan.state <- aborted", "at <- b, r_req_trigger <- false"],
    "failed": ["g: r_req_state == failed, a: [r_req_state <- initial]", "g: flag == true, a: [count += 1]"],
}
AUTOMATIC = {
    "fails": "g: r_req_state == failed, a: [r_req_state <- initial, current.state <- failed, r_req_trigger <- false]",
    "fails_o0": "g: flag == true && count == 1, a: [o0.state <- failed, flag <- false]",
    "gives_up": "g: count == 2, a: [plan.state <- aborted]",
    "celebrates": "g: plan.state == completed, a: [flag <- true]",
    "mourns": "g: plan.state == aborted && at != a, a: [at <- a, s_req_trigger <- true]",
    "regrets": "g: plan.state == unsolvable, a: [note <- y]",
    "looks": "g: plan.state == planning && s_req_state == initial, a: [s_req_trigger <- true]",
    "looks_too": "g: o1.state == executing, a: [s_req_trigger <- true]",
    "has_seen": "g: s_req_state == succeeded, a: [s_req_state <- initial, s_req_trigger <- false, count += 1]",
    "sees_again": "g: 's_req_state in {succeeded, failed} && flag == false', a: [s_req_state <- initial]",
    "stops_looking": "g: s_req_trigger == true && flag == true && at == b, a: [s_req_trigger <- false]",
    "helps": "g: current.state == disabled, a: [flag <- true]",
    "hinders": "g: current.state == completed && count != 0, a: [at <- a, count -= 1]",
    "blinks": "g: current.name == o1 && note == x, a: [note <- y]",
    "blinks_back": "g: current.name == o1 && note == y, a: [note <- x]",
}


@st.composite
def cells(draw: st.DrawFn) -> BehaviorModel:
    """Models in which much happens: replies while a plan is awaited, failures, deadlines, aborts, hooks at the end."""
    operations = range(draw(st.sampled_from([4, 3, 2])))
    automatic = draw(
        st.lists(st.sampled_from(sorted(AUTOMATIC)), min_size=draw(st.integers(0, 3)), max_size=5, unique=True)
    )
    text = CELL + "".join(draw(cell_operations(index)) for index in operations)
    if automatic:
        text += "automatic_transitions:\n" + "".join(f"  {name}: {{{AUTOMATIC[name]}}}\n" for name in automatic)
    return read_model(text)


@st.composite
def cell_operations(draw: st.DrawFn, index: int) -> str:
    """An operation from one place to another; most of them with a request, and some of those forget a part of it."""

    def rarely(key: str, usually: str) -> str:
        return draw(st.sampled_from([usually] * 6 + RARELY[key]))

    (source, target), asks = START_AND_END[index], draw(st.integers(0, 5)) > 0
    idle = " && r_req_state == initial && r_req_trigger == false" if asks and draw(st.integers(0, 3)) else ""
    done = "r_req_state == succeeded" if asks else rarely("gr", "true")
    cleared = ["r_req_state <- initial", "r_req_trigger <- false"] if draw(st.integers(0, 4)) else []
    begun = "r_req_trigger <- true" if asks else ""
    lines = [
        f"pre: {{g: at == {source}{idle}, gr: {rarely('gr', 'true')}, a: [{begun}], ar: [{rarely('ar', '')}]}}",
        f"post: {{g: true, gr: {done}, a: [{', '.join([f'at <- {target}', *(cleared if asks else [])])}]}}",
    ]
    if draw(st.integers(0, 3)):
        lines += ["deadline: 5 s", f"timedout: [{rarely('timedout', 'r_req_trigger <- false')}]"]
    if draw(st.booleans()):
        lines.append("disabled_deadline: 2 s")
    if draw(st.integers(0, 2)) == 0:
        lines.append(f"failed: {{{draw(st.sampled_from(RARELY['failed']))}}}")
    return f"  o{index}:\n" + "".join(f"    {line}\n" for line in lines)


MAX_SITUATIONS = 400
FACTS = {Fact.NO_DEADLINE: "timedout", Fact.CANNOT_FAIL: "failed", Fact.ALWAYS_ENABLED: "disabled"}
TIME_LIMIT_NS = 10**15
OPTIONS = RunnerOptions(time_limit_ns=TIME_LIMIT_NS, plan_limit=10**9, instant_bound=10**9)


class Real:
    """The real runner with the same events; the planner answers at once if nothing else can come before."""

    def __init__(self, model: BehaviorModel, state: dict[str, Value], variables: tuple[str, ...]) -> None:
        self.model = model
        self.is_open = any(name in variables for name in changed_from_outside(model))
        self.runner = Runner(Program(model), state, replace(OPTIONS, awaits_measurements=self.is_open))
        self.in_flight: dict[str, int] = {}
        self.question: AskPlan | None = None
        self.has_ended = False
        self.goes_round = False
        self.visited: tuple[str, ...] = ()
        self._planner = Planner(model)
        self._obligations = Obligations.of(model)
        self._now_ns = 0

    def give(self, event: RunnerEvent) -> None:
        visited = self._handle(event)
        asked: dict[object, None] = {}
        while self.question is not None and not (self.in_flight or self.has_ended or self.is_open):
            answer = self.answer()
            key = (tuple(self.runner.state.items()), tuple(self.question.state.items()))
            if key in asked:
                self.goes_round = True
                break
            asked[key] = None
            visited |= self._handle(answer)
        self.visited = self._obligations.names(visited)

    @property
    def is_as_asked(self) -> bool:
        """Whether the state is the one from which the last plan was requested."""
        return self.runner._asked_in == self.runner._state

    def answer(self) -> PlanAnswered:
        assert self.question is not None
        answer = self._planner.plan(self.question.state, self.question.goal)
        plan = answer.plan if isinstance(answer, Solved) else ()
        return PlanAnswered(self.question.ask, PlanStatus(answer.status), plan)

    def _handle(self, event: RunnerEvent) -> int:
        if isinstance(event, PlanAnswered):
            self.question = None
        if isinstance(event, ReplyArrived):
            self.in_flight = {name: number for name, number in self.in_flight.items() if number != event.request}
        if isinstance(event, TimePassed):
            assert self.runner.deadline_ns is not None
            self._now_ns = self.runner.deadline_ns
        visited = 0
        for effect in self.runner.handle(event, self._now_ns):
            match effect:
                case SendRequest(request, resource):
                    self.in_flight[resource] = request
                case CancelRequest(request):
                    self.in_flight = {name: number for name, number in self.in_flight.items() if number != request}
                case AskPlan():
                    self.question = effect
                case RunFinished():
                    self.has_ended = True
                case ChangeResource():
                    pass
                case _:
                    visited |= visited_by([effect], self._obligations)
        return visited

    def happen(self, data: st.DataObject, event: Event, variables: tuple[str, ...]) -> None:
        """Apply an event; measured values of variables outside `variables` are drawn."""
        match event:
            case ReplyEvent(resource, succeeded, measured):
                others = [
                    (name, data.draw(st.sampled_from(self.model.space[name].domain.values)))
                    for name in self._measures(resource)
                    if name not in variables
                ]
                self.give(ReplyArrived(self.in_flight[resource], succeeded, (*measured, *others)))
            case DeadlineEvent():
                self.give(TimePassed())
            case OutsideEvent(changes):
                self.give(Measured(changes))
            case GivingUp():
                self.runner.options = replace(self.runner.options, awaits_measurements=False)
                self.give(Measured(()))
            case PlannerAnswer():
                self.give(self.answer())

    def possible(self, data: st.DataObject) -> list[RunnerEvent]:
        """What can happen next, with measured values that are drawn, and the time limit."""
        events: list[RunnerEvent] = [TimePassed()]
        for name, number in self.in_flight.items():
            measured = [
                (v, data.draw(st.sampled_from(self.model.space[v].domain.values))) for v in self._measures(name)
            ]
            events += [ReplyArrived(number, True, tuple(measured)), ReplyArrived(number, False)]
        return [*events, self.answer()] if self.question is not None else events

    def _measures(self, name: str) -> tuple[str, ...]:
        return next(resource.measures for resource in self.model.resources if resource.name == name)


def all_variables(model: BehaviorModel) -> tuple[str, ...]:
    return tuple(variable.name for variable in model.running_space if variable.role is not Role.OPERATION_STATE)


def variables_that_matter(model: BehaviorModel) -> tuple[str, ...]:
    """Those that cannot be left out, found by putting back what the check misses."""
    kept: list[str] = ["current.name", "current.state", "plan.state"]
    while True:
        variables = tuple(name for name in all_variables(model) if name in kept)
        missing = [flaw.where.removeprefix("variable ") for flaw in check_variables(variables, model)]
        if not missing:
            return variables
        kept += missing


def check_same(step: CheckedStep, real: Real) -> None:
    if real.is_open and real.has_ended:  # the step has what changes from outside bring about after the end
        assert set(real.visited) <= set(step.visited)
    else:
        assert sorted(step.visited) == sorted(real.visited)
    if real.goes_round:
        assert step.situation is None
        return
    assert (step.situation is None) == real.has_ended
    state = real.runner.state
    assert step.values == {name: state[name] for name in step.values}
    if step.situation is not None:
        assert list(step.situation.in_flight) == list(real.in_flight)
        assert (step.situation.awaits in ("plan", "unsolvable", "stale")) == (real.question is not None)


def drive(model: BehaviorModel, data: st.DataObject, state: dict[str, Value], variables: tuple[str, ...]) -> None:
    """The same random events for both."""
    goal, predicate = data.draw(st.sampled_from(model.goals))
    interpreter, real = Interpreter(model, predicate, variables), Real(model, state, variables)
    start = interpreter.start(state)
    real.give(GoalGiven(goal, predicate))
    if not start.rests:
        assert real.has_ended
        return
    step = interpreter.begin(start.rests[0])
    check_same(replace(step, visited=tuple(dict.fromkeys((*start.visited, *step.visited)))), real)
    for _ in range(25):
        if step.situation is None:
            return
        events = list(interpreter.events(step.situation))
        assert (DeadlineEvent() in events) == (real.runner.deadline_ns != TIME_LIMIT_NS)
        if not events:
            break
        event = data.draw(st.sampled_from(events))
        step = interpreter.after(step.situation, event)
        real.happen(data, event, variables)
        if step.situation is not None and step.situation.awaits is Awaits.STALE and real.is_as_asked:
            return  # a change from outside was undone; then the interpreter asks again, and gets the same answer
        check_same(step, real)
    if step.situation is not None and real.runner.deadline_ns == TIME_LIMIT_NS:
        ended = interpreter.cut_off(step.situation)
        assert ended is not None
        expected = ended.visited
        real.give(TimePassed())
        assert set(real.visited) <= set(expected) if real.is_open else sorted(expected) == sorted(real.visited)


@pytest.mark.slow
@given(cells(), st.data(), st.booleans())
@examples(300)
def test_the_interpreter_does_what_the_runner_does(
    model: BehaviorModel,
    data: st.DataObject,
    leave_out: bool,  # noqa: FBT001 - drawn
) -> None:
    state = {v.name: data.draw(st.sampled_from(v.random)) for v in model.space}
    drive(model, data, state, variables_that_matter(model) if leave_out else all_variables(model))


@given(running_models(), st.data(), st.booleans())
@examples(150, usual=8)
def test_the_interpreter_does_what_the_runner_does_whatever_the_model_is(
    model: BehaviorModel,
    data: st.DataObject,
    leave_out: bool,  # noqa: FBT001
) -> None:
    state = {v.name: data.draw(st.sampled_from(v.domain.values)) for v in model.space}
    drive(model, data, state, variables_that_matter(model) if leave_out else all_variables(model))


# certificates


@dataclass(frozen=True)
class Explored:
    """All situations of a model, found with the interpreter, and what they visit."""

    argument: RunsArgument
    visited: tuple[str, ...]
    others: tuple[str, ...]


KINDS = tuple(product(GoalOrder, PlanSet))
"""The goals and plans that arguments about all runs are about."""


def explore(
    model: BehaviorModel,
    variables: tuple[str, ...],
    goals: GoalOrder = GoalOrder.SINGLE,
    plans: PlanSet = PlanSet.CANONICAL,
) -> Explored:
    """All situations of all runs, as the interpreter finds them."""
    interpreters = [Interpreter(model, predicate, variables, goals, plans) for _, predicate in model.goals]
    visited: dict[str, None] = {}
    situations: list[dict[Situation, None]] = [{} for _ in interpreters]
    rests: dict[tuple[Value, ...], None] = {}
    todo: list[dict[str, Value]] = []
    for state in initial_states(variables, model):
        start = interpreters[0].start(state)
        visited |= dict.fromkeys(start.visited)
        todo += start.rests
    while todo:
        rest = todo.pop()
        if tuple(rest.values()) in rests:
            continue
        rests[tuple(rest.values())] = None
        steps = list(interpreters[0].at_rest(rest))
        for interpreter, found in zip(interpreters, situations, strict=True):
            steps += _all_steps(interpreter, rest, found)
        for step in steps:
            visited |= dict.fromkeys((*step.visited, *step.cut_off))
            todo += step.rests
    runs = zip(model.goals, situations, interpreters, strict=True)
    named = tuple(GoalRuns(goal, tuple(found), each.planned) for (goal, _), found, each in runs)
    names = [str(obligation) for obligation in Obligations.of(model)]
    others = tuple(name for name in names if name not in visited)
    return Explored(RunsArgument(variables, named, goals, plans), tuple(visited), others)


def _all_steps(interpreter: Interpreter, rest: dict[str, Value], seen: dict[Situation, None]) -> Iterator[CheckedStep]:
    """The steps of all runs for one goal from a runner at rest, but for those that were seen."""
    steps = deque([interpreter.begin(rest)])
    while steps:
        step = steps.popleft()
        yield step
        if step.situation is None or step.situation in seen:
            continue
        seen[step.situation] = None
        ended = interpreter.cut_off(step.situation)
        if ended is not None:
            yield ended
        steps.extend(interpreter.after(step.situation, event) for event in interpreter.events(step.situation))
        if len(seen) > MAX_SITUATIONS:
            reject()


def certificate(model: BehaviorModel, argument: Argument, *names: str) -> Certificate:
    claims = tuple(names)
    return Certificate(model.name, "0" * 64, claims, argument, planner_for(argument))


def planner_for(argument: Argument) -> PlannerIdentity | None:
    is_canonical = isinstance(argument, RunsArgument) and argument.plans is PlanSet.CANONICAL
    return FIRST_PLANNER if is_canonical else None


@pytest.mark.slow
@given(cells(), st.data(), st.booleans(), st.sampled_from(KINDS))
@examples(60)
def test_all_situations_prove_what_they_do_not_visit_and_nothing_else(
    model: BehaviorModel,
    data: st.DataObject,
    leave_out: bool,  # noqa: FBT001
    kind: tuple[GoalOrder, PlanSet],
) -> None:
    model = replace(model, runs=RunsDeclaration(kind[0]))
    explored = explore(model, variables_that_matter(model) if leave_out else all_variables(model), *kind)
    assume(explored.others)
    sound = certificate(model, explored.argument, *explored.others)
    assert read_certificate(certificate_text(sound)) == sound
    assert check_certificate(sound, model) == ()
    if explored.visited:
        claimed = data.draw(st.sampled_from(explored.visited))
        flaws = check_certificate(certificate(model, explored.argument, claimed), model)
        assert any(f" {claimed}," in flaw.reason for flaw in flaws)


@given(cells(), st.data())
@examples(60, usual=4)
def test_without_one_of_its_situations_an_argument_is_refused(model: BehaviorModel, data: st.DataObject) -> None:
    model = replace(model, runs=RunsDeclaration(GoalOrder.SINGLE))
    explored = explore(model, variables_that_matter(model))
    assume(explored.others)
    runs = list(explored.argument.runs)
    places = [(goal, index) for goal, each in enumerate(runs) for index in range(len(each.situations))]
    assume(places)
    goal, index = data.draw(st.sampled_from(places))
    listed = runs[goal].situations
    other = data.draw(changed(model, listed[index]))
    runs[goal] = replace(runs[goal], situations=(*listed[:index], *other, *listed[index + 1 :]))
    flaws = check_certificate(certificate(model, replace(explored.argument, runs=tuple(runs)), *explored.others), model)
    assert flaws


@st.composite
def changed(draw: st.DrawFn, model: BehaviorModel, situation: Situation) -> tuple[Situation, ...]:
    """The situation left out, or another one in its place."""
    operation, resource = model.operations[0].name, model.resources[0].name
    others = (
        (),
        (replace(situation, queue=(*(situation.queue or ()), operation)),),
        (replace(situation, queue=situation.queue[1:] or None),) if situation.queue else (),
        (replace(situation, in_flight=situation.in_flight[1:]),) if situation.in_flight else (),
        (replace(situation, in_flight=tuple(reversed(situation.in_flight))),) if len(situation.in_flight) > 1 else (),
        (replace(situation, in_flight=(resource,)),) if situation.in_flight != (resource,) else (),
        (replace(situation, awaits=Awaits.CHANGE),) if situation.awaits is not Awaits.CHANGE else (),
        (replace(situation, values=situation.values[1:]),),
    )
    return draw(st.sampled_from(others))


@given(cells(), st.data())
@examples(60, usual=4)
def test_no_run_visits_what_is_proved_never_to_be_visited(model: BehaviorModel, data: st.DataObject) -> None:
    explored = explore(model, variables_that_matter(model))
    state = {v.name: data.draw(st.sampled_from(v.random)) for v in model.space}
    goal, predicate = data.draw(st.sampled_from(model.goals))
    real = Real(model, state, all_variables(model))
    real.give(GoalGiven(goal, predicate))
    for _ in range(25):
        assert not [name for name in real.visited if name in explored.others]
        if real.has_ended or real.goes_round:
            break
        event = data.draw(st.sampled_from(real.possible(data)))
        real.give(event)


def least_values(model: BehaviorModel) -> ValuesArgument:
    """The smallest sets of values that nothing leaves, found by adding what the check misses."""
    sets: dict[str, tuple[Value, ...]] = {variable.name: () for variable in model.running_space}
    while True:
        missing = [
            (name, value) for step in all_possible(sets, model) for name, value in step.gives if value not in sets[name]
        ]
        if not missing:
            return ValuesArgument(sets)
        for name, value in missing:
            domain = model.running_space[name].domain.values
            sets[name] = tuple(v for v in domain if v in sets[name] or v == value)


@pytest.mark.slow
@given(cells())
@examples(60)
def test_values_prove_nothing_that_a_run_visits(model: BehaviorModel) -> None:
    explored = explore(model, variables_that_matter(model), GoalOrder.SEQUENCE, PlanSet.ANY)
    argument = least_values(model)
    names = [str(obligation) for obligation in Obligations.of(model)]
    refused = [f.where.removeprefix("claim ") for f in check_values(claimable_obligations(model), argument, model)]
    assert not [name for name in names if name not in refused and name in explored.visited]
    proved = [name for name in names if name not in refused]
    if proved:
        assert check_certificate(certificate(model, argument, *proved), model) == ()


@given(cells(), st.data())
@examples(60, usual=4)
def test_sets_of_values_without_one_of_them_are_refused(model: BehaviorModel, data: st.DataObject) -> None:
    values = list(least_values(model).values.items())
    index = data.draw(st.integers(0, len(values) - 1))
    name, allowed = values[index]
    dropped = data.draw(st.sampled_from(allowed))
    values[index] = (name, tuple(value for value in allowed if value != dropped))
    assert list(check_values([], ValuesArgument(dict(values)), model))


@pytest.mark.slow
@given(cells())
@examples(60)
def test_facts_prove_nothing_that_a_run_visits(model: BehaviorModel) -> None:
    explored = explore(model, variables_that_matter(model), GoalOrder.SEQUENCE, PlanSet.ANY)
    for operation in model.operations:
        for fact, aspect in FACTS.items():
            claimed = f"{operation.name}/{aspect}"
            if claimed in explored.visited:
                assert check_certificate(certificate(model, StructureArgument((fact,)), claimed), model)


# texts

SMALL = (
    CELL
    + """
  o0:
    deadline: 5 s
    pre: {g: at == a, a: [r_req_trigger <- true]}
    post: {g: true, gr: r_req_state == succeeded, a: [at <- b, r_req_state <- initial, r_req_trigger <- false]}
  o1:
    pre: {g: at == b}
    post: {g: true, a: [at <- c]}
automatic_transitions:
  looks: {g: plan.state == planning && s_req_state == initial, a: [s_req_trigger <- true]}
"""
)


def certificates(model: BehaviorModel) -> list[Certificate]:
    """One of each kind; not all of them are sound."""
    explored = explore(model, all_variables(model))
    whole = {variable.name: variable.domain.values for variable in model.running_space}
    claims = ("o1/failed", "o1/timedout")
    arguments = (explored.argument, StructureArgument((Fact.CANNOT_FAIL, Fact.NO_DEADLINE)), ValuesArgument(whole))
    return [Certificate(model.name, "0a" * 32, claims, argument, planner_for(argument)) for argument in arguments]


MODEL = read_model(SMALL)
TEXTS = [certificate_text(certificate) for certificate in certificates(MODEL)]


def check_text(text: str) -> None:
    """A certificate that can be checked, or located errors. Any other exception fails the test."""
    try:
        read = read_certificate(text, "certificate.json")
    except InputError as error:
        check_diagnostics(error.diagnostics, text, "certificate.json")
        return
    assert all(str(flaw).isprintable() for flaw in check_certificate(read, MODEL))
    assert read_certificate(certificate_text(read)) == read


@given(malformed(TEXTS, MUTATIONS, 3))
@examples(300)
def test_a_text_that_is_broken_on_its_way_is_read_or_reported_where_it_is_broken(text: str) -> None:
    check_text(text)


@given(st.text(CHARACTERS, max_size=40), st.sampled_from(TEXTS))
@examples(100)
def test_any_text_is_no_certificate(text: str, whole: str) -> None:
    check_text(text)
    check_text(whole + text)
    check_text(whole[: len(whole) // 2] + text + whole[len(whole) // 2 :])


LEAVES = st.none() | st.booleans() | st.integers() | st.just(2**70) | st.floats() | st.text(CHARACTERS, max_size=5)
WORDS = st.sampled_from(["o0", "o1", "r", "s", "a", "plan", "stale", "executing", "none", "o1/queued", "no_deadline"])
JSON = st.recursive(
    LEAVES | WORDS, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=3)
)


@given(st.data(), st.sampled_from(TEXTS))
@examples(300, usual=12)
def test_a_certificate_with_other_values_is_read_or_its_flaws_are_reported(data: st.DataObject, text: str) -> None:
    document = json.loads(text)
    for _ in range(data.draw(st.integers(1, 3))):
        container = document
        while True:
            keys = list(container) if isinstance(container, dict) else list(range(len(container)))
            if not keys:
                break
            key = data.draw(st.sampled_from(keys))
            if isinstance(container[key], (dict, list)) and data.draw(st.integers(0, 5)):
                container = container[key]
                continue
            container[key] = data.draw(JSON)
            break
    check_text(
        json.dumps(document, indent=data.draw(st.sampled_from([None, 1])), ensure_ascii=data.draw(st.booleans()))
    )
