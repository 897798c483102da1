"""Models for problems of PDDL, from values as the reader makes them; and whole files, which need `unified-planning`."""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from msgspec.structs import replace

from scbm.files import read_model
from scbm.model import BehaviorModel, Diagnostic, InputError, Place, Slug
from scbm.pddl import ImportedModel, PddlImportOptions, PddlText, imported_model, read_pddl
from scbm.pddl.pddl_task import (
    FALSE,
    TRUE,
    InvariantPart,
    PddlDuration,
    PddlEffect,
    PddlFluent,
    PddlFormula,
    PddlLiftedAction,
    PddlTask,
)
from scbm.planning import Planner, Solved
from support.wording import Wording, diagnostic_heads

BLOCKS = """(define (domain blocks) (:requirements :strips)
 (:predicates (on ?x ?y) (ontable ?x) (clear ?x) (handempty) (holding ?x))
 (:action pick-up :parameters (?x) :precondition (and (clear ?x) (ontable ?x) (handempty))
  :effect (and (not (ontable ?x)) (not (clear ?x)) (not (handempty)) (holding ?x)))
 (:action put-down :parameters (?x) :precondition (holding ?x)
  :effect (and (not (holding ?x)) (clear ?x) (handempty) (ontable ?x)))
 (:action stack :parameters (?x ?y) :precondition (and (holding ?x) (clear ?y))
  :effect (and (not (holding ?x)) (not (clear ?y)) (clear ?x) (handempty) (on ?x ?y)))
 (:action unstack :parameters (?x ?y) :precondition (and (on ?x ?y) (clear ?x) (handempty))
  :effect (and (holding ?x) (clear ?y) (not (clear ?x)) (not (handempty)) (not (on ?x ?y)))))
"""

FOUR_BLOCKS = """(define (problem blocks-4-0) (:domain blocks) (:objects d b a c)
 (:init (clear c) (clear a) (clear b) (clear d) (ontable c) (ontable a) (ontable b) (ontable d) (handempty))
 (:goal (and (on d c) (on c b) (on b a))))
"""

MOVING = """(define (domain moving) (:requirements :typing :durative-actions)
 (:types robot zone) (:predicates (at ?r - robot ?z - zone) (next ?a ?b - zone))
 (:durative-action move :parameters (?r - robot ?from ?to - zone) :duration (= ?duration 5)
  :condition (and (at start (at ?r ?from)) (at start (next ?from ?to)))
  :effect (and (at start (not (at ?r ?from))) (at end (at ?r ?to)))))
"""

TWO_ROOMS = """(define (problem two-zones) (:domain moving) (:objects r1 - robot a b c - zone)
 (:init (at r1 a) (next a b) (next b c)) (:goal (at r1 c)))
"""

PLACES = """(define (domain d) (:predicates (at ?r ?z))
 (:action move :parameters (?r ?z)
  :effect (and (at ?r ?z) (decrease (fuel) 1))))
"""


def parameter(name: str) -> PddlFormula:
    return PddlFormula("parameter", name=name)


def fact(name: str, *arguments: PddlFormula) -> PddlFormula:
    return PddlFormula("fluent", arguments, name)


R, FROM, TO = parameter("r"), parameter("from"), parameter("to")
B = PddlFormula("object", name="b")
AT_Z = PddlEffect(fact("at", R, parameter("z")), TRUE)
CLEANED_Z = PddlEffect(fact("dirty", parameter("z")), FALSE)
CLEANED = PddlEffect(fact("dirty", TO), FALSE)
FUEL_LEFT = PddlFormula("<=", (PddlFormula("number", number=1), fact("fuel")))


def robot_task(
    *effects: PddlEffect, conditions: tuple[PddlFormula, ...] = (), **initial: dict[tuple[str, ...], int]
) -> PddlTask:
    """A robot that moves between zones, with `effects` beside those of the move."""
    move = PddlLiftedAction(
        "move",
        (("r", "robot"), ("from", "zone"), ("to", "zone")),
        (fact("at", R, FROM), *conditions),
        (PddlEffect(fact("at", R, FROM), FALSE), PddlEffect(fact("at", R, TO), TRUE), *effects),
    )
    first: dict[str, dict[tuple[str, ...], int]] = {
        "at": {("r1", "a"): 1, ("r2", "b"): 1},
        "dirty": {},
        "fuel": {(): 3},
    }
    return PddlTask(
        "zones",
        {"robot": None, "zone": None},
        {"r1": "robot", "r2": "robot", "a": "zone", "b": "zone"},
        {
            "at": PddlFluent("at", (("r", "robot"), ("z", "zone"))),
            "dirty": PddlFluent("dirty", (("z", "zone"),)),
            "fuel": PddlFluent("fuel", (), is_numeric=True),
        },
        (move,),
        first | initial,
        (fact("at", PddlFormula("object", name="r1"), B),),
    )


