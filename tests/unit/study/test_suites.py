"""The suites of the study: drawn, chosen by coverage, limited by requests, and completed by closed cases."""

from __future__ import annotations

from random import Random

from kill_matrix import CaseFacts, sample
from suites import chosen_suites, completed, random_suites, requests_of, suites_of_requests, visited_by

from scbm.mutation import mutants_of
from support.models import scan_cell

RANDOM = Random(1)
FACTS = tuple(CaseFacts(RANDOM.randint(1, 9), 1 << RANDOM.randrange(12), 0, 0, 0) for _ in range(40))


def test_random_suites_have_their_size_and_no_case_twice() -> None:
    suites = list(random_suites(40, 8, 20))
    assert [len(set(suite)) for suite in suites] == [8] * 20
    assert suites == list(random_suites(40, 8, 20))
    assert list(random_suites(7, 8, 20)) == []


def test_suites_chosen_by_coverage_visit_more() -> None:
    def visits(suites: list[tuple[int, ...]]) -> int:
        return sum(visited_by(suite, FACTS).bit_count() for suite in suites)

    chosen = list(chosen_suites(FACTS, 8, 20))
    assert [len(set(suite)) for suite in chosen] == [8] * 20
    assert visits(chosen) > visits(list(random_suites(40, 8, 20)))


def test_a_suite_keeps_to_its_number_of_requests() -> None:
    suites = list(suites_of_requests(FACTS, 50, 20))
    assert len(suites) == 20
    assert all(40 < requests_of(suite, FACTS) <= 50 for suite in suites)
    assert list(suites_of_requests(FACTS, 10_000, 20)) == []


def test_closed_cases_complete_a_suite() -> None:
    facts = tuple(CaseFacts(1, visited, 0, 0, 0) for visited in (0b001, 0b011, 0b110, 0b100))
    assert completed((0,), facts, range(1, 4)) == (0, 2)
    assert completed((0, 1, 3), facts, range(1, 4)) == (0, 1, 3)


def test_a_sample_has_each_operator() -> None:
    mutants = tuple(mutants_of(scan_cell()))
    drawn = sample(mutants, 30)
    assert len(drawn) == 30
    assert {mutant.operator for mutant in drawn} == {mutant.operator for mutant in mutants}
    assert sample(mutants, len(mutants)) == mutants
