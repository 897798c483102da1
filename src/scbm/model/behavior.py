"""Behavior models (paper, Section II): variables, operations, other transitions, initial states, waivers."""

from __future__ import annotations

import re
from enum import StrEnum
from functools import cached_property
from typing import TYPE_CHECKING

from msgspec import Struct
from msgspec.structs import replace

from scbm.model.predicates import TRUE, Predicate
from scbm.model.struct_classes import PartlyCompared
from scbm.model.variables import State, StateSpace, Variable, resource_variables, runner_variables

if TYPE_CHECKING:
    from scbm.model.diagnostics import Place
    from scbm.model.operations import Action, Operation, Transition
    from scbm.model.requirements import Requirement
    from scbm.model.resources import Latency, Resource


class RateKind(StrEnum):
    """When the clock of an environment transition starts."""

    EVERY = "every"
    """At the beginning of a run, and again each time that it has passed."""
    AFTER = "after"
    """The clock starts when the guard becomes true, and stops when it becomes false."""


class Rate(PartlyCompared, frozen=True):
    """How often an environment transition fires in a simulation.

    Attributes:
        kind: when its clock starts.
        time: the distribution of the time that the clock runs.
        place: where it is written; two rates that differ only in their places are equal.
    """

    kind: RateKind
    time: Latency
    place: Place | None = None
    uncompared = ("place",)


class EnvironmentTransition(Struct, frozen=True):
    """A change that something outside the model and its resources makes, such as a person who presses a button.

    Attributes:
        name: an identifier.
        guard: where it can fire; reads no variable of the runner.
        actions: what it assigns, all at once; declared variables only.
        rate: how often it fires in a simulation; `None` for never.
    """

    name: str
    guard: Predicate
    actions: tuple[Action, ...]
    rate: Rate | None = None

    def __str__(self) -> str:
        return f"{self.name}: {self.guard} / [{', '.join(map(str, self.actions))}]"


class PlannerChoice(Struct, frozen=True):
    """The planner that the runs of a model use, and the limits of its searches; `None` for the default.

    Attributes:
        name: an entry of the registry of planners.
        max_length: the maximum number of operations of a plan.
        max_expanded: the maximum number of states that a search expands.
    """

    name: str | None = None
    max_length: int | None = None
    max_expanded: int | None = None


class PlannerIdentity(Struct, frozen=True):
    """The planner that made the plans of a run: its name and version, and the limits of its searches.

    Attributes:
        name: its name.
        version: its version.
        max_length: the maximum number of operations of a plan; `None` for the default.
        max_expanded: the maximum number of states that a search expanded; `None` for the default.
    """

    name: str
    version: str
    max_length: int | None = None
    max_expanded: int | None = None

    @staticmethod
    def parse(text: str) -> PlannerIdentity:
        """Return the identity that `str` has written. Raise `ValueError` for any other text."""
        match = _IDENTITY.fullmatch(text)
        if match is None or not text.isprintable():
            raise ValueError(f"`{text}` is not the name and the version of a planner")
        length, expanded = (None if number is None else int(number) for number in match.group(3, 4))
        return PlannerIdentity(match[1], match[2], length, expanded)

    @property
    def choice(self) -> PlannerChoice:
        """The choice of a model whose runs have such plans."""
        return PlannerChoice(self.name, self.max_length, self.max_expanded)

    @property
    def limits(self) -> dict[str, int]:
        """The limits that are set, by the names of their attributes."""
        given = {"max_length": self.max_length, "max_expanded": self.max_expanded}
        return {name: limit for name, limit in given.items() if limit is not None}

    @property
    def words(self) -> str:
        """The name and the limits without the version: `greedy, max_length 50`."""
        return ", ".join([self.name, *(f"{name} {limit}" for name, limit in self.limits.items())])

    def __str__(self) -> str:
        return ", ".join([f"{self.name} {self.version}", *(f"{name} {limit}" for name, limit in self.limits.items())])


_IDENTITY = re.compile(r"([^ ,]+) ([^,]+)(?:, max_length (\d{1,18}))?(?:, max_expanded (\d{1,18}))?", re.ASCII)


FIRST_PLANNER = PlannerIdentity("canonical", "1")
"""The planner of recorded runs that name none; claims about canonical plans are checked for it alone."""


