"""What a check says of certificates that are sound, and of those that something is wrong with."""

from __future__ import annotations

from dataclasses import replace

import pytest

from scbm.files import read_model
from scbm.model import BehaviorModel, Value
from scbm.proofcheck import (
    Argument,
    Awaits,
    Certificate,
    Claim,
    Fact,
    RunsArgument,
    Situation,
    StructureArgument,
    ValuesArgument,
    check_certificate,
)
from support.models import scan_cell

LAMP = """
behavior_model: lamp
variables:
  lamp: {domain: [dark, lit], initial: dark}
  note: {domain: [x, y], initial: x}
resources:
  switch: {request: [note]}
operations:
  light:
    deadline: 5 s
    pre: {g: lamp == dark, a: [switch_req_trigger <- true, note <- y]}
    post: {g: true, gr: switch_req_state == succeeded, a: [lamp <- lit]}
    timedout: [switch_req_trigger <- false]
automatic_transitions:
  burns_out: {g: lamp == lit && note == x && lamp == dark, a: [lamp <- dark]}
goals:
  lit: lamp == lit
"""
VARIABLES = (
    "lamp",
    "note",
    "switch_req_trigger",
    "switch_req_state",
    "current.name",
    "current.state",
    "plan.state",
)
EXECUTING = Situation(("dark", "y", True, "executing", "light", "executing", "executing"), (), ("switch",))
FAILED = Situation(("dark", "y", True, "failed", "light", "executing", "executing"))
"""`light` ignores a reply that says failed. It times out, and then waits for a reply that no resource will send."""


def lamp(*replacements: tuple[str, str], more: str = "") -> BehaviorModel:
    text = LAMP
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new)
    return read_model(text + more)


def told(model: BehaviorModel, argument: Argument, *names: str) -> list[str]:
    claims = tuple(Claim(name, "because") for name in names)
    return [str(flaw) for flaw in check_certificate(Certificate(model.name, "0" * 64, claims, argument), model)]


# claims


def test_claims_name_obligations_of_the_model_and_each_once() -> None:
    argument = StructureArgument((Fact.CANNOT_FAIL,))
    assert told(scan_cell(), argument) == ["the claims: there are none"]
    assert told(scan_cell(), argument, "scan/failed") == ["claim scan/failed: the model has no such obligation"]
    twice = told(scan_cell(), argument, "scan_box/failed", "scan_box/failed")
    assert twice == ["claim scan_box/failed: it is made twice"]


def test_a_certificate_of_another_model_proves_nothing() -> None:
    certificate = Certificate("press", "0" * 64, (Claim("light/failed", "x"),), StructureArgument((Fact.CANNOT_FAIL,)))
    (flaw,) = check_certificate(certificate, lamp())
    assert str(flaw) == "the certificate: it is one of the model press, and this is lamp"


def test_no_more_than_twenty_flaws_are_told() -> None:
    names = [f"light/{number}" for number in range(30)]
    assert len(told(lamp(), StructureArgument(()), *names)) == 20


# facts


def test_facts_that_hold_prove_their_claims() -> None:
    model = lamp(
        ("deadline: 5 s", ""), ("    timedout: [switch_req_trigger <- false]\n", ""), ("lamp == dark,", "true,")
    )
    facts = StructureArgument((Fact.NO_DEADLINE, Fact.CANNOT_FAIL, Fact.ALWAYS_ENABLED))
    assert told(model, facts, "light/timedout", "light/failed", "light/disabled") == []


def test_there_is_one_fact_for_each_claim_and_a_fitting_one() -> None:
    assert told(lamp(), StructureArgument(()), "light/failed") == ["the argument: there are 1 claims, and 0 facts"]
    (other,) = told(lamp(), StructureArgument((Fact.NO_DEADLINE,)), "light/failed")
    assert other == "claim light/failed: it does not follow from this fact: the operation has no deadline"