def model_of(task: PddlTask, *groups: str, ranges: tuple[str, ...] = (), domain: str = PLACES) -> ImportedModel:
    texts = PddlText("domain.pddl", domain), PddlText("problem.pddl", "")
    return imported_model(task, *texts, PddlImportOptions(groups, ranges=ranges))


def imported(task: PddlTask, *groups: str, ranges: tuple[str, ...] = ()) -> str:
    return model_of(task, *groups, ranges=ranges).text


def errors_of(task: PddlTask, *groups: str) -> list[str]:
    with pytest.raises(InputError) as raised:
        imported(task, *groups)
    return [f"{each.place} {each.slug} {each.message}" for each in raised.value.diagnostics]


def heads(errors: list[str]) -> list[str]:
    """Return place and slug of each error."""
    return [" ".join(each.split()[:2]) for each in errors]


def operations(model: BehaviorModel) -> list[str]:
    return [operation.name for operation in model.operations]


def test_facts_are_booleans_and_a_move_to_the_same_zone_is_left_out() -> None:
    model = read_model(imported(robot_task()))
    assert operations(model) == ["move.r1.a.b", "move.r1.b.a", "move.r2.a.b", "move.r2.b.a"]
    assert dict(model.nominal_state) == {"at.r1.a": True, "at.r1.b": False, "at.r2.a": False, "at.r2.b": True}


def test_a_group_is_one_variable_that_needs_no_extra_value_if_one_holds_always() -> None:
    model = read_model(imported(robot_task(), "at.z"))
    assert dict(model.nominal_state) == {"at.r1": "a", "at.r2": "b"}
    assert [v.domain.values for v in model.variables] == [("a", "b"), ("a", "b")]
    assert operations(model) == ["move.r1.a.b", "move.r1.b.a", "move.r2.a.b", "move.r2.b.a"]


def test_groups_that_are_proved_need_no_option() -> None:
    proved = replace(robot_task(), exclusive={"at": 1})
    assert model_of(proved).warnings == ()
    word = "# Not proved to have one value at a time: at\n"
    assert imported(proved) == imported(robot_task(), "at").replace(word, "")


def test_a_group_without_a_proof_is_a_warning_at_an_action_that_may_add_a_second_value(wording: Wording) -> None:
    domain = "(define (domain d) (:predicates (at ?r ?z))\n (:action move :parameters (?r ?z)\n  :effect (at ?r ?z)))"
    appearing = replace(robot_task(), actions=(PddlLiftedAction("move", (("r", "robot"), ("z", "zone")), (), (AT_Z,)),))
    (warning,) = model_of(appearing, "at.z", domain=domain).warnings
    assert (str(warning.place), warning.slug, warning.severity) == (
        "domain.pddl:3:12",
        "pddl-group-unproved",
        "warning",
    )
    wording(warning.message)
    proved = (InvariantPart("at", (0,), 1), InvariantPart("dirty", (0,), None))
    assert model_of(replace(appearing, invariants=(proved,)), "at.z").warnings == ()


def test_a_group_may_have_one_parameter_only(wording: Wording) -> None:
    last = errors_of(robot_task(), "at.r", "at.z")[-1]
    assert heads([last]) == ["--group bad-option"]
    wording(last)


def test_an_action_that_adds_a_value_beside_the_one_that_it_requires_contradicts_a_group(wording: Wording) -> None:
    move = replace(robot_task().actions[0], effects=(PddlEffect(fact("at", R, TO), TRUE),))
    kept = replace(robot_task(), actions=(move,))
    errors = errors_of(kept, "at")
    assert heads(errors) == ["domain.pddl:3:17 pddl-not-expressible"]
    wording(errors)
    same = PddlFormula("equals", (FROM, TO))
    together = replace(move, conditions=(*move.conditions, same))
    assert "operations: {}" in imported(replace(kept, actions=(together,)), "at")  # it moves nowhere


