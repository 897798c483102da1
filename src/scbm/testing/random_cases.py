"""Random cases: goals, initial state and, on request, network of each case (paper, Section VI, step 3; semantics 7.5).

The seed and the number of a case determine what is drawn for the case. The first goal and the initial state come from
`case_stream`, further goals from `goal_stream`, the network from `fault_stream` (`testing/random_streams.py`). So the
first goal and the initial state are the same whether or not the others are drawn. A drawn network has each kind of
fault with probability 1/2, and always a value for each limit.
"""

from __future__ import annotations

from fractions import Fraction
from typing import TYPE_CHECKING, TypeVar, assert_never

from scbm.cases import NETWORK_FAULTS, Case, CaseGoal, FaultAction, Network, Origin, ShareFault, TimeFault, WindowFault
from scbm.cases.trace import End
from scbm.model import Diagnostic, GoalOrder, InitialStates, InputError, Place, Slug, State
from scbm.testing.random_streams import case_stream, fault_stream, goal_stream

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from random import Random

    from scbm.cases import AnyNetworkFault, FaultWindow
    from scbm.model import BehaviorModel, Predicate

_T = TypeVar("_T")

_PERFECT = Network()
"""The network of cases without network faults."""

_TRIES = 1_000
"""Maximum number of combinations of random initial values that are drawn until one is allowed."""

_MAX_LISTED = 100_000
"""Maximum number of combinations for listing the allowed ones, which happens after `_TRIES` drawn ones."""

_MS_NS = 1_000_000

_MAX_PER_CENT = 20
"""Maximum probability of a fault in a drawn network, in per cent."""

_LATEST_MS = 20_000
"""Latest beginning of a drawn window, such as a partition, in time of the run."""

_LONGEST_MS = 5_000
"""Maximum length of a drawn window."""


MOST_GOALS = 3
"""The largest number of goals of a random case in a model whose goals follow each other, if nothing else is asked."""


_WITHOUT_PLAN = (End.UNSOLVABLE, End.TIME_LIMIT)
"""How the run for a goal without plan ends: at once, or, where the environment acts in time, at the limit of time."""


def most_goals(model: BehaviorModel) -> int:
    """Return the largest number of goals of a random case if nothing else is asked for: 1 where runs are single."""
    return MOST_GOALS if model.runs.goals is GoalOrder.SEQUENCE else 1


def draw_network(model: BehaviorModel, origin: Origin) -> Network:
    """Return a network with a value for each kind of fault, drawn in the order of `NETWORK_FAULTS`.

    Durations are whole milliseconds, probabilities whole per cent of at most 20. Windows, such as partitions,
    begin in the first twenty seconds of the run and last five at most.
    """
    resources = [resource.name for resource in model.resources]
    draw = _Draw(fault_stream(origin))
    return Network(**{fault.attribute: _draw_value(fault, draw, resources) for fault in NETWORK_FAULTS.values()})


def _draw_value(fault: AnyNetworkFault, draw: _Draw, resources: list[str]) -> object:
    """Draw the value of a kind of fault by its form."""
    match fault:
        case TimeFault(action=FaultAction.LIMIT):
            return draw.from_one_to(fault.most_drawn_ms) * _MS_NS
        case TimeFault():
            return draw.perhaps(fault.most_drawn_ms) * _MS_NS
        case ShareFault():
            return Fraction(draw.perhaps(_MAX_PER_CENT), 100)
        case WindowFault():
            subjects = resources if fault.needs_resource else [None, *resources]
            return (_draw_window(fault, draw, subjects),) if draw.coin() and subjects else ()
        case _:
            assert_never(fault)


def _draw_window(fault: WindowFault, draw: _Draw, subjects: Sequence[str | None]) -> FaultWindow:
    """Draw a window, its attributes in the order of its fields."""
    draws: dict[str, Callable[[], object]] = {
        "resource": lambda: draw.one_of(subjects),
        "at_ns": draw.moment_ns,
        "for_ns": draw.length_ns,
    }
    window: FaultWindow = fault.window(**{name: draws[name]() for name in fault.window.__struct_fields__})
    return window