@pytest.mark.parametrize(
    ("model", "fact", "claim", "reason"),
    [
        (lamp(), Fact.NO_DEADLINE, "light/timedout", "the operation has a deadline"),
        (
            lamp(("    timedout", "    failed: {g: note == x}\n    timedout")),
            Fact.CANNOT_FAIL,
            "light/failed",
            "the operation has a `failed` transition",
        ),
        (
            lamp(("a: [lamp <- dark]", "a: [current.state <- failed]")),
            Fact.CANNOT_FAIL,
            "light/failed",
            "the automatic transition burns_out can fail it: current.state <- failed",
        ),
        (
            lamp(("a: [lamp <- dark]", "a: [light.state <- failed]")),
            Fact.CANNOT_FAIL,
            "light/failed",
            "the automatic transition burns_out can fail it: light.state <- failed",
        ),
        (lamp(), Fact.ALWAYS_ENABLED, "light/disabled", "the precondition does not always hold: lamp == dark"),
        (
            scan_cell(
                ("g: scan_req_state == initial && scan_req_trigger == false && box_is_scanned == false", "g: true"),
                ("gr: light != red", "gr: true"),
                ("scan_command <- scan_box", "count += 1"),
            ),
            Fact.ALWAYS_ENABLED,
            "scan_box/disabled",
            "an action of the precondition can leave its domain: count += 1",
        ),
    ],
)
def test_facts_that_do_not_hold_are_refused(model: BehaviorModel, fact: Fact, claim: str, reason: str) -> None:
    assert told(model, StructureArgument((fact,)), claim) == [f"claim {claim}: {reason}"]


