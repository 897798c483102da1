"""Failing cases made small: on seeded faults of the example, and choice by choice on a small cell."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import pytest
from msgspec.structs import replace

from scbm.cases import (
    Case,
    CaseLimits,
    Condition,
    ConditionKind,
    EnvironmentChange,
    Expectations,
    Injection,
    Network,
    OutcomeRule,
    Partition,
    Restart,
)
from scbm.files import Scope, Where, parse_predicate, read_case, read_model, write_case
from scbm.model import Always, BehaviorModel, Constant, Equal, Not, Outcome, Predicate, Reference, Requirement
from scbm.testing import Campaign, FailureKind, RandomCases, Shrinker, Shrunk, Tester, find_causes
from scbm.testing.shrinking.shrink_steps import without_changes
from support.models import scan_cell
from support.seeded import SEEDED
from support.wording import Wording

S = 1_000_000_000


def _shown(name: str, shrunk: Shrunk) -> str:
    sizes = [f"{size.operations} operations, {size.choices} choices" for size in (shrunk.before, shrunk.after)]
    lines = [f"{name}: from {sizes[0]} to {sizes[1]}, in {shrunk.runs} runs", f"  {shrunk.failure}"]
    return "\n".join([*lines, *(f"  it matters: {choice}" for choice in shrunk.matters), ""])


@pytest.mark.slow
def test_seeded_faults_shrink_to_a_few_operations(golden: Callable[[str, str], None]) -> None:
    shown = []
    for name, seeded in SEEDED.items():
        tester, execution, failure = seeded.find()
        shown.append(_shown(name, Shrinker(tester).shrink(execution, failure)))
    golden("shrunk.txt", "".join(shown))


@pytest.mark.slow
@pytest.mark.parametrize("name", SEEDED)
def test_a_small_case_fails_alike_wherever_it_is_run(name: str) -> None:
    tester, execution, failure = SEEDED[name].find()
    shrunk = Shrinker(tester).shrink(execution, failure, "small")
    assert shrunk.after < shrunk.before
    assert shrunk.failure.is_like(failure)
    text = write_case(shrunk.execution.case, tester.model, None)
    again = Tester(tester.model).execute(read_case(text, tester.model))
    assert again.digest == shrunk.execution.digest
    assert shrunk.failure in again.verdict.failures
    assert Shrinker(Tester(tester.model)).shrink(execution, failure, "small") == shrunk


# one choice after the other

MODEL = scan_cell(("initial: green}", "initial: green, random: any}"), ("goals:", "goals:\n  light: light == blue"))


def _predicate(text: str) -> Predicate:
    return parse_predicate(text, Scope.of(MODEL), Where.REQUIREMENT)


def _shrink(case: Case, never: str, model: BehaviorModel = MODEL) -> Shrunk:
    """What a case shrinks to that breaks the requirement that a predicate never holds."""
    requirement = Requirement("seeded", Always(Not(_predicate(never))))
    tester = Tester(model)
    execution = tester.execute(replace(case, requirements=(requirement,)))
    return Shrinker(tester).shrink(execution, execution.verdict.failures[0])


def _case(**keys: object) -> Case:
    return replace(Case("case", "scanned", _predicate("box_is_scanned == true"), MODEL.nominal_state), **keys)


FAILED_ONCE = "scan_box.state == failed"


def test_forced_outcomes_that_do_not_matter_are_left_out() -> None:
    outcomes = (
        OutcomeRule("scan", 1, 2, Outcome.TIMEOUT),
        *(OutcomeRule("scan", n, n, Outcome.FAIL, n * S) for n in (3, 4, 5)),
    )
    shrunk = _shrink(_case(outcomes=outcomes), FAILED_ONCE)
    assert shrunk.execution.case.outcomes == (OutcomeRule("scan", 1, 1, Outcome.FAIL),)
    assert (shrunk.before.operations, shrunk.before.outcomes) == (3, 5)
    assert (shrunk.after.operations, shrunk.after.outcomes) == (1, 1)


def test_a_state_that_does_not_matter_becomes_nominal() -> None:
    initial = MODEL.nominal_state.replace({"light": "blue", "count": 2})
    shrunk = _shrink(_case(initial=initial), "scan_box.state == executing")
    assert shrunk.execution.case.initial == MODEL.nominal_state
    assert shrunk.matters == ()


def test_what_matters_is_reported_with_what_was_tried_instead(wording: Wording) -> None:
    initial = MODEL.nominal_state.replace({"light": "blue", "count": 2})
    shrunk = _shrink(_case(initial=initial), "light == blue")
    (choice,) = shrunk.matters
    wording(choice)
    assert shrunk.after.operations == 0


def test_injections_lose_what_they_need_not_say(wording: Wording) -> None:
    held = Injection("held", (("temperature", 7), ("count", 1)), _predicate("scan_box.state == executing"), 0, 5 * S)
    other = Injection("other", (("temperature", 3),), at_ns=123_456_789)
    shrunk = _shrink(_case(injections=(other, held)), "count == 1")
    assert shrunk.execution.case.injections == (Injection("held", (("count", 1),)),)
    (choice,) = shrunk.matters
    wording(choice)


def test_what_the_environment_changes_is_reported_with_its_time(wording: Wording) -> None:
    model = scan_cell(("light: {", "light: {source: input, "))
    changes = (EnvironmentChange(S, (("light", "blue"),)), EnvironmentChange(2 * S, (("light", "red"),)))
    slow = _case(initial=model.nominal_state, outcomes=(OutcomeRule("scan", 1, 1, latency_ns=9 * S),))
    shrunk = _shrink(replace(slow, environment=changes), "light == red", model)
    assert shrunk.execution.case.environment == (replace(changes[1], at_ns=0),)
    wording(shrunk.matters)
    fading = scan_cell(more="environment:\n  fades: {guard: light == green, actions: [light <- red]}\n")
    by_a_transition = replace(slow, environment=(replace(changes[1], by="fades"),))
    wording(_shrink(by_a_transition, "light == red", fading).matters)


def test_times_become_round() -> None:
    late = Injection("late", (("count", 1),), at_ns=1_234_567_891)
    outcomes = (OutcomeRule("scan", 1, 1, latency_ns=9 * S),)
    shrunk = _shrink(_case(injections=(late,), outcomes=outcomes), "count == 1 && scan_req_state == executing")
    assert shrunk.execution.case.injections[0].at_ns is None
    shrunk = _shrink(_case(injections=(late,), outcomes=outcomes), "count == 1 && scan_box.state == completed")
    assert shrunk.execution.case.injections[0].at_ns is None


def test_faults_of_the_network_are_left_out_and_become_round(wording: Wording) -> None:
    network = Network(
        partitions=(Partition(90 * S, S), Partition(0, 3_141_592_653)), restarts=(Restart("scan", 70 * S, 7),)
    )
    shrunk = _shrink(_case(network=network), "scan_box.state == timedout")
    assert shrunk.execution.case.network.restarts == ()
    assert [p.for_ns % S for p in shrunk.execution.case.network.partitions] == [0]
    (choice,) = shrunk.matters
    wording(choice)


def test_a_resource_that_is_slower_is_a_choice(wording: Wording) -> None:
    slower = Injection("slow", resource="scan", condition=Condition(ConditionKind.SLOWER, Fraction(20)))
    outcomes = (OutcomeRule("scan", 1, 1, latency_ns=S),)
    shrunk = _shrink(_case(injections=(slower,), outcomes=outcomes), "scan_box.state == timedout")
    slows, answers = shrunk.matters
    wording((slows, answers))


def test_a_plainer_goal_is_taken_if_fewer_operations_lead_there() -> None:
    shrunk = _shrink(_case(), "scan_box.state == initial")
    assert shrunk.after.operations == 0


def test_a_run_that_leads_to_a_bad_state_does_not_become_one_that_begins_in_it() -> None:
    injected = Injection("turns", (("light", "blue"),), _predicate("scan_box.state == executing"))
    shrunk = _shrink(_case(injections=(injected,)), "light == blue")
    assert shrunk.execution.case.initial == MODEL.nominal_state
    assert len(shrunk.execution.case.injections) == 1


def test_a_run_that_begins_in_a_bad_state_stays_one() -> None:
    shrunk = _shrink(_case(initial=MODEL.nominal_state.replace({"light": "red"})), "light == red")
    assert shrunk.execution.case.initial["light"] == "red"


def test_times_of_messages_become_round() -> None:
    outcomes = (OutcomeRule("scan", 1, 1, request=(330_098_000,), reply=(9_876_543_210,)),)
    shrunk = _shrink(_case(outcomes=outcomes), "scan_box.state == timedout")
    (rule,) = shrunk.execution.case.outcomes
    assert (rule.request, rule.reply) == ((S,), (10 * S,))


def test_limits_that_matter_are_reported(wording: Wording) -> None:
    slow = (OutcomeRule("scan", 1, None, latency_ns=3 * S),)
    tester = Tester(scan_cell())
    execution = tester.execute(_case(outcomes=slow, limits=CaseLimits(time_ns=S)))
    shrunk = Shrinker(tester).shrink(execution, execution.verdict.failures[0])
    assert shrunk.execution.case.limits == CaseLimits(time_ns=S)
    wording(shrunk.matters)


def test_what_a_case_expects_is_not_shrunk(wording: Wording) -> None:
    tester = Tester(MODEL)
    execution = tester.execute(_case(expect=Expectations(plan=())))
    failure = execution.verdict.failures[0]
    assert failure.kind is FailureKind.EXPECTATION
    assert not Shrinker.can_shrink(failure)
    with wording.raises(ValueError):
        Shrinker(tester).shrink(execution, failure)


def test_a_failure_of_another_run_is_refused(wording: Wording) -> None:
    tester = Tester(MODEL)
    requirement = Requirement("seeded", Always(Equal(Reference("light"), Constant("red"))))
    failed = tester.execute(_case(requirements=(requirement,)))
    with wording.raises(ValueError):
        Shrinker(tester).shrink(tester.execute(_case()), failed.verdict.failures[0])


def test_the_number_of_attempts_is_bounded() -> None:
    tester, execution, failure = SEEDED["a counter is not stopped before its domain ends"].find()
    shrunk = Shrinker(tester, most_runs=10).shrink(execution, failure)
    assert shrunk.failure.is_like(failure)
    assert shrunk.runs <= 10 + len(shrunk.matters) + 1 + shrunk.after.choices


def test_initial_states_that_the_model_forbids_are_not_tried() -> None:
    model = scan_cell(("initial: green}", "initial: green, random: any}"), more="initial_states: light != green\n")
    never = Requirement("seeded", Always(Not(Equal(Reference("scan_box.state"), Constant("executing")))))
    case = replace(_case(requirements=(never,)), initial=model.nominal_state.replace({"light": "blue", "count": 1}))
    tester = Tester(model)
    execution = tester.execute(case)
    small = Shrinker(tester).shrink(execution, execution.verdict.failures[0]).execution.case
    assert small.initial == model.nominal_state.replace({"light": "blue"})


def test_only_the_requirement_that_is_broken_is_kept() -> None:
    others = tuple(Requirement(f"other_{n}", Always(Equal(Reference("count"), Constant(n)))) for n in (0, 1))
    never = Requirement("seeded", Always(Not(Equal(Reference("scan_box.state"), Constant("executing")))))
    tester = Tester(MODEL)
    execution = tester.execute(_case(requirements=(*others, never)))
    failure = next(f for f in execution.verdict.failures if f.subject == "seeded")
    assert Shrinker(tester).shrink(execution, failure).execution.case.requirements == (never,)


def test_limits_are_kept_so_that_no_attempt_runs_longer_than_it_may() -> None:
    tester = Tester(scan_cell())
    execution = tester.execute(
        _case(outcomes=(OutcomeRule("scan", 1, None, latency_ns=3 * S),), limits=CaseLimits(time_ns=S))
    )
    small = Shrinker(tester).shrink(execution, execution.verdict.failures[0]).execution.case
    assert small.limits == CaseLimits(time_ns=S)


def test_what_is_reported_of_all_requests_is_not_reported_of_each() -> None:
    """A written case leaves nothing to chance, so nothing has to be written down that was not there."""
    shrunk = _shrink(
        _case(outcomes=(OutcomeRule("scan", 1, None, Outcome.FAIL),), limits=CaseLimits(plans=9)), FAILED_ONCE
    )
    assert shrunk.before.requests == 1
    assert shrunk.execution.case.outcomes == (OutcomeRule("scan", 1, None, Outcome.FAIL),)


def test_the_latency_of_a_network_that_does_not_matter_is_left_out() -> None:
    network = Network(latency_ns=S, partitions=(Partition(0, S),))
    shrunk = _shrink(_case(network=network), "scan_box.state == timedout")
    assert shrunk.execution.case.network == Network(partitions=(Partition(0, S),))


def test_a_random_case_in_which_the_environment_acts_has_a_smallest_case() -> None:
    """`recovers` judges drawn cases and small ones, in which no environment acts, by one rule."""
    fails = "    simulation: {outcomes: {succeed: 0, fail: 1, timeout: 0}}\n"
    fades = "environment:\n  fades: {guard: light == green, actions: [light <- blue], every: 1 h}\n"
    aborts = ("[current.state <- failed, scan", "[plan.state <- aborted, scan")
    model = scan_cell(("    measures: [temperature]\n", fails), aborts, more=fades, is_open=True)
    tester = Tester(model)
    execution = tester.execute(RandomCases(model).case(1, 1))
    (failure,) = execution.verdict.failures
    assert failure.subject == "recovers"
    shrunk = Shrinker(tester).shrink(execution, failure)
    assert shrunk.execution.case.environment == ()
    (finding,) = find_causes(tester, Campaign.of(model, [execution.result]))
    assert finding.shrunk is not None


ENDLESS = """
behavior_model: endless
variables:
  light: {domain: [green, red], initial: green, source: input}
  ready: {domain: bool, initial: false, source: input}
  done: {domain: bool, initial: false}
