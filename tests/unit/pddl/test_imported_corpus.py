"""The problems of `tests/models/imported_pddl`: the models have the right operations, and plans of the right length."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest

from scbm.files import read_model
from scbm.model import InputError
from scbm.pddl import PddlImportOptions, PddlText, imported_model, read_pddl
from scbm.planning import Planner, Solved, Unsolvable

# the reader of `unified-planning` 1.3 calls old names of a library of its own
pytestmark = pytest.mark.filterwarnings("ignore:.* deprecated - use:DeprecationWarning")

FOLDER = Path(__file__).parents[2] / "models" / "imported_pddl"


class Expected(NamedTuple):
    """The operations of the model, the length of its shortest plans, and the ranges of the import."""

    operations: int
    length: int
    ranges: tuple[str, ...] = ()


PROBLEMS = {
    "carousel": Expected(24, 2),
    "power_during_an_action": Expected(2, 2),
    "predicate_called_as_a_parameter": Expected(6, 4),
    "predicates_called_as_states": Expected(2, 2),
    "pushed_box": Expected(528 + 480, 2),
    "sums_for_equal_tanks": Expected(6, 1),
    "tanks_that_are_poured": Expected(12, 7, ("level=0..8",)),
    "types_below_two_types": Expected(12, 5),
}


def imported(domain: str, problem: str, *, resources: tuple[str, ...] = (), ranges: tuple[str, ...] = ()) -> str:
    texts = PddlText("domain.pddl", domain), PddlText("problem.pddl", problem)
    return imported_model(read_pddl(*texts), *texts, PddlImportOptions((), resources, ranges)).text


def found(text: str) -> tuple[int, int]:
    """Return the number of operations of a model, and the length of its shortest plans."""
    model = read_model(text)
    answer = Planner(model).plan(model.nominal_state, model.goals[0][1])
    assert isinstance(answer, Solved), text
    return len(model.operations), len(answer.plan)


@pytest.mark.parametrize("name", PROBLEMS)
def test_an_imported_problem_has_these_operations_and_plans(name: str) -> None:
    domain, problem = ((FOLDER / f"{name}.{kind}.pddl").read_text(encoding="utf-8") for kind in ("domain", "problem"))
    expected = PROBLEMS[name]
    assert found(imported(domain, problem, ranges=expected.ranges)) == expected[:2]


def test_each_problem_is_tested() -> None:
    assert sorted({path.name.partition(".")[0] for path in FOLDER.iterdir()}) == sorted(PROBLEMS)


NAMES = """(define (domain depot) (:requirements :typing :adl :durative-actions :fluents)
 (:types {kind} - item zone) (:constants {object} - zone)
 (:predicates ({flag}) (done ?{argument} - {kind}) ({at} ?r - {kind} ?z - zone) ({table} ?a ?b - zone)
  ({set} ?z - zone))
 (:functions ({fuel} ?r - {kind}))
 (:action {move} :parameters (?{parameter} - {kind} ?b ?c - zone)
  :precondition (and ({at} ?{parameter} ?b) (not (done ?{parameter})) ({table} ?b ?c) ({set} ?c)
   (>= ({fuel} ?{parameter}) 1) (forall (?{variable} - zone) (or ({set} ?{variable}) (= ?{variable} ?b)
    (not ({at} ?{parameter} ?{variable})))))
  :effect (and (not ({at} ?{parameter} ?b)) ({at} ?{parameter} ?c) (decrease ({fuel} ?{parameter}) 1) ({flag})))
 (:durative-action {mop} :parameters (?r - {kind} ?command - zone) :duration (= ?duration 3)
  :condition (and (at start ({at} ?r ?command)) (at start ({flag}))) :effect (at end (done ?r))))
"""
NAMES_PROBLEM = """(define (problem {problem}) (:domain depot) (:objects r1 r2 - {kind} z2 z3 - zone)
 (:init ({at} r1 {object}) ({at} r2 z2) ({table} {object} z2) ({table} z2 z3) ({set} z2) ({set} z3)
  (= ({fuel} r1) 5) (= ({fuel} r2) 4)) (:goal (and (done r1) ({at} r1 z3))))
