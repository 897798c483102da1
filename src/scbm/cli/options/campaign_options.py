"""Options of verbs that run many cases: thresholds, worker processes, moved inputs, and the output.

`--fail-under` sets a threshold for the coverage of all obligations, or of one kind.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

from scbm.cases.coverage import ASSERTED, COVERABLE, KINDS, LIFTED, Threshold
from scbm.cli.options.option_errors import option_error
from scbm.cli.options.verb_options import FAIL_UNDER
from scbm.cli.output.terminal import errors
from scbm.files import suggestion
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.model.visible_text import shown_path
from scbm.reports.status_lines import united_in_words
from scbm.testing.batches.all_cores import Cores

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from scbm.cases.coverage import AssertionEvidence, Figure, LiftedStatuses
    from scbm.closing.proved_statuses import StatusEvidence
    from scbm.store import History
    from scbm.testing import CampaignResult
    from scbm.testing.batches.campaign_runs import Executor


class CampaignOutput(Struct, frozen=True):
    """The options for the output of a campaign.

    Attributes:
        thresholds: the required coverage.
        missing: whether only missed obligations are shown.
        json: whether the report is JSON.
        store: the store to add the cases to; `None` for none.
        save: the directory for all random cases; `None` saves none.
        failures: the directory for small failing cases.
        shrink: whether to search for small failing cases.
        stop: whether the first failure ends the campaign.
        dry: after how many random cases in a row that visited nothing new it ends; `None` for never.
        evidence: the certificates and waivers that count; `None` if statuses are not asked for.
        recorded: what was recorded in case files before, as further parts of the JSON.
        shows_all: whether each of many missed obligations is listed, instead of the reasons alone.
    """

    thresholds: Sequence[Threshold]
    missing: bool
    json: bool
    store: Path | None
    save: Path | None
    failures: Path
    shrink: bool
    stop: bool
    dry: int | None = None
    evidence: StatusEvidence | None = None
    recorded: Mapping[str, Any] = field(default_factory=dict)
    shows_all: bool = False


_ALL_PERCENT = 100
_NUMBER = re.compile(r"(\d+(?:\.\d+)?)\s*%?", re.ASCII)


def read_thresholds(texts: Sequence[str]) -> tuple[Threshold, ...]:
    """Return thresholds such as `90` or `executing=100`. Raise `InputError` with all errors."""
    kinds = [*KINDS, COVERABLE, LIFTED, ASSERTED]
    other = {"mutants": "`scbm mutate` has the threshold of mutants; write `asserted=90` for what the cases notice"}
    read = read_percentages(texts, kinds, lambda kind: other.get(kind) or suggestion(kind, kinds, "kinds are"), "all")
    return tuple(Threshold(percent, kind) for kind, percent in read)


def read_percentages(
    texts: Sequence[str], kinds: Sequence[str], remedy_for: Callable[[str], str | None], default: str = ""
) -> tuple[tuple[str, float], ...]:
    """Return kinds with their percentages from texts such as `executing=100`. Raise `InputError` with all errors.

    Args:
        texts: the values of `--fail-under`.
        kinds: the kinds that there are.
        remedy_for: returns what to write instead of a kind that there is not.
        default: the kind of a percentage alone; empty if it needs one.
    """
    wrong: list[Diagnostic] = []
    found = []
    for text in texts:
        kind, equals, number = text.rpartition("=")
        kind = kind.strip() if equals else default
        percent = _percent(number)
        if kind not in kinds:
            place = Place(FAIL_UNDER, 1, 1, max(1, len(kind)))
            wrong.append(Diagnostic(Slug.BAD_OPTION, f"there is no kind `{kind}`", place, remedy_for(kind), text))
        elif percent is None:
            place = Place(FAIL_UNDER, 1, len(text) - len(number) + 1, max(1, len(number)))
            remedy = f"write for example `{kind}=90`" if equals else "write `90`, or `executing=100`"
            message = f"`{number}` is not a number from 0 to 100"
            wrong.append(Diagnostic(Slug.BAD_OPTION, message, place, remedy, text))
        else:
            found.append((kind, percent))
    if wrong:
        raise InputError(wrong)
    return tuple(found)


def _percent(text: str) -> float | None:
    match = _NUMBER.fullmatch(text.strip())
    percent = float(match[1]) if match else None
    return percent if percent is not None and percent <= _ALL_PERCENT else None


def refuse_asserted(thresholds: Sequence[Threshold], store: Path | None, *, is_over_nodes: bool) -> None:
    """Raise `InputError` for a threshold of asserted obligations where no results of mutants can be known."""
    if not asks_for_asserted(thresholds) or (store is not None and not is_over_nodes):
        return
    message = "the threshold `asserted` needs results of `scbm mutate` in a store"
    remedy = "add `--store FILE`, and fill it by `scbm mutate` with the same cases and the same store"
    if is_over_nodes:
        message, remedy = "mutants run in simulation, and the cases of this command do not", "leave `asserted` out"
    raise option_error(FAIL_UNDER, message, remedy)


def asks_for_asserted(thresholds: Sequence[Threshold]) -> bool:
    """Return whether a threshold is about asserted obligations."""
    return any(threshold.kind == ASSERTED for threshold in thresholds)


def meets_thresholds(
    result: CampaignResult | History, thresholds: Sequence[Threshold], apart_from: Path | None = None
) -> bool:
    """Return whether all thresholds are met; print a sentence for each that is not.

    Args:
        result: what the cases showed.
        thresholds: the thresholds of the command line.
        apart_from: a store with cases under other objects, if `result` is about the cases of this run alone.
    """
    coverage, lifted = result.coverage, result.lifted
    evidence = result.evidence if asks_for_asserted(thresholds) else None
    asserted = None if evidence is None else evidence.figure
    coverable = None if result.decided is None else result.decided.coverable
    folded = None if lifted is None else lifted.figure
    missed = [threshold for threshold in thresholds if not threshold.is_met(coverage, coverable, asserted, folded)]
    for threshold in missed:
        if threshold.kind == ASSERTED:
            errors().prose(_unasserted_sentence(threshold, evidence))
        else:
            figure = threshold.figure(coverage, coverable, None, folded)
            origin = _lifted_origin(lifted, apart_from) if threshold.kind == LIFTED else ""
            errors().prose(_missed_sentence(threshold, figure, origin))
    return not missed


def _unasserted_sentence(threshold: Threshold, evidence: AssertionEvidence | None) -> str:
    from scbm.cases.coverage import NO_MUTANTS  # noqa: PLC0415 - only stores have results of mutants

    wanted = f"{FAIL_UNDER} {ASSERTED}={threshold.percent:g} cannot be met."
    if evidence is None or evidence.found is None:
        why = NO_MUTANTS if evidence is None else evidence.why_none
        return f"What cases assert is not known: {why}. So {wanted}"
    figure = evidence.figure
    if not figure.of:
        return f"No visited obligation has a mutant that may behave differently, so {wanted}"
    return f"Of what is visited, {figure} is asserted, under {threshold.percent:g} %."


def _lifted_origin(lifted: LiftedStatuses | None, apart_from: Path | None) -> str:
    """Return which cases a lifted figure is about, where there are others under other objects."""
    if apart_from is not None:
        store = shown_path(str(apart_from))
        return f"this is about the cases of this run; `scbm report {store}` unites those of all objects"
    return "" if lifted is None else united_in_words(lifted)


def _missed_sentence(threshold: Threshold, figure: Figure, origin: str = "") -> str:
    if threshold.kind == COVERABLE and figure.of:
        return f"Of what can be covered, {figure} is covered, under {threshold.percent:g} %."
    kind = "" if threshold.kind == "all" else f"{threshold.kind}="
    if not figure.of:
        of_kind = f" for `{threshold.kind}`" if kind else ""
        return f"The model has no obligations{of_kind}, so {FAIL_UNDER} {kind}{threshold.percent:g} cannot be met."
    what = f"Coverability of `{threshold.kind}`, {figure}," if kind else f"Coverability {figure}"
    return f"{what} is under {threshold.percent:g} %{': ' if origin else ''}{origin}."


def read_inputs(text: str | None) -> bool:
    """Return whether `--inputs` asks for inputs that are drawn. Raise `InputError` for any other text."""
    if text not in (None, "drawn"):
        message = f"there is no way `{text}` to move inputs"
        raise option_error("--inputs", message, "write `--inputs drawn`")
    return text is not None


def read_executor(jobs: int | None, cluster: str | None = None) -> Executor:
    """Return what runs the batches of a campaign. Raise `InputError`.

    Args:
        jobs: the number of worker processes; `None` for all cores as soon as the campaign takes long.
        cluster: the address of a Dask scheduler, if its workers are to run the batches.
    """
    if cluster is not None:
        return _read_cluster(jobs, cluster)
    return Cores(jobs)


def _read_cluster(jobs: int | None, address: str) -> Executor:
    if jobs is not None:
        message = "with `--cluster` the workers of the cluster run the cases"
        raise option_error("-j", message, "leave one of the two out")
    try:
        from scbm.testing.batches.dask_cluster import DaskCluster  # noqa: PLC0415 - an extra
    except ImportError:
        remedy = 'install the extra: `pip install "scbm[cluster]"`'
        place = Place("--cluster")
        raise InputError([Diagnostic(Slug.CLUSTER_UNUSABLE, "Dask is not installed", place, remedy)]) from None
    return DaskCluster(address)