def test_two_values_that_are_required_of_one_group_are_equal() -> None:
    task = robot_task()
    both = (fact("at", R, FROM), fact("at", R, TO), fact("dirty", TO))
    mop = PddlLiftedAction("mop", task.actions[0].parameters, both, (CLEANED,))
    text = imported(replace(task, actions=(*task.actions, mop), exclusive={"at": 1}))
    assert "  mop[r in robot, from in zone, to in zone]:\n    where: from == to" in text


def test_parameters_differ_where_the_condition_contradicts_itself_for_one_object() -> None:
    other = PddlFormula("not", (fact("dirty", FROM),))
    dirty = PddlLiftedAction("mop", (("from", "zone"), ("to", "zone")), (fact("dirty", TO), other), (CLEANED,))
    assert "where: from != to" in imported(replace(robot_task(), actions=(dirty,)))
    known = PddlFormula("not", (PddlFormula("equals", (FROM, TO)),))
    apart = replace(dirty, conditions=(known, *dirty.conditions))
    assert "where: from != to\n" in imported(replace(robot_task(), actions=(apart,)))


def test_facts_that_exclude_each_other_by_an_invariant_exclude_a_case_for_one_object() -> None:
    deleted = (PddlEffect(fact("dirty", FROM), FALSE), PddlEffect(fact("wet", TO), FALSE))
    effects = (*deleted, PddlEffect(fact("dirty", TO), TRUE))
    conditions = (fact("dirty", FROM), fact("wet", TO))
    mop = PddlLiftedAction("mop", (("from", "zone"), ("to", "zone")), conditions, effects)
    wet = PddlFluent("wet", (("z", "zone"),))
    task = replace(robot_task(wet={}), actions=(mop, *robot_task().actions))
    task = replace(task, fluents={**task.fluents, "wet": wet})
    assert "mop_2[from in zone]" in imported(task)
    excluded = (InvariantPart("dirty", (0,), None), InvariantPart("wet", (0,), None))
    text = imported(replace(task, invariants=(excluded,)))
    assert "mop_2" not in text
    assert "where: from != to" in text


def test_a_case_for_one_object_that_no_table_admits_is_left_out() -> None:
    kinds = {name: PddlFluent(name, (("z", "zone"),)) for name in ("first", "second")}
    swap = PddlLiftedAction(
        "swap",
        (("from", "zone"), ("to", "zone")),
        (fact("first", FROM), fact("second", TO)),
        (PddlEffect(fact("dirty", FROM), TRUE), PddlEffect(fact("dirty", TO), FALSE)),
    )
    task = robot_task(first={("a",): 1}, second={("b",): 1})
    text = imported(replace(task, actions=(swap,), fluents={**task.fluents, **kinds}))
    assert "swap_2" not in text
    twice = robot_task(first={("a",): 1}, second={("a",): 1, ("b",): 1})
    assert "swap_2" in imported(replace(twice, actions=(swap,), fluents={**task.fluents, **kinds}))


def test_errors_of_the_reader_come_with_those_of_groups_and_ranges() -> None:
    problem = PddlText("domain.pddl", PLACES)
    fault = problem.error("a product", problem.action("move"))
    burning = PddlEffect(fact("fuel"), PddlFormula("number", number=1), "decrease")
    task = robot_task(burning, conditions=(PddlFormula("<", (PddlFormula("number"), fact("dirty", FROM))),))
    unread = replace(task, errors=(fault,), goals=(PddlFormula("<", (fact("fuel"), PddlFormula("number"))),))
    assert [each.split()[:2] for each in errors_of(unread, "at.q", "fuel")] == [
        ["domain.pddl:2:11", "pddl-not-expressible"],
        ["domain.pddl:3:38", "pddl-not-expressible"],
        ["--group", "bad-option"],
        ["--group", "bad-option"],
    ]


def test_an_error_of_the_model_is_reported_at_the_action_of_the_domain(wording: Wording) -> None:
    made = model_of(robot_task())
    line = 1 + made.text.splitlines().index("  move[r in robot, from in zone, to in zone]:")
    model_error = Diagnostic(Slug.TOO_MANY_INSTANCES, "`move` has too many instances", Place("model.yaml", line + 1, 5))
    moved = made.at_origin(model_error)
    assert diagnostic_heads(str(moved)) == ["domain.pddl:2:11: error[too-many-instances]"]
    wording(moved)