class _Draw:
    """Draws numbers, times and probabilities for networks."""

    def __init__(self, random: Random) -> None:
        self._random = random

    def coin(self) -> bool:
        return self._random.random() < 1 / 2

    def from_one_to(self, most: int) -> int:
        return 1 + int(self._random.random() * most)

    def perhaps(self, most: int) -> int:
        """Return 0, or with the same probability a number from 1 to `most`."""
        return self.from_one_to(most) if self.coin() else 0

    def moment_ns(self) -> int:
        return int(self._random.random() * _LATEST_MS) * _MS_NS

    def length_ns(self) -> int:
        return self.from_one_to(_LONGEST_MS) * _MS_NS

    def one_of(self, choices: Sequence[_T]) -> _T:
        return choices[int(self._random.random() * len(choices))]


class RandomCases:
    """Draws the cases of campaigns for one model."""

    def __init__(
        self,
        model: BehaviorModel,
        file: str | None = None,
        network: Network | None = _PERFECT,
        *,
        moves_inputs: bool = False,
        goals: int = 1,
    ) -> None:
        """Take the model; raise `InputError` if it has no goals.

        Args:
            model: the model under test.
            file: the name of the model in errors; by default the name that it has.
            network: how messages travel in every case; `None` draws another network for each.
            moves_inputs: whether inputs and published values without environment transitions are moved, too.
            goals: the largest number of goals of a case.
        """
        self.model = model
        self._network = network
        self._moves_inputs = moves_inputs
        self._goals = goals
        self._place = Place(file or model.name)
        self._initial = InitialStates(model)
        if not model.goals:
            raise self._error(Slug.NO_GOALS, "the model has no goals to draw from", "add `goals:` to the model")
        self._listed: tuple[State, ...] | None = None

    def first(self, count: int, seed: int) -> Iterator[Case]:
        """Return cases 1 to `count` of a seed."""
        return (self.case(seed, number) for number in range(1, count + 1))

    def case(self, seed: int, number: int) -> Case:
        """Return case `number`, counted from 1; raise `InputError` if no allowed initial state is found."""
        origin = Origin(seed, number, self._moves_inputs, self._goals)
        random = case_stream(origin)
        network = draw_network(self.model, origin) if self._network is None else self._network
        goal, predicate = self._draw_goal(random)
        name, later = f"seed-{seed}-case-{number}", tuple(self._draw_later(goal_stream(origin)))
        return Case(name, goal, predicate, self._draw_state(random), network=network, origin=origin, later=later)

    def _draw_goal(self, random: Random) -> tuple[str, Predicate]:
        return self.model.goals[int(random.random() * len(self.model.goals))]

    def _draw_later(self, random: Random) -> Iterator[CaseGoal]:
        """Yield the goals after the first one.

        Some goals of a model exclude others, so there may be no plan: such a run is unsolvable, or waits in vain.
        """
        for _ in range(int(random.random() * self._goals)):
            goal, predicate = self._draw_goal(random)
            yield CaseGoal(goal, predicate, may_end=_WITHOUT_PLAN if self.model.environment else _WITHOUT_PLAN[:1])

    def _draw_state(self, random: Random) -> State:
        space = self.model.space
        for _ in range(_TRIES):
            values = {v.name: v.random[int(random.random() * len(v.random))] for v in space}
            if self._initial.allows(values):
                return State(space, values)
        listed = self._list()
        return listed[int(random.random() * len(listed))]

    def _list(self) -> tuple[State, ...]:
        """Return all allowed states, for a predicate that few combinations satisfy."""
        says = f"it says: {self.model.initial_states}"
        if self._initial.combinations > _MAX_LISTED:
            message = f"none of {_TRIES} drawn combinations of random initial values satisfies `initial_states`"
            raise self._error(Slug.INITIAL_STATE_NOT_FOUND, message, f"list fewer random values; {says}")
        if self._listed is None:
            self._listed = tuple(self._initial.allowed(_MAX_LISTED))
        if not self._listed:
            message = "no combination of the random initial values satisfies `initial_states`"
            raise self._error(Slug.NO_INITIAL_STATE, message, says)
        return self._listed

    def _error(self, slug: Slug, message: str, remedy: str) -> InputError:
        return InputError([Diagnostic(slug, message, self._place, remedy)])
