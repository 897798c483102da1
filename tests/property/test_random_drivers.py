"""Real drivers that send whatever they like: a run takes it, and reports what no maker in the model could have sent.

The cells run over the loopback bus in virtual time. What is possible from outside is judged here by a slow reference,
which lets the changes of the enumeration of all runs happen to copies of the runner.
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, partial
from random import Random

import pytest
from msgspec.structs import replace

from scbm.cases import Case, CaseLimits, EnvironmentChange
from scbm.cases.trace import SENT, InjectionApplied, Record, Trace, write_trace
from scbm.closing import Decision
from scbm.files import read_model
from scbm.model import BehaviorModel, Resource, Value
from scbm.nodes import ControllerNode, beyond_reach
from scbm.nodes.bindings.ros_binding import RosBinding, TopicPair
from scbm.nodes.buses.bus import Publisher, Received, Topic
from scbm.running import Measured, Program, ReplyArrived, Runner, records_of
from scbm.running.simulation.case_runner import CaseRunner
from scbm.running.simulation.excluded_values import EXCLUDED
from scbm.testing import Execution, RandomCases, Tester
from scbm.testing.event_logs.event_log import EventLog, read_event_log, replay, write_event_log
from scbm.testing.event_logs.event_records import Note
from support.enumeration import _Outside, fork
from support.loops import GUARD_S
from support.nodes import Stage, run_or_lose
from support.opened_models import opened
from support.profiles import share
from support.random_models import random_model
from support.shared_closings import shared_closing
from support.virtual_loop import VirtualLoop, run_virtually

SECOND_NS = 10**9
LIMITS = CaseLimits(20 * SECOND_NS, 12)
RUNS = 200
BY_HAND = """
behavior_model: press
variables:
  pressed: {domain: bool, initial: false}
  checked: {domain: bool, initial: false}
  door: {domain: [closed, open, broken], initial: closed}
  part: {domain: [none, good, scrap], initial: none}
  force: {domain: 0..3, initial: 0}
  curtain: {domain: [clear, blocked], initial: clear, source: input}
  lock: {domain: [off, on], initial: off, source: state}
  alarm: {domain: [none, jam, burst, intruder], initial: none, source: state}
resources:
  ram: {measures: {force: [0, 1, 2]}, simulation: {latency: 1 s}}
  camera: {measures: {part: [none, good]}, publishes: {part: [none, good]}, simulation: {latency: 1 s}}
operations:
  press:
    request: ram
    deadline: 3 s
    guard: pressed == false
    pre: {gr: [door == closed, curtain == clear], ar: [lock <- on]}
    effects: [pressed <- true, lock <- off]
    on_timeout: [lock <- off]
  check:
    request: camera
    deadline: 3 s
    guard: [pressed == true, checked == false]
    effects: [checked <- true]
  remove_scrap:
    pre: {g: pressed == true, gr: part == scrap}
    post: {g: true, a: [checked <- true]}
automatic_transitions:
  jams: {g: force == 3 && alarm != jam, a: [alarm <- jam]}
  bursts: {g: door == open && lock == on && alarm != burst, a: [alarm <- burst]}
  breaks: {g: door == broken && alarm == none, a: [alarm <- intruder]}
  stops:
    g: curtain == blocked && press.state == executing
    a: [press.state <- failed, ram_req_trigger <- false, lock <- off]
environment:
  opens: {guard: [door == closed, lock == off], actions: [door <- open]}
  closes: {guard: door == open, actions: [door <- closed]}
goals:
  pressed: pressed == true
  checked: pressed == true && checked == true