def test_a_group_that_holds_twice_at_first_is_refused_where_it_was_asked_for(wording: Wording) -> None:
    twice = robot_task(at={("r1", "a"): 1, ("r1", "b"): 1})
    errors = [*errors_of(twice, "at"), errors_of(twice, "att", "at.q")[0]]
    assert heads(errors) == ["problem.pddl pddl-not-expressible", "--group bad-option"]
    wording(errors)


def test_an_effect_with_a_condition_makes_a_case_for_each_answer() -> None:
    cleaning = PddlEffect(fact("dirty", TO), FALSE, condition=fact("dirty", TO))
    text = imported(robot_task(cleaning, dirty={("b",): 1}), "at")
    assert "at.r == from && dirty.to == true" in text
    assert "at.r == from && dirty.to == false" in text
    read_model(text)


def test_an_addition_precedes_a_deletion_of_the_same_fact() -> None:
    moved_dirt = (PddlEffect(fact("dirty", FROM), FALSE), PddlEffect(fact("dirty", TO), TRUE))
    model = read_model(imported(robot_task(*moved_dirt, dirty={("a",): 1})))
    assert operations(model)[:2] == ["move.r1.a.b", "move.r1.b.a"]
    assert "move_2.r1.a" in operations(model)


def test_conditions_bound_numbers_and_a_range_is_asked_for_otherwise(wording: Wording) -> None:
    burning = PddlEffect(fact("fuel"), PddlFormula("number", number=1), "decrease")
    enough = PddlFormula("<=", (PddlFormula("number", number=1), fact("fuel")))
    assert "fuel: {domain: 0..3, initial: 3}" in imported(robot_task(burning, conditions=(enough,)))
    positive = PddlFormula("not", (PddlFormula("equals", (fact("fuel"), PddlFormula("number"))),))
    unbounded = robot_task(burning, conditions=(positive,))
    errors = errors_of(unbounded)
    assert heads(errors) == ["domain.pddl:3:38 pddl-not-expressible"]
    wording(errors)
    assert "fuel: {domain: 0..9, initial: 3}" in imported(unbounded, ranges=("fuel=0..9",))
    for wrong in (("fuel=3..0",), ("fuel",), ("fule=0..3",), ("fuel=0..3", "fuel=0..4")):
        with pytest.raises(InputError) as raised:
            imported(unbounded, ranges=wrong)
        assert [each.place.file for each in raised.value.diagnostics] == ["--range"]


def test_functions_that_no_action_changes_are_constants() -> None:
    task = robot_task(size={("a",): 2, ("b",): 1})
    size = PddlFluent("size", (("z", "zone"),), is_numeric=True)
    small = PddlFormula("<=", (fact("size", TO), PddlFormula("number", number=2)))
    (move,) = task.actions
    move = replace(move, conditions=(*move.conditions, small))
    text = imported(replace(task, actions=(move,), fluents={**task.fluents, "size": size}))
    assert '  size[z in zone]: {where: "z == b", domain: 1..2, initial: 1, source: constant}\n' in text
    assert '  size[z_2 in zone]: {where: "z_2 != b", domain: 1..2, initial: 2, source: constant}\n' in text
    assert [v.name for v in read_model(text).variables if v.source == "constant"] == ["size.b", "size.a"]


def test_functions_that_no_condition_reads_are_left_out(wording: Wording) -> None:
    cost = PddlEffect(fact("fuel"), PddlFormula("number", number=1), "increase")
    text = imported(robot_task(cost))
    assert "fuel:" not in text
    wording([line for line in text.splitlines() if "fuel" in line])


def test_a_wrong_place_is_within_its_action() -> None:
    text = PddlText("d", PLACES)
    assert str(text.inside_action("move", "at")) == "d:3:17"
    assert str(text.inside_action("move", "absent")) == "d:2:11"
    assert str(text.inside_action("absent", "at")) == "d"


