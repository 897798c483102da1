"""Models for problems of PDDL, from values as the reader makes them; and whole files, which need `unified-planning`."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from scbm.files import read_model
from scbm.files.pddl import PddlImportOptions, PddlText, imported_model, read_pddl
from scbm.files.pddl.pddl_task import FALSE, TRUE, PddlEffect, PddlFluent, PddlFormula, PddlLiftedAction, PddlTask
from scbm.model import BehaviorModel, InputError, Slug

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


def imported(task: PddlTask, *groups: str, ranges: tuple[str, ...] = ()) -> str:
    texts = PddlText("domain.pddl", PLACES), PddlText("problem.pddl", "")
    return imported_model(task, *texts, PddlImportOptions(groups, ranges=ranges))


def errors_of(task: PddlTask, *groups: str) -> list[str]:
    with pytest.raises(InputError) as raised:
        imported(task, *groups)
    return [f"{each.place} {each.slug} {each.message}" for each in raised.value.diagnostics]


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
    assert imported(proved) == imported(robot_task(), "at")


def test_a_group_that_holds_twice_at_first_is_refused_where_it_was_asked_for() -> None:
    twice = robot_task(at={("r1", "a"): 1, ("r1", "b"): 1})
    fault = "`at` cannot be one variable: it holds for a and b at first"
    assert errors_of(twice, "at") == [f"problem.pddl pddl-not-expressible {fault}"]
    assert errors_of(twice, "att", "at.q")[0].startswith("--group bad-option `att` is no predicate")


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


def test_conditions_bound_numbers_and_a_range_is_asked_for_otherwise() -> None:
    burning = PddlEffect(fact("fuel"), PddlFormula("number", number=1), "decrease")
    enough = PddlFormula("<=", (PddlFormula("number", number=1), fact("fuel")))
    assert "fuel: {domain: 0..3, initial: 3}" in imported(robot_task(burning, conditions=(enough,)))
    positive = PddlFormula("not", (PddlFormula("equals", (fact("fuel"), PddlFormula("number"))),))
    unbounded = robot_task(burning, conditions=(positive,))
    assert errors_of(unbounded) == ["domain.pddl:3:38 pddl-not-expressible nothing bounds `fuel`, which move changes"]
    assert "fuel: {domain: 0..9, initial: 3}" in imported(unbounded, ranges=("fuel=0..9",))


def test_functions_that_no_condition_reads_are_left_out() -> None:
    cost = PddlEffect(fact("fuel"), PddlFormula("number", number=1), "increase")
    text = imported(robot_task(cost))
    assert "# Left out, since no condition reads it: fuel" in text
    assert "fuel:" not in text


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


@pytest.mark.slow
def test_durations_become_latencies() -> None:
    texts = PddlText("domain.pddl", MOVING), PddlText("problem.pddl", TWO_ROOMS)
    text = imported_model(read_pddl(*texts), *texts, PddlImportOptions(("at",), ("r",)))
    model = read_model(text)
    assert [resource.name for resource in model.resources] == ["robot_controller.r1"]
    assert "simulation: {latency: 5 s}" in text
    assert operations(model) == ["move.r1.a.b", "move.r1.b.c"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("domain", "slug", "place"),
    [
        ("(define (domain x)", Slug.BAD_PDDL, "d:1:19"),
        ("(define (domain x) (:predicates (a)) (:derived (a) (a)))", Slug.PDDL_NOT_EXPRESSIBLE, "d:1:39"),
    ],
)
def test_files_that_cannot_be_read_are_located(domain: str, slug: Slug, place: str) -> None:
    with pytest.raises(InputError) as raised:
        read_pddl(PddlText("d", domain), PddlText("p", ""))
    (error,) = raised.value.diagnostics
    assert (error.slug, str(error.place)) == (slug, place)


def test_a_missing_library_is_named_with_the_command_that_installs_it(
    scbm: Callable[..., Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    def missing(name: str) -> ModuleType:
        if name.startswith("unified_planning"):
            raise ModuleNotFoundError(name=name)
        return import_module(name)

    monkeypatch.setattr("scbm.files.pddl.pddl_reader.import_module", missing)
    (tmp_path / "d.pddl").write_text(BLOCKS)
    ran = scbm("import", "pddl", tmp_path / "d.pddl", tmp_path / "d.pddl", "-o", tmp_path / "m.yaml")
    assert (ran.code, "pip install 'scbm[pddl]'" in ran.err) == (2, True)
