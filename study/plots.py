"""The plots of the report, as SVG: the same figures give the same bytes, with the same version of matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from effects import over_models
from hypotheses import share_of, tau_of
from kill_matrix import ORACLES
from matplotlib import rc_context
from matplotlib.figure import Figure
from model_figures import BUILT_INS, RECORDED, REQUIREMENTS
from predictors import PREDICTORS, SCBM_IAS
from subjects import GENERATED, WRITTEN
from suites import SIZES

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from hypotheses import Figure as Measure
    from matplotlib.axes import Axes
    from model_figures import ModelFigures

_SETTINGS: Any = {"svg.hashsalt": "scbm", "svg.fonttype": "none", "font.family": "DejaVu Sans", "font.size": 9}
"""Settings of matplotlib, whose versions type them differently."""
_COLORS = {WRITTEN: "#0b6e99", GENERATED: "#d98032"}
_GREY = "#777777"


def write_plots(models: Sequence[ModelFigures], resamples: int, directory: Path) -> None:
    """Write the plots of the models that hypotheses are about: `tau.svg`, `found.svg` and `oracles.svg`."""
    with rc_context(_SETTINGS):
        for name, plot in (("tau", tau_plot), ("found", found_plot), ("oracles", oracle_plot)):
            # without a date and without the version of matplotlib
            plot(models, resamples).savefig(directory / f"{name}.svg", metadata={"Date": None, "Creator": None})


def tau_plot(models: Sequence[ModelFigures], resamples: int) -> Figure:
    """Return a plot of Kendall's τ of SCBM-IAS and its rivals: a row for each, a dot for each model."""
    figure = Figure(figsize=(7.5, 5.2), layout="constrained")
    axes = figure.subplots()
    rows = [(name, tau_of(name)) for name in PREDICTORS if name != "completed alone"]  # is operations completed
    _rows_of_dots(axes, rows, models, resamples)
    axes.axvline(0, color=_GREY, linewidth=0.6)
    axes.set_xlim(right=1.02)
    axes.set_xlabel("Kendall's τ with the number of mutants found, at fixed numbers of cases")
    _legend_below(figure, axes)
    figure.suptitle(f"What predicts the mutants that a suite finds? {SCBM_IAS} and its rivals", fontsize=10)
    return figure


def oracle_plot(models: Sequence[ModelFigures], resamples: int) -> Figure:
    """Return a plot of the shares that oracles notice: of all mutants, and of those of clean-up and deadlines."""
    figure = Figure(figsize=(7.5, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    oracles = (REQUIREMENTS, BUILT_INS, RECORDED)
    shares = [(ORACLES[oracle], share_of(oracle)) for oracle in oracles]
    clean_up = [(ORACLES[oracle], share_of(oracle, clean_up=True)) for oracle in oracles]
    _rows_of_dots(left, shares, models, resamples)
    _rows_of_dots(right, clean_up, models, resamples)
    for axes, title in ((left, "all mutants"), (right, "mutants of clean-up and deadlines")):
        axes.set_title(title, fontsize=9)
        axes.set_xlim(-0.03, 1.03)
        axes.set_xlabel("share of what the pool can show")
    _legend_below(figure, left)
    figure.suptitle("Which share of what the cases of the pool can show do their verdicts notice?", fontsize=10)
    return figure


def found_plot(models: Sequence[ModelFigures], resamples: int) -> Figure:
    """Return a plot of the share of mutants found: random suites against chosen ones, and against completed ones."""
    figure = Figure(figsize=(7.5, 3.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    _curves(left, models, resamples, (("chosen", "chosen by coverage", "#0b6e99"), ("random", "random", _GREY)))
    left.set_title("suites of the same number of cases", fontsize=9)
    left.set_xlabel("number of cases")
    completed = (
        ("completed", "random, completed by closing", "#0b6e99"),
        ("matching", "random, as many requests", _GREY),
    )
    _curves(right, models, resamples, completed)
    right.set_title("suites of the same number of requests", fontsize=9)
    right.set_xlabel("number of random cases before they are completed")
    left.set_ylabel("share of mutants found")
    figure.suptitle("What do suites find? Median over models, with its 95 % interval", fontsize=10)
    return figure


def _rows_of_dots(
    axes: Axes,
    rows: Sequence[tuple[str, Measure]],
    models: Sequence[ModelFigures],
    resamples: int,
) -> None:
    """Draw a row for each figure: a dot for each model, and the median with its interval."""
    for place, (_, measure) in enumerate(rows):
        for group, color in _COLORS.items():
            values = [
                value for model in models if model.matrix.group == group and (value := measure(model)) is not None
            ]
            below = 0.12 if group == WRITTEN else 0.28
            heights = place + below + 0.05 * np.sin(12.9898 * np.arange(len(values)))  # dots apart, without chance
            label = f"{group} models" if place == 0 else None
            axes.scatter(values, heights, s=7, color=color, alpha=0.55, linewidths=0, label=label)
        effect = over_models([measure(model) for model in models], 0.0, resamples)
        if effect is not None:
            axes.plot([effect.low, effect.high], [place - 0.12] * 2, color="black", linewidth=2)
            label = "median and its 95 % interval" if place == 0 else None
            axes.plot([effect.median], [place - 0.12], "D", color="black", markersize=5, label=label)
    axes.set_yticks(range(len(rows)), [name for name, _ in rows])
    axes.set_ylim(len(rows) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)


def _legend_below(figure: Figure, axes: Axes) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.legend(handles, labels, fontsize=8, frameon=False, loc="outside lower center", ncols=len(labels))


def _curves(axes: Axes, models: Sequence[ModelFigures], resamples: int, kinds: Sequence[tuple[str, str, str]]) -> None:
    """Draw the median share of mutants found for each size, with its interval."""
    for kind, label, color in kinds:
        effects = [over_models([model.found[kind][n] for model in models], 0.0, resamples) for n in range(len(SIZES))]
        known = [(size, effect) for size, effect in zip(SIZES, effects, strict=True) if effect is not None]
        sizes = [size for size, _ in known]
        axes.plot(sizes, [effect.median for _, effect in known], "o-", color=color, label=label, markersize=4)
        axes.fill_between(
            sizes, [e.low for _, e in known], [e.high for _, e in known], color=color, alpha=0.18, linewidth=0
        )
    axes.set_xscale("log", base=2)
    axes.set_xlim(SIZES[0] / 1.2, SIZES[-1] * 1.2)
    axes.set_xticks(SIZES, [str(size) for size in SIZES])
    axes.set_ylim(0, 1.02)
    axes.grid(color="#dddddd", linewidth=0.6)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(fontsize=7, frameon=False, loc="lower right")
