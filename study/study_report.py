"""The report of the study in Markdown: all tables, from the figures of its models."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from statistics import median
from textwrap import wrap
from typing import TYPE_CHECKING

from effects import RESAMPLES, mean, over_models
from hypotheses import HYPOTHESES, RIVALS, decisions, difference, less_than_ours, share_of, tau_of
from kill_matrix import ORACLES
from mixed_logistic import mixed_logistic
from predictors import AFTERWARDS, PREDICTORS, SCBM_IAS
from subjects import CONTROL, GENERATED, GROUPS, WRITTEN
from suites import SIZES

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from hypotheses import Decision, Figure
    from kill_matrix import KillMatrix
    from mixed_logistic import OddsRatio
    from model_figures import ModelFigures

DEVIATIONS = Path(__file__).with_name("deviations.md")
"""What deviates from the protocol, and what threatens the results: written by hand."""


@dataclass(frozen=True, slots=True)
class StudyResults:
    """The results of a run of the study.

    Attributes:
        models: the figures of the models that stay in the study.
        left: the kill matrices of those that leave.
        suites: the number of suites of each kind and size.
        resamples: the number of resamples over models.
    """

    models: tuple[ModelFigures, ...]
    left: tuple[KillMatrix, ...] = ()
    suites: int = 100
    resamples: int = RESAMPLES

    @property
    def tested(self) -> tuple[ModelFigures, ...]:
        """The models that hypotheses are about: those with failure handling."""
        return tuple(model for model in self.models if model.matrix.group != CONTROL)

    def group(self, name: str) -> tuple[ModelFigures, ...]:
        """Return the models of a group."""
        return tuple(model for model in self.models if model.matrix.group == name)

    def over(self, figure: Figure, models: Sequence[ModelFigures] | None = None) -> str:
        """Return the median of a figure over models, by default over those that hypotheses are about."""
        chosen = self.tested if models is None else models
        effect = over_models([figure(model) for model in chosen], 0.0, self.resamples)
        return "too few models" if effect is None else str(effect)


def report(results: StudyResults) -> str:
    """Return the report."""
    decided = decisions(results.tested, results.resamples)
    sections = {
        "Outcome": _outcome(decided),
        "What the results do not support": _negative(results, decided),
        "Hypotheses": _hypotheses(decided, results),
        "Predictors": _predictors(results, decided),
        "What suites find": _found(results),
        "The logistic model": _logistic(results),
        "Oracles": _oracles(results),
        "Written and generated models": _groups(results),
        "Control: planning problems": _control(results),
        "Looked at afterwards": _afterwards(results),
        "Models": _models(results),
        "Figures of each model": _each_model(results),
    }
    lines = ["# The study: results", "", *_introduction(results)]
    for title, section in sections.items():
        lines += ["", f"## {title}", "", *section]
    return "\n".join([*lines, "", DEVIATIONS.read_text(encoding="utf-8")])


def _introduction(results: StudyResults) -> Iterator[str]:
    yield from _paragraph(
        "`study/run.py` has written this page from the kill matrices beside it. The [protocol](../protocol.md) is "
        f"older than all results, and explains the terms. {len(results.tested)} models with failure handling take "
        f"part, with {results.suites} suites of each kind and size. Unless a table says otherwise, a suite finds a "
        "mutant if some trace differs from that of the original. Figures are medians over models, with 95 % intervals "
        "by a bootstrap over models."
    )


def _outcome(decided: Sequence[Decision]) -> Iterator[str]:
    for decision in decided:
        missed = ", ".join(decision.missed)
        verdict = f"**not confirmed**: {missed}" if missed else "**confirmed**"
        rival, effect = decision.weakest
        shown = "" if effect is None else f" {effect.median:.2f} [{effect.low:.2f}, {effect.high:.2f}]"
        where = f" for *{rival}*" if rival else ""
        yield f"- {decision.hypothesis.name}, {decision.hypothesis.words}:{shown}{where}; {verdict}."


def _negative(results: StudyResults, decided: Sequence[Decision]) -> Iterator[str]:
    yield from _paragraph(
        "Hypotheses that are not confirmed, rivals that coverage does not beat, and oracles for which coverage does "
        "not predict what a suite finds: the 95 % interval is not above 0. Rivals are listed for all models of the "
        "hypotheses, for both groups of them apart, and for the control."
    )
    yield ""
    for decision in decided:
        if decision.missed:
            yield f"- {decision.hypothesis.name}, {decision.hypothesis.words}, is not confirmed."
    tested = {"written and generated models": results.tested}
    groups = {f"{group} models": results.group(group) for group in (WRITTEN, GENERATED)}
    for group, models in (tested | groups | {"planning problems (control)": results.group(CONTROL)}).items():
        for way in (False, True):
            for rival in RIVALS:
                figure = less_than_ours(rival, by_requests=way)
                effect = over_models([figure(model) for model in models], 0.0, results.resamples)
                if effect is not None and effect.low <= 0:
                    fixed = "requests" if way else "cases"
                    yield f"- {group}, fixed number of {fixed}: SCBM-IAS less *{rival}* is {effect}."
    for index, name in enumerate(ORACLES):
        effect = over_models([mean(model.by_oracle[index]) for model in results.tested], 0.0, results.resamples)
        if effect is not None and effect.low <= 0:
            yield f"- oracle *{name}*: τ of SCBM-IAS with what verdicts find is {effect}."


def _hypotheses(decided: Sequence[Decision], results: StudyResults) -> Iterator[str]:
    yield from _paragraph(
        "A hypothesis is confirmed if its effect reaches the thresholds of the protocol, and if its p-value is below "
        f"0.05 after Holm's correction for seven hypotheses. With {results.resamples} resamples no p-value is below "
        f"{1 / (results.resamples + 1):.4f}. H3 holds only if it holds for each rival, at fixed numbers of cases and "
        "of requests, so its row shows the comparison with the largest p-value."
    )
    yield ""
    yield from _row("", "effect", "median [95 %]", "confirmed if", "p", "p (Holm)", "decision")
    yield _rule(7)
    for each in decided:
        hypothesis = each.hypothesis
        rival, weakest = each.weakest
        effect = f"{weakest or 'too few models'}{f' ({rival})' if rival else ''}"
        decision = "not confirmed" if each.missed else "confirmed"
        p_values = (f"{each.p:.4f}", f"{each.corrected:.4f}")
        yield from _row(hypothesis.name, hypothesis.words, effect, hypothesis.threshold.words, *p_values, decision)


def _predictors(results: StudyResults, decided: Sequence[Decision]) -> Iterator[str]:
    yield "![Kendall's τ of SCBM-IAS and its rivals](tau.svg)"
    yield ""
    yield from _paragraph(
        "Kendall's τ between a predictor and the number of mutants that a suite finds. A predictor that does not vary "
        "has no τ, so rivals have different numbers of models. *Operations completed* and *completed alone* count the "
        "same thing."
    )
    yield ""
    yield from _row("predictor", "τ, fixed number of cases", "τ, fixed number of requests")
    yield _rule(3)
    for name in PREDICTORS:
        yield from _row(name, *(results.over(tau_of(name, by_requests=way)) for way in (False, True)))
    yield ""
    yield from _paragraph(
        "By how much τ of SCBM-IAS is larger than that of each rival (H3), with p-values before correction. Two more "
        "comparisons, at fixed numbers of cases, are not in the protocol: *or 0* takes τ = 0 where the rival does not "
        "vary, and *paired* takes only sizes at which both have a τ."
    )
    yield ""
    yield from _row("rival", "fixed number of cases", "p", "fixed number of requests", "p", "or 0", "paired")
    yield _rule(7)
    effects = next(each for each in decided if each.hypothesis.name == "H3").effects
    for rival in RIVALS:
        cells: list[object] = []
        for way in ("cases", "requests"):
            effect = effects[f"{rival}, fixed number of {way}"]
            cells += ["too few models", ""] if effect is None else [effect, f"{effect.p:.4f}"]
        yield from _row(rival, *cells, results.over(_less_or_zero(rival)), results.over(_less_paired(rival)))


def _less_or_zero(rival: str) -> Figure:
    return lambda model: difference(model.tau, mean(model.by_cases[rival]) or 0.0)


def _less_paired(rival: str) -> Figure:
    def figure(model: ModelFigures) -> float | None:
        pairs = zip(model.by_cases[SCBM_IAS], model.by_cases[rival], strict=True)
        return mean([difference(our, their) for our, their in pairs])

    return figure


def _found(results: StudyResults) -> Iterator[str]:
    yield "![The share of mutants that suites find](found.svg)"
    yield ""
    yield "The share of mutants found: the mean over the suites of a model, then the median over models."
    yield ""
    yield from _row(
        "cases", "random", "chosen by coverage", "random, completed", "random, as many requests as completed"
    )
    yield _rule(5)
    for place, size in enumerate(SIZES):
        kinds = ("random", "chosen", "completed", "matching")
        yield from _row(size, *(results.over(_found_by(kind, place)) for kind in kinds))
    yield ""
    yield from _paragraph(
        f"The cases of closing alone find {results.over(lambda m: m.closed)}. Random suites with as many requests find "
        f"{results.over(lambda m: m.matching_closed)}."
    )
    yield ""
    yield from _paragraph(
        "Suites chosen by coverage may have longer cases than random ones. And a random suite for a number of requests "
        "leaves out the case that passes the number, so it has fewer requests than the suite it is compared with. Two "
        "comparisons beside those of the protocol take these advantages away:"
    )
    yield ""
    yield from _row("comparison", "Â12")
    yield _rule(2)
    yield from _row("H4: chosen against random, as many cases", results.over(lambda m: m.chosen))
    yield from _row("chosen against random, at most as many requests", results.over(lambda m: m.chosen_by_requests))
    yield from _row("H5: completed against random, at most as many requests", results.over(lambda m: m.completed))
    yield from _row(
        "completed against random, at least as many requests", results.over(lambda m: m.completed_generously)
    )


def _found_by(kind: str, place: int) -> Figure:
    return lambda model: model.found[kind][place]


def _logistic(results: StudyResults) -> Iterator[str]:
    estimated = mixed_logistic([model.counts for model in results.tested])
    if estimated is None:
        yield "Too few models."
        return
    yield from _paragraph(
        f"The data are {estimated.pairs:,} pairs of a random suite and a mutant, from {estimated.suites:,} suites of "
        f"{estimated.models} models. The outcome is whether the suite finds the mutant. Each model has a random "
        f"intercept (standard deviation {estimated.deviation:.2f}). An odds ratio is for one standard deviation more, "
        "within the model. Suites of a model share cases and mutants, so pairs are not independent, and the interval "
        "comes from the variation between models. The last column shows how narrow the interval would be if pairs were "
        "independent."
    )
    yield ""
    yield from _row("predictor", "odds ratio [95 %]", "if all pairs were independent")
    yield _rule(3)
    for name, ratio in (("coverage (SCBM-IAS)", estimated.coverage), ("log of the number of cases", estimated.cases)):
        yield from _row(name, ratio, _narrow(ratio))


def _narrow(ratio: OddsRatio) -> str:
    return f"[{ratio.narrow[0]:.3f}, {ratio.narrow[1]:.3f}]"


def _oracles(results: StudyResults) -> Iterator[str]:
    yield "![Shares that oracles notice](oracles.svg)"
    yield ""
    yield from _paragraph(
        "The share of mutants that the verdicts on all cases of the pool notice, of those for which the trace of some "
        "case differs; and τ of SCBM-IAS with the number that an oracle notices. *Requirements* includes whatever "
        "fails a case without a built-in requirement or a recorded result, such as a missed goal."
    )
    yield ""
    yield from _row("oracle", "share of all mutants", "share of clean-up and deadlines", "τ")
    yield _rule(4)
    for index, name in enumerate(ORACLES):
        figures = (share_of(index), share_of(index, clean_up=True), _tau_of_oracle(index))
        yield from _row(name, *map(results.over, figures))


def _tau_of_oracle(oracle: int) -> Figure:
    return lambda model: mean(model.by_oracle[oracle])


def _groups(results: StudyResults) -> Iterator[str]:
    yield "The effects of the hypotheses in both groups of models apart. The protocol tests them together."
    yield ""
    yield from _row("", "effect", "written", "generated")
    yield _rule(4)
    for hypothesis in HYPOTHESES:
        for rival, figure in hypothesis.figures:
            words = f"{hypothesis.words}: {rival}" if rival else hypothesis.words
            yield from _row(
                hypothesis.name, words, *(results.over(figure, results.group(g)) for g in (WRITTEN, GENERATED))
            )
    yield ""
    yield "What oracles notice in both groups: the share of all mutants, and τ of SCBM-IAS with their number."
    yield ""
    yield from _row("oracle", "share, written", "share, generated", "τ, written", "τ, generated")
    yield _rule(5)
    for index, name in enumerate(ORACLES):
        figures = (share_of(index), _tau_of_oracle(index))
        yield from _row(name, *(results.over(f, results.group(g)) for f in figures for g in (WRITTEN, GENERATED)))


def _control(results: StudyResults) -> Iterator[str]:
    control = results.group(CONTROL)
    yield f"{len(control)} planning problems without failure handling of their own. No hypothesis is about them."
    yield ""
    yield from _row("predictor", "τ, fixed number of cases", "τ, fixed number of requests")
    yield _rule(3)
    for name in PREDICTORS:
        yield from _row(name, *(results.over(tau_of(name, by_requests=way), control) for way in (False, True)))
    yield ""
    yield from _row("effect", "median [95 %]")
    yield _rule(2)
    for hypothesis in HYPOTHESES:
        if len(hypothesis.figures) == 1:
            yield from _row(hypothesis.words, results.over(hypothesis.figures[0][1], control))


def _afterwards(results: StudyResults) -> Iterator[str]:
    yield from _paragraph(
        "This was tried after the results were seen, to understand where *timedout alone* predicts as well as "
        "coverage. So it confirms nothing. A likely reason: in generated models and planning problems all operations "
        "of a resource fail by the same automatic transition. So *failed* of one more operation hardly shows another "
        "mutant, and SCBM-IAS counts it nevertheless. In written models this makes no such difference."
    )
    yield ""
    yield from _row("τ", "written", "generated", "control")
    yield _rule(4)
    for name in (SCBM_IAS, *AFTERWARDS, "timedout alone"):
        for way, fixed in ((False, "cases"), (True, "requests")):
            medians = (results.over(tau_of(name, by_requests=way), results.group(g)) for g in GROUPS)
            yield from _row(f"{name}, fixed number of {fixed}", *medians)
    yield ""
    yield from _weighted(results)


def _weighted(results: StudyResults) -> Iterator[str]:
    drawn, weighted = (results.over(_clean_up_part(place)) for place in (0, 1))
    yield from _paragraph(
        "This was not in the protocol either. A sample has as many mutants of each operator, as far as a model has so "
        "many. So operators with few mutants weigh more than they would among all mutants of the model. Those of "
        f"clean-up and deadlines have a part of {drawn}. If each mutant counts as often as there are mutants of its "
        f"operator for each one in the sample, their part is {weighted}. The shares of the oracles depend on this:"
    )
    yield ""
    yield from _row("oracle", "share of all mutants, as drawn", "share, each mutant weighted")
    yield _rule(3)
    for index, name in enumerate(ORACLES):
        yield from _row(name, results.over(share_of(index)), results.over(_weighted_share_of(index)))


def _clean_up_part(place: int) -> Figure:
    return lambda model: model.clean_up_parts[place]


def _weighted_share_of(oracle: int) -> Figure:
    return lambda model: model.weighted_shares[oracle]


def _models(results: StudyResults) -> Iterator[str]:
    matrices = [model.matrix for model in results.models]
    cpu_s = sum(matrix.cpu_s for matrix in (*matrices, *results.left))
    drawn = sum(matrix.equivalent + len(matrix.mutants) for matrix in matrices)
    yield from _paragraph(
        f"{len(matrices)} models stay in the study, {len(results.left)} left it. All kill matrices took "
        f"{cpu_s / 3600:.1f} hours of CPU. {drawn:,} mutants were drawn, and {sum(m.equivalent for m in matrices):,} "
        f"of them are proved equivalent and left out. The median model keeps "
        f"{median(len(m.mutants) for m in matrices):g}. No case finds {_never_found(matrices):,} of the others; they "
        "stay in, as not found."
    )
    yield ""
    for matrix in results.left:
        yield f"- `{matrix.name}` ({matrix.group}) left: {matrix.left}."
    yield ""
    yield from _row(
        "model",
        "group",
        "operations",
        "obligations",
        "cases",
        "closed",
        "mutants",
        "equivalent",
        "of all",
        "CPU",
        "SHA-256 of the model",
        "SHA-256 of its file",
    )
    yield _rule(12)
    files = {model.matrix.name: model.file_digest for model in results.models}
    for m in (*matrices, *results.left):
        obligations = sum(not name.endswith("/queued") for name in m.obligations)
        counts = (m.operations, obligations, len(m.cases), len(m.closed), len(m.mutants), m.equivalent, m.all_mutants)
        yield from _row(
            m.name,
            m.group,
            *counts,
            f"{m.cpu_s:.1f} s",
            f"`{m.digest}`",
            f"`{files.get(m.name)}`" if files.get(m.name) else "",
        )
    yield ""
    yield from _paragraph(
        "*Cases* are those of the pool of random cases that pass on the original, and *closed* those of closing. *Of "
        "all* is the number of mutants before sampling. The SHA-256 of a model is that of its text as `scbm` writes "
        "it. Generated models and planning problems have no files."
    )


def _never_found(matrices: Iterable[KillMatrix]) -> int:
    return sum(not row.found[0] for matrix in matrices for row in matrix.mutants)


def _each_model(results: StudyResults) -> Iterator[str]:
    yield from _row("model", *(f"{hypothesis.name}" for hypothesis in HYPOTHESES if len(hypothesis.figures) == 1))
    yield _rule(7)
    for model in results.models:
        figures = (hypothesis.figures[0][1](model) for hypothesis in HYPOTHESES if len(hypothesis.figures) == 1)
        yield from _row(model.matrix.name, *("" if figure is None else f"{figure:.2f}" for figure in figures))


def _paragraph(text: str) -> Iterator[str]:
    yield from wrap(text, 120, break_long_words=False, break_on_hyphens=False)


def _row(*cells: object) -> Iterator[str]:
    yield f"| {' | '.join(map(str, cells))} |"


def _rule(columns: int) -> str:
    return "| " + " | ".join(["---"] * columns) + " |"
