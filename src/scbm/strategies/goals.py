"""What a run is for."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.errors import Diagnostic, InputError, Place, Slug
from scbm.strategies.choices import one_of

if TYPE_CHECKING:
    from hypothesis.strategies import SearchStrategy

    from scbm.model import BehaviorModel, Predicate


def goals(model: BehaviorModel) -> SearchStrategy[tuple[str, Predicate]]:
    """The goals of a model, each with its name; shrinks towards the first.

    Raises:
        InputError: the model has none.
    """
    if not model.goals:
        message, remedy = "the model has no goals to draw from", "add `goals:` to the model"
        raise InputError([Diagnostic(Slug.NO_GOALS, message, Place(model.name), remedy)])
    return one_of(model.goals)
