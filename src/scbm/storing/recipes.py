"""What a store keeps of a case that is going to be run: all that decides it, and no more."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.notation import write_case, write_network
from scbm.storing.history import Drawn, Written

if TYPE_CHECKING:
    from collections.abc import Iterable

    from scbm.cases import Case, Network
    from scbm.model import BehaviorModel, Requirement

DRAWN = "drawn"
"""What a recipe says for another network in each case."""


def written_recipe(
    case: Case,
    model: BehaviorModel,
    path: str,
    completed: Case | None = None,
    real: tuple[str, ...] | None = None,
) -> Written:
    """The recipe of a case from a file.

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
    return Written(write_case(case, model, None), path, _said(added), limit_ns, real)


def _said(requirements: Iterable[Requirement]) -> tuple[tuple[str, str], ...]:
    return tuple((requirement.name, str(requirement.sentence)) for requirement in requirements)


def network_words(network: Network | None) -> str:
    """What recipes of random cases say of their network; `None` is another one for each case."""
    return DRAWN if network is None else write_network(network)


def drawn_recipe(case: Case, network: str, real: tuple[str, ...] | None = None) -> Drawn:
    """The recipe of a random case.

    Args:
        case: the case, with what the command line added to it.
        network: the words for its network.
        real: if it runs over nodes, the resources that are real.
    """
    if case.origin is None:
        raise ValueError(f"`{case.name}` is not drawn")
    origin = case.origin
    return Drawn(origin.seed, origin.number, network, _said(case.requirements), case.limits.time_ns, real)