resources:
  poll: {simulation: {latency: 1 ms}}
operations:
  wait:
    pre: {g: poll_req_state == initial, a: [poll_req_trigger <- true]}
    post: {g: true, gr: ready == true, a: [done <- true, poll_req_trigger <- false]}
automatic_transitions:
  again: {g: "poll_req_state in {succeeded, failed}", a: [poll_req_state <- initial]}
requirements:
  never_red: always light == green
goals:
  done: done == true
"""


@pytest.mark.parametrize(
    "later",
    [
        {"environment": (EnvironmentChange(20_000_000, (("ready", True),)),)},
        {"injections": (Injection("late", (("ready", True),), at_ns=20_000_000),)},
        {"limits": CaseLimits(20_000_000)},
        {"network": Network(restarts=(Restart("poll", 20_000_000, 1_000_000),))},
    ],
)
def test_a_choice_after_the_violation_does_not_matter(later: dict[str, object]) -> None:
    model = read_model(ENDLESS)
    red = EnvironmentChange(10_000_000, (("light", "red"),))
    case = Case("case", "done", model.goals[0][1], model.nominal_state, environment=(red,))
    changes = (red, *later.get("environment", ()))  # type: ignore[misc] # a tuple of changes
    execution = Tester(model).execute(replace(case, **(later | {"environment": changes})))
    shrunk = Shrinker(Tester(model)).shrink(execution, execution.verdict.failures[0])
    small = shrunk.execution.case
    assert shrunk.after.choices > 1 or small.limits.time_ns is not None  # without the other one the run has no end
    (choice,) = shrunk.matters
    assert choice.text.startswith("light = red ")


GATE = """
behavior_model: gate
variables:
  done: {domain: bool, initial: false}
  gate: {domain: [closed, open], initial: closed}
  seen: {domain: [unknown, good, bad], initial: unknown}
