"""Mutual-exclusion invariants: those of known domains, what breaks them, and a search of all states of random ones."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from importlib import import_module
from itertools import product
from random import Random
from typing import Any

import pytest

from scbm.pddl.exclusive import proved_invariants
from scbm.pddl.pddl_task import FactInvariant, InvariantPart
from support.profiles import share
from support.published_pddl import PUBLISHED

# the reader of `unified-planning` 1.3 calls old names of a library of its own
pytestmark = pytest.mark.filterwarnings("ignore:.* deprecated - use:DeprecationWarning")

BLOCKS = """
  (:types block)
  (:predicates (on ?x ?y - block) (on-table ?x - block) (clear ?x - block) (hand-empty) (holding ?x - block))
  (:action pick-up :parameters (?x - block) :precondition (and (clear ?x) (on-table ?x) (hand-empty))
   :effect (and (not (on-table ?x)) (not (clear ?x)) (not (hand-empty)) (holding ?x)))
  (:action put-down :parameters (?x - block) :precondition (holding ?x)
   :effect (and (not (holding ?x)) (clear ?x) (hand-empty) (on-table ?x)))
  (:action stack :parameters (?x ?y - block) :precondition (and (holding ?x) (clear ?y))
   :effect (and (not (holding ?x)) (not (clear ?y)) (clear ?x) (hand-empty) (on ?x ?y)))
  (:action unstack :parameters (?x ?y - block) :precondition (and (on ?x ?y) (clear ?x) (hand-empty))
   :effect (and (holding ?x) (clear ?y) (not (clear ?x)) (not (hand-empty)) (not (on ?x ?y))))"""
MOVE = """
  (:types robot zone)
  (:predicates (at ?r - robot ?z - zone) (ready))
  (:action move :parameters (?r - robot ?from ?to - zone) :precondition {needs} :effect {effects})"""
ROBOTS = "r1 r2 - robot a b c - zone"
MOVED = "(and (not (at ?r ?from)) (at ?r ?to))"


@cache
def _reader() -> Any:  # noqa: ANN401 - as below; building its grammar takes long
    return import_module("unified_planning.io").PDDLReader()


@cache
def problem(domain: str, objects: str, init: str) -> Any:  # noqa: ANN401 - a class of a library without types
    head = "(define (domain d) (:requirements :typing :adl :durative-actions)"
    task = f"(define (problem p) (:domain d) (:objects {objects}) (:init {init}) (:goal (and)))"
    return _reader().parse_problem_string(f"{head}{domain})", task)


def exclusive_parameters(problem: Any) -> dict[str, int]:  # noqa: ANN401 - as above
    return proved_invariants(problem).exclusive


def move(needs: str = "(at ?r ?from)", effects: str = MOVED, init: str = "(at r1 a) (at r2 a)") -> dict[str, int]:
    return exclusive_parameters(problem(MOVE.format(needs=needs, effects=effects), ROBOTS, init))


@pytest.mark.longer
def test_an_invariant_may_need_several_fluents() -> None:
    tower = problem(BLOCKS, "a b c - block", "(hand-empty) (on-table a) (on b a) (clear b) (on-table c) (clear c)")
    # {on, on-table, holding} of the upper block; {holding, hand-empty} without a key
    assert exclusive_parameters(tower) == {"on": 1, "holding": 0}


def test_a_block_is_on_another_one_or_clear_or_held() -> None:
    tower = problem(BLOCKS, "a b c - block", "(hand-empty) (on-table a) (on b a) (clear b) (on-table c) (clear c)")
    one_of = (InvariantPart("clear", (0,), None), InvariantPart("holding", (0,), None), InvariantPart("on", (1,), 0))
    assert one_of in proved_invariants(tower).all


def test_the_last_parameter_that_is_exclusive_counts() -> None:
    domain = """
      (:types truck parcel - thing place)
      (:predicates (at ?x - thing ?p - place) (in ?x - parcel ?t - truck))
      (:action load :parameters (?x - parcel ?t - truck ?p - place) :precondition (and (at ?x ?p) (at ?t ?p))
       :effect (and (not (at ?x ?p)) (in ?x ?t)))
      (:action unload :parameters (?x - parcel ?t - truck ?p - place) :precondition (and (in ?x ?t) (at ?t ?p))
       :effect (and (not (in ?x ?t)) (at ?x ?p)))
      (:action drive :parameters (?t - truck ?a ?b - place) :precondition (at ?t ?a)
       :effect (and (not (at ?t ?a)) (at ?t ?b)))"""
    start = "(at t a) (at x a) (at y b)"
    assert exclusive_parameters(problem(domain, "t s - truck x y - parcel a b - place", start)) == {"at": 1, "in": 1}


def test_a_single_object_and_a_fluent_that_nothing_makes_true_are_left_out() -> None:
    assert (
        exclusive_parameters(
            problem(MOVE.format(needs="(at ?r ?from)", effects=MOVED), "r1 - robot a - zone", "(at r1 a)")
        )
        == {}
    )
    assert move(effects="(not (at ?r ?from))") == {}


def test_a_move_that_requires_and_deletes_the_old_place_is_exclusive() -> None:
    assert move() == {"at": 1}


@pytest.mark.parametrize(
    ("needs", "effects", "init"),
    [
        pytest.param("(at ?r ?from)", MOVED, "(at r1 a) (at r1 b)", id="two places initially"),
        pytest.param("(at ?r ?from)", "(at ?r ?to)", "(at r1 a)", id="nothing deleted"),
        pytest.param("(ready)", MOVED, "(at r1 a)", id="the deleted place is not required"),
        pytest.param("(or (at ?r ?from) (ready))", MOVED, "(at r1 a)", id="required in a disjunction only"),
        pytest.param(
            "(at ?r ?from)", "(and (when (ready) (not (at ?r ?from))) (at ?r ?to))", "(at r1 a)", id="deleted sometimes"
        ),
        pytest.param(
            "(at ?r ?from)",
            "(and (not (at ?r ?from)) (forall (?z - zone) (at ?r ?z)))",
            "(at r1 a)",
            id="several added by one effect",
        ),
        pytest.param(
            "(at ?r ?from)",
            "(and (not (at ?r ?from)) (forall (?z - zone) (when (ready) (at ?r ?z))))",
            "(at r1 a)",
            id="several added by one conditional effect",
        ),
        pytest.param(
            "(at ?r ?from)", "(and (not (at ?r ?from)) (at ?r ?to) (at ?r a))", "(at r1 a)", id="two places added"
        ),
    ],
)
def test_what_may_add_a_second_value_is_left_out(needs: str, effects: str, init: str) -> None:
    domain = MOVE.replace("(:predicates", "(:constants a - zone) (:predicates") if "(at ?r a)" in effects else MOVE
    objects = ROBOTS.replace("a b c", "b c") if domain != MOVE else ROBOTS
    assert exclusive_parameters(problem(domain.format(needs=needs, effects=effects), objects, init)) == {}


@pytest.mark.parametrize(
    "effects",
    [
        pytest.param("(when (ready) (and (not (at ?r ?from)) (at ?r ?to)))", id="both under one condition"),
        pytest.param("(and (not (at ?r ?from)) (when (ready) (at ?r ?to)))", id="only the new place under a condition"),
        pytest.param(
            "(forall (?o - robot) (when (at ?o ?from) (and (not (at ?o ?from)) (at ?o ?to))))", id="all robots at once"
        ),
    ],
)
def test_conditional_effects_keep_the_invariant_if_the_old_value_goes_with_the_new_one(effects: str) -> None:
    assert move(effects=effects) == {"at": 1}


def test_an_object_may_stand_for_two_parameters_unless_that_is_excluded() -> None:
    domain = """
      (:types thing)
      (:predicates (held ?x - thing) (idle) (waits ?x - thing) (ahead ?x ?y - thing))
      (:action swap :parameters (?x ?y - thing) :precondition {needs}
       :effect (and (not (ahead ?x ?x)) (not (ahead ?y ?y)) (ahead ?x ?y) (ahead ?y ?x)))"""
    needs = "(and (ahead ?x ?x) (ahead ?y ?y))"
    both = problem(domain.format(needs=needs), "a b c - thing", "(ahead a a) (ahead b b)")
    apart = problem(domain.format(needs=f"(and {needs} (not (= ?x ?y)))"), "a b c - thing", "(ahead a a) (ahead b b)")
    # With x = y, the two added facts are one fact. So both domains have the invariant.
    assert exclusive_parameters(both) == exclusive_parameters(apart) == {"ahead": 1}


def test_a_durative_action_may_leave_at_its_start_and_arrive_at_its_end() -> None:
    domain = """
      (:types robot zone)
      (:predicates (at ?r - robot ?z - zone))
      (:durative-action move :parameters (?r - robot ?from ?to - zone) :duration (= ?duration 5)
       :condition (at start (at ?r ?from)) :effect (and (at {leave} (not (at ?r ?from))) (at {arrive} (at ?r ?to))))"""
    results = {
        (leave, arrive): exclusive_parameters(
            problem(domain.format(leave=leave, arrive=arrive), ROBOTS, "(at r1 a) (at r2 b)")
        )
        for leave, arrive in product(("start", "end"), repeat=2)
    }
    assert results == {
        ("start", "start"): {"at": 1},
        ("start", "end"): {"at": 1},
        ("end", "end"): {"at": 1},
        ("end", "start"): {},  # in both zones on the way
    }


GROUPS = {
    "blocks-4-0": {"on": 1, "holding": 0},
    "gripper-1": {"at-robby": 0, "at": 1, "carry": 1},
    "logistics-4-0": {"at": 1, "in": 1},
    "rovers-4": {"at": 1, "have_soil": 0, "have_rock": 0},
    "plansys2-simple": {"robot_at": 1},
    "plansys2-factory": {"robot_at": 1, "piece_at": 1},
}


@pytest.mark.slow
@pytest.mark.parametrize("name", GROUPS)
def test_published_problems_have_these_groups(name: str) -> None:
    domain, text, _ = PUBLISHED[name]
    assert exclusive_parameters(_reader().parse_problem_string(domain, text)) == GROUPS[name]


# all reachable states of random problems

FLUENTS = {"p": ("s",), "q": ("s", "t"), "r": (), "u": ("t", "t")}
OBJECTS = {"s": ("s1", "s2"), "t": ("t1", "t2", "t3")}
Fact = tuple[str, ...]


@dataclass(frozen=True)
class RandomAction:
    """An action: its parameters by type, its required, deleted and added atoms, and two different parameters."""

    parameters: dict[str, str]
    required: list[Fact]
    deleted: list[Fact]
    added: list[Fact]
    different: bool

    def instances(self) -> list[tuple[set[Fact], set[Fact], set[Fact]]]:
        found = []
        for chosen in product(*(OBJECTS[kind] for kind in self.parameters.values())):
            bound = dict(zip(self.parameters, chosen, strict=True))
            if not self.different or bound["c"] != bound["d"]:
                kinds = (self.required, self.deleted, self.added)
                found.append(tuple({(name, *(bound[x] for x in rest)) for name, *rest in atoms} for atoms in kinds))
        return found  # type: ignore[return-value]


def _drawn_action(random: Random) -> RandomAction:
    parameters = {"a": "s", "b": "s", "c": "t", "d": "t"}

    def atom() -> Fact:
        name = random.choice(list(FLUENTS))
        return (name, *(random.choice([x for x, kind in parameters.items() if kind == t]) for t in FLUENTS[name]))

    required = [atom() for _ in range(random.randint(1, 3))]
    deleted = [fact for fact in required if random.random() < 0.8]
    added = [atom() for _ in range(random.randint(1, 2))]
    kept = [fact for fact in deleted if fact not in added]
    return RandomAction(parameters, required, kept, added, random.random() < 0.3)


def _reachable(start: frozenset[Fact], actions: list[RandomAction]) -> set[frozenset[Fact]]:
    instances = [instance for action in actions for instance in action.instances()]
    seen, todo = {start}, [start]
    while todo and len(seen) < 300:
        state = todo.pop()
        for required, deleted, added in instances:
            after = frozenset(state - deleted | added)
            if required <= state and after not in seen:
                seen.add(after)
                todo.append(after)
    return seen


def _is_exclusive(fluent: str, counted: int, states: set[frozenset[Fact]]) -> bool:
    for state in states:
        keys = [fact[:counted] + fact[counted + 1 :] for fact in state if fact[0] == fluent]
        if len(keys) != len({(len(key), key) for key in keys}):
            return False
    return True


def _has_one_fact(invariant: FactInvariant, state: frozenset[Fact]) -> bool:
    groups = [
        tuple(fact[1 + key] for key in part.keys) for part in invariant for fact in state if fact[0] == part.fluent
    ]
    return len(groups) == len(set(groups))


def _as_problem(start: set[Fact], actions: list[RandomAction]) -> Any:  # noqa: ANN401 - as above
    up = import_module("unified_planning.shortcuts")
    kinds = {kind: up.UserType(kind) for kind in OBJECTS}
    objects = {name: up.Object(name, kinds[kind]) for kind, names in OBJECTS.items() for name in names}
    fluents = {
        name: up.Fluent(name, up.BoolType(), **{f"x{i}": kinds[kind] for i, kind in enumerate(signature)})
        for name, signature in FLUENTS.items()
    }
    made = up.Problem("random")
    made.add_objects(objects.values())
    for fluent in fluents.values():
        made.add_fluent(fluent, default_initial_value=False)
    for name, *rest in start:
        made.set_initial_value(fluents[name](*(objects[x] for x in rest)), True)
    for number, one in enumerate(actions):
        action = up.InstantaneousAction(f"act{number}", **{x: kinds[kind] for x, kind in one.parameters.items()})
        for name, *rest in one.required:
            action.add_precondition(fluents[name](*map(action.parameter, rest)))
        if one.different:
            action.add_precondition(up.Not(up.Equals(action.parameter("c"), action.parameter("d"))))
        for atoms, value in ((one.deleted, False), (one.added, True)):
            for name, *rest in dict.fromkeys(atoms):
                action.add_effect(fluents[name](*map(action.parameter, rest)), value)
        made.add_action(action)
    return made


@pytest.mark.longer
def test_what_is_proved_holds_in_all_states_of_random_problems() -> None:
    proved = missed = several = 0
    for number in range(share(1000)):
        random = Random(number)
        actions = [_drawn_action(random) for _ in range(random.randint(1, 2))]
        start = {("p", "s1"), ("q", "s1", "t1"), ("q", "s2", "t1"), ("r",), ("u", "t1", "t2"), ("u", "t2", "t3")}
        start = {fact for fact in sorted(start) if random.random() < 0.7}
        invariants, found = proved_invariants(_as_problem(start, actions))
        states = _reachable(frozenset(start), actions)
        for fluent, index in found.items():
            assert _is_exclusive(fluent, index + 1, states), (number, fluent, index)
        for invariant in invariants:
            assert all(_has_one_fact(invariant, state) for state in states), (number, invariant)
        several += sum(len(invariant) > 1 for invariant in invariants)
        changed = {fluent for action in actions for fluent, *_ in (*action.deleted, *action.added)}
        proved += len(found)
        missed += sum(_is_exclusive(f, 1, states) for f in changed - found.keys() if FLUENTS[f])
    assert proved > missed / 3 > 0, (proved, missed)  # it proves something, although not everything
    assert several > 0