"""
USUAL = {"kind": "robot", "object": "z1", "flag": "warm", "argument": "x", "at": "where-is", "table": "road"}
USUAL |= {"set": "open", "fuel": "fuel", "move": "move", "parameter": "who", "variable": "v", "mop": "mop"}
USUAL |= {"problem": "p"}
WORDS: tuple[str, ...] = (
    "idle",
    "executing",
    "none",
    "nothing",
    "null",
    "min",
    "in",
    "state",
    "current",
    "where",
    "true",
    "object-2",
)
WORDS += ("mop-driver", "mop-driver-command", "mop-driver-req-state", "start-move", "fail-mop", "where_is", "robot-2")
WORDS += ("who-2", "z-2", "x-2", "idle-controller", "r-2", "open-2", "move-2", "none-controller-req-trigger")


@pytest.mark.slow
@pytest.mark.parametrize("number", range(len(WORDS)))
def test_anything_may_have_a_word_that_a_model_uses_as_its_name(number: int) -> None:
    names = USUAL | dict(zip(USUAL, (*WORDS[number:], *WORDS[:number]), strict=False))
    for changed in (names, *({**USUAL, role: word} for role, word in (*names.items(),)[:2])):
        texts = NAMES.format(**changed), NAMES_PROBLEM.format(**changed)
        resources = imported(*texts, resources=("r", changed["parameter"]))
        assert (changed, found(imported(*texts))[1], found(resources)[1]) == (changed, 3, 3)


EQUAL = """(define (domain pairs) (:requirements :typing :adl :fluents)
 (:types robot zone) (:predicates (at ?r - robot ?z - zone) (road ?a ?b - zone) (way ?a ?b ?c - zone) (lit ?z - zone))
 (:functions (dirt ?z - zone) (rank ?z - zone))
 (:action move :parameters (?r - robot ?a ?b - zone) :precondition (and (at ?r ?a) (road ?a ?b))
  :effect (and (not (at ?r ?a)) (at ?r ?b)))
 (:action work :parameters (?r ?s - robot ?a ?b ?c - zone) :precondition (and {needs}) :effect (and {effects})))
"""
EQUAL_PROBLEM = """(define (problem p) (:domain pairs) (:objects r1 r2 - robot a b c - zone)
 (:init (at r1 a) (at r2 b) (road a b) (road b c) (road c a) (way a b c) (= (dirt a) 0) (= (dirt b) 0) (= (dirt c) 0)
  (= (rank a) 1) (= (rank b) 2) (= (rank c) 3)) (:goal (lit a)))
"""


@pytest.mark.parametrize(
    "needs",
    [
        "(road ?a ?b)",
        "(way ?a ?b ?c)",
        "(way ?c ?b ?a)",
        "(not (= ?a ?b))",
        "(road ?a ?c) (road ?c ?b)",
        "(road ?a ?c) (way ?b ?a ?c)",
        "(at ?r ?a) (at ?s ?b) (not (= ?r ?s)) (road ?b ?c) (road ?c ?a)",
        "(at ?r ?a) (at ?r ?c) (road ?b ?c)",
        "(or (road ?a ?b) (way ?b ?a ?c))",
        "(imply (= ?a ?b) (road ?a ?a))",
        "(< (rank ?a) (rank ?b))",
    ],
)
def test_equal_objects_that_conditions_exclude_are_no_operation_of_their_own(needs: str) -> None:
    domain = EQUAL.format(needs=needs, effects="(lit ?a) (not (lit ?b))")
    text = imported(domain, EQUAL_PROBLEM)
    assert sum(line.startswith("  work") for line in text.splitlines()) == 1
    read_model(text)


def test_two_values_at_once_are_an_error_of_different_objects_only() -> None:
    domain = EQUAL.format(needs="(road ?a ?c)", effects="(lit ?a) (assign (dirt ?a) 0) (assign (dirt ?b) 2)")
    text = imported(domain, EQUAL_PROBLEM.replace("(lit a)", "(and (lit a) (= (dirt a) 2))"))
    assert "where: road(a_2, c_2) && a_2 != b_2" in text


EDGES = """(define (domain edges) (:requirements :typing :adl :durative-actions)
 (:types thing none - object lamp door - thing both - lamp both - door)
 (:constants l1 l2 - lamp d1 - door) (:predicates (lit ?t - thing) (open ?d - door) (done))
 (:action light :parameters (?l - lamp ?d - door) :precondition {needs} :effect (and (lit ?l) {effect}))
 (:durative-action mend :parameters (?l ?m - lamp) :duration (= ?duration 2) :condition (and {timed})
  :effect (and {started} (at end (open d1)))))
