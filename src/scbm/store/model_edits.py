"""Compares two versions of a model: which obligations mean the same in both, and whether only objects differ."""

from __future__ import annotations

from typing import TYPE_CHECKING

from msgspec import Struct

from scbm.cases.coverage import Aspect, Obligation, Obligations
from scbm.files import read_model

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, ObjectLists

_MAX_NAMED = 5


class Dropped(Struct, frozen=True):
    """An obligation that was visited and does not go over.

    Attributes:
        obligation: which, in the model that it is of.
        is_gone: whether the edited model lacks it; else it is there and says something else.
    """

    obligation: Obligation
    is_gone: bool


class ModelEdit:
    """From one model to another: obligations of equal names, whose operation or automatic transition says the same."""

    def __init__(self, before: BehaviorModel, after: BehaviorModel) -> None:
        self._before = Obligations.of(before)
        self._after = Obligations.of(after)
        self._kept = _equal_parts(before, after)

    def mapped(self, visited: int) -> int:
        """Return obligations of the model before as those of the model after that they are; both as bits."""
        return sum(self._after.bit(o) for o in self._before if visited & self._before.bit(o) and self._is_kept(o))

    def dropped(self, visited: int) -> tuple[Dropped, ...]:
        """Return the obligations that the other model does not keep; those of one operation stand together."""
        lost = [o for o in self._before if visited & self._before.bit(o) and not self._is_kept(o)]
        subjects = dict.fromkeys((o.aspect is Aspect.TAKEN, o.subject) for o in lost)
        by_subject = (o for subject in subjects for o in lost if (o.aspect is Aspect.TAKEN, o.subject) == subject)
        return tuple(Dropped(o, is_gone=not self._after.bit(o)) for o in by_subject)

    def _is_kept(self, obligation: Obligation) -> bool:
        return (obligation.aspect is Aspect.TAKEN, obligation.subject) in self._kept


def _equal_parts(before: BehaviorModel, after: BehaviorModel) -> frozenset[tuple[bool, str]]:
    """Return the operations and automatic transitions that are equal in both: whether automatic, and the name."""
    operations = {o.name: o for o in after.operations}
    transitions = {t.name: t for t in after.automatic_transitions}
    return frozenset(
        (
            *((False, o.name) for o in before.operations if operations.get(o.name) == o),
            *((True, t.name) for t in before.automatic_transitions if transitions.get(t.name) == t),
        )
    )


def has_other_objects(stored: ObjectLists | None, model: BehaviorModel) -> bool:
    """Return whether two models are the same lifted model with other objects or other tables (semantics 8.7).

    Args:
        stored: the objects of one model, as a store has them.
        model: the other model.
    """
    return stored is not None and model.objects is not None and stored.is_other_list(model.objects)


def difference(name: str, text: str, model: BehaviorModel) -> str:
    """Return the differences of a stored model from another model, in a few words."""
    if name != model.name:
        return f"`{name}`, not `{model.name}`"
    stored = read_model(text, name)
    differences = list(_differences(stored, model.unbound)) or ["the order of its parts"]
    more = f" and {len(differences) - _MAX_NAMED} more" if len(differences) > _MAX_NAMED else ""
    return f"{', '.join(differences[:_MAX_NAMED])}{more}"


def _differences(stored: BehaviorModel, model: BehaviorModel) -> Iterator[str]:
    parts = (
        ("variable", stored.variables, model.variables),
        ("resource", stored.resources, model.resources),
        ("operation", stored.operations, model.operations),
        ("automatic transition", stored.automatic_transitions, model.automatic_transitions),
        ("requirement", stored.requirements, model.requirements),
    )
    for noun, before, after in parts:
        old = {part.name: part for part in before}
        new = {part.name: part for part in after}
        for part in dict.fromkeys((*old, *new)):
            if old.get(part) != new.get(part):
                how = "is new" if part not in old else "is gone" if part not in new else "was edited"
                yield f"{noun} `{part}` {how}"
    if stored.goals != model.goals:
        yield "its goals were edited"
    if stored.requirements_off != model.requirements_off:
        yield "its `requirements_off` were edited"
    if stored.requirements_on != model.requirements_on:
        yield "its `requirements_on` were edited"
    if stored.initial_states != model.initial_states:
        yield "its initial states were edited"
