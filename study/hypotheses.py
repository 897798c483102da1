"""The hypotheses of the protocol: the effect of each, its thresholds, and whether the results confirm it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from effects import LEVEL, RESAMPLES, holm, mean, over_models
from model_figures import BUILT_INS, RECORDED, REQUIREMENTS
from predictors import PREDICTORS, SCBM_IAS

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from effects import Effect
    from model_figures import ModelFigures

    Figure = Callable[[ModelFigures], float | None]

RIVALS = tuple(name for name in PREDICTORS if name != SCBM_IAS)


@dataclass(frozen=True, slots=True)
class Threshold:
    """What an effect has to reach.

    Attributes:
        above: the value that the lower end of the 95 % interval has to be above; the p-value is about it.
        median: the value that the median has to be at least.
        words: both.
    """

    above: float
    median: float
    words: str


TAU = Threshold(0.3, 0.5, "median at least 0.5, interval above 0.3")
DIFFERENCE = Threshold(0.0, 0.0, "interval above 0")
SUPERIORITY = Threshold(0.5, 0.64, "median at least 0.64, interval above 0.5")
SHARE = Threshold(0.8, 0.8, "interval above 0.8")


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A hypothesis of the protocol.

    Attributes:
        name: its name.
        words: its effect.
        threshold: what the effect has to reach.
        figures: the effects in one model, each with its name. The hypothesis holds if it holds for each. Only H3 has
            more than one.
    """

    name: str
    words: str
    threshold: Threshold
    figures: tuple[tuple[str, Figure], ...]


def tau_of(predictor: str, *, by_requests: bool = False) -> Figure:
    """Return the figure τ of a predictor, the mean over sizes."""
    return lambda model: mean((model.by_requests if by_requests else model.by_cases)[predictor])


def share_of(oracle: int, *, clean_up: bool = False) -> Figure:
    """Return the figure share that an oracle notices, of all mutants or of those of clean-up and deadlines."""
    return lambda model: (model.clean_up_shares if clean_up else model.shares)[oracle]


def less_than_ours(rival: str, *, by_requests: bool = False) -> Figure:
    """Return the figure τ of SCBM-IAS less τ of a rival, each the mean over the sizes at which it exists."""
    ours, theirs = (tau_of(name, by_requests=by_requests) for name in (SCBM_IAS, rival))
    return lambda model: difference(ours(model), theirs(model))


def raised_by_built_ins(model: ModelFigures) -> float | None:
    """Return by how much built-in requirements raise the share of clean-up and deadline mutants that verdicts find."""
    return difference(model.clean_up_shares[BUILT_INS], model.clean_up_shares[REQUIREMENTS])


def difference(first: float | None, second: float | None) -> float | None:
    """Return `first` less `second`; `None` if one of both is missing."""
    return None if first is None or second is None else first - second


def _against_rivals() -> tuple[tuple[str, Figure], ...]:
    ways = (("fixed number of cases", False), ("fixed number of requests", True))
    return tuple(
        (f"{rival}, {way}", less_than_ours(rival, by_requests=is_way)) for way, is_way in ways for rival in RIVALS
    )


HYPOTHESES = (
    Hypothesis("H1", "τ of coverage, fixed number of cases", TAU, (("", tau_of(SCBM_IAS)),)),
    Hypothesis("H2", "τ of coverage, fixed number of requests", TAU, (("", tau_of(SCBM_IAS, by_requests=True)),)),
    Hypothesis("H3", "τ of coverage less τ of each rival", DIFFERENCE, _against_rivals()),
    Hypothesis("H4", "Â12, chosen by coverage against random", SUPERIORITY, (("", lambda model: model.chosen),)),
    Hypothesis("H5", "Â12, completed by closing against random", SUPERIORITY, (("", lambda model: model.completed),)),
    Hypothesis(
        "H6", "share of clean-up and deadline mutants that built-ins add", DIFFERENCE, (("", raised_by_built_ins),)
    ),
    Hypothesis("H7", "share that recorded results notice", SHARE, (("", share_of(RECORDED)),)),
)


@dataclass(frozen=True, slots=True)
class Decision:
    """Whether the results confirm a hypothesis.

    Attributes:
        hypothesis: the hypothesis.
        effects: the effects over models by their names; `None` where too few models have one.
        p: the largest p-value of the effects.
        corrected: the same, corrected by Holm's method for all hypotheses.
    """

    hypothesis: Hypothesis
    effects: Mapping[str, Effect | None]
    p: float
    corrected: float = 1.0

    @property
    def weakest(self) -> tuple[str, Effect | None]:
        """The effect with the largest p-value, and its name; of equal ones that with the smallest lower end."""

        def weakness(name: str) -> tuple[float, float]:
            effect = self.effects[name]
            return (2.0, 0.0) if effect is None else (effect.p, -effect.low)

        name = max(self.effects, key=weakness)
        return name, self.effects[name]

    @property
    def missed(self) -> tuple[str, ...]:
        """The conditions that do not hold, in words; none if the hypothesis is confirmed."""
        _, effect = self.weakest
        if effect is None:
            return ("too few models have this effect",)
        threshold = self.hypothesis.threshold
        conditions = {
            f"the median is {effect.median:.2f}": effect.median >= threshold.median,
            f"the interval begins at {effect.low:.2f}": effect.low > threshold.above,
            f"the corrected p-value is {self.corrected:.4f}": self.corrected < LEVEL,
        }
        return tuple(words for words, holds in conditions.items() if not holds)


def decisions(models: Sequence[ModelFigures], resamples: int = RESAMPLES) -> tuple[Decision, ...]:
    """Return a decision for each hypothesis."""
    drawn = [_uncorrected(hypothesis, models, resamples) for hypothesis in HYPOTHESES]
    corrected = holm([each.p for each in drawn])
    return tuple(replace(each, corrected=p) for each, p in zip(drawn, corrected, strict=True))


def _uncorrected(hypothesis: Hypothesis, models: Sequence[ModelFigures], resamples: int) -> Decision:
    above = hypothesis.threshold.above
    effects = {name: over_models(list(map(figure, models)), above, resamples) for name, figure in hypothesis.figures}
    return Decision(hypothesis, effects, max(1.0 if effect is None else effect.p for effect in effects.values()))
