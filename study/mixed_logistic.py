"""A logistic model with a random intercept for each model of the study (protocol, Statistics).

Whether a suite finds a mutant depends on the log of its number of cases and on its coverage, both standardized within
the model. All mutants of a suite have the same predictors, so a suite is one binomial count.

The parameters maximize the marginal likelihood by Laplace's approximation. It is nearly exact here: each intercept is
estimated from tens of thousands of pairs of a suite and a mutant. (statsmodels has such a model for single outcomes
only, which would be millions of rows.) The intervals are robust: they come from the variation between models (a
sandwich estimator). The usual ones would take pairs as independent, although suites of a model share cases and mutants.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize
from scipy.special import expit
from scipy.stats import t

if TYPE_CHECKING:
    from collections.abc import Sequence

    from model_figures import SuiteCounts
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

_STEP = 1e-4
"""The step of numerical derivatives."""

_NEWTON = 100
"""Maximum number of steps of Newton's method."""

_KNOWN = 1e-3
"""The information about the log of the deviation below which it is noise of the derivatives, of either sign."""


@dataclass(frozen=True, slots=True)
class OddsRatio:
    """By how much one standard deviation more multiplies the odds that a suite finds a mutant.

    Attributes:
        value: the ratio.
        low, high: its 95 % interval, from the variation between models.
        narrow: the interval if each pair of a suite and a mutant were independent.
    """

    value: float
    low: float
    high: float
    narrow: tuple[float, float]

    def __str__(self) -> str:
        return f"{self.value:.2f} [{self.low:.2f}, {self.high:.2f}]"


@dataclass(frozen=True, slots=True)
class MixedLogistic:
    """The estimated model.

    Attributes:
        coverage: the odds ratio of coverage.
        cases: the odds ratio of the log of the number of cases.
        deviation: the standard deviation of the intercepts.
        models: the number of models.
        suites: the number of suites.
        pairs: the number of pairs of a suite and a mutant.
    """

    coverage: OddsRatio
    cases: OddsRatio
    deviation: float
    models: int
    suites: int
    pairs: int


def mixed_logistic(models: Sequence[SuiteCounts]) -> MixedLogistic | None:
    """Return the estimated model; `None` if coverage varies in fewer than two models, which are the ones that count."""
    varying = [counts for counts in models if len(set(counts.cases)) > 1 and len(set(counts.visited)) > 1]
    if len(varying) < 2:  # noqa: PLR2004 - a variation between models needs two
        return None
    likelihood = MarginalLikelihood(varying)
    estimate = likelihood.maximum()
    information = likelihood.information(estimate)
    scores = likelihood.scores(estimate)[:, : len(information)]
    inverse = np.linalg.inv(information)
    between = len(varying) / (len(varying) - 1) * scores.T @ scores
    robust, narrow = (np.sqrt(np.diag(each)) for each in (inverse @ between @ inverse, inverse))
    wide = float(t.ppf(0.975, len(varying) - 1))

    def ratio(place: int) -> OddsRatio:
        center = estimate[place]
        low, high = (float(np.exp(center + sign * wide * robust[place])) for sign in (-1, 1))
        ends = (float(np.exp(center + sign * 1.96 * narrow[place])) for sign in (-1, 1))
        return OddsRatio(float(np.exp(center)), low, high, (next(ends), next(ends)))

    suites = sum(len(counts.cases) for counts in varying)
    pairs = sum(len(counts.cases) * counts.mutants for counts in varying)
    return MixedLogistic(ratio(2), ratio(1), float(np.exp(estimate[3])), len(varying), suites, pairs)


def standardized(values: Floats) -> Floats:
    """Return values less their mean, divided by their standard deviation."""
    return np.asarray((values - values.mean()) / values.std())