resources:
  cam: {measures: {seen: [good, bad]}, simulation: {latency: 1 s}}
operations:
  look: {request: cam, deadline: 5 s, guard: seen == unknown, assumes: {seen: good}}
  place: {pre: {g: seen == good}, post: {g: true, a: [done <- true]}}
environment:
  open: {guard: gate == closed, actions: [gate <- open], every: {exponential: 30 s}}
  close: {guard: gate == open, actions: [gate <- closed], after: {uniform: [2 s, 10 s]}}
goals: {done: done == true}
"""


def _shrunk_at_time_limit(model: BehaviorModel) -> Shrunk:
    tester = Tester(model)
    drawn = (tester.execute(RandomCases(model).case(1, number)) for number in range(1, 50))
    execution = next(e for e in drawn if [f.subject for f in e.verdict.failures] == ["time_limit"])
    return Shrinker(tester).shrink(execution, execution.verdict.failures[0])


def test_changes_that_only_delay_the_end_of_a_run_without_a_plan_are_left_out() -> None:
    shrunk = _shrunk_at_time_limit(read_model(GATE))
    assert shrunk.execution.case.environment == ()
    assert shrunk.failure.subject == "unsolvable"
    assert [choice.text for choice in shrunk.matters] == ["request 1 of cam: seen = bad measured"]


def test_changes_that_need_each_other_are_left_out_together() -> None:
    """Without one opening of the gate the next closing is impossible."""
    makers = {"on": ("false", "true"), "off": ("true", "false")}
    lamp = (f"  {by}: {{guard: lamp == {old}, actions: [lamp <- {new}]}}\n" for by, (old, new) in makers.items())
    text = GATE.replace("environment:\n", f"environment:\n{''.join(lamp)}")
    model = read_model(text.replace("resources:\n", "  lamp: {domain: bool, initial: false}\nresources:\n"))
    names = ("open", "on", "close", "off", "open", "on", "close", "open")
    changes = tuple(EnvironmentChange(number * S, None, by) for number, by in enumerate(names))
    case = Case("case", "done", model.goals[0][1], model.nominal_state, environment=changes)
    tried = [[change.by for change in each.environment or ()] for each in without_changes(case, model)]
    assert ["open", "close", "open", "close", "open"] in tried
    assert ["open", "on", "off", "on"] in tried
    assert ["open", "on", "off", "on", "close", "open"] in tried
