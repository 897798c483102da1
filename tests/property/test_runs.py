"""Whatever a model is and whatever resources do, a run ends, its trace is whole, and a replay repeats it."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace

from scbm.cases import CONDITIONS, Case, CaseGoal, Condition, ConditionKind, Injection, Network, Origin
from scbm.cases.coverage import Coverage, Obligations, visited_by
from scbm.cases.trace import End, ReplyReceived, RequestSent, RunEnded, RunStarted, Trace, read_trace, write_trace
from scbm.closing.advice import check_model
from scbm.closing.advice.instant_operations import completes_at_once
from scbm.model import FORMS, BehaviorModel, OperationState, Requirement, Role, Slug, Value
from scbm.planning import PlanLimits
from scbm.planning.engines import may_leave
from scbm.running import Runner, RunnerOptions
from scbm.running.simulation import Choices, DrawnReactions, PlainReactions, Simulated, Simulator, leave_nothing_open
from scbm.testing import RandomCases, Tester, draw_network, find_violations
from support.profiles import examples
from support.sentence_references import SENTENCE_REFERENCES
from support.strategies import SECOND_NS, open_models, running_models, sentences

OPTIONS = RunnerOptions(time_limit_ns=100 * SECOND_NS, plan_limit=12, livelock_bound=60)
LIMITS = PlanLimits(length=50, expansions=5_000)


@st.composite
def injections(draw: st.DrawFn, model: BehaviorModel) -> tuple[Injection, ...]:
    found = []
    for index in range(draw(st.integers(0, 2))):
        if draw(st.booleans()):
            resource = draw(st.sampled_from(model.resources)).name
            kind = draw(st.sampled_from(list(CONDITIONS.values())))
            condition = Condition(kind, Fraction(3, 2) if kind is ConditionKind.SLOWER else Fraction(1))
            when = draw(st.sampled_from([None, model.goals[0][1], model.operations[0].pre.g]))
            hold_ns = draw(st.sampled_from([None, SECOND_NS]))
            found.append(Injection(f"i{index}", (), when, SECOND_NS, hold_ns, resource, condition))
            continue
        variable = draw(st.sampled_from([v for v in model.running_space if v.assignable]))
        value = draw(st.sampled_from(variable.assignable))
        at_ns = draw(st.sampled_from([None, 0, SECOND_NS, 7 * SECOND_NS]))
        holds = variable.role in (Role.DECLARED, Role.RESOURCE)
        hold_ns = draw(st.sampled_from([None, SECOND_NS])) if holds else None
        found.append(Injection(f"i{index}", ((variable.name, value),), at_ns=at_ns, hold_ns=hold_ns))
    return tuple(found)


def _case(data: st.DataObject, model: BehaviorModel) -> tuple[Case, int]:
    """A case, and the seed that the rest of it is drawn from."""
    seed = data.draw(st.integers(0, 2**32))
    network = draw_network(model, Origin(seed)) if data.draw(st.booleans()) else Network()
    injected = data.draw(injections(model))
    return Case("case", *model.goals[0], model.nominal_state, injections=injected, network=network), seed


def _choices(case: Case, seed: int) -> Choices:
    drawn = DrawnReactions(Random(f"reactions {seed}"))
    return Choices(drawn, case.outcomes, case.network, Random(f"messages {seed}"))


def _run(data: st.DataObject, model: BehaviorModel) -> Simulated:
    case, seed = _case(data, model)
    return Simulator(model, OPTIONS, LIMITS).run(case, _choices(case, seed))


def _states(run: Simulated) -> list[tuple[int, dict[str, Value]]]:
    """The state at the beginning and after every record, with the time."""
    first = run.records[0]
    for record in run.records:
        if isinstance(record, RunStarted):
            first = record
            break
    assert isinstance(first, RunStarted)
    begin = run.records.index(first)
    state = dict(first.state)
    states = [(first.at_ns, dict(state))]
    for record in run.records[begin:]:
        state.update(record.changes)
        states.append((record.at_ns, dict(state)))
    return states


@given(running_models(), st.data())
@examples(250, usual=10)
def test_a_run_ends_and_its_trace_is_whole(model: BehaviorModel, data: st.DataObject) -> None:
    run = _run(data, model)
    ended = run.records[-1] if isinstance(run.records[-1], RunEnded) else None
    ended = ended or next(record for record in run.records if isinstance(record, RunEnded))
    assert ended.end == run.end.value
    assert all(before.at_ns <= after.at_ns for before, after in pairwise(run.records))
    assert run.ended_ns <= OPTIONS.time_limit_ns
    space = model.running_space
    for _, state in _states(run):
        assert all(state[variable.name] in variable.domain for variable in space)
        busy = [o.name for o in model.operations if state[f"{o.name}.state"] != OperationState.INITIAL]
        assert busy in ([], [state["current.name"]])
        if busy:
            assert state["current.state"] == state[f"{busy[0]}.state"]
    if run.end is End.REACHED:
        assert model.goals[0][1].holds(_states(run)[-1][1])


@given(running_models(), st.integers(0, 2**32))
@examples(300, usual=15)
def test_an_operation_that_completes_at_once_never_waits(model: BehaviorModel, seed: int) -> None:
    fitting = [
        each for each in model.operations if not any(may_leave(a, model.space) for a in each.post.running_actions)
    ]
    instant = [each.name for each in fitting if completes_at_once(each, model)]
    case = Case("case", *model.goals[0], model.nominal_state)
    run = Simulator(model, OPTIONS, LIMITS).run(case, _choices(case, seed))
    for (at_ns, state), (next_ns, _) in pairwise(_states(run)):
        executes = [name for name in instant if state[f"{name}.state"] == OperationState.EXECUTING]
        assert not executes or next_ns == at_ns


@given(open_models() | running_models(), st.integers(0, 2**32))
@examples(300, usual=15)
def test_no_run_reaches_a_goal_that_check_calls_unreachable(model: BehaviorModel, seed: int) -> None:
    doubted = [doubt.path[1] for doubt in check_model(model).doubts if doubt.slug is Slug.GOAL_UNREACHABLE]
    tester = Tester(model, OPTIONS, LIMITS)
    for name, goal in model.goals:
        case = RandomCases(model).case(seed, 1).with_goals([CaseGoal(name, goal)])
        assert name not in doubted or tester.execute(case).verdict.end is not End.REACHED


@given(running_models(), st.data())
@examples(150, usual=6)
def test_no_request_is_answered_twice_and_no_reply_goes_to_another_request(
    model: BehaviorModel, data: st.DataObject
) -> None:
    run = _run(data, model)
    sent = {record.request: record.resource for record in run.records if isinstance(record, RequestSent)}
    answered = [record.request for record in run.records if isinstance(record, ReplyReceived)]
    assert len(answered) == len(set(answered))
    assert all(sent[r.request] == r.resource for r in run.records if isinstance(r, ReplyReceived))


class _MicroStepRunner(Runner):
    """Takes one micro-step after the other, and memoizes no macro-steps."""

    def _take_macro_step(self) -> bool:
        return False


@given(running_models(), st.lists(st.integers(0, 2**32), min_size=2, max_size=6), st.data())
@examples(100, usual=5)
def test_memoized_macro_steps_do_what_their_micro_steps_do(
    model: BehaviorModel, seeds: list[int], data: st.DataObject
) -> None:
    shared = Simulator(model, OPTIONS, LIMITS)
    injected = [data.draw(injections(model)) if data.draw(st.booleans()) else () for _ in seeds]
    for seed, given_ones in [*zip(seeds, injected, strict=True)] * 2:
        case = Case("case", *model.goals[0], model.nominal_state, injections=given_ones)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr("scbm.running.simulation.simulator.Runner", _MicroStepRunner)
            expected = Simulator(model, OPTIONS, LIMITS).run(case, _choices(case, seed))
        assert shared.run(case, _choices(case, seed)) == expected


@pytest.mark.slow
@given(running_models(), st.data())
@examples(150)
def test_a_replay_of_the_recorded_choices_gives_the_same_bytes(model: BehaviorModel, data: st.DataObject) -> None:
    case, seed = _case(data, model)
    choices = _choices(case, seed)
    simulator = Simulator(model, OPTIONS, LIMITS)
    run = simulator.run(case, choices)
    network = Network(partitions=case.network.partitions, restarts=case.network.restarts)
    closed = replace(case, outcomes=leave_nothing_open(choices.taken), network=network)
    again = simulator.run(closed, Choices(PlainReactions(), closed.outcomes, network))
    text = write_trace(Trace(model.name, "case", run.records))
    assert write_trace(Trace(model.name, "case", again.records)) == text
    assert read_trace(text).records == run.records


@given(running_models(), st.data())
@examples(100, usual=6)
def test_what_a_run_visits_is_what_its_states_show(model: BehaviorModel, data: st.DataObject) -> None:
    run = _run(data, model)
    obligations = Obligations.of(model)
    names = Coverage(obligations, (("case", visited_by(run.records, obligations)),)).obligations.names(
        visited_by(run.records, obligations)
    )
    shown = {
        f"{operation.name}/{state[f'{operation.name}.state']}"
        for _, state in _states(run)
        for operation in model.operations
        if state[f"{operation.name}.state"] != OperationState.INITIAL
    }
    assert {name for name in names if not name.startswith("automatic/") and not name.endswith("/queued")} == shown


def test_every_form_of_requirement_has_a_slow_reference() -> None:
    assert list(SENTENCE_REFERENCES) == list(FORMS.values())


@pytest.mark.slow
@given(running_models(), st.data())
@examples(250)
def test_violations_are_those_of_a_slow_monitor(model: BehaviorModel, data: st.DataObject) -> None:
    run = _run(data, model)
    sentence = data.draw(sentences(model.running_space.variables))
    found = find_violations([Requirement("q", sentence)], run.records)
    expected = SENTENCE_REFERENCES[type(sentence)](sentence, _states(run))
    assert [violation.at_ns for violation in found] == ([] if expected is None else [expected])


@pytest.mark.slow
@given(running_models(), st.data())
@examples(250)
def test_a_run_that_violates_a_sentence_has_states_with_all_that_it_needs(
    model: BehaviorModel, data: st.DataObject
) -> None:
    run = _run(data, model)
    sentence = data.draw(sentences(model.running_space.variables))
    if find_violations([Requirement("q", sentence)], run.records):
        states = [state for _, state in _states(run)]
        assert all(any(needed.holds(state) for state in states) for needed in sentence.needed_to_violate)