"""
EDGES_PROBLEM = """(define (problem p) (:domain edges) (:init) (:goal {goal}))
"""


def plan_length(
    goal: str, needs: str = "()", effect: str = "(done)", timed: str = "", started: str = "(at start (lit ?l))"
) -> int | None:
    """Return the length of the shortest plans of a problem with some lamps and a door; `None` without plan."""
    domain = EDGES.format(needs=needs, effect=effect, timed=timed, started=started)
    model = read_model(imported(domain, EDGES_PROBLEM.format(goal=goal)))
    answer = Planner(model).plan(model.nominal_state, model.goals[0][1])
    assert isinstance(answer, Solved | Unsolvable)
    return len(answer.plan) if isinstance(answer, Solved) else None


@pytest.mark.parametrize(
    "needs",
    [
        "(not (= ?l ?d))",
        "(not (= l1 d1))",
        "(and (not (= ?l d1)) (not (= ?d l1)))",
        "(not (exists (?x - door) (= ?x ?l)))",
        "(forall (?n - none) (= ?n ?d))",
    ],
)
def test_terms_without_a_common_object_are_never_equal(needs: str) -> None:
    assert plan_length("(done)", needs) == 1
    assert plan_length("(done)", f"(not {needs})") is None


def test_terms_are_distinguished_after_they_stand_for_single_objects() -> None:
    effect = "(forall (?t - thing) (when (not (= ?t ?l)) (lit ?t)))"
    goals = ("(and (lit l1) (lit l2) (lit d1))", "(forall (?t - thing) (or (= ?t d1) (lit ?t)))")
    assert plan_length(goals[0], effect=effect) == 1
    assert plan_length(goals[1]) == 2


@pytest.mark.parametrize("effect", ["(done)", "(when (not (open ?d)) (done))", "(when (= ?n ?n) (done))"])
def test_an_effect_for_each_of_no_objects_does_not_happen(effect: str) -> None:
    assert plan_length("(done)", effect=f"(forall (?n - none) {effect})") is None
    assert plan_length("(done)", effect=f"(forall (?n - lamp) {effect})") == 1


@pytest.mark.parametrize(
    ("timed", "started", "length"),
    [
        ("(over all (lit ?l))", "(at start (lit ?l))", 1),  # made true
        ("(over all (lit ?l))", "(at start (lit ?l)) (at start (not (lit ?m)))", 1),  # an addition precedes a deletion
        ("(at end (not (lit ?l)))", "(at start (not (lit ?l)))", 1),
        ("(at start (lit ?l)) (over all (lit ?l))", "(at start (lit ?m))", 2),  # left true
        ("(over all (lit ?l)) (at start (not (= ?m ?l)))", "(at start (not (lit ?m)))", 2),  # another fact
        ("(over all (lit ?l))", "(at start (not (lit d1)))", 2),
        ("(over all (exists (?l - lamp) (lit ?l)))", "(at start (not (open d1)))", 2),
        ("(over all (lit ?l))", "(forall (?l - door) (at start (lit ?l)))", 2),
    ],
)
def test_later_conditions_hold_whatever_the_start_of_their_action_changes(
    timed: str, started: str, length: int
) -> None:
    assert plan_length("(open d1)", timed=timed, started=started) == length


@pytest.mark.parametrize(
    ("timed", "started"),
    [
        ("(at end (lit ?l))", "(at start (not (lit ?l)))"),
        ("(over all (lit ?l))", "(at start (not (lit ?l))) (at end (lit ?l))"),
        ("(over all (lit ?l))", "(at start (lit ?m))"),
        ("(over all (not (lit ?l)))", "(at start (not (lit ?l))) (at start (lit ?m))"),
        ("(over all (lit ?l))", "(when (at start (open d1)) (at start (lit ?l)))"),
        ("(over all (or (lit ?l) (done)))", "(at start (lit ?l))"),
        ("", "(at start (lit ?l)) (when (forall (?x - lamp) (at end (lit ?x))) (at end (done)))"),
        ("(forall (?x - lamp) (over all (lit ?x)))", "(forall (?x - lamp) (at start (lit ?x)))"),
        (
            "(at start (not (= ?l ?m)))",
            "(at start (lit ?l)) (forall (?m - lamp) (when (at end (lit ?m)) (at end (done))))",
        ),
    ],
)
def test_later_conditions_that_the_start_of_their_action_changes_are_refused(timed: str, started: str) -> None:
    with pytest.raises(InputError, match="after this action has changed it at its start"):
        plan_length("(open d1)", timed=timed, started=started)
