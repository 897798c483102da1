"""What a check says of certificates that are sound, and of those that something is wrong with."""

from __future__ import annotations

import re

import pytest
from msgspec.structs import replace

from scbm.closing.proofs.possible_values import possible_values
from scbm.files import read_model
from scbm.model import (
    FIRST_PLANNER,
    BehaviorModel,
    GoalOrder,
    PlannerChoice,
    PlannerIdentity,
    PlanSet,
    PlanState,
    RunPlans,
    RunsDeclaration,
    Value,
)
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
    check_certificate,
)
from scbm.proofcheck.runs_check import initial_states
from support.models import as_closed, scan_cell
from support.wording import Wording

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
EXECUTING = Situation(("dark", "y", True, "executing", "light", "executing", "executing"), None, ("switch",))
FAILED = Situation(("dark", "y", True, "failed", "light", "executing", "executing"), None, ())
"""`light` ignores a reply that says failed. It times out, and then waits for a reply that no resource will send."""


def lamp(*replacements: tuple[str, str], more: str = "") -> BehaviorModel:
    text = LAMP
    for old, new in replacements:
        assert old in text, old
        text = text.replace(old, new)
    return as_closed(read_model(text + more))


def flaws_of(model: BehaviorModel, argument: Argument, *names: str) -> list[str]:
    claims = tuple(names)
    planner = FIRST_PLANNER if isinstance(argument, RunsArgument) else None
    certificate = Certificate(model.name, "0" * 64, claims, argument, planner)
    return [str(flaw) for flaw in check_certificate(certificate, model)]


# claims


def test_claims_name_obligations_of_the_model_and_each_once(wording: Wording) -> None:
    argument = StructureArgument((Fact.CANNOT_FAIL,))
    for claims in ((), ("scan/failed",), ("scan_box/failed", "scan_box/failed")):
        (flaw,) = flaws_of(scan_cell(), argument, *claims)
        wording(flaw)


def test_a_certificate_of_another_model_proves_nothing(wording: Wording) -> None:
    certificate = Certificate("press", "0" * 64, ("light/failed",), StructureArgument(()))
    (flaw,) = check_certificate(certificate, lamp())
    wording(flaw)


def test_no_more_than_twenty_flaws_are_reported() -> None:
    names = [f"light/{number}" for number in range(30)]
    assert len(flaws_of(lamp(), StructureArgument(()), *names)) == 20


@pytest.mark.parametrize(
    ("argument", "planner"),
    [
        (StructureArgument((Fact.CANNOT_FAIL,)), FIRST_PLANNER),
        (StructureArgument((Fact.CANNOT_FAIL,)), PlannerIdentity("greedy", "1")),
        (RunsArgument((), ()), None),
        (RunsArgument((), ()), PlannerIdentity("greedy", "1")),
        (RunsArgument((), ()), PlannerIdentity("canonical", "2")),
    ],
)
def test_a_certificate_names_the_planner_that_its_argument_is_about(
    argument: Argument, planner: PlannerIdentity | None, wording: Wording
) -> None:
    certificate = Certificate("lamp", "0" * 64, ("light/failed",), argument, planner)
    (flaw,) = check_certificate(certificate, lamp())
    assert flaw.where == "the planner"
    wording(flaw)


def situations(goals: GoalOrder, plans: PlanSet) -> Certificate:
    """A certificate about some runs of the lamp. Its situations do not matter where the runs are other ones."""
    planner = FIRST_PLANNER if plans is PlanSet.CANONICAL else None
    argument = RunsArgument(VARIABLES, (GoalRuns("lit", ()),), goals, plans)
    return Certificate("lamp", "0" * 64, NEVER, argument, planner)


