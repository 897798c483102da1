"""The cases of a campaign, each made from its position: from files first, then random ones."""

from __future__ import annotations

from functools import cached_property
from itertools import chain, count
from typing import TYPE_CHECKING, Protocol

from msgspec import Struct, field
from msgspec.structs import replace

from scbm.cases import Network
from scbm.testing.random_cases import RandomCases

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from scbm.cases import Case
    from scbm.model import BehaviorModel, Requirement


class CaseSource(Protocol):
    """The cases of a campaign by their positions, from 1."""

    def case(self, position: int) -> Case:
        """Return the case at a position."""
        ...

    def name(self, position: int) -> str:
        """Return the name of the case at a position."""
        ...


class ListedCases(Struct, frozen=True):
    """Cases in memory."""

    cases: Sequence[Case]

    def case(self, position: int) -> Case:
        """Return the case at a position."""
        return self.cases[position - 1]

    def name(self, position: int) -> str:
        """Return the name of the case at a position."""
        return self.cases[position - 1].name


class FollowedBy(Struct, frozen=True):
    """Some cases, and others after them.

    Attributes:
        first: the cases that come first.
        count: how many these are.
        rest: the others.
    """

    first: CaseSource
    count: int
    rest: CaseSource

    def case(self, position: int) -> Case:
        """Return the case at a position."""
        return self.first.case(position) if position <= self.count else self.rest.case(position - self.count)

    def name(self, position: int) -> str:
        """Return the name of the case at a position."""
        return self.first.name(position) if position <= self.count else self.rest.name(position - self.count)


class CampaignWork(Struct, frozen=True, dict=True):
    """A campaign that is to be run; it can be sent to other processes as it is.

    Attributes:
        model: what is tested.
        written: the cases from files, which run first.
        numbers: the numbers of the random cases, from 1.
        seed: what random cases are drawn from.
        network: the faults of their network; `None` draws another network for each.
        requirements: what every case must meet beside the requirements of the model.
        time_limit_ns: for cases that have no limit of their own.
        file: the name of the model in errors; by default the name that it has.
        moves_inputs: whether random cases move inputs and published values without environment transitions, too.
        goals: the largest number of goals of a random case.
    """

    model: BehaviorModel
    written: Sequence[Case] = ()
    numbers: Sequence[int] = ()
    seed: int = 0
    network: Network | None = field(default_factory=Network)
    requirements: tuple[Requirement, ...] = ()
    time_limit_ns: int | None = None
    file: str | None = None
    moves_inputs: bool = False
    goals: int = 1

    @property
    def count(self) -> int:
        """The number of cases."""
        return len(self.written) + len(self.numbers)

    def case(self, position: int) -> Case:
        """Return the case at a position, complete. Raise `InputError` if it cannot be drawn."""
        index = position - 1 - len(self.written)
        case = self.written[index] if index < 0 else self._random.case(self.seed, self.numbers[index])
        return complete(case, self.requirements, self.time_limit_ns, self.model)

    def name(self, position: int) -> str:
        """Return the name of the case at a position; the case is not drawn."""
        index = position - 1 - len(self.written)
        return self.written[index].name if index < 0 else drawn_name(self.seed, self.numbers[index])

    def cases(self) -> Iterator[Case]:
        """Yield all cases in their order."""
        return map(self.case, range(1, self.count + 1))

    @cached_property
    def _random(self) -> RandomCases:
        moves_inputs, goals = self.moves_inputs, self.goals
        return RandomCases(self.model, self.file, self.network, moves_inputs=moves_inputs, goals=goals)


def drawn_name(seed: int, number: int) -> str:
    """Return the name of a random case."""
    return f"seed-{seed}-case-{number}"


def complete(case: Case, requirements: Sequence[Requirement], time_limit_ns: int | None, model: BehaviorModel) -> Case:
    """Return the case with requirements and a time limit of its campaign, so that it keeps them when it is saved."""
    if time_limit_ns is not None and case.limits.time_ns is None:
        case = replace(case, limits=replace(case.limits, time_ns=time_limit_ns))
    return replace(case, requirements=_add_requirements(case, requirements, model)) if requirements else case


def _add_requirements(case: Case, asked: Iterable[Requirement], model: BehaviorModel) -> tuple[Requirement, ...]:
    """Return the requirements of a case with additional ones, which get names that are free."""
    requirements = list(case.requirements)
    for requirement in asked:
        if all(known.sentence != requirement.sentence for known in requirements):
            taken = [known.name for known in (*requirements, *model.requirements)]
            names = chain([requirement.name], (f"required_{number}" for number in count(1)))
            requirements.append(replace(requirement, name=next(name for name in names if name not in taken)))
    return tuple(requirements)
