"""The suites of the study: how cases of the pool of one model are put together (protocol, Cases and suites)."""

from __future__ import annotations

from functools import reduce
from random import Random
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from kill_matrix import CaseFacts

SIZES = (2, 4, 8, 16, 32)
"""Numbers of cases."""

REQUESTS = (25, 50, 100, 200, 400)
"""Numbers of requests."""

CHOICE = 10
"""A case that is chosen by coverage is the best of so many."""

Suite = tuple[int, ...]
"""The numbers of its cases."""


def random_suites(pool: int, size: int, count: int, seed: int = 2) -> Iterator[Suite]:
    """Yield suites of `size` cases, drawn without putting back; none if the pool is smaller."""
    random = Random(f"{seed}/{size}")
    if size <= pool:
        for _ in range(count):
            yield tuple(random.sample(range(pool), size))


def chosen_suites(facts: Sequence[CaseFacts], size: int, count: int, seed: int = 3) -> Iterator[Suite]:
    """Yield suites in which each case is the one of ten drawn ones that adds most obligations."""
    random = Random(f"{seed}/{size}")
    if size <= len(facts):
        for _ in range(count):
            yield _chosen(facts, size, random)


def _chosen(facts: Sequence[CaseFacts], size: int, random: Random) -> Suite:
    left, visited = list(range(len(facts))), 0
    suite: list[int] = []
    while len(suite) < size:
        drawn = random.sample(left, min(CHOICE, len(left)))
        best = max(drawn, key=lambda number: (facts[number].visited & ~visited).bit_count())  # the first of the best
        suite.append(best)
        left.remove(best)
        visited |= facts[best].visited
    return tuple(suite)


def suites_of_requests(facts: Sequence[CaseFacts], requests: int, count: int, seed: int = 2) -> Iterator[Suite]:
    """Yield suites drawn until they have so many requests, without the case that passes the number."""
    random = Random(f"{seed}/requests/{requests}")
    if sum(fact.requests for fact in facts) <= requests:
        return
    for _ in range(count):
        order = random.sample(range(len(facts)), len(facts))
        suite, sent = [], 0
        for number in order:
            sent += facts[number].requests
            if sent > requests:
                break
            suite.append(number)
        yield tuple(suite)


def matching_suite(
    facts: Sequence[CaseFacts], requests: int, random: Random, *, generous: bool = False
) -> Suite | None:
    """Return a random suite for comparison with another one that has so many requests.

    Args:
        facts: the facts of the cases of the pool.
        requests: the number of requests; `None` is returned if the pool has fewer.
        random: the source of the choice.
        generous: whether the case that passes the number belongs to the suite.
    """
    if sum(fact.requests for fact in facts) < requests:
        return None
    suite: list[int] = []
    sent = 0
    for number in random.sample(range(len(facts)), len(facts)):
        sent += facts[number].requests
        if sent > requests and not generous:
            break
        suite.append(number)
        if sent >= requests:
            break
    return tuple(suite)


def completed(suite: Suite, facts: Sequence[CaseFacts], closed: range) -> Suite:
    """Return a suite with closed cases that visit what it does not visit, each the one that adds most."""
    cases, visited = list(suite), visited_by(suite, facts)
    while True:
        best = max(closed, key=lambda number: (facts[number].visited & ~visited).bit_count(), default=None)
        if best is None or not facts[best].visited & ~visited:
            return tuple(cases)
        cases.append(best)
        visited |= facts[best].visited


def visited_by(suite: Iterable[int], facts: Sequence[CaseFacts]) -> int:
    """Return the obligations that a suite visits, as bits."""
    return reduce(lambda seen, number: seen | facts[number].visited, suite, 0)


def requests_of(suite: Iterable[int], facts: Sequence[CaseFacts]) -> int:
    """Return the number of requests of a suite."""
    return sum(facts[number].requests for number in suite)
