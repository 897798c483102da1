"""Whatever is changed in a lifted model or in a part, the answer is a model or located errors, after limited work."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path

import pytest

from scbm.files import load_model
from scbm.model import InputError
from support.lifted_mutants import Mutant, mutant
from support.mutations import check_diagnostics
from support.profiles import share, slow_beyond
from support.step_limits import step_limit

MAX_CALLS = 20_000_000
"""Maximum number of calls for one model: those of the largest one that the limits of the language allow."""

BATCH = 20
"""The number of mutants of one test."""

BATCHES = slow_beyond(1, range(share(10_000) // BATCH))
"""20 mutants in the usual run, where calls are not counted; 1,000 with the slow tests, 10,000 with all examples."""

USER = """\
behavior_model: cell
parts:
  first: {use: part.yaml}
  second: {use: part.yaml}
variables:
  on: {domain: bool, initial: false}
operations:
  wait: {pre: {g: on == true}, post: {g: true}}
"""
"""A model that uses a part twice."""


def check_answer(found: Mutant, folder: Path, max_calls: int | None) -> None:
    """Load a mutant. Any other exception than `InputError` fails the test, and so do more calls than `max_calls`."""
    path = folder / "model.yaml"
    texts = {str(path): USER if found.is_part else found.text}
    path.write_bytes(texts[str(path)].encode("utf-8"))
    if found.is_part:
        texts[str(folder / "part.yaml")] = found.text
        (folder / "part.yaml").write_bytes(found.text.encode("utf-8"))
    try:
        with step_limit(max_calls) if max_calls is not None else nullcontext():
            load_model(path)
    except InputError as error:
        for file in dict.fromkeys(each.place.file for each in error.diagnostics):
            text = texts[file] if file in texts else Path(file).read_text(encoding="utf-8")
            check_diagnostics([each for each in error.diagnostics if each.place.file == file], text, file)


@pytest.mark.longer
@pytest.mark.parametrize("batch", BATCHES)
def test_mutants_of_lifted_models_end_in_a_model_or_in_located_errors(batch: int, tmp_path: Path) -> None:
    for number in range(batch * BATCH, (batch + 1) * BATCH):
        found = mutant(number)
        try:
            check_answer(found, tmp_path, MAX_CALLS if batch else None)
        except Exception as error:
            error.add_note(f"mutant {number} of {found.source.name}:\n{found.text}")
            raise