"""
EXCLUDED_BY_HAND = ("automatic/jams", "automatic/bursts", "automatic/breaks")


def with_drivers(model: BehaviorModel) -> BehaviorModel:
    """The model with a pair of topics for each resource."""
    bound = (
        replace(r, binding=RosBinding({}, TopicPair(f"/{r.name}/request", f"/{r.name}/reply"))) for r in model.resources
    )
    return replace(model, resources=tuple(bound))


@cache
def model_of(number: int) -> BehaviorModel:
    """Model 0 by hand; the others are random."""
    return with_drivers(opened(random_model(number), number) if number else read_model(BY_HAND))


@cache
def proved_of(number: int) -> tuple[str, ...]:
    """The obligations that are proved uncoverable."""
    model = replace(model_of(number), resources=tuple(replace(r, binding=None) for r in model_of(number).resources))
    return tuple(str(d.obligation) for d in shared_closing(model).decided if d.decision is Decision.UNCOVERABLE)


@dataclass(frozen=True)
class Drivers:
    """What the drivers of one run do, by chance.

    Attributes:
        model: the model.
        random: decides.
        real: the resources that they carry out.
    """

    model: BehaviorModel
    random: Random
    real: tuple[str, ...]

    def value(self, name: str) -> Value:
        """Mostly a value of the variable."""
        return self.random.choice(self.model.space[name].domain.values) if self.random.random() < 0.95 else 99

    def some(self, names: tuple[str, ...]) -> dict[str, Value]:
        """One or two of the variables with values."""
        count = min(len(names), self.random.choice((1, 1, 1, 2)))
        return {name: self.value(name) for name in self.random.sample(names, count)}

    def join(self, stage: Stage, loop: VirtualLoop) -> None:
        """Answer requests, or not, and send values at random moments."""
        measurable, declared = Program(self.model).measurable, tuple(v.name for v in self.model.variables)
        bus = stage.join("drivers")
        for resource in (each for each in self.model.resources if each.name in self.real):
            replies = bus.publisher(Topic(f"/{resource.name}/reply"))
            answer = partial(self.answer, resource, replies, loop)
            bus.subscribe(Topic(f"/{resource.name}/request"), answer)
            for _ in range(self.random.randint(0, 8) if measurable else 0):
                names = measurable if self.random.random() < 0.95 else declared
                text = json.dumps({"measured": self.some(names)})
                loop.call_later(self.random.uniform(0, 12), replies.publish, {"data": text})

    def answer(self, resource: Resource, replies: Publisher, loop: VirtualLoop, received: Received) -> None:
        """Answer a request after some time, or never."""
        message = json.loads(str(received.message.data))
        if "request" not in message or self.random.random() < 0.2:
            return
        measures = resource.measures
        measured = self.some(measures) if measures and self.random.random() < 0.7 else {}
        reply = {"id": message["id"], "succeeded": self.random.random() < 0.8, "measured": measured}
        loop.call_later(self.random.uniform(0, 4), replies.publish, {"data": json.dumps(reply)})


def drawn_case(number: int, real: tuple[str, ...], random: Random) -> Case:
    """A random case that lists some changes of its own, of what no real driver sends."""
    model = model_of(number)
    case = RandomCases(model).case(random.randint(0, 10**6), 1)
    possible = [EnvironmentChange(0, None, each.name) for each in model.environment]
    for maker in Program(model).outside.free:
        possible += [EnvironmentChange(0, ((name, value),)) for name, values in maker.values for value in values]
    possible = [each for each in possible if beyond_reach(replace(case, environment=(each,)), model, real) is None]
    changes = random.choices(possible, k=random.choice((0, 0, 1, 2))) if possible else []
    times_ns = sorted(random.randint(0, 8) * SECOND_NS + 7 for _ in changes)
    environment = [replace(change, at_ns=at_ns) for at_ns, change in zip(times_ns, changes, strict=True)]
    return replace(case, environment=tuple(environment), limits=LIMITS)


def run_of(number: int, seed: int) -> tuple[Execution, list[str]]:
    """One run with drivers, and what the cell complained of."""
    model, random = model_of(number), Random(f"drivers {number} {seed}")
    names = [resource.name for resource in model.resources]
    real = tuple(name for name in names if random.random() < 0.7) or (names[0],)
    case = drawn_case(number, real, random)

    async def scene(loop: VirtualLoop) -> tuple[Execution, list[str]]:
        stage, tester = Stage.virtual(model, loop), Tester(model)
        ControllerNode(stage.context("controller", real))
        stage.resources([name for name in names if name not in real])
        Drivers(model, random, real).join(stage, loop)
        node = stage.tester()
        await node.wait_for_cell(GUARD_S)
        return await run_or_lose(node, tester, case), stage.complaints

    return run_virtually(scene)


def could_come(outside: _Outside, runner: Runner, values: dict[str, Value]) -> bool:
    """Whether makers can give variables these values now, perhaps by several changes while the runner stays settled."""
    target = runner.state | values
    todo = [fork(runner)]
    while todo:
        here = todo.pop()
        state = here.state
        if state == target:
            return True
        for _, event in outside.events(here):
            changed = dict(event.values) if isinstance(event, Measured) else {}
            new = {name: value for name, value in changed.items() if state[name] != value}
            if not new or any(target[name] != value for name, value in new.items()):
                continue
            if state | new == target:
                return True
            after = fork(here)
            if len(records_of(after.handle(event, after._now_ns))) == 1:  # no micro-step follows
                todo.append(after)
    return False


def forced_by_reference(model: BehaviorModel, log: EventLog) -> Iterator[bool]:
    """For each event of drivers, whether it has values that nothing in the model could have sent."""
    program, outside = Program(model), _Outside(model)
    runner = CaseRunner(program, log.case, log.options)
    for step in log.steps:
        if isinstance(step.event, Note):
            continue
        inner = runner._runner
        if isinstance(step.event, Measured):
            if not inner._has_started:
                inner = fork(inner)
                inner.handle(Measured(()), 0)
            values = {n: v for n, v in step.event.values if n in program.measurable and v in model.space[n].domain}
            yield not could_come(outside, inner, values)
        elif isinstance(step.event, ReplyArrived) and step.event.request in inner._requests._lines:
            resource = inner._requests._lines[step.event.request].resource
            sent = [(n, v) for n, v in step.event.measured if n in resource.measures and v in model.space[n].domain]
            state = inner.state
            yield any(v not in resource.sends(model.space[n]) and state[n] != v for n, v in sent)
        runner.handle(step.event, step.at_ns)


def is_forced(record: Record) -> bool:
    return isinstance(record, InjectionApplied) and record.injection == SENT and record.forced


def assert_good(number: int, seed: int) -> bool:
    """Check one run; return whether a driver sent what the model excludes."""
    model = model_of(number)
    execution, complaints = run_of(number, seed)
    log = execution.log
    assert log is not None
    visited = execution.visited_freely
    names = Tester(model).obligations.names(visited)
    assert [name for name in proved_of(number) if name in names] == []
    forced = [record for record in execution.trace.records if is_forced(record)]
    assert len(forced) == sum(forced_by_reference(model, log))
    sent = list(dict.fromkeys(name for record in forced for name, _ in record.changes))
    reported = list(dict.fromkeys(each.variable for each in execution.excluded))
    assert bool(reported) == bool(forced)
    assert [name for name in reported if name not in sent] == []
    assert sum(EXCLUDED in complaint for complaint in complaints) == len(reported)
    again = read_event_log(write_event_log(log, model), model, log.digest)
    for known in (log, again):
        assert write_trace(Trace(model.name, log.case.name, replay(known, Program(model)))) == write_trace(
            execution.trace
        )
    return bool(forced)


def test_by_hand_some_things_are_proved_uncoverable() -> None:
    assert [name for name in EXCLUDED_BY_HAND if name not in proved_of(0)] == []


def test_what_drivers_send_is_taken_and_what_the_model_excludes_is_reported() -> None:
    found = [assert_good(0, seed) for seed in range(share(RUNS // 2, usual=8))]
    assert {True, False} <= set(found)


@pytest.mark.slow
@pytest.mark.parametrize("number", [2, 18, 9, 47])
def test_so_it_is_for_random_models(number: int) -> None:
    for seed in range(share(RUNS // 8)):
        assert_good(number, seed)
