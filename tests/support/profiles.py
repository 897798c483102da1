"""How many examples tests draw: few by default, all with `pytest --full`, and always the same ones."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, TypeVar

import pytest
from hypothesis import settings

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

Parameter = TypeVar("Parameter")

_ALL = 100
"""`max_examples` of the full profiles; that of the small one is the share, in per cent, that a usual run draws."""

# Examples are the same in every run: a test that fails only sometimes proves nothing. SCBM_EXPLORE=1 draws new ones.
# No deadlines: how fast a machine is says nothing about what is right.
settings.register_profile("small", derandomize=True, deadline=None, max_examples=10)
settings.register_profile("full", derandomize=True, deadline=None, max_examples=_ALL)
settings.register_profile("explore", derandomize=False, deadline=None, max_examples=_ALL)


def load_profile(*, is_full: bool) -> None:
    """Choose the profile of this process; test modules that are imported afterwards use it."""
    full = "explore" if os.environ.get("SCBM_EXPLORE") else "full"
    settings.load_profile(full if is_full or full == "explore" else "small")


def share(count: int, least: int = 5, usual: int | None = None) -> int:
    """Return how many of `count` examples the profile draws: all, or a share of at least `least`.

    `usual` is the number of the small profile where examples take long; by default a tenth.
    """
    profile = settings.default
    assert profile is not None
    drawn = min(count, max(least, count * profile.max_examples // _ALL))
    return drawn if usual is None or profile.max_examples == _ALL else min(drawn, usual)


def examples(count: int, usual: int | None = None) -> settings:
    """Return settings for a property that draws `count` examples in the full profile.

    `usual` is how many the small profile draws of a property whose examples take long; by default a tenth.
    """
    return settings(max_examples=share(count, usual=usual))


def slow_where(is_slow: Callable[[Parameter], bool], parameters: Iterable[Parameter]) -> list[object]:
    """The parameters of a test, those that take long in the slow tier."""
    return [pytest.param(each, marks=pytest.mark.slow) if is_slow(each) else each for each in parameters]


def slow_beyond(count: int, parameters: Sequence[object]) -> list[object]:
    """The parameters of a test: the first ones run always, the others in the slow tier."""
    return [*parameters[:count], *(pytest.param(each, marks=pytest.mark.slow) for each in parameters[count:])]


def longer_but_one_in(one_in: int, parameters: Sequence[Parameter]) -> list[object]:
    """The parameters of a test: one of so many runs always, the others in the longer tier."""
    return [
        pytest.param(each, marks=pytest.mark.longer) if number % one_in else each
        for number, each in enumerate(parameters)
    ]
