"""Histories of models, as a store would give them, made without one."""

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from msgspec.structs import replace

from scbm.cases import Case
from scbm.cases.coverage import visitors_of_each
from scbm.files import load_model, write_case
from scbm.store import (
    Drawn,
    History,
    ModelSource,
    ObligationChange,
    Recipe,
    RunComparison,
    StoredCase,
    StoredRun,
    VerdictChange,
    Written,
    digest_of,
    key_of,
)
from scbm.testing import RandomCases, Tester, load_suite

EXAMPLE = Path(__file__).parents[2] / "examples/robot_in_the_air"


def history_of(model_file: Path, cases: int, seed: int = 1, written: Sequence[Path] = ()) -> History:
    """What a store holds after one run of written cases and random ones; the same each time."""
    text = model_file.read_text(encoding="utf-8")
    return _drawn_history(model_file, text, cases, seed) if not written else _history(model_file, cases, seed, written)


@cache
def _drawn_history(model_file: Path, text: str, cases: int, seed: int) -> History:
    """The history of random cases, which many tests need; `text` is that of the model."""
    history = _history(model_file, cases, seed, ())
    assert history.runs[0].source.text == text
    return history


def _history(model_file: Path, cases: int, seed: int, written: Sequence[Path]) -> History:
    model = load_model(model_file)
    digest = digest_of(model)
    tester = Tester(model)
    suite: list[tuple[Case, Recipe]] = [
        (w.case, Written(write_case(w.case, model, None), str(w.path))) for w in load_suite(written, model)
    ]
    drawn = RandomCases(model).first(cases, seed)
    pairs = [*suite, *((case, Drawn(seed, number)) for number, case in enumerate(drawn, start=1))]
    kept = []
    for position, (case, recipe) in enumerate(pairs, start=1):
        result = tester.execute(case).result
        stored = StoredCase(
            key_of(recipe, digest),
            case.name,
            recipe,
            case.goal,
            0,
            position,
            result.verdict,
            result.ended_ns,
            result.requests,
            result.visited,
        )
        kept.append(stored)
    union = 0
    for stored in kept:
        union |= stored.visited
    failed = sum(not stored.verdict.passed for stored in kept)
    shown = model_file.relative_to(EXAMPLE.parents[1]) if model_file.is_relative_to(EXAMPLE.parents[1]) else model_file
    source = ModelSource(str(shown), model_file.read_text(encoding="utf-8"))
    command = f"scbm test {shown} --cases {cases} --seed {seed} --store cov.db"
    run = StoredRun("0" * 31 + "1", "2026-11-21T12:00:00.000000Z", command, source, union, len(kept), failed)
    return History(model, (run,), tuple(kept))


def since_another_run(history: History) -> History:
    """The history with its run compared with an earlier one, whose only case has no page and failed."""
    now, bits = history.runs[-1], history.obligations
    then = replace(now, id="f" * 32, visited=bits.bit(bits.all[-1]), cases=1, failed=1, is_finished=True)
    changes = tuple(
        ObligationChange(obligation, is_gained=bool(places), cases=tuple(history.labels[place] for place in places))
        for obligation, places in zip(bits, visitors_of_each(history.coverage), strict=True)
    )
    labels = zip(history.labels, history.cases, strict=True)
    failing = [VerdictChange(label, None, True, f"{label} failed") for label, case in labels if case in history.failed]
    return replace(history, since=RunComparison(now, then, changes, (*failing, VerdictChange("gone", True, None))))


def with_lost_cases(history: History, count: int) -> History:
    """The history with its first cases lost, as no store has it."""
    lost = Tester(history.model).lost(RandomCases(history.model).case(1, 1), "the controller was lost").result
    cases = [
        replace(case, verdict=lost.verdict, ended_ns=lost.ended_ns, requests=lost.requests, visited=lost.visited)
        for case in history.cases[:count]
    ]
    return replace(history, cases=(*cases, *history.cases[count:]))
