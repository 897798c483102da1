"""The report of the study: all tables, from the kill matrices of its models."""

from __future__ import annotations

from functools import reduce
from statistics import median
from typing import TYPE_CHECKING

from effects import LEVEL, Effect, holm, kendall, mean, over_models, vargha_delaney
from kill_matrix import ORACLES
from predictors import PREDICTORS, SCBM_IAS, masks_of
from subjects import CONTROL
from suites import (
    REQUESTS,
    SIZES,
    chosen_suites,
    completed,
    random_suites,
    requests_of,
    suites_of_requests,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from kill_matrix import KillMatrix
    from suites import Suite

EACH, _, BUILT_INS, RECORDED = range(len(ORACLES))
_CLEAN_UP = ("clean-up-drop", "deadline-none", "deadline-shorter", "deadline-longer")
"""The operators of H6."""


class ModelResults:
    """The suites of one model, what they have exercised, and what they find."""

    def __init__(self, matrix: KillMatrix, suites: int) -> None:
        self.matrix = matrix
        self._count = suites
        self._facts = (*matrix.cases, *matrix.closed)
        self._masks = masks_of(matrix.obligations)
        self._closed = range(len(matrix.cases), len(self._facts))

    def found(self, suite: Suite, oracle: int = EACH) -> int:
        """Return how many mutants a suite finds."""
        cases = reduce(lambda bits, number: bits | 1 << number, suite, 0)
        return sum(bool(row.found[oracle] & cases) for row in self.matrix.mutants)

    def tau(self, predictor: str, *, by_requests: bool = False, oracle: int = EACH) -> float | None:
        """Return Kendall's τ between a predictor and what suites find: the mean over sizes."""
        measure = PREDICTORS[predictor]
        taus = []
        for suites in self._sized(by_requests=by_requests):
            predicted = [measure(suite, self._facts, self._masks) for suite in suites]
            taus.append(kendall(predicted, [self.found(suite, oracle) for suite in suites]))
        return mean(taus)

    def _sized(self, *, by_requests: bool) -> Iterator[list[Suite]]:
        if by_requests:
            yield from (list(suites_of_requests(self.matrix.cases, number, self._count)) for number in REQUESTS)
        else:
            yield from (list(random_suites(len(self.matrix.cases), size, self._count)) for size in SIZES)

    def chosen_against_random(self) -> float | None:
        """Return Â12 of suites chosen by coverage against random ones of the same number of cases."""
        found = []
        for size, drawn in zip(SIZES, self._sized(by_requests=False), strict=True):
            chosen = [self.found(suite) for suite in chosen_suites(self.matrix.cases, size, self._count)]
            found.append(vargha_delaney(chosen, [self.found(suite) for suite in drawn]) if drawn else None)
        return mean(found)

    def completed_against_random(self) -> float | None:
        """Return Â12 of random suites completed by closing against random ones of the same number of requests."""
        ours, theirs = [], []
        for suite in random_suites(len(self.matrix.cases), SIZES[1], self._count):
            whole = completed(suite, self._facts, self._closed)
            others = next(suites_of_requests(self.matrix.cases, requests_of(whole, self._facts), 1), None)
            if others is not None:
                ours.append(self.found(whole))
                theirs.append(self.found(others))
        return vargha_delaney(ours, theirs) if ours else None

    def share(self, oracle: int, operators: Iterable[str] | None = None) -> float | None:
        """Return the share of what can be noticed that an oracle notices with the whole pool."""
        cases = (1 << len(self.matrix.cases)) - 1
        rows = [row for row in self.matrix.mutants if operators is None or row.operator in operators]
        seen = [row for row in rows if row.found[EACH] & cases]
        return sum(bool(row.found[oracle] & cases) for row in seen) / len(seen) if seen else None


def report(matrices: Sequence[KillMatrix], suites: int) -> str:
    """Return the report in Markdown; `suites` is the number of suites of each size."""
    kept = [ModelResults(matrix, suites) for matrix in matrices if not matrix.left]
    tested = [results for results in kept if results.matrix.group != CONTROL]
    control = [results for results in kept if results.matrix.group == CONTROL]
    lines = [
        "# The study: results",
        "",
        "Written by `study/run.py` from the files beside it. The protocol is `study/protocol.md`.",
        "",
    ]
    lines += ["## Hypotheses", "", *_hypotheses(tested), ""]
    lines += ["## Predictors", "", *_predictors(tested), ""]
    lines += ["## Oracles", "", *_oracles(tested), ""]
    if control:
        lines += ["## Control: planning problems", "", *_predictors(control), ""]
    lines += ["## Models", "", *_models(matrices), ""]
    return "\n".join(lines)


def _hypotheses(results: Sequence[ModelResults]) -> Iterator[str]:
    rivals = [name for name in PREDICTORS if name != SCBM_IAS]
    ours = [each.tau(SCBM_IAS) for each in results]
    found: dict[str, tuple[str, Effect | None]] = {
        "H1": ("τ at fixed numbers of cases", over_models(ours, 0.3)),
        "H2": (
            "τ at fixed numbers of requests",
            over_models([e.tau(SCBM_IAS, by_requests=True) for e in results], 0.3),
        ),
    }
    for rival in rivals:
        differences = [
            None if our is None or (their := each.tau(rival)) is None else our - their
            for our, each in zip(ours, results, strict=True)
        ]
        found[f"H3 {rival}"] = (f"τ less that of {rival}", over_models(differences, 0.0))
    found["H4"] = ("Â12, chosen by coverage", over_models([each.chosen_against_random() for each in results], 0.5))
    found["H5"] = ("Â12, completed by closing", over_models([each.completed_against_random() for each in results], 0.5))
    raised = [_difference(each.share(BUILT_INS, _CLEAN_UP), each.share(1, _CLEAN_UP)) for each in results]
    found["H6"] = ("more clean-up and deadline mutants with built-ins", over_models(raised, 0.0))
    found["H7"] = ("share that recorded results notice", over_models([each.share(RECORDED) for each in results], 0.8))
    known = {name: effect for name, (_, effect) in found.items() if effect is not None}
    corrected = dict(zip(known, holm([effect.p for effect in known.values()]), strict=True))
    medians = {"H1": 0.5, "H2": 0.5, "H4": 0.64, "H5": 0.64}
    yield "| | effect | median over models [95 %] | p (Holm) | |"
    yield "| --- | --- | --- | --- | --- |"
    for name, (words, effect) in found.items():
        if effect is None:
            yield f"| {name} | {words} | too few models | | |"
            continue
        holds = corrected[name] < LEVEL and effect.median >= medians.get(name, effect.median)
        yield f"| {name} | {words} | {effect} | {corrected[name]:.4f} | {'confirmed' if holds else 'not confirmed'} |"


def _difference(first: float | None, second: float | None) -> float | None:
    return None if first is None or second is None else first - second


def _predictors(results: Sequence[ModelResults]) -> Iterator[str]:
    yield "Kendall's τ with the mutants that a suite finds, each difference noticed: median over models [95 %]."
    yield ""
    yield "| predictor | fixed number of cases | fixed number of requests |"
    yield "| --- | --- | --- |"
    for name in PREDICTORS:
        cells = [over_models([each.tau(name, by_requests=way) for each in results], 0.0) for way in (False, True)]
        yield f"| {name} | {' | '.join(str(cell or 'too few models') for cell in cells)} |"


def _oracles(results: Sequence[ModelResults]) -> Iterator[str]:
    yield "What the whole pool of random cases finds, of what it can show; and τ of SCBM-IAS with that."
    yield ""
    yield "| oracle | share, median over models [95 %] | of clean-up and deadlines | τ |"
    yield "| --- | --- | --- | --- |"
    for index, name in enumerate(ORACLES):
        share = over_models([each.share(index) for each in results], 0.0)
        clean_up = over_models([each.share(index, _CLEAN_UP) for each in results], 0.0)
        tau = over_models([each.tau(SCBM_IAS, oracle=index) for each in results], 0.0)
        yield f"| {name} | {share or ''} | {clean_up or ''} | {tau or ''} |"


def _models(matrices: Sequence[KillMatrix]) -> Iterator[str]:
    left = [matrix for matrix in matrices if matrix.left]
    yield f"{len(matrices)} models, {len(left)} left the study. Median number of mutants: " + str(
        median(len(matrix.mutants) for matrix in matrices)
    )
    yield ""
    yield "| model | group | operations | obligations | mutants | equivalent | of all | cases | CPU | SHA-256 | |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    for m in matrices:
        cells = (m.name, m.group, m.operations, len(m.obligations), len(m.mutants), m.equivalent, m.all_mutants,
                 len(m.cases), f"{m.cpu_s:.1f} s", f"`{m.digest[:12]}`", m.left)  # fmt: skip
        yield f"| {' | '.join(map(str, cells))} |"