@pytest.mark.slow
def test_files_become_models_with_plans_of_the_published_length(scbm: Callable[..., Any], tmp_path: Path) -> None:
    paths = [tmp_path / name for name in ("domain.pddl", "problem.pddl", "model.yaml")]
    for path, text in zip(paths, (BLOCKS, FOUR_BLOCKS), strict=False):
        path.write_text(text)
    ran = scbm("import", "pddl", paths[0], paths[1], "-o", paths[2], "--group", "on")
    assert (ran.code, ran.err) == (0, "")
    plan = scbm("plan", paths[2], "--goal", "goal")
    assert plan.out.startswith("6 operations")
    refused = scbm("import", "pddl", paths[0], paths[1], "-o", paths[0])
    assert (refused.code, paths[0].read_text()) == (2, BLOCKS)
    assert scbm("import", "pddl", paths[0], paths[1], "-o", paths[2], "--group", "on").code == 0
    finished = f"{paths[2].read_text()}# finished by hand\n"
    paths[2].write_text(finished)
    refused = scbm("import", "pddl", paths[0], paths[1], "-o", paths[2], "--group", "on")
    assert (refused.code, paths[2].read_text()) == (2, finished)
    assert refused.err.startswith("--out: error[bad-option]")


def test_a_problem_of_another_domain_is_an_error_in_the_problem(wording: Wording) -> None:
    domain, problem = (
        PddlText("d", "(define (domain Places))"),
        PddlText("p", "(define (problem x)\n (:domain halls) (:init) (:goal (and)))"),
    )
    with pytest.raises(InputError) as raised:
        read_pddl(domain, problem)
    wrong_domain = str(raised.value.diagnostics[0])
    assert diagnostic_heads(wrong_domain) == ["p:2:11: error[bad-pddl]"]
    wording(wrong_domain)


@pytest.mark.slow
def test_a_doubtful_group_is_a_warning_and_the_model_is_written(scbm: Callable[..., Any], tmp_path: Path) -> None:
    domain, problem, model = (tmp_path / name for name in ("domain.pddl", "problem.pddl", "model.yaml"))
    problem.write_text(TWO_ROOMS)
    domain.write_text(MOVING.replace("(at start (at ?r ?from)) ", ""))
    ran = scbm("import", "pddl", domain, problem, "-o", model, "--group", "at")
    assert (ran.code, model.exists(), "domain.pddl:5:56: warning[pddl-group-unproved]" in ran.err) == (0, True, True)


def test_requests_carry_arguments_if_that_is_asked_for() -> None:
    task = robot_task()
    mop = PddlLiftedAction("mop", (("r", "robot"), ("from", "robot"), ("z", "zone")), (), (CLEANED_Z,))
    texts = PddlText("domain.pddl", PLACES), PddlText("problem.pddl", "")
    options = PddlImportOptions(("at",), ("r",), arguments=True)
    text = imported_model(replace(task, actions=(*task.actions, mop)), *texts, options).text
    model = read_model(text)
    (first, *_) = model.resources
    names = ("command", "from", "to", "z")
    assert [*first.request] == [f"robot_controller_{each}.r1" for each in names]
    assert "  robot_controller_from[robot]: {domain: [zone, robot, none], initial: none}\n" in text
    assert (
        "      robot_controller_from.r: from\n      robot_controller_to.r: none\n      robot_controller_z.r: z\n"
        in text
    )


def lasting(action: PddlLiftedAction, seconds: int) -> PddlLiftedAction:
    length = PddlFormula("number", number=seconds)
    return replace(action, duration=PddlDuration(length, length))


def test_deadlines_cover_the_longest_latency_of_their_resource() -> None:
    task = robot_task()
    mop = PddlLiftedAction("mop", (("r", "robot"), ("z", "zone")), (), (CLEANED_Z,))
    actions = (lasting(mop, 1), lasting(task.actions[0], 60), replace(mop, name="wipe"))
    texts = PddlText("domain.pddl", PLACES), PddlText("problem.pddl", "")
    text = imported_model(replace(task, actions=actions), *texts, PddlImportOptions(("at",), ("r",))).text
    assert "latency: {uniform: [1 s, 60 s]}" in text
    assert [line for line in text.splitlines() if "deadline" in line] == ["    deadline: 120 s"] * 3
    own = imported_model(replace(task, actions=actions), *texts, PddlImportOptions(("at",))).text
    assert [line for line in own.splitlines() if "deadline" in line] == ["    deadline: 2 s", "    deadline: 120 s"]


