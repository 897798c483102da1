"""The worker process of a console: it keeps the model, follows its files, and is ended by a newer text."""

from __future__ import annotations

import threading
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import pytest
from msgspec.json import decode

from scbm.testing.batches.worker_processes import WorkerPool
from scbm.web.console_runs import LIMIT, ConsoleRequest
from scbm.web.model_worker import ModelWorker
from support.consoles import CELL

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.slow

TEXT = "case: a\ngoal: gripped\n"


def hard_model() -> str:
    """Return a model whose plan no planner finds within minutes: neighbours swap until all values are in reverse."""
    names = [f"v{number}" for number in range(16)]
    variables = (f"{name}: {{domain: 0..15, initial: {number}}}" for number, name in enumerate(names))
    swap = "swap_{0}: {{pre: {{g: true}}, post: {{g: true, a: [{0} <- {1}, {1} <- {0}]}}}}"
    swaps = (swap.format(*pair) for pair in pairwise(names))
    goal = " && ".join(f"{name} == {15 - number}" for number, name in enumerate(names))
    parts = (f"variables: {{{', '.join(variables)}}}", f"operations: {{{', '.join(swaps)}}}")
    return "\n".join(("behavior_model: hard", *parts, f"goals: {{all: {goal}, none: v0 == 0}}", ""))


@pytest.fixture
def worker(tmp_path: Path) -> Iterator[ModelWorker]:
    (tmp_path / "cell.yaml").write_text(CELL, encoding="utf-8")
    made = ModelWorker(tmp_path / "cell.yaml")
    yield made
    made.close()


def ask(worker: ModelWorker, name: str, text: str = TEXT) -> dict[str, Any]:
    answer: dict[str, Any] = decode(worker.ask(name, ConsoleRequest(text=text)))
    return answer


def test_a_changed_model_is_loaded_again_and_its_errors_shown(worker: ModelWorker, tmp_path: Path) -> None:
    before = worker.digest()
    assert ask(worker, "run")["run"]["passed"]
    model = tmp_path / "cell.yaml"
    model.write_text(CELL.replace("gripped: gripped == true", "gripped: grpped == true"), encoding="utf-8")
    assert worker.digest() != before
    (error,) = ask(worker, "run")["model_errors"]
    assert error["line"] == CELL.splitlines().index("  gripped: gripped == true") + 1
    model.unlink()
    assert worker.digest() not in (before, "")
    assert ask(worker, "run")["model_errors"]
    model.write_text(CELL, encoding="utf-8")
    assert worker.digest() == before
    assert ask(worker, "run")["run"]["passed"]


def test_a_run_that_takes_too_long_is_ended_and_the_next_one_answered(tmp_path: Path) -> None:
    (tmp_path / "hard.yaml").write_text(hard_model(), encoding="utf-8")
    worker = ModelWorker(tmp_path / "hard.yaml", seconds=3)  # ten times what the next answer takes
    try:
        assert ask(worker, "run", "case: a\ngoal: all\n")["ended"]
        assert "model" in ask(worker, "facts")
    finally:
        worker.close()


@pytest.fixture
def hard(tmp_path: Path) -> Iterator[ModelWorker]:
    """A worker with nearly no limit of time."""
    (tmp_path / "hard.yaml").write_text(hard_model(), encoding="utf-8")
    made = ModelWorker(tmp_path / "hard.yaml", seconds=600)
    yield made
    made.close()


class PairOfAnswers(NamedTuple):
    """The answers to a text whose plan is hard, and to an easy one that came while it ran."""

    older: dict[str, Any]
    newer: dict[str, Any]


def ask_while_another_runs(worker: ModelWorker, page: str, monkeypatch: pytest.MonkeyPatch) -> PairOfAnswers:
    """Let page `a` run a text whose plan is hard, and then a page an easy one."""
    is_begun, submit = threading.Event(), WorkerPool.submit

    def submitted(*arguments: Any) -> Any:  # noqa: ANN401 - as `WorkerPool` has them
        future = submit(*arguments)
        is_begun.set()
        return future

    def run(name: str, goal: str) -> None:
        answers[goal] = decode(worker.ask("run", ConsoleRequest(f"case: a\ngoal: {goal}\n", page=name)))

    ask(worker, "facts")
    answers: dict[str, dict[str, Any]] = {}
    monkeypatch.setattr(WorkerPool, "submit", submitted)
    older = threading.Thread(target=run, args=("a", "all"))
    older.start()
    is_begun.wait()
    run(page, "none")
    older.join()
    return PairOfAnswers(answers["all"], answers["none"])


def test_a_newer_text_ends_an_older_run(hard: ModelWorker, monkeypatch: pytest.MonkeyPatch) -> None:
    older, newer = ask_while_another_runs(hard, "a", monkeypatch)
    assert older["ended"] != LIMIT
    assert newer["run"]["passed"]


def test_another_page_waits_for_a_run(hard: ModelWorker, monkeypatch: pytest.MonkeyPatch) -> None:
    older, newer = ask_while_another_runs(hard, "b", monkeypatch)
    assert older["run"]["limit"] == LIMIT
    assert newer["run"]["passed"]