class MarginalLikelihood:
    """The likelihood of the counts of all models, as a function of four parameters.

    They are the mean intercept, the coefficients of size and of coverage, and the log of the standard deviation of the
    intercepts.
    """

    def __init__(self, models: Sequence[SuiteCounts]) -> None:
        self._models = len(models)
        self._model = np.repeat(np.arange(len(models)), [len(counts.cases) for counts in models])
        sizes = [standardized(np.log(np.array(counts.cases))) for counts in models]
        visited = [standardized(np.array(counts.visited, dtype=float)) for counts in models]
        self._predictors = np.column_stack([np.ones(len(self._model)), np.concatenate(sizes), np.concatenate(visited)])
        self._found = np.concatenate([np.array(counts.found, dtype=float) for counts in models])
        self._mutants = np.concatenate([np.full(len(counts.cases), float(counts.mutants)) for counts in models])

    def logs(self, parameters: Floats) -> Floats:
        """Return the log likelihood of each model, by Laplace's approximation."""
        fixed = self._predictors @ parameters[:3]
        variance = float(np.exp(2 * parameters[3]))
        mode = self._modes(fixed, variance)
        whole = fixed + mode[self._model]
        logs = self._per_model(self._found * whole - self._mutants * np.logaddexp(0, whole))
        curvature = 1 + variance * self._per_model(self._mutants * expit(whole) * expit(-whole))
        return np.asarray(logs - mode**2 / (2 * variance) - np.log(curvature) / 2)

    def _modes(self, fixed: Floats, variance: float) -> Floats:
        """Return the most likely intercept of each model, less the mean intercept, by Newton's method."""
        mode = np.zeros(self._models)
        for _ in range(_NEWTON):
            expected = expit(fixed + mode[self._model])
            slope = self._per_model(self._found - self._mutants * expected) - mode / variance
            curvature = self._per_model(self._mutants * expected * (1 - expected)) + 1 / variance
            step = np.clip(slope / curvature, -1, 1)
            mode += step
            if np.abs(step).max() < 1e-12:  # noqa: PLR2004 - far below what derivatives need
                break
        return mode

    def _per_model(self, values: Floats) -> Floats:
        return np.asarray(np.bincount(self._model, weights=values, minlength=self._models), dtype=np.float64)

    def scores(self, parameters: Floats) -> Floats:
        """Return the derivatives of the log likelihood of each model: a row for each model."""
        steps = np.eye(len(parameters)) * _STEP
        return np.column_stack(
            [(self.logs(parameters + step) - self.logs(parameters - step)) / (2 * _STEP) for step in steps]
        )

    def gradient(self, parameters: Floats) -> Floats:
        """Return the derivatives of the log likelihood of all models."""
        return np.asarray(self.scores(parameters).sum(axis=0))

    def information(self, parameters: Floats) -> Floats:
        """Return the second derivatives of the log likelihood of all models, negated.

        Where the intercepts do not differ, nothing is known of the log of their deviation, which has no end: then the
        derivatives are those of the first three parameters only.
        """
        steps = np.eye(len(parameters)) * _STEP
        rows = [(self.gradient(parameters - step) - self.gradient(parameters + step)) / (2 * _STEP) for step in steps]
        information = (np.array(rows) + np.array(rows).T) / 2
        return np.asarray(information if information[3, 3] > _KNOWN else information[:3, :3])

    def maximum(self) -> Floats:
        """Return the most likely parameters."""
        pairs = self._mutants.sum()
        found = minimize(
            lambda parameters: -self.logs(parameters).sum() / pairs,
            np.zeros(4),
            jac=lambda parameters: -self.gradient(parameters) / pairs,
            method="BFGS",
            options={"gtol": 1e-7},
        )
        estimate = np.asarray(found.x)
        for _ in range(_NEWTON):  # the last digits, by Newton's method
            information = self.information(estimate)
            known = len(information)
            step = np.clip(np.linalg.solve(information, self.gradient(estimate)[:known]), -1, 1)
            estimate[:known] += step
            if np.abs(step).max() < 1e-8:  # noqa: PLR2004 - far below what the report shows
                break
        return estimate