@pytest.mark.parametrize(
    ("goals", "plans", "runs", "planner", "places"),
    [
        ("single", "canonical", RunsDeclaration(GoalOrder.SINGLE), None, []),
        ("single", "canonical", RunsDeclaration(GoalOrder.SEQUENCE), None, ["the goals"]),
        ("single", "any", RunsDeclaration(GoalOrder.SEQUENCE), None, ["the goals"]),
        ("sequence", "canonical", RunsDeclaration(GoalOrder.SEQUENCE), None, []),
        ("sequence", "canonical", RunsDeclaration(GoalOrder.SINGLE), None, []),
        ("single", "canonical", RunsDeclaration(GoalOrder.SINGLE, RunPlans.DRAWN), None, ["the plans"]),
        ("single", "any", RunsDeclaration(GoalOrder.SINGLE, RunPlans.DRAWN), None, []),
        ("single", "canonical", RunsDeclaration(GoalOrder.SINGLE), "canonical", []),
        ("single", "canonical", RunsDeclaration(GoalOrder.SINGLE), "greedy", ["the planner"]),
        ("single", "any", RunsDeclaration(GoalOrder.SINGLE), "greedy", []),
        ("single", "canonical", RunsDeclaration(), "greedy", ["the goals", "the planner"]),
    ],
)
def test_a_certificate_is_about_the_runs_of_the_model(  # noqa: PLR0913, PLR0917 - the parameters of the test
    goals: str, plans: str, runs: RunsDeclaration, planner: str | None, places: list[str], wording: Wording
) -> None:
    model = replace(lamp(), runs=runs, planner=PlannerChoice(planner))
    flaws = check_certificate(situations(GoalOrder(goals), PlanSet(plans)), model)
    about_runs = [flaw for flaw in flaws if not flaw.where.startswith("goal lit")]
    assert [flaw.where for flaw in about_runs] == places
    if about_runs:
        wording(about_runs)


# facts


def test_facts_that_hold_prove_their_claims() -> None:
    model = lamp(
        ("deadline: 5 s", ""), ("    timedout: [switch_req_trigger <- false]\n", ""), ("lamp == dark,", "true,")
    )
    facts = StructureArgument((Fact.NO_DEADLINE, Fact.CANNOT_FAIL, Fact.ALWAYS_ENABLED))
    for runs_of_model in (RunsDeclaration(GoalOrder.SINGLE), RunsDeclaration(GoalOrder.SEQUENCE)):
        model = replace(model, runs=runs_of_model)
        assert flaws_of(model, facts, "light/timedout", "light/failed", "light/disabled") == []


def test_an_action_that_copies_a_value_of_the_same_domain_disables_no_operation() -> None:
    model = lamp(
        ("resources:", "  other: {domain: [x, y], initial: x}\nresources:"),
        ("g: lamp == dark, a: [", "g: true, a: [other <- note, "),
    )
    assert flaws_of(model, StructureArgument((Fact.ALWAYS_ENABLED,)), "light/disabled") == []


def test_there_is_one_fact_for_each_claim_and_a_fitting_one(wording: Wording) -> None:
    for facts in ((), (Fact.NO_DEADLINE,)):
        (flaw,) = flaws_of(lamp(), StructureArgument(facts), "light/failed")
        wording(flaw)


@pytest.mark.parametrize(
    ("model", "fact", "claim"),
    [
        (lamp(), Fact.NO_DEADLINE, "light/timedout"),
        (lamp(("    timedout", "    failed: {g: note == x}\n    timedout")), Fact.CANNOT_FAIL, "light/failed"),
        (lamp(("a: [lamp <- dark]", "a: [current.state <- failed]")), Fact.CANNOT_FAIL, "light/failed"),
        (lamp(("a: [lamp <- dark]", "a: [light.state <- failed]")), Fact.CANNOT_FAIL, "light/failed"),
        (lamp(), Fact.ALWAYS_ENABLED, "light/disabled"),
        (lamp(("g: lamp == dark, a", "g: true, gr: note == x, a")), Fact.ALWAYS_ENABLED, "light/disabled"),
        (
            scan_cell(
                ("g: scan_req_state == initial && scan_req_trigger == false && box_is_scanned == false", "g: true"),
                ("gr: light != red", "gr: true"),
                ("scan_command <- scan_box", "count += 1"),
            ),
            Fact.ALWAYS_ENABLED,
            "scan_box/disabled",
        ),
    ],
    ids=lambda value: value.name if isinstance(value, Fact) else None,
)
def test_facts_that_do_not_hold_are_refused(model: BehaviorModel, fact: Fact, claim: str, wording: Wording) -> None:
    (flaw,) = flaws_of(model, StructureArgument((fact,)), claim)
    assert claim in flaw
    wording(flaw)