class Waiver(PartlyCompared, frozen=True):
    """The decision of a person that an obligation need not be covered (semantics 8.5).

    Dates are texts in the form of ISO 8601, such as `2026-11-23`, so that they sort by time.

    Attributes:
        obligation: its name, such as `scan/failed`.
        reason: why it need not be covered, for people.
        author: who decided that.
        date: the date of the decision.
        expires: the last date on which the waiver counts; `None` if it always counts.
        place: where it is written; two waivers that differ only in their places are equal.
        lifted: the obligation as it is written, such as `move/failed`, if it stands for all instances; else empty.
    """

    obligation: str
    reason: str
    author: str
    date: str
    expires: str | None = None
    place: Place | None = None
    lifted: str = ""
    uncompared = ("place", "lifted")

    def is_expired(self, today: str) -> bool:
        """Return whether the waiver does not count any more on the date `today`."""
        return self.expires is not None and self.expires < today

    def __str__(self) -> str:
        until = f", until {self.expires}" if self.expires is not None else ""
        return f"{self.reason} ({self.author}, {self.date}{until})"


class GoalOrder(StrEnum):
    """The goals that one operation of a system pursues; a proof about all runs is about these (semantics 9.3)."""

    SINGLE = "single"
    """Each run starts in an allowed initial state, and has one goal."""
    SEQUENCE = "sequence"
    """Goals of the model follow each other in any order, each from the state in which the last run ended."""


class RunPlans(StrEnum):
    """The plans of random cases (semantics 4.4)."""

    CANONICAL = "canonical"
    """Those of the planner."""
    DRAWN = "drawn"
    """Drawn from all shortest plans."""


class PlanSet(StrEnum):
    """The plans of the runs that a proof is about (semantics 9.3)."""

    CANONICAL = "canonical"
    """The plan of the canonical planner."""
    ANY = "any"
    """Any sequence of operations that leads, by the planner's rules, from the state planned in to the goal."""


class RunsDeclaration(Struct, frozen=True):
    """The runs of a model.

    Attributes:
        goals: how many goals follow each other without a new beginning.
        plans: the plans of random cases.
    """

    goals: GoalOrder = GoalOrder.SEQUENCE
    plans: RunPlans = RunPlans.CANONICAL

    @property
    def proved_plans(self) -> PlanSet:
        """The plans that proofs about all runs are about: any plans where they are drawn."""
        return PlanSet.ANY if self.plans is RunPlans.DRAWN else PlanSet.CANONICAL


class LiftedOrigin(PartlyCompared, frozen=True):
    """The lifted entry of a model file that a ground part of the model was expanded from.

    Attributes:
        section: the section of both: `operations`, `automatic_transitions`, `goals` or `requirements`.
        name: the name of the ground part, such as `move.r1.a.b`.
        lifted: the name of the lifted entry, such as `move`.
        written: the lifted entry with its parameters, such as `move[r in robot, x in zone]`; empty if these are not
            known.
    """

    section: str
    name: str
    lifted: str
    written: str = ""
    uncompared = ("written",)

    @property
    def parameters(self) -> dict[str, str]:
        """The parameter for each object of the instance; without objects that stand for several parameters."""
        objects = self.name.removeprefix(f"{self.lifted}.").split(".")
        listed = self.written.partition("[")[2].rstrip("]").split(",") if self.written else []
        names = [each.split()[0] for each in listed]
        return {each: name for each, name in zip(objects, names, strict=False) if objects.count(each) == 1}


class ObjectLists(Struct, frozen=True):
    """The objects and the tables of a model file with types, and the digest of what else it says (semantics 8.7).

    Attributes:
        lifted: the SHA-256 of the lifted model: all declarations without objects, rows, initial values and goals.
        types: the objects of each type, without those of its subtypes.
        parents: the parent of each subtype.
        tables: for each table its name, the types of its columns, and its rows.
        entries: the section and the name of each operation and automatic transition with parameters.
    """

    lifted: str
    types: tuple[tuple[str, tuple[str, ...]], ...]
    parents: tuple[tuple[str, str], ...] = ()
    tables: tuple[tuple[str, tuple[str, ...], tuple[tuple[str, ...], ...]], ...] = ()
    entries: tuple[tuple[str, str], ...] = ()

    def is_other_list(self, other: ObjectLists) -> bool:
        """Return whether `other` belongs to the same lifted model, and has other objects or other rows."""
        return self.lifted == other.lifted and (self.types, self.tables) != (other.types, other.tables)


