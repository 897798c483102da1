"""The obligations that mutants belong to: those whose transitions they change (decision 52)."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from scbm.cases.coverage import Aspect
from scbm.model.variables import CURRENT_STATE, operation_state_name
from scbm.mutation.mutants import MutatedPart, SubjectKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.cases.coverage import Obligations
    from scbm.model import BehaviorModel
    from scbm.mutation.mutants import Mutant


_PART = MutatedPart

_ASPECTS: dict[MutatedPart, tuple[Aspect, ...]] = {
    _PART.PRE_G: (Aspect.EXECUTING, Aspect.DISABLED),
    _PART.PRE_GR: (Aspect.EXECUTING, Aspect.DISABLED),
    _PART.PRE_A: (Aspect.EXECUTING,),
    _PART.PRE_AR: (Aspect.EXECUTING,),
    _PART.POST_G: (Aspect.COMPLETED,),
    _PART.POST_GR: (Aspect.COMPLETED,),
    _PART.POST_A: (Aspect.COMPLETED,),
    _PART.POST_AR: (Aspect.COMPLETED,),
    _PART.FAILED: (Aspect.FAILED,),
    _PART.FAILED_G: (Aspect.FAILED,),
    _PART.FAILED_GR: (Aspect.FAILED,),
    _PART.FAILED_A: (Aspect.FAILED,),
    _PART.FAILED_AR: (Aspect.FAILED,),
    _PART.TIMEDOUT: (Aspect.TIMEDOUT,),
    _PART.DEADLINE: (Aspect.TIMEDOUT,),
    _PART.DISABLED_DEADLINE: (Aspect.DISABLED,),
}
"""The aspects of an operation whose transitions a part decides."""


class MutantObligation(NamedTuple):
    """An obligation that a mutant belongs to.

    Attributes:
        bit: the bit of the obligation.
        visits: the obligations, as bits, that a case has to visit so that it is a case of this one.
    """

    bit: int
    visits: int


class MutantObligations:
    """The obligations of a model that its mutants belong to."""

    def __init__(self, model: BehaviorModel, obligations: Obligations) -> None:
        self._model = model
        self._obligations = obligations

    def of(self, mutant: Mutant) -> tuple[MutantObligation, ...]:
        """Return the obligations that a mutant belongs to."""
        return tuple(dict.fromkeys(self._found(mutant)))

    def _found(self, mutant: Mutant) -> Iterator[MutantObligation]:
        bit_of = self._obligations.bit_of
        match mutant.kind:
            case SubjectKind.OPERATION:
                for part in mutant.parts:
                    for aspect in _ASPECTS.get(part, ()):
                        bit = bit_of(mutant.subject, aspect)
                        yield MutantObligation(bit, bit)
            case SubjectKind.AUTOMATIC:
                taken = bit_of(mutant.subject, Aspect.TAKEN)
                yield MutantObligation(taken, taken)
                for name in self._failed_by(mutant.subject):
                    bit = bit_of(name, Aspect.FAILED)
                    yield MutantObligation(bit, bit | taken)
            case SubjectKind.ENVIRONMENT | SubjectKind.VARIABLE | SubjectKind.RESOURCE:
                return

    def _failed_by(self, name: str) -> Iterator[str]:
        """Yield the operations that an automatic transition can fail: it assigns their states."""
        transition = next(each for each in self._model.automatic_transitions if each.name == name)
        targets = [action.target for action in transition.running_actions]
        for operation in self._model.operations:
            if CURRENT_STATE in targets or operation_state_name(operation.name) in targets:
                yield operation.name


def belonging(found: tuple[MutantObligation, ...]) -> int:
    """Return the obligations of a mutant as bits."""
    bits = 0
    for each in found:
        bits |= each.bit
    return bits


def visited_ones(found: tuple[MutantObligation, ...], visited: int) -> int:
    """Return those of the obligations of a mutant that a case visits, as bits."""
    return belonging(tuple(each for each in found if each.visits & ~visited == 0))