def test_a_parameter_whose_actions_have_a_resource_already_is_an_error(wording: Wording) -> None:
    texts = PddlText("domain.pddl", PLACES), PddlText("problem.pddl", "")
    with pytest.raises(InputError) as raised:
        imported_model(robot_task(), *texts, PddlImportOptions(("at",), ("robot", "zone", "crane")))
    assert [(str(each.place), each.slug) for each in raised.value.diagnostics] == [("--resource", Slug.BAD_OPTION)] * 2
    wording(each.message for each in raised.value.diagnostics)


def test_a_misspelt_type_of_a_resource_is_suggested() -> None:
    texts = PddlText("domain.pddl", PLACES), PddlText("problem.pddl", "")
    with pytest.raises(InputError) as raised:
        imported_model(robot_task(), *texts, PddlImportOptions(("at",), ("robbot",)))
    assert [each.remedy for each in raised.value.diagnostics] == ["did you mean `robot`?"]


@pytest.mark.slow
def test_durations_become_latencies() -> None:
    texts = PddlText("domain.pddl", MOVING), PddlText("problem.pddl", TWO_ROOMS)
    text = imported_model(read_pddl(*texts), *texts, PddlImportOptions(("at",), ("r",))).text
    model = read_model(text)
    assert [resource.name for resource in model.resources] == ["robot_controller.r1"]
    assert "simulation: {latency: 5 s}" in text
    assert operations(model) == ["move.r1.a.b", "move.r1.b.c"]


FAULTY = """(define (domain faulty)
 (:types zone robot)
 (:predicates (at ?r - robot ?z - zone) (open ?z - zone) (tall ?z - zone))
 (:functions (fuel) (load ?z - zone))
 (:derived (tall ?z - zone) (open ?z))
 (:action burn :parameters (?z - zone)
  :precondition (and (preference p1 (open ?z)) (> (fuel) 0) (> (load ?z) 1))
  :effect (and (decrease (fuel) (* (load ?z) 2)) (increase (load ?z) 1.5) (not (open ?z))))
 (:durative-action wait :parameters (?z - zone ?r - robot) :duration (= ?duration (+ (fuel) 2))
  :condition (at start (at ?r ?z))
  :effect (and (at end (scale-up (fuel) 2)) (increase (fuel) (* #t 1)) (at end (not (at ?r ?z))))))
"""

FAULTY_PROBLEM = """(define (problem p) (:domain faulty)
 (:objects a b - zone q - robot)
 (:init (at q a) (at q b) (= (fuel) 1.5)
  (at 5 (open b)))
 (:goal (at q b))
 (:constraints (always (open a))) (:metric minimize (+ (is-violated p1) (fuel))))
"""


@pytest.mark.slow
def test_all_that_a_model_cannot_express_is_reported_at_once(wording: Wording) -> None:
    texts = PddlText("d", FAULTY), PddlText("p", FAULTY_PROBLEM)
    options = PddlImportOptions(("at",), ("crane",), ("load=0..9",))
    with pytest.raises(InputError) as raised:
        imported_model(read_pddl(*texts), *texts, options)
    expected = "d:5:3 d:7:23 d:8:27 d:8:34 d:8:70 d:9:60 d:11:25 d:11:65 p:3:3 p:3:19 p:3:37 p:4:4 p:6:3 --resource"
    assert [str(each.place) for each in raised.value.diagnostics] == expected.split()
    wording(f"{each.place} {each.message}" for each in raised.value.diagnostics)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("domain", "slug", "place"),
    [
        ("(define (domain x)", Slug.BAD_PDDL, "d:1:1"),
        ("(define (domain x) (:predicates (a)) (:derived (a) (a)))", Slug.PDDL_NOT_EXPRESSIBLE, "d:1:39"),
        ("(define (domain x) (:types t) (:functions (f) - t))", Slug.PDDL_NOT_EXPRESSIBLE, "d:1:49"),
        (
            "(define (domain x) (:types t - u u v) (:predicates (a ?x - (either t v))))",
            Slug.PDDL_NOT_EXPRESSIBLE,
            "d:1:61",
        ),
    ],
)
def test_files_that_cannot_be_read_are_located(domain: str, slug: Slug, place: str) -> None:
    texts = PddlText("d", domain), PddlText("p", "(define (problem y) (:domain x) (:init) (:goal (and)))")
    with pytest.raises(InputError) as raised:
        imported_model(read_pddl(*texts), *texts, PddlImportOptions())
    (error,) = raised.value.diagnostics
    assert (error.slug, str(error.place)) == (slug, place)


