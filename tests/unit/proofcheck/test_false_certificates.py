"""False certificates, each of which only one event or one rule refutes: without it the checker would accept them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import pytest
from msgspec.structs import replace

from scbm.files import read_model
from scbm.model import BehaviorModel, GoalOrder, PlanSet
from scbm.proofcheck import check_certificate
from scbm.running.untimed.situations import Happening, HappeningKind
from support.certificates import certificate_of, forgetful_certificate_of, without_situation

KEY = "key: {domain: [off, on], initial: off, source: input}"
SIZE = "size: {domain: 0..2, initial: 0}"


def cell(  # noqa: PLR0913 - the parts of a model
    *automatic: str,
    variables: str = "",
    arm: str = "",
    resources: str = "",
    guard: str = "at == home",
    go: str = "",
    operations: str = "",
    goals: str = "",
    more: str = "",
) -> str:
    """A model in which `go` leads from home to work, with one request to the arm."""
    lines = "".join(f"  {line}\n" for line in automatic)
    return f"""
behavior_model: cell
variables:
  at: {{domain: [home, work], initial: home}}
  mark: {{domain: 0..3, initial: 0, source: state}}
  {variables}
resources:
  arm: {{{arm}}}
  {resources}
operations:
  go:
    pre: {{g: {guard}, a: [arm_req_trigger <- true]}}
    post: {{g: true, gr: arm_req_state == succeeded, a: [at <- work, arm_req_trigger <- false]}}
    {go}
  {operations}
automatic_transitions:
  lit: {{g: mark == 3 && at == work, a: [at <- home]}}
{lines}
goals:
  done: at == work
  {goals}
{more}
"""


def twice(when: str, first: str, then: str) -> tuple[str, str]:
    """Two automatic transitions: `was` sees the first value, and `seen` the next one."""
    return (
        f"was: {{g: {when} && {first} && mark == 0, a: [mark <- 1]}}",
        f"seen: {{g: {when} && {then} && mark == 1, a: [mark <- 0]}}",
    )


@dataclass(frozen=True)
class Forgotten:
    """What a finder forgets, and how the checker notices.

    Attributes:
        text: the model.
        forgets: as in `forgetful_certificate_of`.
        event: a part of the place of each flaw: how the checker names the event.
        claim: the false claim; only the event visits it.
        goals: the goals of the runs.
        plans: the plans of the runs.
    """

    text: str
    forgets: Callable[[Happening, bool], bool]
    event: str
    claim: str = "automatic/seen"
    goals: GoalOrder = GoalOrder.SINGLE
    plans: PlanSet = PlanSet.CANONICAL


def kind(kind: HappeningKind, *, at_rest: bool = False) -> Callable[[Happening, bool], bool]:
    return lambda happening, is_at_rest: happening.kind is kind and is_at_rest is at_rest


def reply(*, succeeded: bool, measured: tuple[tuple[str, int], ...] | None = None) -> Callable[[Happening, bool], bool]:
    return lambda each, _: (
        each.kind is HappeningKind.REPLY
        and each.succeeded is succeeded
        and (measured is None or each.measured == measured)
    )


MID_RUN = """
behavior_model: mid_run
variables:
  a: {domain: bool, initial: false}
  b: {domain: bool, initial: false}
  s: {domain: bool, initial: true, source: input}
resources: {r: {simulation: {latency: 1 s}}}
operations:
  first: {request: r, guard: a == false, effects: [a <- true]}
  second: {pre: {g: a == true && b == false && s == true}, post: {g: true, a: [b <- true]}}