class BehaviorModel(PartlyCompared, frozen=True, dict=True):
    """The content of a model file. All orders are those of the file, and they matter.

    Attributes:
        name: an identifier.
        variables: the declared variables.
        resources: the resources that requests are sent to.
        operations: the operations to plan with; their order decides between plans of the same length (semantics 4.2).
        automatic_transitions: the transitions that are taken as soon as they are enabled, the first in order first
            (semantics 5.1).
        initial_states: the predicate that every initial state satisfies.
        goals: the goals of runs, by name.
        requirements: the requirements that hold during runs.
        planner: the planner of its runs; it is how plans are found, and no part of what the model means.
        environment: the changes that something outside the model makes; planners ignore them (semantics 9.4).
        waivers: the obligations that need not be covered; they are no part of what the model means either.
        may_end: the ends of runs that excuse a missed goal, whichever goal it is (semantics 7.4).
        goals_may_end: by the name of a goal, further ends that excuse missing this goal.
        runs: what its runs are.
        requirements_off: the names of the built-in requirements that do not hold in it, each with the reason.
        requirements_on: the names of the requirements that it has only as it says so.
        reachable_again: the goals that every run leaves reachable, also where plain runs do not (semantics 7.12).
        origins: where its expanded parts come from. Reports fold by it; two models that differ only in it are equal.
        objects: the objects of its file, if the file has types; two models that differ only in it are equal.
        interfaces: where its file finds the types of bindings; two models that differ only in it are equal.
    """

    name: str
    variables: tuple[Variable, ...]
    operations: tuple[Operation, ...]
    resources: tuple[Resource, ...] = ()
    automatic_transitions: tuple[Transition, ...] = ()
    initial_states: Predicate = TRUE
    goals: tuple[tuple[str, Predicate], ...] = ()
    requirements: tuple[Requirement, ...] = ()
    planner: PlannerChoice = PlannerChoice()
    environment: tuple[EnvironmentTransition, ...] = ()
    waivers: tuple[Waiver, ...] = ()
    may_end: tuple[str, ...] = ()
    goals_may_end: tuple[tuple[str, tuple[str, ...]], ...] = ()
    runs: RunsDeclaration = RunsDeclaration()
    requirements_off: tuple[tuple[str, str], ...] = ()
    requirements_on: tuple[str, ...] = ()
    reachable_again: tuple[str, ...] = ()
    origins: tuple[LiftedOrigin, ...] = ()
    objects: ObjectLists | None = None
    interfaces: tuple[str, ...] = ()
    uncompared = ("origins", "objects", "interfaces")

    @cached_property
    def space(self) -> StateSpace:
        """The variables of the world: the declared ones, then two for each resource."""
        owned = (variable for resource in self.resources for variable in resource_variables(resource.name))
        return StateSpace((*self.variables, *owned))

    @cached_property
    def running_space(self) -> StateSpace:
        """The variables of the world, then those of the runner (semantics 1.3)."""
        return StateSpace((*self.space, *runner_variables(operation.name for operation in self.operations)))

    @cached_property
    def transitions(self) -> tuple[Transition, ...]:
        """All transitions: `pre`, `post` and `failed` of each operation, then the automatic ones."""
        lives = ((operation.pre, operation.post, operation.failed) for operation in self.operations)
        own = (transition for life in lives for transition in life if transition is not None)
        return (*own, *self.automatic_transitions)

    @cached_property
    def actions(self) -> tuple[Action, ...]:
        """All actions of all transitions, then the `timedout` actions of operations."""
        taken = (action for transition in self.transitions for action in transition.running_actions)
        return (*taken, *(action for operation in self.operations for action in operation.timedout))

    @cached_property
    def read(self) -> tuple[str, ...]:
        """The variables on which the course of a run can depend."""
        guards = (*(each.running_guard for each in self.transitions), *(each.guard for each in self.environment))
        actions = (*self.actions, *(action for each in self.environment for action in each.actions))
        parts = (*guards, *actions, *(goal for _, goal in self.goals))
        return tuple(dict.fromkeys(name for part in parts for name in part.reads()))

    @cached_property
    def nominal_state(self) -> State:
        """The state of the world in which every variable has its nominal value."""
        return State.nominal(self.space)

    @cached_property
    def unbound(self) -> BehaviorModel:
        """The model without its bindings, which do not change what it means."""
        resources = tuple(replace(resource, binding=None) for resource in self.resources)
        return replace(self, resources=resources, interfaces=())

    def goal(self, name: str) -> Predicate | None:
        """Return the goal with this name; `None` if there is none."""
        return dict(self.goals).get(name)

    def may_end_of(self, goal: str) -> tuple[str, ...]:
        """Return the ends that excuse missing the goal with this name, without those that excuse missing any goal."""
        return dict(self.goals_may_end).get(goal, ())

    @cached_property
    def _lifted(self) -> dict[tuple[str, str], str]:
        return {(origin.section, origin.name): origin.lifted for origin in self.origins}

    def lifted_name(self, section: str, name: str) -> str:
        """Return the name of the lifted entry that a part of a section comes from; its own name if it is written."""
        return self._lifted.get((section, name), name)

    def operation(self, name: str) -> Operation:
        """Return the operation with this name. Raises `KeyError` if there is none."""
        for operation in self.operations:
            if operation.name == name:
                return operation
        raise KeyError(name)
