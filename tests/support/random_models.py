"""Random models of cells: realistic, nasty, and mostly small enough that all their runs can be enumerated.

The models are numbered. All chance comes from `Random(...).random()`, which is the same in every version of Python.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from itertools import count
from math import prod
from random import Random
from typing import TypeVar

from msgspec.structs import replace

from scbm.model import (
    Action,
    Add,
    And,
    Assign,
    BehaviorModel,
    Constant,
    Domain,
    DrawnVariable,
    Equal,
    Implies,
    InitialStates,
    Latency,
    LatencyShape,
    Member,
    Not,
    NotEqual,
    Operation,
    Or,
    Order,
    Outcome,
    Predicate,
    Reference,
    Relation,
    Resource,
    Simulation,
    Transition,
    Truth,
    Value,
    ValueKind,
    Variable,
)
from scbm.planning import PlanLimits, Planner, Solved

T = TypeVar("T")

_SECOND_NS = 1_000_000_000
_TRUE, _FALSE = Truth(True), Truth(False)
_MAX_VARIABLES = 12
_MAX_OPERATIONS = 20
_MAX_TRIES = 20
_SIZES = (0, 5_000, 20_000, 60_000, 150_000, 400_000, 1_000_000)
_LIMITS = PlanLimits(expansions=20_000)

_PLACES = ("home", "box", "rack", "agv", "table")
_RESOURCES = ("robot", "gantry", "scanner", "gripper")
_SYMBOLS = ("robot_at", "item_at", "gantry_at", "tray.at")
_BOOLS = ("scanned", "clamped", "sorted_out", "labelled")
_TOOLS = Domain.symbols("no_tool", "hand", "camera")


@cache
def random_model(number: int) -> BehaviorModel:
    """Model `number`, the same everywhere."""
    dice = _Dice(Random(f"scbm model {number}"))
    wanted = dice.pick(_SIZES)
    model, size = _Cell(dice).model(f"cell_{number}")
    for _ in range(_MAX_TRIES):
        if size >= wanted:
            break
        other, other_size = _Cell(dice).model(f"cell_{number}")
        if other_size > size:
            model, size = other, other_size
    return model


@cache
def small_random_model(number: int) -> BehaviorModel:
    """Small model `number`, the same everywhere: of some models the one in which least can happen, but something."""
    dice = _Dice(Random(f"small scbm model {number}"))
    drawn = [_Cell(dice).model(f"cell_{number}") for _ in range(_MAX_TRIES)]
    return min(drawn, key=lambda each: (each[1] == 0, each[1]))[0]


def _size(model: BehaviorModel, planner: Planner) -> int:
    """Roughly how much can happen in runs: from how many states, over how many operations, with what counted."""
    starts = InitialStates(model).combinations
    counted = prod(len(variable.domain) for variable in model.variables if variable.name.startswith("timeouts"))
    return starts * counted * sum(max(_length(planner, goal), 0) for _, goal in model.goals)


def _length(planner: Planner, goal: Predicate) -> int:
    """How many operations lead to a goal from the nominal state; -1 if none do."""
    answer = planner.plan(planner.model.nominal_state, goal, _LIMITS)
    return len(answer.plan) if isinstance(answer, Solved) else -1


class _Dice:
    """Choices, made of `random()` alone."""

    def __init__(self, random: Random) -> None:
        self._random = random.random

    def chance(self, share: float) -> bool:
        return self._random() < share

    def between(self, low: int, high: int) -> int:
        return low + int(self._random() * (high - low + 1))

    def pick(self, options: Sequence[T]) -> T:
        return options[int(self._random() * len(options))]

    def some(self, options: Iterable[T], most: int) -> list[T]:
        """At most so many of the options, in random order."""
        left = list(options)
        return [left.pop(int(self._random() * len(left))) for _ in range(min(most, len(left)))]


def _all(*parts: Predicate) -> Predicate:
    """The conjunction, without parts that are true and without conjunctions inside."""
    flat = [one for part in parts for one in (part.operands if isinstance(part, And) else (part,)) if one != _TRUE]
    if not flat:
        return _TRUE
    return flat[0] if len(flat) == 1 else And(tuple(flat))


def _is(name: str, value: Value) -> Equal:
    return Equal(Reference(name), Constant(value))


def _let(name: str, value: Value) -> Assign:
    return Assign(name, Constant(value))


def _one_each(actions: Iterable[Action]) -> tuple[Action, ...]:
    """The actions, only the first for each target."""
    first: dict[str, Action] = {}
    for action in actions:
        first.setdefault(action.target, action)
    return tuple(first.values())


def _idle(resource: str) -> Predicate:
    return And((_is(f"{resource}_req_state", "initial"), _is(f"{resource}_req_trigger", False)))


def _cleared(resource: str) -> tuple[Action, ...]:
    return _let(f"{resource}_req_state", "initial"), _let(f"{resource}_req_trigger", False)


def _executing() -> Predicate:
    return _is("current.state", "executing")


@dataclass(frozen=True)
class _Change:
    """What an operation is for.

    Attributes:
        name: for the operation.
        missing: holds where there is something to do.
        action: does it.
    """

    name: str
    missing: Predicate
    action: Action


@dataclass
class _Habits:
    """What the author of a model tends to do: mostly shares of operations, resources and variables."""

    clears: float
    has_deadline: float
    guards: int
    fails_by_itself: float
    hidden_guards: float
    random_starts: float
    most_starts: int


class _Cell:
    """Draws one model, part by part; later parts speak of earlier ones."""

    def __init__(self, dice: _Dice) -> None:
        self.dice = dice
        self.habits = _Habits(
            clears=dice.pick((1.0, 0.9, 0.8, 0.5)),
            has_deadline=dice.pick((1.0, 0.9, 0.7)),
            guards=dice.pick((0, 1, 1, 1, 2)),
            fails_by_itself=dice.pick((0.0, 0.2, 0.6)),
            hidden_guards=dice.pick((0.0, 0.15, 0.4)),
            random_starts=dice.pick((0.2, 0.7, 1.0)),
            most_starts=dice.pick((100, 500, 1_500, 4_000)),
        )
        self.resources = _RESOURCES[: dice.pick((1, 2, 2, 2, 3, 3, 4))]
        self.world = self._world()
        self.counters = [self._counter(f"timeouts_{i}") for i in range(dice.pick((0, 1, 2, 2, 3)))]
        self.inputs = [self._input(i) for i in range(dice.pick((0, 1, 1, 2)))]
        self.measured = {name: self._measured(name) for name in self.resources if dice.chance(0.35)}
        self.commands = {name: self._command(name) for name in self.resources if dice.chance(0.6)}

    # variables

    def _world(self) -> list[Variable]:
        dice = self.dice
        names = dice.some((*_SYMBOLS, *_BOOLS, "level", "mounted"), dice.pick((2, 3, 4, 4, 5, 5, 6, 7)))
        return [self._variable(name, self._domain(name), self.habits.random_starts) for name in names]

    def _domain(self, name: str) -> Domain:
        if name in _BOOLS:
            return Domain.boolean()
        if name == "mounted":
            return _TOOLS
        if name == "level":
            return Domain.integers(0, self.dice.between(1, 4))
        return Domain(_PLACES[: self.dice.between(2, len(_PLACES))])

    def _variable(self, name: str, domain: Domain, share: float) -> Variable:
        """A variable; with this probability its initial values are drawn."""
        initial = self.dice.pick(domain.values[:2])
        random: tuple[Value, ...] = (initial,)
        if self.dice.chance(share):
            random = domain.values if self.dice.chance(0.4) else tuple(self.dice.some(domain.values, 2))
        return Variable(name, domain, initial, random)

    def _counter(self, name: str) -> Variable:
        domain = Domain.integers(0, self.dice.between(1, 5))
        random = (0, domain.values[-1]) if self.dice.chance(0.1) else (0,)
        return Variable(name, domain, 0, random)

    def _input(self, number: int) -> Variable:
        if self.dice.chance(0.5):
            return self._variable(f"stop_{number}", Domain.boolean(), 0.4)
        return self._variable(f"door_{number}", Domain.symbols("open", "closed"), 0.6)

    def _measured(self, resource: str) -> Variable:
        domain = Domain.integers(-1, 1) if self.dice.chance(0.5) else Domain.symbols("unknown", "good", "bad")
        return Variable(f"{resource}_measured", domain, domain.values[0], (domain.values[0],))

    def _command(self, resource: str) -> Variable:
        domain = Domain.symbols("nothing", *(f"go_{place}" for place in _PLACES[:3]))
        return Variable(f"{resource}_command", domain, "nothing", ("nothing",))

    def _variables(self) -> tuple[Variable, ...]:
        """All of them, at most 12; the commands, which nothing reads, are left out first."""
        left = _MAX_VARIABLES - len(self.world) - len(self.counters)
        self.measured = dict(list(self.measured.items())[:left])
        self.inputs = self.inputs[: left - len(self.measured)]
        self.commands = dict(list(self.commands.items())[: left - len(self.measured) - len(self.inputs)])
        others = (*self.measured.values(), *self.inputs, *self.commands.values())
        return self._with_fewer_starts((*self.world, *self.counters, *others))

    def _with_fewer_starts(self, declared: tuple[Variable, ...]) -> tuple[Variable, ...]:
        """The variables; those behind the first few combinations begin with their nominal value."""
        kept: list[Variable] = []
        for v in declared:
            starts = prod(len(other.random) for other in kept) * len(v.random)
            kept.append(v if starts <= self.habits.most_starts else Variable(v.name, v.domain, v.initial, (v.initial,)))
        return tuple(kept)

    # predicates

    def _leaf(self, variables: Sequence[Variable]) -> Predicate:
        variable = self.dice.pick(variables)
        reference, constant = Reference(variable.name), Constant(self.dice.pick(variable.domain.values))
        equal: list[Predicate] = [Equal(reference, constant)]
        if variable.domain.kind is ValueKind.INTEGER:
            equal.append(Order(reference, self.dice.pick(tuple(Relation)), constant))
        if len(variable.domain) > 2:
            members = self.dice.some(variable.domain.values, 2)
            equal += [NotEqual(reference, constant), Member(reference, tuple(map(Constant, members)))]
        return self.dice.pick(equal)

    def _unusual(self, variables: Sequence[Variable]) -> Predicate:
        """A leaf; mostly one that does not hold in the nominal state."""
        nominal = {variable.name: variable.initial for variable in variables}
        leaf = self._leaf(variables)
        for _ in range(4):
            if leaf.holds(nominal):
                leaf = self._leaf(variables)
        return leaf

    def _condition(self, variables: Sequence[Variable]) -> Predicate:
        """A leaf, or now and then something with more shape."""
        first = self._leaf(variables)
        if self.dice.chance(0.8):
            return first
        second = self._leaf(variables)
        shapes: tuple[Predicate, ...] = (Or((first, second)), Not(first), Implies(first, second))
        return self.dice.pick(shapes)

    @property
    def _visible(self) -> list[Variable]:
        """What guards speak of."""
        return [*self.world, *self.counters, *self.inputs, *self.measured.values()]

    @property
    def _hidden(self) -> list[Variable]:
        """What guards speak of that planning does not change."""
        return [*self.inputs, *self.measured.values(), *self.counters] or self.world

    # operations

    def _changes(self) -> list[_Change]:
        """What there is to do in the world; a few values are forgotten, so that nothing leads to them."""
        found = [change for variable in self.world for change in self._changes_of(variable)]
        pairs = [(a, b) for a in self.world for b in self.world if a is not b and a.domain.kind is b.domain.kind]
        symbols = [(a, b) for a, b in pairs if a.name in _SYMBOLS and b.name in _SYMBOLS]
        for target, source in self.dice.some(symbols, 1) if self.dice.chance(0.3) else []:
            action = Assign(target.name, Reference(source.name))
            missing = NotEqual(Reference(target.name), Reference(source.name))
            found.append(_Change(f"take_{target.name.replace('.', '_')}", missing, action))
        return [change for change in found if self.dice.chance(0.85)] or found

    def _changes_of(self, variable: Variable) -> Iterator[_Change]:
        name = variable.name.replace(".", "_")
        if variable.name == "level":
            yield _Change(
                "raise_level",
                Order(Reference("level"), Relation.LESS, Constant(variable.domain.values[-1])),
                Add("level", 1),
            )
            yield _Change("lower_level", _TRUE, Add("level", -1))
            return
        for value in variable.domain.values:
            written = str(value).lower()
            yield _Change(
                f"{name}_{written}", NotEqual(Reference(variable.name), Constant(value)), _let(variable.name, value)
            )

    def _operations(self) -> tuple[Operation, ...]:
        changes = self._changes()
        changes = self.dice.some(changes, len(changes))
        wanted = min(_MAX_OPERATIONS, max(3, self.dice.between(len(changes) // 2, len(changes) + 2)))
        names: dict[str, None] = {}
        operations = []
        for index in range(wanted):
            change = changes[index % len(changes)]
            name = next(
                n for n in (f"{change.name}{suffix}" for suffix in ("", "_again", "_more", "_still")) if n not in names
            )
            names[name] = None
            if index == 0 and self.dice.chance(0.05):
                name = f"{self.resources[0]}.works"
            operations.append(self._operation(name, change))
        return tuple(operations)

    def _operation(self, name: str, change: _Change) -> Operation:
        if self.dice.chance(0.85):
            return self._requesting(name, change, self.dice.pick(self.resources))
        return self._alone(name, change)

    def _guard(self, change: _Change) -> Predicate:
        """When there is something to do, and how the world has to be for it."""
        target = change.action.target
        others = [v for v in self.world if v.name != target] or self.world
        if self.dice.chance(0.1):
            others = self._visible
        conditions = [self._condition(others) for _ in range(self.dice.between(0, self.habits.guards))]
        return _all(change.missing, *conditions)

    def _hidden_guard(self) -> Predicate:
        if not self.dice.chance(self.habits.hidden_guards):
            return _TRUE
        if self.dice.chance(0.3):
            return _is(f"{self.dice.pick(self.resources)}_req_state", "initial")
        return self._condition(self._hidden)

    def _requesting(self, name: str, change: _Change, resource: str) -> Operation:
        """The pattern of the paper: trigger a request, wait for its success; now and then of two resources at once."""
        dice = self.dice
        used = [resource, *(other for other in self.resources if other != resource and dice.chance(0.04))]
        idle = _all(*map(_idle, used)) if dice.chance(0.95) else _is(f"{resource}_req_trigger", False)
        triggers = tuple(_let(f"{one}_req_trigger", True) for one in used)
        command = self._commanded(resource)
        seen = dice.chance(0.5)
        pre = Transition(
            f"start_{name}",
            _all(idle, self._guard(change)),
            self._hidden_guard(),
            (*triggers, *command) if seen else triggers,
            () if seen else command,
        )
        succeeded = _all(*(_is(f"{one}_req_state", "succeeded") for one in used))
        cleared = [action for one in used for action in _cleared(one)][0 if dice.chance(0.97) else 1 :]
        done = _one_each((*cleared, change.action, *self._besides(0.1)))
        post = Transition(f"complete_{name}", _TRUE, succeeded, done, self._uncounted(done))
        return self._with_deadlines(name, pre, post, resource)

    def _commanded(self, resource: str) -> tuple[Action, ...]:
        """What the request carries, if it carries anything."""
        if resource not in self.commands:
            return ()
        variable = self.commands[resource]
        return (_let(variable.name, self.dice.pick(variable.domain.values[1:])),)

    def _alone(self, name: str, change: _Change) -> Operation:
        """An operation that no resource works on."""
        waits = self._condition(self._visible) if self.dice.chance(0.3) else _TRUE
        shown = self.dice.chance(0.2)
        pre = Transition(f"start_{name}", self._guard(change), self._hidden_guard())
        done = _one_each((change.action, *self._besides(0.1)))
        post = Transition(f"complete_{name}", waits if shown else _TRUE, _TRUE if shown else waits, done)
        return self._with_deadlines(name, pre, post, None)

    def _besides(self, share: float) -> list[Action]:
        """Something else that an operation or a transition does to the world."""
        if not self.dice.chance(share):
            return []
        variable = self.dice.pick(self.world)
        return [_let(variable.name, self.dice.pick(variable.domain.values))]

    def _uncounted(self, taken: tuple[Action, ...]) -> tuple[Action, ...]:
        """A counter is reset behind the planner's back."""
        free = [c for c in self.counters if all(action.target != c.name for action in taken)]
        return (_let(self.dice.pick(free).name, 0),) if free and self.dice.chance(0.15) else ()

    def _with_deadlines(self, name: str, pre: Transition, post: Transition, resource: str | None) -> Operation:
        dice = self.dice
        deadline_ns = dice.pick((0, *(1, 5, 10) * 10)) * _SECOND_NS if dice.chance(self.habits.has_deadline) else None
        waits = pre.gr != _TRUE
        disabled_ns = dice.pick((2, 30)) * _SECOND_NS if dice.chance(0.6 if waits else 0.1) else None
        timedout = () if deadline_ns is None else self._timedout(resource)
        failed = self._failed(name, resource) if dice.chance(self.habits.fails_by_itself) else None
        return Operation(name, pre, post, deadline_ns, failed, timedout, disabled_ns)

    def _timedout(self, resource: str | None) -> tuple[Action, ...]:
        actions: list[Action] = []
        if resource is not None and self.dice.chance(self.habits.clears):
            actions.append(_let(f"{resource}_req_trigger", False))
        if self.counters and self.dice.chance(0.7):
            actions.append(Add(self.dice.pick(self.counters).name, 1))
        return _one_each((*actions, *self._besides(0.2)))

    def _failed(self, name: str, resource: str | None) -> Transition:
        if resource is None:
            return Transition(f"fail_{name}", self._condition(self._hidden), a=tuple(self._besides(0.3)))
        guard = _is(f"{resource}_req_state", "failed")
        cleared = _cleared(resource) if self.dice.chance(0.85) else _cleared(resource)[:1]
        return Transition(f"fail_{name}", guard, a=_one_each((*cleared, *self._besides(0.25))))

    # automatic transitions

    def _automatic(self, operations: Sequence[Operation]) -> tuple[Transition, ...]:
        dice = self.dice
        drawn: list[Transition] = [self._resource_failed(name) for name in self.resources if dice.chance(0.9)]
        drawn += [self._orphan(name) for name in self.resources if dice.chance(0.4)]
        for counter in self.counters:
            drawn += self._counting(counter)
        kinds: list[Callable[[Sequence[Operation]], list[Transition]]] = [
            self._stopping, self._impossible, self._for_one_operation, self._sequence, self._ring, self._at_the_end,
            self._for_one_operation, self._world_rule, self._failing_one,
        ]  # fmt: skip
        for kind in dice.some(kinds, dice.pick((0, 1, 1, 2, 2, 3))):
            drawn += kind(operations)
        if drawn and dice.chance(0.3):
            drawn.append(self._shadowed(dice.pick(drawn)))
        if dice.chance(0.2):
            drawn = dice.some(drawn, len(drawn))
        return self._named(drawn)

    def _named(self, drawn: Iterable[Transition]) -> tuple[Transition, ...]:
        """Each under a name of its own."""
        named: dict[str, Transition] = {}
        for t in drawn:
            name = t.name if t.name not in named else next(n for i in count(2) if (n := f"{t.name}_{i}") not in named)
            named[name] = Transition(name, t.g, t.gr, t.a, t.ar)
        return tuple(named.values())

    def _resource_failed(self, resource: str) -> Transition:
        """As in the paper; or the request is sent again; or the trigger is forgotten."""
        guard = _is(f"{resource}_req_state", "failed")
        kind = self.dice.between(1, 12)
        if kind == 1:
            return Transition(f"{resource}_again", guard, a=(_let(f"{resource}_req_state", "initial"),))
        cleared = _cleared(resource) if kind > 2 else _cleared(resource)[:1]
        actions = (_let("current.state", "failed"), *cleared, *self._besides(0.15))
        hidden = kind == 3
        return Transition(
            f"{resource}_failed",
            guard if hidden else _all(guard, _executing()),
            _executing() if hidden else _TRUE,
            actions,
        )

    def _orphan(self, resource: str) -> Transition:
        """A reply that came too late for its operation is cleared away."""
        answered = Member(Reference(f"{resource}_req_state"), (Constant("succeeded"), Constant("failed")))
        is_idle = NotEqual(Reference("current.state"), Constant("executing"))
        return Transition(f"{resource}_forgotten", _all(answered, is_idle), a=_cleared(resource))

    def _counting(self, counter: Variable) -> Iterator[Transition]:
        """What comes of counting: an abort, a new beginning, or nothing, so that the counter leaves its domain."""
        dice = self.dice
        top = counter.domain.values[-1]
        if dice.chance(0.7):
            limit = _is(counter.name, top if dice.chance(0.8) else dice.pick(counter.domain.values[1:]))
            actions = (_let("plan.state", "aborted"), _let(counter.name, 0))
            yield Transition(f"abort_by_{counter.name}", limit, a=actions if dice.chance(0.9) else actions[:1])
        if dice.chance(0.5):
            some = NotEqual(Reference(counter.name), Constant(0))
            yield Transition(f"clear_{counter.name}", _all(self._leaf(self.world), some), a=(_let(counter.name, 0),))

    def _stopping(self, _: Sequence[Operation]) -> list[Transition]:
        """Something from outside aborts the run, or fails what is executing."""
        if not self.inputs:
            return []
        wrong = self._unusual(self.inputs)
        if self.dice.chance(0.5):
            return [Transition("stop", wrong, a=(_let("plan.state", "aborted"),))]
        return [Transition("interrupt", wrong, _executing(), (_let("current.state", "failed"),))]

    def _impossible(self, operations: Sequence[Operation]) -> list[Transition]:
        """A guard that contradicts itself, or the runner."""
        variable = self.dice.pick(self.world)
        first, second = self.dice.some(variable.domain.values, 2)
        one, other = self.dice.some(operations, 2)
        guard = self.dice.pick(
            (
                _all(_is(variable.name, first), _is(variable.name, second)),
                _all(_is("current.name", one.name), _is(f"{other.name}.state", "executing")),
                _all(_is("current.name", "none"), NotEqual(Reference("current.state"), Constant("initial"))),
                _FALSE,
            )
        )
        return [Transition("impossible", guard, a=(_let(variable.name, first),))]

    def _for_one_operation(self, operations: Sequence[Operation]) -> list[Transition]:
        """Something happens in the world around one operation."""
        operation = self.dice.pick(operations)
        state = self.dice.pick(("executing", "disabled", "timedout", "failed", "completed", "initial"))
        around = _all(_is("current.name", operation.name), _is("current.state", state))
        if self.dice.chance(0.4):
            around = (
                _is(f"{operation.name}.state", state) if state != "initial" else _is("current.name", operation.name)
            )
        variable = self.dice.pick(self._visible)
        action = _let(variable.name, self.dice.pick(variable.domain.values))
        guard = _all(around, self._condition(self._visible)) if self.dice.chance(0.6) else around
        return [Transition(f"around_{operation.name}", guard, a=(action,))]

    def _sequence(self, _: Sequence[Operation]) -> list[Transition]:
        """Only some timeouts in a row, at the right place, lead here."""
        if not self.counters:
            return []
        counter = self.dice.pick(self.counters)
        reached = Order(Reference(counter.name), Relation.AT_LEAST, Constant(self.dice.pick(counter.domain.values[1:])))
        guard = _all(reached, self._leaf(self.world), self._leaf(self.world) if self.dice.chance(0.5) else _executing())
        action = _let(counter.name, 0) if self.dice.chance(0.5) else _let("plan.state", "aborted")
        return [Transition("after_timeouts", guard, a=(action,))]

    def _ring(self, _: Sequence[Operation]) -> list[Transition]:
        """Two transitions that undo each other, under a condition that may never hold."""
        if not self.dice.chance(0.5):
            return []
        variable = self.dice.pick(self.world)
        first, second = self.dice.some(variable.domain.values, 2)
        others = [v for v in self._visible if v is not variable] or self.world
        under = _all(self._leaf(others), self._leaf(others), _executing() if self.dice.chance(0.5) else _TRUE)
        return [
            Transition("forth", _all(_is(variable.name, first), under), a=(_let(variable.name, second),)),
            Transition("back", _all(_is(variable.name, second), under), a=(_let(variable.name, first),)),
        ]

    def _at_the_end(self, _: Sequence[Operation]) -> list[Transition]:
        """Something happens when a run begins or is over."""
        state = self.dice.pick(("completed", "completed", "unsolvable", "aborted", "planning", "idle"))
        variable = self.dice.pick(self._visible)
        action = _let(variable.name, self.dice.pick(variable.domain.values))
        guard = _all(_is("plan.state", state), self._condition(self.world) if self.dice.chance(0.6) else _TRUE)
        return [Transition(f"when_{state}", guard, a=(action,))]

    def _world_rule(self, _: Sequence[Operation]) -> list[Transition]:
        """The world changes by itself, or corrects what was measured."""
        variable = self.dice.pick(self._visible)
        action = _let(variable.name, self.dice.pick(variable.domain.values))
        return [Transition("rule", self._unusual(self._visible), self._hidden_guard(), (action,), self._note())]

    def _note(self) -> tuple[Action, ...]:
        """A command is forgotten; nothing reads it."""
        commands = list(self.commands.values())
        return (_let(commands[0].name, "nothing"),) if commands and self.dice.chance(0.3) else ()

    def _failing_one(self, operations: Sequence[Operation]) -> list[Transition]:
        """One operation fails under a condition of the world."""
        operation = self.dice.pick(operations)
        actions = (_let(f"{operation.name}.state", "failed"), *self._besides(0.3))
        return [Transition(f"break_{operation.name}", self._unusual(self._visible), a=actions)]

    def _shadowed(self, before: Transition) -> Transition:
        """A transition behind one that comes first wherever it could be taken, at least at first sight."""
        variable = self.dice.pick(self._visible)
        guard = _all(before.g, self._leaf(self._visible))
        return Transition(
            f"behind_{before.name}", guard, a=(_let(variable.name, self.dice.pick(variable.domain.values)),)
        )

    # what runs are for

    def _goals(self, planner: Planner) -> tuple[tuple[str, Predicate], ...]:
        return tuple((f"goal_{i}", self._far_goal(planner)) for i in range(1, 1 + self.dice.pick((1, 2, 3, 4, 5, 5))))

    def _far_goal(self, planner: Planner) -> Predicate:
        """Mostly one with a long plan; now and then one that is trivial or cannot be reached."""
        goals = [self._goal() for _ in range(1 if self.dice.chance(0.15) else 10)]
        return max(goals, key=lambda goal: _length(planner, goal))

    def _goal(self) -> Predicate:
        kind = self.dice.between(1, 20)
        if kind == 1:
            return _all(*(_is(v.name, v.initial) for v in self.world[:2]))
        if kind == 2:
            values = self.world[0].domain.values
            return _all(_is(self.world[0].name, values[0]), _is(self.world[0].name, values[1]))
        wanted = self.dice.some(self.world, self.dice.pick((1, 2, 3, 4, 5)))
        parts = [_is(v.name, self._new_value(v)) for v in wanted]
        if kind == 3:
            parts.append(_is(wanted[0].name, wanted[0].initial))
        if kind == 4:
            return _all(*parts, self._condition(self._visible))
        return _all(*parts) if kind > 5 else Or((parts[0], self._leaf(self.world)))

    def _new_value(self, variable: Variable) -> Value:
        """Mostly another value than the nominal one."""
        others = [value for value in variable.domain.values if value != variable.initial]
        return self.dice.pick(others) if self.dice.chance(0.85) else variable.initial

    def _resource(self, name: str) -> Resource:
        dice = self.dice
        commands = (self.commands[name].name,) if name in self.commands else ()
        measures = (self.measured[name].name,) if name in self.measured else ()
        simulated = (
            tuple(DrawnVariable(v.name, v.domain.values[: dice.between(1, 3)]) for v in [self.measured[name]])
            if measures
            else ()
        )
        half, quarter = Fraction(1, 2), Fraction(1, 4)
        outcomes = dice.pick(
            (
                ((Outcome.SUCCEED, half), (Outcome.FAIL, quarter), (Outcome.TIMEOUT, quarter)),
                ((Outcome.SUCCEED, half + quarter), (Outcome.FAIL, quarter)),
                ((Outcome.SUCCEED, Fraction(1)),),
            )
        )
        latency = dice.pick(
            (
                Latency(LatencyShape.FIXED, (0,)),
                Latency(LatencyShape.FIXED, (_SECOND_NS,)),
                Latency(LatencyShape.UNIFORM, (_SECOND_NS // 5, 3 * _SECOND_NS)),
                Latency(LatencyShape.TRIANGULAR, (0, _SECOND_NS, 12 * _SECOND_NS)),
            )
        )
        return Resource(name, commands, measures, Simulation(latency, outcomes, simulated))

    def _initial_states(self, model: BehaviorModel) -> Predicate:
        """What initial states satisfy, if there are some that do."""
        drawn = [v for v in model.variables if len(v.random) > 1]
        if not drawn or self.dice.chance(0.5):
            return _TRUE
        predicate = self._condition(drawn)
        combinations = InitialStates(model)
        allowed = (combinations.combination(n) for n in range(combinations.combinations))
        return predicate if any(predicate.holds(values) for values in allowed) else _TRUE

    def model(self, name: str) -> tuple[BehaviorModel, int]:
        """Everything together, and roughly how much can happen in its runs."""
        variables = self._variables()
        resources = tuple(self._resource(resource) for resource in self.resources)
        operations = self._operations()
        automatic = self._automatic(operations)
        model = BehaviorModel(name, variables, operations, resources, automatic)
        planner = Planner(model)
        model = replace(model, initial_states=self._initial_states(model), goals=self._goals(planner))
        return model, _size(model, planner)
