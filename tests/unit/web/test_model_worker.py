"""The worker process of a console: it keeps the model, follows its files, and is ended by a newer text."""

from __future__ import annotations

import threading
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from msgspec.json import decode

from scbm.web.console_runs import ConsoleRequest
from scbm.web.model_worker import ModelWorker
from support.consoles import CELL

if TYPE_CHECKING:
    from collections.abc import Iterator

pytestmark = pytest.mark.slow

TEXT = "case: a\ngoal: gripped\n"
HARD = """\
behavior_model: hard
variables: {%s}
operations: {%s}
goals: {all: %s}
"""
"""A model whose plan takes long to find: its goal needs all of many variables, in any order."""


def hard_model() -> str:
    names = [f"v{number}" for number in range(26)]
    variables = ", ".join(f"{name}: {{domain: 0..3, initial: 0}}" for name in names)
    step = "{pre: {g: %s < 3 && %s == 0}, post: {g: true, a: [%s += 1]}}"
    pairs = zip(names, [*names[1:], names[0]], strict=True)
    operations = ", ".join(f"o_{name}: {step % (name, other, name)}" for name, other in pairs)
    return HARD % (variables, operations, " && ".join(f"{name} == 3" for name in names))


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
    worker = ModelWorker(tmp_path / "hard.yaml", seconds=0.5)
    try:
        assert ask(worker, "run", "case: a\ngoal: all\n")["ended"]
        assert "model" in ask(worker, "facts")
    finally:
        worker.close()


def test_a_newer_text_ends_an_older_run(tmp_path: Path) -> None:
    (tmp_path / "hard.yaml").write_text(hard_model(), encoding="utf-8")
    worker, answers = ModelWorker(tmp_path / "hard.yaml", seconds=600), []
    ask(worker, "facts")
    older = threading.Thread(target=lambda: answers.append(ask(worker, "run", "case: a\ngoal: all\n")))
    try:
        older.start()
        newer = ask(worker, "run", "case: b\ngoal: v0 == 0\n")
        older.join()
    finally:
        worker.close()
    assert "run" in newer or "run" in answers[0] or answers[0]["ended"]
    assert len(answers) == 1
