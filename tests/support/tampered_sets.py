"""Sets of certificates that have been tampered with."""

from __future__ import annotations

from random import Random

from msgspec.structs import replace

from scbm.model import PlanSet
from scbm.proofcheck import RequirementSetsArgument, SetsArgument


def tampered(argument: SetsArgument, dice: Random) -> SetsArgument:
    """The argument with a number changed: situations leave sets, states are dead, plans or watched sets are others."""
    numbers = range(2, len(argument.nodes) + 2)
    if isinstance(argument, RequirementSetsArgument) and dice.random() < 0.4:
        return replace(argument, watched=tuple(dice.choice([0, *numbers]) for _ in argument.watched))
    if argument.plans is PlanSet.CANONICAL and dice.random() < 0.5:
        field = dice.choice(["layers", "choices"])
        listed = list(getattr(argument, field))
        one, other = dice.randrange(len(listed)), dice.randrange(len(listed))
        listed[one], listed[other] = dice.choice([(listed[other], listed[one]), (0, listed[other])])
        return replace(argument, **{field: tuple(listed)})
    if dice.random() < 0.3:
        return replace(argument, dead=dice.choice([1, *numbers]))
    if dice.random() < 0.1:
        return replace(argument, reached=dice.choice([0, *numbers]))
    nodes = list(argument.nodes)
    at = dice.randrange(len(nodes))
    level, *following = nodes[at]
    following[dice.randrange(len(following))] = 0
    return replace(argument, nodes=(*nodes[:at], (level, *following), *nodes[at + 1 :]))
