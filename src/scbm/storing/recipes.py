"""What a store keeps of a case that is going to be run: all that decides it, and no more."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.notation import write_case, write_network
from scbm.storing.history import Drawn, Written

if TYPE_CHECKING:
    from scbm.cases import Case, Network
    from scbm.model import BehaviorModel

DRAWN = "drawn"
"""What a recipe says for another network in each case."""


def written_recipe(case: Case, model: BehaviorModel, path: str) -> Written:
    """The recipe of a case from a file, with what the command line added to it."""
    return Written(write_case(case, model, None), path)


def network_words(network: Network | None) -> str:
    """What recipes of random cases say of their network; `None` is another one for each case."""
    return DRAWN if network is None else write_network(network)


def drawn_recipe(case: Case, network: str) -> Drawn:
    """The recipe of a random case.

    Args:
        case: the case, with what the command line added to it.
        network: the words for its network.
    """
    if case.origin is None:
        raise ValueError(f"`{case.name}` is not drawn")
    requirements = tuple((requirement.name, str(requirement.sentence)) for requirement in case.requirements)
    return Drawn(case.origin.seed, case.origin.number, network, requirements, case.limits.time_ns)