def test_a_precondition_too_large_to_look_at_is_no_fact(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setattr("scbm.proofcheck.valuations.MAX_STEPS", 500)
    wide = "\n".join(f"  w{n}: {{domain: 0..9, initial: 0}}" for n in range(12))
    same = " || ".join(f"w{n} == w{n + 1}" for n in range(11))
    always = f"{same} || !({same})"
    model = lamp(("resources:", f"{wide}\nresources:"), ("g: lamp == dark", f"g: '{always}'"))
    (flaw,) = flaws_of(model, StructureArgument((Fact.ALWAYS_ENABLED,)), "light/disabled")
    wording(flaw)


# values


def values(model: BehaviorModel, **other: tuple[Value, ...]) -> ValuesArgument:
    """All values that variables can have, but for some variables; `_` stands for `.`."""
    given = {name.replace("__", "."): allowed for name, allowed in other.items()}
    return ValuesArgument({v.name: given.get(v.name, v.domain.values) for v in model.running_space})


def test_values_that_nothing_leaves_prove_what_they_rule_out() -> None:
    assert flaws_of(lamp(), values(lamp()), "automatic/burns_out", "light/failed") == []


def test_a_guard_that_the_values_of_its_variables_rule_out_is_never_taken(wording: Wording) -> None:
    model = lamp(
        ("&& lamp == dark", "&& plan.state == aborted"),
        ("a: [switch_req_trigger <- true, note <- y]", "ar: [note <- x]"),
    )
    (flaw,) = flaws_of(model, values(model, note=("x",)), "automatic/burns_out")
    wording(flaw)
    other = lamp(("lamp == lit && note == x && lamp == dark", "note == y"), ("true, note <- y]", "true]"))
    assert flaws_of(other, values(other, note=("x",)), "automatic/burns_out") == []


def test_automatic_transitions_that_change_nothing_are_never_taken() -> None:
    model = lamp(
        ("lamp == lit && note == x && lamp == dark, a: [lamp <- dark]", "lamp == lit, a: [note <- y]"),
        ("initial: x", "initial: y"),
    )
    assert flaws_of(model, values(model, note=("y",)), "automatic/burns_out") == []
    assert flaws_of(model, values(model), "automatic/burns_out") != []


@pytest.mark.parametrize(
    ("name", "allowed"),
    [
        ("lamp", ("lit",)),
        ("lamp", ("dark",)),
        ("note", ("x",)),
        ("switch_req_state", ("initial", "executing", "succeeded")),
        ("switch_req_trigger", (False,)),
        ("current__name", ("none",)),
        ("current__state", ("initial", "executing", "completed", "timedout")),
        ("current__state", ("initial", "executing", "timedout", "completed")),
        ("light__state", ("initial", "disabled", "executing", "completed")),
        ("plan__state", ("planning",)),
        ("note", ("x", "z")),
        ("note", ("y", "x")),
        ("switch_req_trigger", (0, 1)),
        ("note", ("x", "x", "y")),
    ],
)
def test_values_that_a_run_leaves_are_refused(name: str, allowed: tuple[Value, ...], wording: Wording) -> None:
    flaws = flaws_of(lamp(), values(lamp(), **{name: allowed}), "light/failed")
    assert any(flaw.startswith(f"{name.replace('__', '.')}: ") for flaw in flaws)
    wording(flaws)


@pytest.mark.parametrize("state", PlanState)
def test_each_state_of_the_plan_is_listed(state: PlanState) -> None:
    rest = tuple(other.value for other in PlanState if other is not state)
    flaws = flaws_of(lamp(), values(lamp(), plan__state=rest), "light/failed")
    assert [flaw.partition(":")[0] for flaw in flaws] == ["plan.state"]


@pytest.mark.parametrize(("model", "claim"), [(lamp(), "light/failed"), (scan_cell(), "scan_box/failed")])
def test_no_value_that_closing_lists_can_be_left_out(model: BehaviorModel, claim: str) -> None:
    found = possible_values(model)
    for name, allowed in found.items():
        for dropped in allowed:
            rest = tuple(value for value in allowed if value != dropped)
            flaws = flaws_of(model, ValuesArgument({**found, name: rest}), claim)
            assert any(flaw.startswith(f"{name}: ") for flaw in flaws), (name, dropped)


def test_an_operation_starts_though_no_later_state_is_listed() -> None:
    early = ("initial", "disabled")
    flaws = flaws_of(lamp(), values(lamp(), light__state=early, current__state=early), "light/executing")
    assert any(flaw.startswith("light.state: ") for flaw in flaws)


def test_what_a_resource_measures_can_be_anything(wording: Wording) -> None:
    model = lamp(("{request: [note]}", "{measures: [note]}"), ("true, note <- y]", "true]"))
    flaws = flaws_of(model, values(model, note=("x",)), "light/failed")
    assert any(flaw.startswith("note: ") for flaw in flaws)
    wording(flaws)


def test_flaws_show_no_characters_that_act_on_a_terminal() -> None:
    (flaw,) = check_certificate(Certificate("a\nb\u202e", "0" * 64, ("light/failed",), values(lamp())), lamp())
    assert str(flaw).isprintable()


def test_every_variable_has_its_values(wording: Wording) -> None:
    whole = values(lamp())
    first, *others = whole.values.items()
    for listed in (others, [*others, first]):
        (flaw,) = flaws_of(lamp(), ValuesArgument(dict(listed)), "light/failed")
        wording(flaw)


@pytest.mark.parametrize(
    "claim",
    [
        "light/disabled",
        "light/queued",
        "light/executing",
        "light/completed",
        "light/timedout",
    ],
)
def test_what_values_allow_is_not_proved(claim: str, wording: Wording) -> None:
    (flaw,) = flaws_of(lamp(), values(lamp()), claim)
    assert claim in flaw
    wording(flaw)


def test_an_operation_fails_if_the_values_allow_an_automatic_transition_to_fail_it(wording: Wording) -> None:
    model = scan_cell()
    (flaw,) = flaws_of(model, values(model), "scan_box/failed")
    assert "scan_failed" in flaw
    wording(flaw)


def test_no_automatic_transition_fails_an_operation_that_the_values_never_let_execute() -> None:
    breaks = ("a: [lamp <- dark]", "a: [current.state <- failed]")
    model = lamp(
        ("g: lamp == dark,", "g: lamp == lit,"), ("lamp == lit && note == x && lamp == dark", "note == x"), breaks
    )
    waits = ("initial", "disabled")
    argument = values(model, lamp=("dark",), current__state=waits, light__state=waits)
    assert flaws_of(model, argument, "light/failed", "automatic/burns_out") == []


@pytest.mark.parametrize("state", ["completed", "unsolvable", "aborted"])
def test_what_waits_for_the_end_of_a_run_is_taken_behind_it(state: str, wording: Wording) -> None:
    """Also what a hook at the end makes possible: `burns_out` needs what `hook` assigns."""
    hook = f"  hook: {{g: plan.state == {state}, a: [note <- y]}}\ngoals:"
    model = lamp(
        ("lamp == lit && note == x && lamp == dark", "note == y"), ("true, note <- y]", "true]"), ("goals:", hook)
    )
    (without,) = flaws_of(model, values(model, note=("x",)), "automatic/hook")
    assert without.startswith("note: ")
    first, second = flaws_of(model, values(model), "automatic/hook", "automatic/burns_out")
    assert ("automatic/hook" in first, "automatic/burns_out" in second) == (True, True)
    wording((without, first, second))


# runs


def runs(*situations: Situation, variables: tuple[str, ...] = VARIABLES) -> RunsArgument:
    return RunsArgument(variables, (GoalRuns("lit", situations),))


NEVER = ("light/failed", "light/disabled", "automatic/burns_out")


def test_all_situations_of_all_runs_prove_what_they_do_not_visit() -> None:
    assert flaws_of(lamp(), runs(EXECUTING, FAILED), *NEVER) == []


def test_more_situations_than_there_are_do_no_harm() -> None:
    asked = Situation(("dark", "x", False, "initial", "none", "initial", "planning"), ("light",), (), Awaits.PLAN)
    change = replace(asked, queue=None, awaits=Awaits.CHANGE)
    assert flaws_of(lamp(), runs(asked, EXECUTING, FAILED, change, EXECUTING), *NEVER) == []


def test_a_first_situation_that_is_not_listed_is_reported(wording: Wording) -> None:
    (flaw,) = flaws_of(lamp(), runs(FAILED), *NEVER)
    wording(flaw)


def test_a_later_situation_that_is_not_listed_is_reported_with_the_step_that_leads_to_it(wording: Wording) -> None:
    (flaw,) = flaws_of(lamp(), runs(EXECUTING), *NEVER)
    wording(flaw)


@pytest.mark.parametrize(
    "other",
    [
        replace(EXECUTING, queue=("light",)),
        replace(EXECUTING, in_flight=()),
        replace(EXECUTING, values=("dark", "x", *EXECUTING.values[2:])),
    ],
)
def test_a_situation_that_is_another_one_is_missing(other: Situation, wording: Wording) -> None:
    flaws = flaws_of(lamp(), runs(other, FAILED), *NEVER)
    assert flaws
    wording(flaws)


def test_what_a_step_visits_is_not_proved(wording: Wording) -> None:
    flaws = flaws_of(lamp(), runs(EXECUTING, FAILED), "light/queued", "light/completed", "light/timedout")
    visited = [name for flaw in flaws for name in ("queued", "completed", "timedout") if f"light/{name}" in flaw]
    assert visited == ["queued", "completed", "timedout", "queued", "timedout", "queued"]
    wording(flaws)


def test_the_goals_are_those_of_the_model(wording: Wording) -> None:
    situations = runs(EXECUTING, FAILED).runs[0].situations
    others: list[tuple[str, ...]] = [(), ("dark",), ("lit", "lit"), ("lit", "dark")]
    for goals in others:
        argument = RunsArgument(VARIABLES, tuple(GoalRuns(goal, situations) for goal in goals))
        (flaw,) = flaws_of(lamp(), argument, *NEVER)
        wording(flaw)


def test_a_model_without_goals_has_no_runs_to_argue_about() -> None:
    (flaw,) = flaws_of(replace(lamp(), goals=()), RunsArgument(VARIABLES, ()), *NEVER)
    assert flaw.startswith("the goals:")


@pytest.mark.parametrize(
    "variables",
    [("lamp", "lamp", *VARIABLES[1:]), tuple(reversed(VARIABLES)), (*VARIABLES, "light.state"), (*VARIABLES, "lump")],
)
def test_the_variables_are_those_of_the_model(variables: tuple[str, ...], wording: Wording) -> None:
    (flaw,) = flaws_of(lamp(), runs(variables=variables), *NEVER)
    wording(flaw)


def without(situation: Situation, name: str) -> Situation:
    index = VARIABLES.index(name)
    return replace(situation, values=(*situation.values[:index], *situation.values[index + 1 :]))


def test_a_variable_that_nothing_depends_on_can_be_left_out() -> None:
    model = lamp(("lamp == lit && note == x && lamp == dark", "lamp == lit && lamp == dark"))
    left = tuple(name for name in VARIABLES if name != "note")
    argument = runs(without(EXECUTING, "note"), without(FAILED, "note"), variables=left)
    assert flaws_of(model, argument, *NEVER) == []


@pytest.mark.parametrize(
    ("replacement", "left_out"),
    [
        (("", ""), "note"),
        (("", ""), "lamp"),
        (("", ""), "plan.state"),
        (("", ""), "current.name"),
        (("", ""), "switch_req_trigger"),
        (("", ""), "switch_req_state"),
        (("a: [lamp <- lit]", "a: [lamp <- lit, count += 1]"), "count"),
        (("a: [lamp <- dark]", "a: [count <- 1]"), "count"),
        (("a: [lamp <- lit]", "a: [lamp <- lit, note <- other]"), "other"),
        (("    timedout: [", "    failed: {g: count == 1}\n    timedout: ["), "count"),
        (("timedout: [", "timedout: [note <- other, "), "other"),
        (("goals:", "environment:\n  fade: {guard: count == 1, actions: [other <- y]}\ngoals:"), "count"),
    ],
)
def test_a_variable_that_matters_cannot_be_left_out(
    replacement: tuple[str, str], left_out: str, wording: Wording
) -> None:
    more = "  count: {domain: 0..2, initial: 0}\n  other: {domain: [x, y], initial: x}\nresources:"
    model = lamp(("resources:", more), replacement)
    variables = ("lamp", "note", "count", "other", *VARIABLES[2:])
    argument = runs(variables=tuple(name for name in variables if name != left_out))
    flaws = flaws_of(model, argument, *NEVER)
    assert any(left_out in flaw for flaw in flaws)
    wording(flaws)


@pytest.mark.parametrize(
    "situation",
    [
        replace(EXECUTING, values=EXECUTING.values[1:]),
        replace(EXECUTING, values=("red", *EXECUTING.values[1:])),
        replace(EXECUTING, values=(*EXECUTING.values[:2], 1, *EXECUTING.values[3:])),
        replace(EXECUTING, queue=("dim",)),
        replace(EXECUTING, in_flight=("switch", "switch")),
        replace(EXECUTING, in_flight=("lamp",)),
        replace(EXECUTING, awaits=Awaits.STALE),
        Situation(("dark", "y", True, "failed", "none", "executing", "executing"), None, ()),
        Situation(("dark", "y", True, "failed", "none", "initial", "planning"), ("light",), (), Awaits.CHANGE),
        replace(EXECUTING, queue=("light", "dim")),
    ],
)
def test_what_is_no_situation_at_all_is_reported(situation: Situation, wording: Wording) -> None:
    (flaw,) = flaws_of(lamp(), runs(EXECUTING, situation), *NEVER)
    wording(flaw)


def test_what_happens_behind_the_end_of_a_run_counts(wording: Wording) -> None:
    model = lamp(("lamp == lit && note == x && lamp == dark", "plan.state == completed"))
    flaws = flaws_of(model, runs(EXECUTING, FAILED), "automatic/burns_out")
    assert ["automatic/burns_out" in flaw for flaw in flaws] == [True]
    wording(flaws)


def test_limits_can_end_a_run_anywhere(wording: Wording) -> None:
    """At the limit of plans nothing is in flight and the trigger is false: no situation is like that."""
    model = lamp(
        ("lamp == lit && note == x && lamp == dark", "plan.state == aborted && note == y"),
        ("lamp <- dark", "note <- x"),
    )
    flaws = flaws_of(model, runs(EXECUTING, FAILED), "automatic/burns_out")
    assert ["automatic/burns_out" in flaw for flaw in flaws] == [True] * 4
    wording(flaws)


def test_every_allowed_initial_state_is_begun_from() -> None:
    model = lamp(
        ("lamp: {domain: [dark, lit], initial: dark}", "lamp: {domain: [dark, lit], initial: dark, random: any}"),
        ("note: {domain: [x, y], initial: x}", "note: {domain: [x, y], initial: x, random: any}"),
        more="initial_states: '!(lamp == lit && note == y)'\n",
    )
    flaws = flaws_of(model, runs(), "light/queued")
    assert [re.findall(r"(?:lamp|note)=\w+", flaw) for flaw in flaws if "light/queued" in flaw] == [
        ["lamp=dark", "note=x"],
        ["lamp=dark", "note=y"],
    ]


def test_too_many_initial_states_are_not_checked(monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setattr("scbm.proofcheck.runs_check.MAX_INITIAL_STATES", 3)
    (flaw,) = flaws_of(lamp(), runs(EXECUTING, FAILED), *NEVER)
    wording(flaw)


def test_only_initial_states_that_are_allowed_count_towards_their_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    """`number` is chosen before `note` and `lamp`, and all but one of its values are ruled out at once."""
    monkeypatch.setattr("scbm.proofcheck.runs_check.MAX_INITIAL_STATES", 30)
    model = lamp(
        ("initial: dark}", "initial: dark, random: any}"),
        ("initial: x}", "initial: x, random: any}\n  number: {domain: 0..9, initial: 3, random: any}"),
        more="initial_states: number == 3\n",
    )
    flaws = flaws_of(model, runs(), "light/queued")
    assert flaws
    assert not [flaw for flaw in flaws if flaw.startswith("the initial states")]


def test_a_variable_that_is_left_out_decides_which_initial_states_are_allowed() -> None:
    model = lamp(
        ("initial: dark}", "initial: dark, random: any}"),
        ("initial: x}", "initial: x}\n  number: {domain: 0..9, initial: 3}"),
        more="initial_states: number == 4 || lamp == lit\n",
    )
    assert list(dict.fromkeys(state["lamp"] for state in initial_states(VARIABLES, model))) == ["lit"]


@pytest.mark.parametrize(("allowed", "is_proof"), [("lamp == lit", True), ("'true'", False)])
def test_the_nominal_state_is_begun_from_if_it_is_allowed_though_it_is_not_drawn(allowed: str, is_proof: bool) -> None:  # noqa: FBT001 - a parameter of the test
    """From `lit`, which alone is drawn, the goal is reached at once; from the nominal `dark` a plan is needed."""
    model = lamp(("initial: dark}", "initial: dark, random: [lit]}"), more=f"initial_states: {allowed}\n")
    assert (flaws_of(model, runs(), "light/queued") == []) == is_proof