def test_a_precondition_too_large_to_look_at_is_no_fact(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scbm.proofcheck.valuations.MAX_STEPS", 500)
    wide = "\n".join(f"  w{n}: {{domain: 0..9, initial: 0}}" for n in range(12))
    same = " || ".join(f"w{n} == w{n + 1}" for n in range(11))
    always = f"{same} || !({same})"
    model = lamp(("resources:", f"{wide}\nresources:"), ("g: lamp == dark", f"g: '{always}'"))
    (flaw,) = told(model, StructureArgument((Fact.ALWAYS_ENABLED,)), "light/disabled")
    assert "the precondition is too large to check: " in flaw


# values


def values(model: BehaviorModel, **other: tuple[Value, ...]) -> ValuesArgument:
    """All values that variables can have, but for some variables; `_` stands for `.`."""
    given = {name.replace("__", "."): allowed for name, allowed in other.items()}
    return ValuesArgument(tuple((v.name, given.get(v.name, v.domain.values)) for v in model.running_space))


def test_values_that_nothing_leaves_prove_what_they_rule_out() -> None:
    assert told(lamp(), values(lamp()), "automatic/burns_out", "light/failed") == []


def test_a_guard_that_the_values_of_its_variables_rule_out_is_never_taken() -> None:
    model = lamp(
        ("&& lamp == dark", "&& plan.state == aborted"),
        ("a: [switch_req_trigger <- true, note <- y]", "ar: [note <- x]"),
    )
    states = ("idle", "planning", "executing")
    flaws = told(model, values(model, note=("x",), plan__state=states), "automatic/burns_out")
    assert flaws == ["claim automatic/burns_out: these values allow it to be visited by burns_out"]
    other = lamp(("lamp == lit && note == x && lamp == dark", "note == y"), ("true, note <- y]", "true]"))
    assert told(other, values(other, note=("x",)), "automatic/burns_out") == []


def test_automatic_transitions_that_change_nothing_are_never_taken() -> None:
    model = lamp(
        ("lamp == lit && note == x && lamp == dark, a: [lamp <- dark]", "lamp == lit, a: [note <- y]"),
        ("initial: x", "initial: y"),
    )
    assert told(model, values(model, note=("y",)), "automatic/burns_out") == []
    assert told(model, values(model), "automatic/burns_out") != []


@pytest.mark.parametrize(
    ("name", "allowed", "flaw"),
    [
        ("lamp", ("lit",), "lamp: dark is not among its values, but it gets it by the beginning of a run"),
        ("lamp", ("dark",), "lamp: lit is not among its values, but it gets it by complete_light"),
        ("note", ("x",), "note: y is not among its values, but it gets it by start_light"),
        (
            "switch_req_state",
            ("initial", "executing", "succeeded"),
            "switch_req_state: failed is not among its values, but it gets it by a request to switch",
        ),
        (
            "switch_req_trigger",
            (False,),
            "switch_req_trigger: true is not among its values, but it gets it by start_light",
        ),
        (
            "current__name",
            ("none",),
            "current.name: light is not among its values, but it gets it by light at the head of the queue",
        ),
        (
            "current__state",
            ("initial", "executing", "completed", "timedout"),
            "current.state: the values are not some of its domain, each once and in order",
        ),
        (
            "current__state",
            ("initial", "executing", "timedout", "completed"),
            "current.state: disabled is not among its values, but it gets it by light at the head of the queue",
        ),
        (
            "light__state",
            ("initial", "disabled", "executing", "completed"),
            "light.state: timedout is not among its values, but it gets it by the deadline of light",
        ),
        (
            "plan__state",
            ("planning",),
            "plan.state: executing is not among its values, but it gets it by the beginning of a run",
        ),
        ("note", ("x", "z"), "note: the values are not some of its domain, each once and in order"),
        ("note", ("y", "x"), "note: the values are not some of its domain, each once and in order"),
        (
            "switch_req_trigger",
            (0, 1),
            "switch_req_trigger: the values are not some of its domain, each once and in order",
        ),
    ],
)
def test_values_that_a_run_leaves_are_refused(name: str, allowed: tuple[Value, ...], flaw: str) -> None:
    assert flaw in told(lamp(), values(lamp(), **{name: allowed}), "light/failed")


def test_what_a_resource_measures_can_be_anything() -> None:
    model = lamp(("{request: [note]}", "{measures: [note]}"), ("true, note <- y]", "true]"))
    assert "note: y is not among its values, but it gets it by a request to switch" in told(
        model, values(model, note=("x",)), "light/failed"
    )


def test_every_variable_has_its_values() -> None:
    whole = values(lamp())
    for argument in (replace(whole, values=whole.values[1:]), replace(whole, values=(*whole.values, whole.values[0]))):
        flaw = "the argument: it does not name every variable once, in the order of the model"
        assert told(lamp(), argument, "light/failed") == [flaw]


@pytest.mark.parametrize(
    ("claim", "by"),
    [
        ("light/disabled", "light at the head of the queue"),
        ("light/queued", "light at the head of the queue"),
        ("light/executing", "start_light"),
        ("light/completed", "complete_light"),
        ("light/timedout", "the deadline of light"),
    ],
)
def test_what_values_allow_is_not_proved(claim: str, by: str) -> None:
    assert told(lamp(), values(lamp()), claim) == [f"claim {claim}: these values allow it to be visited by {by}"]


def test_an_operation_fails_if_the_values_allow_an_automatic_transition_to_fail_it() -> None:
    model = scan_cell()
    assert told(model, values(model), "scan_box/failed") == [
        "claim scan_box/failed: these values allow it to be visited by scan_failed"
    ]


@pytest.mark.parametrize("state", ["completed", "unsolvable", "aborted"])
def test_what_waits_for_the_end_of_a_run_is_taken_behind_it(state: str) -> None:
    """Also what a hook at the end makes possible: `burns_out` needs what `hook` assigns."""
    hook = f"  hook: {{g: plan.state == {state}, a: [note <- y]}}\ngoals:"
    model = lamp(
        ("lamp == lit && note == x && lamp == dark", "note == y"), ("true, note <- y]", "true]"), ("goals:", hook)
    )
    argument = values(model, note=("x",), plan__state=("planning", "executing"))
    assert told(model, argument, "automatic/hook", "automatic/burns_out") == [
        "claim automatic/hook: these values allow it to be visited by hook",
        "claim automatic/burns_out: these values allow it to be visited by burns_out",
    ]


# runs


def runs(*situations: Situation, variables: tuple[str, ...] = VARIABLES) -> RunsArgument:
    return RunsArgument(variables, (("lit", situations),))


NEVER = ("light/failed", "light/disabled", "automatic/burns_out")


def test_all_situations_of_all_runs_prove_what_they_do_not_visit() -> None:
    assert told(lamp(), runs(EXECUTING, FAILED), *NEVER) == []


def test_more_situations_than_there_are_do_no_harm() -> None:
    asked = Situation(("dark", "x", False, "initial", "none", "initial", "planning"), ("light",), (), Awaits.PLAN)
    change = replace(asked, queue=(), awaits=Awaits.CHANGE)
    assert told(lamp(), runs(asked, EXECUTING, FAILED, change, EXECUTING), *NEVER) == []


def test_a_first_situation_that_is_not_listed_is_told() -> None:
    (flaw,) = told(lamp(), runs(FAILED), *NEVER)
    assert flaw == (
        "goal lit, from lamp=dark, note=x, switch_req_trigger=false, switch_req_state=initial: leads to a situation "
        "that is not listed: lamp=dark, note=y, switch_req_trigger=true, switch_req_state=executing, "
        "current.name=light, current.state=executing, plan.state=executing; in flight switch"
    )


def test_a_later_situation_that_is_not_listed_is_told_with_the_step_that_leads_to_it() -> None:
    (flaw,) = told(lamp(), runs(EXECUTING), *NEVER)
    assert flaw.startswith("goal lit, situation 1, switch fails: leads to a situation that is not listed: lamp=dark,")


@pytest.mark.parametrize(
    "other",
    [
        replace(EXECUTING, queue=("light",)),
        replace(EXECUTING, in_flight=()),
        replace(EXECUTING, values=("dark", "x", *EXECUTING.values[2:])),
    ],
)
def test_a_situation_that_is_another_one_is_missing(other: Situation) -> None:
    assert any("is not listed" in flaw for flaw in told(lamp(), runs(other, FAILED), *NEVER))


def test_what_a_step_visits_is_not_proved() -> None:
    flaws = told(lamp(), runs(EXECUTING, FAILED), "light/queued", "light/completed", "light/timedout")
    reason = "which is claimed never to be visited"
    first = "goal lit, from lamp=dark, note=x, switch_req_trigger=false, switch_req_state=initial"
    assert flaws == [
        f"{first}: visits light/queued, {reason}",
        f"goal lit, situation 1, switch succeeds: visits light/completed, {reason}",
        f"goal lit, situation 1, the deadline passes: visits light/timedout, {reason}",
        f"goal lit, situation 1, the deadline passes: visits light/queued, {reason}",
        f"goal lit, situation 2, the deadline passes: visits light/timedout, {reason}",
        f"goal lit, situation 2, the deadline passes: visits light/queued, {reason}",
    ]


def test_the_goals_are_those_of_the_model() -> None:
    flaw = "the goals: they are not those of the model, each once and in order"
    situations = runs(EXECUTING, FAILED).runs[0][1]
    others: list[tuple[str, ...]] = [(), ("dark",), ("lit", "lit"), ("lit", "dark")]
    for goals in others:
        argument = RunsArgument(VARIABLES, tuple((goal, situations) for goal in goals))
        assert told(lamp(), argument, *NEVER) == [flaw]


@pytest.mark.parametrize(
    "variables",
    [("lamp", "lamp", *VARIABLES[1:]), tuple(reversed(VARIABLES)), (*VARIABLES, "light.state"), (*VARIABLES, "lump")],
)
def test_the_variables_are_those_of_the_model(variables: tuple[str, ...]) -> None:
    flaw = "the variables: they are not some of the model without `<operation>.state`, each once and in order"
    assert told(lamp(), runs(variables=variables), *NEVER) == [flaw]


def without(situation: Situation, name: str) -> Situation:
    index = VARIABLES.index(name)
    return replace(situation, values=(*situation.values[:index], *situation.values[index + 1 :]))


def test_a_variable_that_nothing_depends_on_can_be_left_out() -> None:
    model = lamp(("lamp == lit && note == x && lamp == dark", "lamp == lit && lamp == dark"))
    left = tuple(name for name in VARIABLES if name != "note")
    argument = runs(without(EXECUTING, "note"), without(FAILED, "note"), variables=left)
    assert told(model, argument, *NEVER) == []


@pytest.mark.parametrize(
    ("replacement", "left_out", "reason"),
    [
        (("", ""), "note", "the guard of automatic transition burns_out reads it"),
        (("", ""), "lamp", "the goal lit reads it"),
        (("", ""), "plan.state", "the runner keeps it"),
        (("", ""), "current.name", "the runner keeps it"),
        (("", ""), "switch_req_trigger", "requests are sent by it"),
        (("", ""), "switch_req_state", "requests are sent by it"),
        (("a: [lamp <- lit]", "a: [lamp <- lit, count += 1]"), "count",
         "the postcondition of light is taken only if this fits: count += 1"),
        (("a: [lamp <- dark]", "a: [count <- 1]"), "count",
         "automatic transition burns_out is taken only if it changes something: count <- 1"),
        (("a: [lamp <- lit]", "a: [lamp <- lit, note <- other]"), "other",
         "the postcondition of light reads it: note <- other"),
        (("    timedout: [", "    failed: {g: count == 1}\n    timedout: ["), "count",
         "the guard of the `failed` transition of light reads it"),
        (("timedout: [", "timedout: [note <- other, "), "other",
         "the `timedout` actions of light reads it: note <- other"),
    ],
)  # fmt: skip
def test_a_variable_that_matters_cannot_be_left_out(replacement: tuple[str, str], left_out: str, reason: str) -> None:
    more = "  count: {domain: 0..2, initial: 0}\n  other: {domain: [x, y], initial: x}\nresources:"
    model = lamp(("resources:", more), replacement)
    variables = ("lamp", "note", "count", "other", *VARIABLES[2:])
    argument = runs(variables=tuple(name for name in variables if name != left_out))
    assert f"variable {left_out}: it is left out, but {reason}" in told(model, argument, *NEVER)


@pytest.mark.parametrize(
    ("situation", "reason"),
    [
        (replace(EXECUTING, values=EXECUTING.values[1:]), "it has 6 values for 7 variables"),
        (replace(EXECUTING, values=("red", *EXECUTING.values[1:])), "lamp cannot be red"),
        (
            replace(EXECUTING, values=(*EXECUTING.values[:2], 1, *EXECUTING.values[3:])),
            "switch_req_trigger cannot be 1",
        ),
        (replace(EXECUTING, queue=("dim",)), "its queue has something that is no operation"),
        (
            replace(EXECUTING, in_flight=("switch", "switch")),
            "what is in flight is not some of the resources, each once",
        ),
        (replace(EXECUTING, in_flight=("lamp",)), "what is in flight is not some of the resources, each once"),
        (replace(EXECUTING, awaits=Awaits.STALE), "it awaits stale while an operation is current"),
        (
            Situation(("dark", "y", True, "failed", "none", "executing", "executing")),
            "no operation is current, but current.state is not initial",
        ),
        (
            Situation(("dark", "y", True, "failed", "none", "initial", "planning"), ("light",), (), Awaits.CHANGE),
            "it awaits change while there is a queue",
        ),
    ],
)
def test_what_is_no_situation_at_all_is_told(situation: Situation, reason: str) -> None:
    assert told(lamp(), runs(EXECUTING, situation), *NEVER) == [f"goal lit, situation 2: {reason}"]


def test_what_happens_behind_the_end_of_a_run_counts() -> None:
    model = lamp(("lamp == lit && note == x && lamp == dark", "plan.state == completed"))
    flaws = told(model, runs(EXECUTING, FAILED), "automatic/burns_out")
    reason = "visits automatic/burns_out, which is claimed never to be visited"
    assert flaws == [f"goal lit, situation 1, switch succeeds: {reason}"]


def test_limits_can_end_a_run_anywhere() -> None:
    """At the limit of plans nothing is in flight and the trigger is false: no situation is like that."""
    model = lamp(
        ("lamp == lit && note == x && lamp == dark", "plan.state == aborted && note == y"),
        ("lamp <- dark", "note <- x"),
    )
    flaws = told(model, runs(EXECUTING, FAILED), "automatic/burns_out")
    reason = "visits automatic/burns_out, which is claimed never to be visited"
    assert flaws == [
        f"goal lit, situation 1, the deadline passes, the limit of plans is reached: {reason}",
        f"goal lit, situation 1, the time limit passes: {reason}",
        f"goal lit, situation 2, the deadline passes, the limit of plans is reached: {reason}",
        f"goal lit, situation 2, the time limit passes: {reason}",
    ]


def test_every_allowed_initial_state_is_begun_from() -> None:
    model = lamp(
        ("lamp: {domain: [dark, lit], initial: dark}", "lamp: {domain: [dark, lit], initial: dark, random: any}"),
        ("note: {domain: [x, y], initial: x}", "note: {domain: [x, y], initial: x, random: any}"),
        more="initial_states: '!(lamp == lit && note == y)'\n",
    )
    flaws = told(model, runs(), "light/queued")
    begun = [flaw.partition(",")[2].partition(", switch")[0] for flaw in flaws if "visits light/queued" in flaw]
    assert begun == [" from lamp=dark, note=x", " from lamp=dark, note=y"]


def test_too_many_initial_states_are_not_checked(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scbm.proofcheck.runs_check.MAX_INITIAL_STATES", 3)
    flaws = told(lamp(), runs(EXECUTING, FAILED), *NEVER)
    assert flaws == ["goal lit: there are too many initial states to check"]
