"""The figures of one model, from its kill matrix: how well predictors predict, and what kinds of suites find."""

from __future__ import annotations

from dataclasses import dataclass
from random import Random
from typing import TYPE_CHECKING

import numpy as np
from effects import kendall, mean, vargha_delaney
from kill_matrix import ORACLES
from predictors import AFTERWARDS, PREDICTORS, SCBM_IAS, masks_of
from suites import (
    REQUESTS,
    SIZES,
    chosen_suites,
    completed,
    matching_suite,
    random_suites,
    requests_of,
    suites_of_requests,
    visited_by,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from kill_matrix import KillMatrix
    from suites import Suite

EACH, REQUIREMENTS, BUILT_INS, RECORDED = range(len(ORACLES))

CLEAN_UP = ("clean-up-drop", "deadline-none", "deadline-shorter", "deadline-longer")
"""The operators of H6: those of clean-up and deadlines."""


@dataclass(frozen=True, slots=True)
class SizedSuites:
    """Suites of one model and one size, random ones and others that are compared with them.

    Attributes:
        drawn: random suites of the size.
        chosen: as many of the same size, chosen by coverage.
        matching_chosen: for each of these a random suite with as many requests.
        completed: the random suites, completed by closing.
        matching: for each of these a random suite with as many requests; `None` where the pool has too few.
        generous: the same, with the case that passes the number of requests.
    """

    drawn: tuple[Suite, ...]
    chosen: tuple[Suite, ...]
    matching_chosen: tuple[Suite | None, ...]
    completed: tuple[Suite, ...]
    matching: tuple[Suite | None, ...]
    generous: tuple[Suite | None, ...]


@dataclass(frozen=True, slots=True)
class SuiteCounts:
    """What the logistic model needs of the random suites of one model; an element for each suite.

    Attributes:
        cases: the numbers of cases.
        visited: the numbers of visited obligations.
        found: the numbers of mutants that the suites find.
        mutants: the number of mutants.
    """

    cases: tuple[int, ...]
    visited: tuple[int, ...]
    found: tuple[int, ...]
    mutants: int


@dataclass(frozen=True, slots=True)
class ModelFigures:
    """The figures of one model. A figure is `None` where the model does not have it.

    Attributes:
        matrix: its kill matrix.
        file_digest: the SHA-256 of its file; empty if it has none.
        by_cases: Kendall's τ of each predictor, with `AFTERWARDS`, for each of `SIZES`; each difference noticed.
        by_requests: the same for each of `REQUESTS`.
        by_oracle: τ of SCBM-IAS for each of `SIZES`, for each of `ORACLES`.
        chosen: Â12 of suites chosen by coverage against random ones of as many cases.
        chosen_by_requests: the same against random ones of as many requests.
        completed: Â12 of completed suites against random ones of as many requests.
        completed_generously: the same, where the random ones may pass the number of requests by one case.
        shares: for each of `ORACLES`, the share of what the pool shows that it notices.
        clean_up_shares: the same for mutants of `CLEAN_UP`.
        weighted_shares: as `shares`, with each mutant weighted as its operator; without weights `None`.
        clean_up_parts: the part of the mutants that are those of `CLEAN_UP`: as they were drawn, and weighted likewise.
        found: by the names of kinds of suites, the mean share of mutants that they find, for each of `SIZES`.
        closed: the share of mutants that the cases of closing find.
        matching_closed: the share that random suites with as many requests find, mean over suites.
        counts: for the logistic model.
    """

    matrix: KillMatrix
    file_digest: str
    by_cases: Mapping[str, tuple[float | None, ...]]
    by_requests: Mapping[str, tuple[float | None, ...]]
    by_oracle: tuple[tuple[float | None, ...], ...]
    chosen: float | None
    chosen_by_requests: float | None
    completed: float | None
    completed_generously: float | None
    shares: tuple[float | None, ...]
    clean_up_shares: tuple[float | None, ...]
    weighted_shares: tuple[float | None, ...]
    clean_up_parts: tuple[float | None, float | None]
    found: Mapping[str, tuple[float | None, ...]]
    closed: float | None
    matching_closed: float | None
    counts: SuiteCounts

    @property
    def tau(self) -> float | None:
        """τ of SCBM-IAS at fixed numbers of cases: the mean over sizes."""
        return mean(self.by_cases[SCBM_IAS])


def model_figures(
    matrix: KillMatrix, suites: int, file_digest: str = "", weights: Mapping[str, float] | None = None
) -> ModelFigures:
    """Return the figures of a model that stays in the study.

    Args:
        matrix: its kill matrix.
        suites: the number of suites of each size.
        file_digest: the SHA-256 of its file, if it has one.
        weights: for each operator the number of mutants of the model for each one in the sample.
    """
    model = _SuitesOfModel(matrix, suites)
    sized = [model.sized(size) for size in SIZES]
    by_cases = [each.drawn for each in sized]
    measures = (*PREDICTORS, *AFTERWARDS)
    by_requests = [tuple(suites_of_requests(matrix.cases, number, suites)) for number in REQUESTS]
    return ModelFigures(
        matrix=matrix,
        file_digest=file_digest,
        by_cases={name: model.taus(name, by_cases) for name in measures},
        by_requests={name: model.taus(name, by_requests) for name in measures},
        by_oracle=tuple(model.taus(SCBM_IAS, by_cases, oracle) for oracle in range(len(ORACLES))),
        chosen=mean([model.superiority(each.chosen, each.drawn) for each in sized]),
        chosen_by_requests=mean([model.superiority(each.chosen, each.matching_chosen) for each in sized]),
        completed=mean([model.superiority(each.completed, each.matching) for each in sized]),
        completed_generously=mean([model.superiority(each.completed, each.generous) for each in sized]),
        shares=tuple(model.share(oracle) for oracle in range(len(ORACLES))),
        clean_up_shares=tuple(model.share(oracle, CLEAN_UP) for oracle in range(len(ORACLES))),
        weighted_shares=tuple(model.weighted_share(oracle, weights) for oracle in range(len(ORACLES))),
        clean_up_parts=(model.clean_up_part(), model.clean_up_part(weights) if weights else None),
        found={
            "random": model.mean_found(by_cases),
            "chosen": model.mean_found([each.chosen for each in sized]),
            "completed": model.mean_found([each.completed for each in sized]),
            "matching": model.mean_found([each.matching for each in sized]),
        },
        closed=model.mean_found([(model.closed,)])[0],
        matching_closed=model.mean_found([model.matching_closed()])[0],
        counts=model.counts(by_cases),
    )


class _SuitesOfModel:
    """The suites of one model, and what they find."""

    def __init__(self, matrix: KillMatrix, suites: int) -> None:
        self._matrix = matrix
        self._count = suites
        self._pool = matrix.cases
        self._facts = (*matrix.cases, *matrix.closed)
        self._masks = masks_of(matrix.obligations)
        self.closed = tuple(range(len(self._pool), len(self._facts)))
        self._finds = [
            np.array(
                [[row.found[oracle] >> number & 1 for number in range(len(self._facts))] for row in matrix.mutants]
            )
            for oracle in range(len(ORACLES))
        ]

    def found(self, suite: Suite, oracle: int = EACH) -> int:
        """Return how many mutants a suite finds."""
        return int(self._finds[oracle][:, list(suite)].any(axis=1).sum())

    def taus(self, predictor: str, sized: Iterable[Sequence[Suite]], oracle: int = EACH) -> tuple[float | None, ...]:
        """Return Kendall's τ between a predictor and what suites find, for each size."""
        measure = (PREDICTORS | AFTERWARDS)[predictor]
        return tuple(
            kendall(
                [measure(suite, self._facts, self._masks) for suite in suites],
                [self.found(suite, oracle) for suite in suites],
            )
            for suites in sized
        )

    def sized(self, size: int) -> SizedSuites:
        """Return the suites of a size."""
        drawn = tuple(random_suites(len(self._pool), size, self._count))
        chosen = tuple(chosen_suites(self._pool, size, self._count))
        whole = tuple(completed(suite, self._facts, range(len(self._pool), len(self._facts))) for suite in drawn)
        return SizedSuites(
            drawn,
            chosen,
            self._matching(chosen, f"5/chosen/{size}"),
            whole,
            self._matching(whole, f"5/completed/{size}"),
            self._matching(whole, f"5/generous/{size}", generous=True),
        )

    def _matching(self, suites: Iterable[Suite], seed: str, *, generous: bool = False) -> tuple[Suite | None, ...]:
        random = Random(seed)
        requests = (requests_of(suite, self._facts) for suite in suites)
        return tuple(matching_suite(self._pool, number, random, generous=generous) for number in requests)

    def matching_closed(self) -> tuple[Suite | None, ...]:
        """Return random suites with as many requests as the cases of closing together."""
        return self._matching((self.closed,) * self._count, "5/closed")

    def superiority(self, ours: Sequence[Suite], theirs: Sequence[Suite | None]) -> float | None:
        """Return Â12 of suites against others; pairs without a second suite are left out."""
        pairs = [(our, their) for our, their in zip(ours, theirs, strict=True) if their is not None]
        if not pairs:
            return None
        return vargha_delaney([self.found(our) for our, _ in pairs], [self.found(their) for _, their in pairs])

    def mean_found(self, sized: Iterable[Sequence[Suite | None]]) -> tuple[float | None, ...]:
        """Return the mean share of mutants that suites find, for each size."""
        mutants = len(self._matrix.mutants)
        return tuple(mean([self.found(suite) / mutants for suite in suites if suite is not None]) for suites in sized)

    def share(self, oracle: int, operators: Sequence[str] | None = None) -> float | None:
        """Return the share of what the pool shows that an oracle notices, of the mutants of some operators."""
        cases = range(len(self._pool))
        rows = [n for n, row in enumerate(self._matrix.mutants) if operators is None or row.operator in operators]
        shown, noticed = (self._finds[index][rows][:, cases].any(axis=1) for index in (EACH, oracle))
        return float((shown & noticed).sum() / shown.sum()) if shown.any() else None

    def weighted_share(self, oracle: int, weights: Mapping[str, float] | None) -> float | None:
        """Return the same of all mutants, each with the weight of its operator; `None` without weights."""
        if weights is None:
            return None
        cases = range(len(self._pool))
        shown, noticed = (self._finds[index][:, cases].any(axis=1) for index in (EACH, oracle))
        of_rows = np.array([weights[row.operator] for row in self._matrix.mutants])
        return float(of_rows[shown & noticed].sum() / of_rows[shown].sum()) if shown.any() else None

    def clean_up_part(self, weights: Mapping[str, float] | None = None) -> float:
        """Return which part of the mutants is of `CLEAN_UP`, each with the weight of its operator, if there are any."""
        of_rows = [(row.operator, 1.0 if weights is None else weights[row.operator]) for row in self._matrix.mutants]
        return sum(weight for name, weight in of_rows if name in CLEAN_UP) / sum(weight for _, weight in of_rows)

    def counts(self, sized: Sequence[Sequence[Suite]]) -> SuiteCounts:
        """Return what the logistic model needs."""
        suites = [suite for suites in sized for suite in suites]
        return SuiteCounts(
            tuple(map(len, suites)),
            tuple(visited_by(suite, self._facts).bit_count() for suite in suites),
            tuple(map(self.found, suites)),
            len(self._matrix.mutants),
        )