EITHER = """(define (domain yard)
 (:types truck crane crate place)
 (:functions (distance ?a ?b - place) (speed ?t - truck))
 (:predicates (at ?x - (either truck crane) ?p - place) (truck ?p - place))
 (:durative-action drive :parameters (?t - truck ?a ?b - place)
  :duration (/ (distance ?a ?b) (speed ?t))
  :condition (at start (at ?t ?a))
  :effect (and (at start (not (at ?t ?a))) (at end (at ?t ?b)))))
"""
YARD = """(define (problem yard-1) (:domain yard) (:objects t1 t2 - truck a b - place c1 - crane)
 (:init (at t1 a) (at t2 a) (at c1 b) (= (distance a b) 90) (= (distance b a) 30) (= (speed t1) 10) (= (speed t2) 4))
 (:goal (at t1 b)))
"""


@pytest.mark.slow
def test_a_type_above_them_stands_for_either_of_several_types() -> None:
    domain = PddlText("d", EITHER.replace("(/ (distance ?a ?b) (speed ?t))", "(= ?duration 5)"))
    problem = PddlText("p", YARD)
    text = imported_model(read_pddl(domain, problem), domain, problem, PddlImportOptions()).text
    assert "  truck_or_crane: []\n  truck: {objects: [t1, t2], of: truck_or_crane}\n" in text
    assert "  at[x in truck_or_crane]: {" in text
    assert operations(read_model(text))[0] == "drive.t1.a.b"


@pytest.mark.parametrize(
    ("duration", "latency", "deadline"),
    [
        ("(= ?duration (* 2 (distance ?a ?b)))", "{uniform: [60 s, 180 s]}", "360 s"),
        ("(= ?duration (/ (distance ?a ?b) (speed ?t)))", "{uniform: [3 s, 22500 ms]}", "45 s"),
        ("(and (>= ?duration 0.5) (<= ?duration (+ 1 (distance b a))))", "{uniform: [500 ms, 31 s]}", "62 s"),
        ("(<= ?duration (- (distance ?a ?b) 20))", "{uniform: [0 s, 70 s]}", "140 s"),
    ],
)
def test_durations_are_terms_over_constant_functions(
    duration: str, latency: str, deadline: str, wording: Wording
) -> None:
    constants = "(:constants a b - place)\n (:functions"
    domain = EITHER.replace("(/ (distance ?a ?b) (speed ?t))", duration).replace("(:functions", constants)
    texts = PddlText("d", domain), PddlText("p", YARD.replace(" a b - place", ""))
    text = imported_model(read_pddl(*texts), *texts, PddlImportOptions()).text
    assert (f"simulation: {{latency: {latency}}}" in text, f"deadline: {deadline}\n" in text) == (True, True)
    assert "distance:" not in text
    wording([line for line in text.splitlines() if "distance" in line])
    read_model(text)


@pytest.mark.parametrize(
    "changed",
    [
        ("(= (speed t1) 10) (= (speed t2) 4)", "(= (speed t1) 0)"),
        ("(= (speed t1) 10) (= (speed t2) 4)", ""),
        ("(= (distance a b) 90)", "(= (distance a b) -90)"),
    ],
    ids=["a speed of zero", "no speed", "a negative distance"],
)
def test_durations_without_a_value_are_errors_at_the_action(changed: tuple[str, str], wording: Wording) -> None:
    domain = EITHER.replace("(/ (distance ?a ?b) (speed ?t))", "(= ?duration (/ (distance ?a ?b) (speed ?t)))")
    texts = PddlText("d", domain), PddlText("p", YARD.replace(*changed))
    with pytest.raises(InputError) as raised:
        imported_model(read_pddl(*texts), *texts, PddlImportOptions())
    (error,) = raised.value.diagnostics
    assert str(error.place) == "d:6:3"
    wording(error.message)


