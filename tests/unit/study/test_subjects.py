"""The models of the study: as many as the protocol says, and each can be made."""

from __future__ import annotations

from collections import Counter

import pytest
from subjects import CONTROL, GENERATED, WRITTEN, subjects


def test_there_are_as_many_models_as_the_protocol_says() -> None:
    counted = Counter(subject.group for subject in subjects())
    assert counted[WRITTEN] >= 30
    assert (counted[GENERATED], counted[CONTROL]) == (60, 30)


@pytest.mark.slow
def test_each_model_can_be_made_and_has_a_goal() -> None:
    for subject in subjects():
        assert subject.model().goals, subject.name
