"""Random cases: a goal and an initial state drawn for each (paper, Section VI, step 3; semantics 7.5).

Each case has streams of chance of its own; see `chance`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.cases import Case, Network, Origin
from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.model import InitialStates, State
from scbm.testing.chance import case_stream
from scbm.testing.faults import draw_network

if TYPE_CHECKING:
    from collections.abc import Iterator
    from random import Random

    from scbm.model import BehaviorModel

_PERFECT = Network()

_TRIES = 1_000
"""So many combinations of random values are drawn until one is allowed."""

_MOST_LISTED = 100_000
"""After that, the allowed ones are listed, which shows whether there are any, unless there are more than so many."""


class RandomCases:
    """Draws the cases of campaigns for one model."""

    def __init__(
        self,
        model: BehaviorModel,
        file: str | None = None,
        network: Network | None = _PERFECT,
    ) -> None:
        """Raises `InputError` if the model has no goals.

        Args:
            model: what is tested.
            file: what errors call the model; its name if nothing is said.
            network: how messages travel in every case; `None` draws another network for each.
        """
        self.model = model
        self._network = network
        self._place = Place(file or model.name)
        self._initial = InitialStates(model)
        if not model.goals:
            raise self._error(Slug.NO_GOALS, "the model has no goals to draw from", "add `goals:` to the model")
        self._listed: tuple[State, ...] | None = None

    def first(self, count: int, seed: int) -> Iterator[Case]:
        """Cases 1 to `count` of a seed."""
        return (self.case(seed, number) for number in range(1, count + 1))

    def case(self, seed: int, number: int) -> Case:
        """Case `number`, counted from 1. Raises `InputError` if no allowed initial state is found."""
        origin = Origin(seed, number)
        random = case_stream(origin)
        network = draw_network(self.model, origin) if self._network is None else self._network
        goal, predicate = self.model.goals[int(random.random() * len(self.model.goals))]
        name = f"seed-{seed}-case-{number}"
        return Case(name, goal, predicate, self._draw_state(random), network=network, origin=origin)

    def _draw_state(self, random: Random) -> State:
        space = self.model.space
        for _ in range(_TRIES):
            values = {v.name: v.random[int(random.random() * len(v.random))] for v in space}
            if self._initial.allows(values):
                return State(space, values)
        listed = self._list()
        return listed[int(random.random() * len(listed))]

    def _list(self) -> tuple[State, ...]:
        """All allowed states, for a predicate that hardly any combination satisfies."""
        says = f"it says: {self.model.initial_states}"
        if self._initial.combinations > _MOST_LISTED:
            message = f"none of {_TRIES} drawn combinations of random initial values satisfies `initial_states`"
            raise self._error(Slug.INITIAL_STATE_NOT_FOUND, message, f"list fewer random values; {says}")
        if self._listed is None:
            self._listed = tuple(self._initial.allowed(_MOST_LISTED))
        if not self._listed:
            message = "no combination of the random initial values satisfies `initial_states`"
            raise self._error(Slug.NO_INITIAL_STATE, message, says)
        return self._listed

    def _error(self, slug: Slug, message: str, remedy: str) -> InputError:
        return InputError([Diagnostic(slug, message, self._place, remedy)])