ROADS = """(define (domain roads)
 (:types agv - machine station - place)
 (:functions (fuel ?a - agv) (full ?a - agv) (way ?x ?y - place))
 (:predicates (at ?a - agv ?s - station) (road ?x ?y - station))
 (:action go :parameters (?a - agv ?x ?y - station)
  :precondition (and (at ?a ?x) (road ?x ?y) (>= (fuel ?a) (way ?x ?y)))
  :effect (and (not (at ?a ?x)) (at ?a ?y) (decrease (fuel ?a) (way ?x ?y))))
 (:action fill :parameters (?a - agv) :precondition (< (fuel ?a) (full ?a)) :effect (assign (fuel ?a) (full ?a))))
"""
ROADS_PROBLEM = """(define (problem roads-1) (:domain roads) (:objects a1 - agv s1 s2 s3 - station)
 (:init (at a1 s1) (road s1 s2) (road s2 s3) (= (fuel a1) 2) (= (full a1) 6) (= (way s1 s2) 2) (= (way s2 s3) 5))
 (:goal (at a1 s3)))
"""


def roads(*changes: tuple[str, str]) -> str:
    domain, problem = ROADS, ROADS_PROBLEM
    for old, new in changes:
        domain, problem = domain.replace(old, new), problem.replace(old, new)
    texts = PddlText("d", domain), PddlText("p", problem)
    return imported_model(read_pddl(*texts), *texts, PddlImportOptions()).text


def test_constant_functions_bound_numbers_and_have_values_where_the_problem_gives_them() -> None:
    model = read_model(roads())
    assert {v.name: str(v.domain) for v in model.variables} == {
        "at.a1": "[s1, s2, s3]",
        "fuel.a1": "0..6",
        "full.a1": "6..6",
        "way.s1.s2": "2..5",
        "way.s2.s3": "2..5",
    }
    assert operations(model) == ["go.a1.s1.s2", "go.a1.s2.s3", "fill.a1"]
    solved = Planner(model).plan(model.nominal_state, model.goals[0][1])
    assert isinstance(solved, Solved)
    assert list(solved.plan) == ["go.a1.s1.s2", "fill.a1", "go.a1.s2.s3"]


def test_an_action_requires_the_values_that_it_reads() -> None:
    text = roads(("(road ?x ?y) (>=", "(>="))
    assert "    where: way_given(x, y)\n" in text
    assert operations(read_model(text)) == ["go.a1.s1.s2", "go.a1.s2.s3", "fill.a1"]


@pytest.mark.parametrize(
    ("change", "place"),
    [
        (("(= (fuel a1) 2)", ""), "p:2:3"),
        (("(>= (fuel ?a) (way ?x ?y))", "(or (= ?x ?y) (>= (fuel ?a) (way ?y ?x)))"), "d:6:75"),
        (("(:goal (at a1 s3))", "(:goal (> (way s1 s3) 1))"), "p:3:3"),
    ],
)
def test_values_that_cannot_be_left_open_are_errors(change: tuple[str, str], place: str) -> None:
    with pytest.raises(InputError) as raised:
        roads(change)
    errors = [each for each in raised.value.diagnostics if "bounds" not in each.message]
    assert [(str(each.place), each.slug) for each in errors] == [(place, Slug.PDDL_NOT_EXPRESSIBLE)]


@pytest.mark.parametrize("given", ["fuel=0..65536", f"fuel=0..{'9' * 5000}", f"fuel={10**18}..{10**18 + 1}"])
def test_a_range_with_too_many_values_is_an_error_of_the_option(given: str) -> None:
    with pytest.raises(InputError) as raised:
        imported(robot_task(conditions=(FUEL_LEFT,)), ranges=(given,))
    (error,) = raised.value.diagnostics
    assert (str(error.place), error.slug) == ("--range", Slug.BAD_OPTION)


def test_a_missing_library_is_named_with_the_command_that_installs_it(
    scbm: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def missing(name: str) -> ModuleType:
        if name.startswith("unified_planning"):
            raise ModuleNotFoundError(name=name)
        return import_module(name)

    monkeypatch.setattr("scbm.pddl.pddl_reader.import_module", missing)
    (tmp_path / "d.pddl").write_text(BLOCKS)
    ran = scbm("import", "pddl", tmp_path / "d.pddl", tmp_path / "d.pddl", "-o", tmp_path / "m.yaml")
    assert (ran.code, "pip install 'scbm[pddl]'" in ran.err) == (2, True)
