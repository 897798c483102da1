"""Runs the cases of a store again: in simulation from the case, over nodes from its log (decisions 20, 29).

What a store keeps of a case that is going to be run: all that decides it, and no more.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

from msgspec.structs import replace

from scbm.cases import Network
from scbm.files import Scope, digest_of, parse_requirement, read_case, read_network, write_case, write_network
from scbm.model import InputError, PlannerIdentity, Requirement
from scbm.planning import DEFAULT_PLANNER, DRAWN_PLANS, PLANNERS, model_planned_by
from scbm.store.history import Drawn, Written
from scbm.store.packed_logs import unpacked_log
from scbm.testing import RandomCases, Tester

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.cases import Case
    from scbm.model import BehaviorModel
    from scbm.running import Program
    from scbm.store.history import History, StoredCase
    from scbm.testing import Execution

DRAWN = "drawn"
"""The word of a recipe for a network that is drawn anew for each case."""


def written_recipe(
    case: Case,
    model: BehaviorModel,
    path: str,
    completed: Case | None = None,
    real: tuple[str, ...] | None = None,
) -> Written:
    """Return the recipe of a case from a file.

    Args:
        case: the case as the file says it.
        model: its model.
        path: the file.
        completed: the case with what the command line added to it, if it did.
        real: if it runs over nodes, the resources that are real.
    """
    completed = completed or case
    added = [requirement for requirement in completed.requirements if requirement not in case.requirements]
    limit_ns = completed.limits.time_ns if case.limits.time_ns is None else None
    return Written(write_case(case, model, None), path, _sentences(added), limit_ns, real)


def _sentences(requirements: Iterable[Requirement]) -> tuple[tuple[str, str], ...]:
    return tuple((requirement.name, str(requirement.sentence)) for requirement in requirements)


def network_words(network: Network | None) -> str:
    """Return the words of a recipe for the network of random cases; `None` is a network drawn for each case."""
    return DRAWN if network is None else write_network(network)


def drawn_recipe(case: Case, network: str, real: tuple[str, ...] | None = None) -> Drawn:
    """Return the recipe of a random case.

    Args:
        case: the case, with what the command line added to it.
        network: the words for its network.
        real: if it runs over nodes, the resources that are real.
    """
    if case.origin is None:
        raise ValueError(f"`{case.name}` is not drawn")
    origin, requirements = case.origin, _sentences(case.requirements)
    added = (requirements, case.limits.time_ns, real, origin.moves_inputs, origin.goals)
    return Drawn(origin.seed, origin.number, network, *added)


class Replays:
    """Makes the cases of a store again, and runs them."""

    def __init__(self, history: History) -> None:
        self._model = history.model
        self._runs = history.runs
        self._testers: dict[str, Tester] = {}
        self._random: dict[tuple[str, bool, int], RandomCases] = {}
        self._requirements: dict[str, Requirement] = {}

    def execute(self, stored: StoredCase) -> Execution | None:
        """Return the run of a case: in simulation the case is run again, over nodes its log is.

        `None` for a case of an earlier version of the model, one that was lost with a node, and for a log that does
        not give its run again, as another version of scbm made it. Also `None` for a case that another program planned,
        if the case does not have the plans.
        """
        if not stored.is_shown_again:
            return None
        if stored.log is None and self._is_planned_elsewhere(stored):
            return None
        return self._tester(stored).execute(self.case(stored)) if stored.log is None else self._of_log(stored)

    def _tester(self, stored: StoredCase) -> Tester:
        """Return a tester with the planner of the run that had the case."""
        planner = self._runs[stored.run].planner
        if planner not in self._testers:
            self._testers[planner] = Tester(model_planned_by(PlannerIdentity.parse(planner), self._model))
        return self._testers[planner]

    def _is_planned_elsewhere(self, stored: StoredCase) -> bool:
        """Return whether another program made the plans of a case, and the case does not have them."""
        name = PlannerIdentity.parse(self._runs[stored.run].planner).name
        entry = PLANNERS.get(DEFAULT_PLANNER if name == DRAWN_PLANS else name)  # drawn plans are drawn again
        return (entry is None or entry.is_external) and not self.case(stored).plans

    def _of_log(self, stored: StoredCase) -> Execution | None:
        """Return the run of a log, if that is still the run that it was."""
        from scbm.testing.event_logs.event_log import read_event_log, rerun  # noqa: PLC0415 - it takes long to load; few stores need it

        try:
            log = read_event_log(unpacked_log(stored.log or b""), self._model, self._digest)
            run = rerun(log, self._program)
        except (InputError, ValueError):
            return None
        execution = self._tester(stored).judged(log.case, run, log.reactions, log)
        return execution if execution.digest == log.trace else None

    @cached_property
    def _digest(self) -> str:
        return digest_of(self._model)

    @cached_property
    def _program(self) -> Program:
        from scbm.running import Program  # noqa: PLC0415 - as above

        return Program(self._model)

    def recorded(self, stored: StoredCase) -> Case:
        """Return a case of a simulation with nothing left to chance: a written one as it is, a drawn one closed."""
        case = self.case(stored)
        return case if isinstance(stored.recipe, Written) else self._tester(stored).execute(case).recorded_case

    def case(self, stored: StoredCase) -> Case:
        """Return the case, which is of the model of the store; raise `InputError` if this scbm cannot read it."""
        recipe = stored.recipe
        if isinstance(recipe, Written):
            case = read_case(recipe.text, self._model, recipe.path)
        else:
            case = self._random_cases(recipe).case(recipe.seed, recipe.number)
        added = tuple(self._requirement(name, sentence) for name, sentence in recipe.requirements)
        limit_ns = recipe.time_limit_ns if case.limits.time_ns is None else case.limits.time_ns
        limits = replace(case.limits, time_ns=limit_ns)
        return replace(case, requirements=(*case.requirements, *added), limits=limits)

    def _random_cases(self, recipe: Drawn) -> RandomCases:
        key = (recipe.network, recipe.moves_inputs, recipe.goals)
        if key not in self._random:
            drawn_in, moves_inputs = self._network(recipe.network), recipe.moves_inputs
            cases = RandomCases(self._model, network=drawn_in, moves_inputs=moves_inputs, goals=recipe.goals)
            self._random[key] = cases
        return self._random[key]

    def _network(self, text: str) -> Network | None:
        if text == DRAWN:
            return None
        return read_network(text, self._model, file="network") if text else Network()

    def _requirement(self, name: str, sentence: str) -> Requirement:
        if sentence not in self._requirements:
            parsed = parse_requirement(sentence, Scope.of(self._model), file="requirement")
            self._requirements[sentence] = Requirement(name, parsed)
        return replace(self._requirements[sentence], name=name)
