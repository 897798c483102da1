"""Random problems of PDDL: the imported model has plans as short as a plain search of the problem finds.

The search knows PDDL only: all effects read the state before the action, and an added fact stays if it is deleted, too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import product
from random import Random

import pytest

from scbm.files import read_model
from scbm.pddl import PddlImportOptions, PddlText, imported_model, read_pddl
from scbm.planning import Planner, Solved, Unsolvable
from support.profiles import share

# the reader of `unified-planning` 1.3 calls old names of a library of its own
pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:.* deprecated - use:DeprecationWarning")]

PREDICATES = {"p": ("s",), "q": ("s", "t"), "r": (), "u": ("t", "t"), "fixed": ("s", "t")}
OBJECTS = {"s": ("s1", "s2"), "t": ("t1", "t2", "t3")}
PARAMETERS = {"a": "s", "b": "s", "c": "t", "d": "t"}
MAX_STATES = 3_000

Fact = tuple[str, ...]
"""A predicate with its arguments: parameters or objects."""

Literal = tuple[bool, Fact]
"""Whether the fact is true, and the fact."""


@dataclass(frozen=True)
class DrawnAction:
    """An action over `PARAMETERS`: conditions, effects with a condition each, and whether `c` and `d` differ."""

    conditions: list[Literal]
    effects: list[tuple[list[Literal], Literal]]
    differ: bool

    def text(self, name: str) -> str:
        conditions = [_literal(each) for each in self.conditions]
        conditions += ["(not (= ?c ?d))"] if self.differ else []
        effects = []
        for when, change in self.effects:
            needs = " ".join(map(_literal, when))
            effects.append(f"(when (and {needs}) {_literal(change)})" if when else _literal(change))
        used = " ".join(f"?{name} - {kind}" for name, kind in PARAMETERS.items())
        return (
            f" (:action {name} :parameters ({used})\n  :precondition (and {' '.join(conditions)})\n"
            f"  :effect (and {' '.join(effects)}))\n"
        )

    def successors(self, state: frozenset[Fact]) -> Iterator[frozenset[Fact]]:
        for chosen in product(*(OBJECTS[kind] for kind in PARAMETERS.values())):
            bound = dict(zip(PARAMETERS, chosen, strict=True))
            if (self.differ and bound["c"] == bound["d"]) or not _holds(self.conditions, bound, state):
                continue
            changes = [change for when, change in self.effects if _holds(when, bound, state)]
            deleted = {_bound(fact, bound) for added, fact in changes if not added}
            yield state - deleted | {_bound(fact, bound) for added, fact in changes if added}


@dataclass(frozen=True)
class DrawnProblem:
    """Actions, an initial state and a goal."""

    actions: list[DrawnAction]
    initial: list[Fact]
    goal: list[Literal]
    texts: tuple[PddlText, PddlText] = field(init=False)

    def __post_init__(self) -> None:
        predicates = " ".join(
            f"({name} {' '.join(f'?x{i} - {kind}' for i, kind in enumerate(kinds))})"
            for name, kinds in PREDICATES.items()
        )
        domain = "(define (domain d) (:requirements :typing :adl)\n (:types s t)\n"
        domain += f" (:predicates {predicates})\n"
        domain += "".join(action.text(f"act{number}") for number, action in enumerate(self.actions)) + ")\n"
        objects = " ".join(f"{' '.join(names)} - {kind}" for kind, names in OBJECTS.items())
        facts = " ".join(f"({' '.join(fact)})" for fact in self.initial)
        goal = " ".join(map(_literal, self.goal))
        problem = f"(define (problem p) (:domain d) (:objects {objects})\n (:init {facts})\n (:goal (and {goal})))\n"
        object.__setattr__(self, "texts", (PddlText("domain.pddl", domain), PddlText("problem.pddl", problem)))

    def shortest(self) -> int | None:
        """Return the length of the shortest plans; `None` if there is none."""
        start = frozenset(self.initial)
        seen, level, length = {start}, [start], 0
        while level:
            if any(_holds(self.goal, {}, state) for state in level):
                return length
            following: dict[frozenset[Fact], None] = {}
            for state in level:
                for action in self.actions:
                    following |= dict.fromkeys(each for each in action.successors(state) if each not in seen)
            seen |= set(following)
            assert len(seen) < MAX_STATES
            level, length = list(following), length + 1
        return None


def _literal(literal: Literal) -> str:
    holds, (name, *arguments) = literal
    shown = " ".join([name, *(f"?{each}" if each in PARAMETERS else each for each in arguments)])
    return f"({shown})" if holds else f"(not ({shown}))"


def _bound(fact: Fact, bound: dict[str, str]) -> Fact:
    return (fact[0], *(bound.get(each, each) for each in fact[1:]))


def _holds(literals: list[Literal], bound: dict[str, str], state: frozenset[Fact]) -> bool:
    return all((_bound(fact, bound) in state) == holds for holds, fact in literals)


def _drawn_problem(random: Random) -> DrawnProblem:
    def lifted(names: list[str]) -> Fact:
        name = random.choice(names)
        return (name, *(random.choice([x for x, kind in PARAMETERS.items() if kind == k]) for k in PREDICATES[name]))

    def ground(names: list[str]) -> Fact:
        name = random.choice(names)
        return (name, *(random.choice(OBJECTS[kind]) for kind in PREDICATES[name]))

    changing = [name for name in PREDICATES if name != "fixed"]
    actions = []
    for _ in range(random.randint(1, 3)):
        conditions = [(random.random() < 0.8, lifted(list(PREDICATES))) for _ in range(random.randint(1, 3))]
        effects: list[tuple[list[Literal], Literal]] = []
        for holds, fact in conditions:
            if holds and fact[0] != "fixed" and random.random() < 0.7:
                effects.append(([], (False, fact)))
        for _ in range(random.randint(1, 2)):
            when = [(random.random() < 0.7, lifted(changing))] if random.random() < 0.2 else []
            effects.append((when, (random.random() < 0.8, lifted(changing))))
        actions.append(DrawnAction(conditions, effects, random.random() < 0.3))
    initial = list(dict.fromkeys(ground(list(PREDICATES)) for _ in range(random.randint(3, 9))))
    return DrawnProblem(
        actions, initial, _drawn_goal(random, actions, frozenset(initial)) or [(True, ground(changing))]
    )


def _drawn_goal(random: Random, actions: list[DrawnAction], state: frozenset[Fact]) -> list[Literal]:
    """Return facts of a state after some actions, new ones if there are; nothing if no action is applicable."""
    initial = state
    for _ in range(random.randint(2, 8)):
        following = sorted({each for action in actions for each in action.successors(state)}, key=sorted)
        state = random.choice(following) if following else state
    changed: list[Literal] = [
        (fact in state, fact) for fact in sorted(state ^ initial, key=lambda fact: (len(fact), fact))
    ]
    return random.sample(changed, min(len(changed), random.randint(1, 3)))


def test_imported_random_problems_have_plans_of_the_shortest_length() -> None:
    solved = longest = 0
    for number in range(share(200)):
        problem = _drawn_problem(Random(number))
        task = read_pddl(*problem.texts)
        text = imported_model(task, *problem.texts, PddlImportOptions()).text
        model = read_model(text)
        answer = Planner(model).plan(model.nominal_state, model.goals[0][1])
        expected = problem.shortest()
        shown = f"{number}\n{problem.texts[0].text}{problem.texts[1].text}{text}"
        if expected is None:
            assert isinstance(answer, Unsolvable), shown
        else:
            assert isinstance(answer, Solved), shown
            assert len(answer.plan) == expected, shown
            longest = max(longest, expected)
            solved += expected > 0
    assert solved >= share(200) // 4
    assert longest > 2
