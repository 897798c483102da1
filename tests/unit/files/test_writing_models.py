"""Models as text: the written form of each valid model means the same."""

from __future__ import annotations

from pathlib import Path

import pytest

from scbm.files import load_model, read_model, write_model

VALID = sorted((Path(__file__).parents[2] / "models" / "valid").glob("*.yaml"))


@pytest.mark.parametrize("file", VALID, ids=lambda file: file.stem)
def test_the_written_form_of_a_model_means_the_same(file: Path) -> None:
    model = load_model(file)
    assert read_model(write_model(model)) == model