goals: {done: b == true}
"""
"""The input `s` changes while `first` executes; then `second` is in the plan and cannot start."""

EXECUTES = "go.state == executing"
SHARED = "press: {shared: true}"
FORGOTTEN = {
    "a reply": Forgotten(cell(), reply(succeeded=True), "arm succeeds", "go/completed"),
    "a failed reply": Forgotten(
        cell(go="failed: {g: arm_req_state == failed, a: [arm_req_state <- initial]}"),
        reply(succeeded=False),
        "arm fails",
        "go/failed",
    ),
    "a measured value": Forgotten(
        cell("seen: {g: size == 2, a: [mark <- 1]}", variables=SIZE, arm="measures: [size]"),
        lambda happening, _: ("size", 2) in happening.measured,
        "with size = 2",
    ),
    "a value that a failed reply measures": Forgotten(
        cell("seen: {g: size == 2 && arm_req_state == failed, a: [mark <- 1]}", variables=SIZE, arm="measures: [size]"),
        reply(succeeded=False, measured=(("size", 2),)),
        "arm fails with size = 2",
    ),
    "a reply that measures nothing": Forgotten(
        cell(
            "seen: {g: size == 0 && arm_req_state == succeeded, a: [mark <- 1]}",
            variables=SIZE,
            arm="measures: {size: [1, 2]}",
        ),
        reply(succeeded=True, measured=()),
        "arm succeeds",
    ),
    "the deadline": Forgotten(
        cell(go="deadline: 5 s"), kind(HappeningKind.DEADLINE), "the deadline passes", "go/timedout"
    ),
    "the deadline of a disabled operation": Forgotten(
        cell(
            "was: {g: go.state == disabled && mark == 0, a: [mark <- 1]}",
            "seen: {g: plan.state == planning && mark == 1, a: [mark <- 2]}",
            guard="at == home, gr: mark == 3",
            go="disabled_deadline: 2 s",
        ),
        kind(HappeningKind.DEADLINE),
        "the deadline passes",
    ),
    "the answer of the planner": Forgotten(
        cell("seen: {g: key == on && mark == 3, a: [mark <- 1]}", variables=KEY),
        kind(HappeningKind.ANSWER),
        "the planner answers",
        "go/queued",
    ),
    "an input before the first goal": Forgotten(
        cell(*twice("plan.state == idle", "key == off", "key == on"), variables=KEY),
        kind(HappeningKind.OUTSIDE, at_rest=True),
        "no goal, from",
    ),
    "an input between two goals": Forgotten(
        cell(*twice("plan.state == completed", "key == off", "key == on"), variables=KEY),
        kind(HappeningKind.OUTSIDE, at_rest=True),
        "no goal, from",
        goals=GoalOrder.SEQUENCE,
    ),
    "an input during a run": Forgotten(
        MID_RUN, kind(HappeningKind.OUTSIDE), "s becomes", "second/disabled", plans=PlanSet.ANY
    ),
    "an input while an operation executes": Forgotten(
        cell(*twice(EXECUTES, "key == off", "key == on"), variables=KEY),
        kind(HappeningKind.OUTSIDE),
        "key becomes on",
    ),
    "a published value": Forgotten(
        cell(*twice(EXECUTES, "size == 0", "size == 2"), variables=SIZE, resources="eye: {publishes: {size: [0, 2]}}"),
        kind(HappeningKind.OUTSIDE),
        "size becomes 2",
    ),
    "several values that are published together": Forgotten(
        cell(
            *twice(EXECUTES, "size == 0 && key == off", "size == 2 && key == on"),
            "mixed: {g: size == 2 && key == off || size == 0 && key == on, a: [mark <- 3]}",
            variables=f"{SIZE}\n  {KEY.replace(', source: input', '')}",
            resources="eye: {publishes: {size: [0, 2], key: [off, on]}}",
        ),
        lambda happening, _: happening.kind is HappeningKind.OUTSIDE and len(happening.measured) > 1,
        "size becomes 2 and key becomes on",
    ),
    "an environment transition": Forgotten(
        cell(
            *twice(EXECUTES, "key == off", "key == on"),
            variables=KEY,
            more="environment:\n  press: {guard: mark == 1, actions: [key <- on]}",
        ),
        kind(HappeningKind.OUTSIDE),
        "key becomes on",
    ),
    "another user who comes": Forgotten(
        cell(*twice(EXECUTES, "press_req_state == initial", "press_req_state == executing"), resources=SHARED),
        kind(HappeningKind.OUTSIDE),
        "press_req_state becomes executing",
    ),
    "another user who leaves": Forgotten(
        cell(*twice(EXECUTES, "press_req_state == executing", "press_req_state == initial"), resources=SHARED),
        lambda happening, is_at_rest: not is_at_rest and ("press_req_state", "initial") in happening.measured,
        "press_req_state becomes initial",
    ),
    "the time limit": Forgotten(
        cell(*twice("at == home", EXECUTES, "plan.state == aborted")),
        kind(HappeningKind.TIME_LIMIT),
        "the time limit passes",
    ),
    "the end of a run that has no plan": Forgotten(
        cell("seen: {g: plan.state == unsolvable, a: [mark <- 1]}", guard="at == home && key == on", variables=KEY),
        kind(HappeningKind.GIVE_UP),
        "the run ends as unsolvable",
    ),
    "an operation that is next in a plan": Forgotten(
        cell(operations="walk: {pre: {g: at == home}, post: {g: true, a: [at <- work]}}"),
        lambda happening, _: happening.kind is HappeningKind.NEXT and happening.number == 1,
        "walk is next in the plan",
        "walk/executing",
        plans=PlanSet.ANY,
    ),
    "the end of a plan": Forgotten(
        cell(
            "slips: {g: slide.state == completed && at == work, a: [at <- home, mark <- 1]}",
            "seen: {g: plan.state == planning && mark == 1, a: [mark <- 2]}",
            operations="slide: {pre: {g: at == home}, post: {g: true, a: [at <- work]}}\n"
            "  stay: {pre: {g: at == work}, post: {g: true}}\n"
            "  rest: {pre: {g: at == work}, post: {g: true}}",
        ),
        lambda happening, _: happening.kind is HappeningKind.NEXT and happening.number == 2,  # the last of three
        "the plan ends",
        plans=PlanSet.ANY,
    ),
}
"""The events, by what the finder forgets."""


def model_of(row: Forgotten | Overclaimed) -> BehaviorModel:
    return read_model(row.text + f"runs: {{goals: {row.goals}}}\n")


@pytest.mark.parametrize("name", FORGOTTEN)
def test_only_the_event_that_the_finder_forgot_refutes_the_certificate(name: str) -> None:
    forgotten = FORGOTTEN[name]
    model = model_of(forgotten)
    true = certificate_of(model, forgotten.goals, forgotten.plans)
    assert check_certificate(true, model) == ()
    assert forgotten.claim not in true.claims
    false = forgetful_certificate_of(model, forgotten.forgets, forgotten.goals, forgotten.plans)
    assert forgotten.claim in false.claims
    flaws = check_certificate(false, model)
    assert flaws
    assert [flaw for flaw in flaws if forgotten.event not in flaw.where] == []


# true certificates that claim one obligation more


@dataclass(frozen=True)
class Overclaimed:
    """A claim that a true certificate lacks, and the place at which the checker sees it visited.

    Attributes:
        text: the model.
        place: a part of the place of each flaw.
        claim: the claim.
        goals: the goals of the runs.
    """

    text: str
    place: str
    claim: str = "automatic/seen"
    goals: GoalOrder = GoalOrder.SINGLE


CONSTANT = "size: {domain: 0..2, initial: 0, source: constant}"
AFTER_END = twice("plan.state == completed", "key == off", "key == on")
TIMES_OUT = "deadline: 5 s\n    timedout: [mark <- 2, arm_req_trigger <- false]"
REPLANS = (
    f"starts: {{g: {EXECUTES}, a: [mark <- 1]}}",
    "asks: {g: plan.state == planning && mark == 2, a: [mark <- 3]}",
)
OVERCLAIMED = {
    "an abort": Overclaimed(
        cell(
            f"stops: {{g: {EXECUTES}, a: [plan.state <- aborted, mark <- 1]}}",
            "seen: {g: plan.state == aborted && current.name == none && mark == 1, a: [mark <- 2]}",
        ),
        "goal done, from at=home",
    ),
    "the goal": Overclaimed(cell("seen: {g: plan.state == completed, a: [mark <- 1]}"), "arm succeeds"),
    "no plan": Overclaimed(
        cell(
            "seen: {g: plan.state == unsolvable, a: [mark <- 1]}", variables=CONSTANT, guard="at == home && size == 1"
        ),
        "goal done, from at=home",
    ),
    "no plan any more": Overclaimed(
        cell(
            "seen: {g: plan.state == unsolvable, a: [mark <- 2]}",
            guard="at == home && mark == 0",
            go="failed: {g: arm_req_state == failed, a: [mark <- 1]}",
        ),
        "arm fails",
    ),
    "the limit of plans at the first plan": Overclaimed(
        cell(
            *twice("at == home", EXECUTES, "mark == 3"),
            "seen_2: {g: plan.state == aborted && mark == 0, a: [mark <- 3]}",
        ),
        "goal done, from at=home, mark=0, arm_req_trigger=false, arm_req_state=initial, the limit of plans is reached",
        "automatic/seen_2",
    ),
    "the limit of plans at a later plan": Overclaimed(
        cell(*REPLANS, "seen: {g: plan.state == aborted && mark == 2, a: [mark <- 0]}", go=TIMES_OUT),
        "the deadline passes, the limit of plans is reached",
    ),
    "an end while a plan is awaited": Overclaimed(
        cell(*REPLANS, "seen: {g: plan.state == aborted && mark == 3, a: [mark <- 0]}", go=TIMES_OUT),
        "the deadline passes, the limit of plans is reached",
    ),
    "automatic transitions without end": Overclaimed(
        cell(
            "first: {g: arm_req_state == succeeded && mark == 0, a: [mark <- 1]}",
            "second: {g: arm_req_state == succeeded && mark == 1, a: [mark <- 2]}",
            "third: {g: arm_req_state == succeeded && mark == 2, a: [mark <- 0]}",
            "seen: {g: plan.state == aborted && mark == 1, a: [mark <- 3]}",  # 1,000 is 333 times 3, and 1
        ),
        "arm succeeds",
    ),
    "an input after the end": Overclaimed(cell(*AFTER_END, variables=KEY), "arm succeeds"),
    "an input after an end by the time limit": Overclaimed(
        cell(
            f"starts: {{g: {EXECUTES} && mark == 0, a: [mark <- 1]}}",
            "was: {g: plan.state == aborted && key == off && mark == 1, a: [mark <- 2]}",
            "seen: {g: plan.state == aborted && key == on && mark == 2, a: [mark <- 3]}",
            variables=KEY,
        ),
        "the time limit passes",
    ),
    "the second goal": Overclaimed(
        cell(operations="back: {pre: {g: at == work}, post: {g: true, a: [at <- home]}}", goals="home: at == home"),
        "goal home, from at=work",
        "back/queued",
        goals=GoalOrder.SEQUENCE,
    ),
    "a goal after the time limit": Overclaimed(
        cell(
            f"starts: {{g: {EXECUTES} && mark == 0, a: [mark <- 1]}}",
            "ends: {g: plan.state == completed, a: [mark <- 0]}",
            "seen: {g: plan.state == planning && mark == 1, a: [mark <- 2]}",
        ),
        "goal done, from at=home, mark=1",
        goals=GoalOrder.SEQUENCE,
    ),
    "a goal after the limit of plans": Overclaimed(
        cell(
            "asks: {g: plan.state == planning && mark == 0, a: [mark <- 1]}",
            f"starts: {{g: {EXECUTES} && mark == 1, a: [mark <- 0]}}",
            "ends: {g: plan.state == aborted && mark == 1, a: [mark <- 2]}",
            "seen: {g: plan.state == planning && mark == 2, a: [mark <- 0]}",
        ),
        "goal done, from at=home, mark=2",
        goals=GoalOrder.SEQUENCE,
    ),
    "an input that begins with another value": Overclaimed(
        cell(
            "was: {g: plan.state == idle && key == off && mark == 0, a: [mark <- 1]}",
            "seen: {g: plan.state == idle && key == on && mark == 0, a: [mark <- 2]}",
            variables=KEY,
        ),
        "the start, from at=home",
    ),
    "an input that begins with another value beside a random one": Overclaimed(
        cell(
            "was: {g: plan.state == idle && key == off && mark == 0, a: [mark <- 1]}",
            "seen: {g: plan.state == idle && key == on && size == 2 && mark == 0, a: [mark <- 2]}",
            "else: {g: plan.state == idle && mark == 0, a: [mark <- 3]}",
            variables=f"{KEY}\n  {CONSTANT.replace('0,', '0, random: [0, 2],')}",
        ),
        "the start, from at=home",
    ),
    "a random initial value": Overclaimed(
        cell("seen: {g: size == 2, a: [mark <- 1]}", variables=CONSTANT.replace("0,", "0, random: [0, 2],")),
        "the start, from at=home, mark=1, size=2",
    ),
    "a nominal value that is not drawn": Overclaimed(
        cell("seen: {g: size == 0, a: [mark <- 1]}", variables=CONSTANT.replace("0,", "0, random: [1, 2],")),
        "the start, from at=home, mark=1, size=0",
    ),
}
"""The rules, by what visits the claim."""


@pytest.mark.parametrize("name", OVERCLAIMED)
def test_only_one_rule_refutes_a_claim_beyond_those_of_a_true_certificate(name: str) -> None:
    overclaimed = OVERCLAIMED[name]
    model = model_of(overclaimed)
    true = certificate_of(model, overclaimed.goals)
    assert check_certificate(true, model) == ()
    flaws = check_certificate(replace(true, claims=(overclaimed.claim,)), model)
    assert flaws
    assert [str(flaw) for flaw in flaws if overclaimed.place not in flaw.where] == []
    assert [str(flaw) for flaw in flaws if overclaimed.claim not in flaw.reason] == []


@pytest.mark.parametrize("name", [*FORGOTTEN, *OVERCLAIMED])
def test_no_situation_of_these_certificates_can_be_left_out(name: str) -> None:
    row = (FORGOTTEN | OVERCLAIMED)[name]
    model = model_of(row)
    plans = row.plans if isinstance(row, Forgotten) else PlanSet.CANONICAL
    for smaller in without_situation(certificate_of(model, row.goals, plans)):
        assert check_certificate(smaller, model) != ()


def test_the_limit_of_plans_gives_up_the_requests_in_flight() -> None:
    text = cell(
        "seen: {g: plan.state == aborted && mark == 2 && arm_req_state == executing, a: [mark <- 0]}",
        go="deadline: 5 s\n    timedout: [mark <- 2]",
    )
    model = read_model(text, "cell.yaml")
    true = certificate_of(model, GoalOrder.SEQUENCE)
    assert "automatic/seen" in map(str, true.claims)
    assert check_certificate(true, model) == ()
