"""Cases of a store at work again: a case decides its run, so the store keeps no traces."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from scbm.cases import Network
from scbm.model import Requirement
from scbm.notation import Scope, parse_requirement, read_case, read_network
from scbm.storing.history import Written
from scbm.storing.recipes import DRAWN
from scbm.testing import RandomCases, Tester

if TYPE_CHECKING:
    from scbm.cases import Case
    from scbm.storing.history import History, StoredCase
    from scbm.testing import Execution


class Replays:
    """Makes the cases of a store again, and runs them."""

    def __init__(self, history: History) -> None:
        self._model = history.model
        self._tester = Tester(history.model)
        self._random: dict[str, RandomCases] = {}
        self._requirements: dict[str, Requirement] = {}

    def execute(self, stored: StoredCase) -> Execution | None:
        """The run of a case; `None` for a case of an earlier version of the model, or one that was lost with a node."""
        return self._tester.execute(self.case(stored)) if stored.is_repeatable else None

    def recorded(self, stored: StoredCase) -> Case:
        """A case that can be run again, with nothing left to chance: a written one as it is, a drawn one closed."""
        case = self.case(stored)
        return case if isinstance(stored.recipe, Written) else self._tester.execute(case).recorded_case

    def case(self, stored: StoredCase) -> Case:
        """The case itself, which is of the model of the store. Raises `InputError` if this scbm cannot read it."""
        recipe = stored.recipe
        if isinstance(recipe, Written):
            case = read_case(recipe.text, self._model, recipe.path)
        else:
            case = self._random_cases(recipe.network).case(recipe.seed, recipe.number)
        added = tuple(self._requirement(name, sentence) for name, sentence in recipe.requirements)
        limit_ns = recipe.time_limit_ns if case.limits.time_ns is None else case.limits.time_ns
        limits = replace(case.limits, time_ns=limit_ns)
        return replace(case, requirements=(*case.requirements, *added), limits=limits)

    def _random_cases(self, network: str) -> RandomCases:
        if network not in self._random:
            self._random[network] = RandomCases(self._model, network=self._network(network))
        return self._random[network]

    def _network(self, text: str) -> Network | None:
        if text == DRAWN:
            return None
        return read_network(text, self._model, file="network") if text else Network()

    def _requirement(self, name: str, sentence: str) -> Requirement:
        if sentence not in self._requirements:
            parsed = parse_requirement(sentence, Scope.of(self._model), file="requirement")
            self._requirements[sentence] = Requirement(name, parsed)
        return replace(self._requirements[sentence], name=name)
