"""The imported example is what the command on its page writes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from conftest import Ran

DELIVERY = Path(__file__).parents[3] / "examples" / "delivery"


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.* deprecated - use:DeprecationWarning")  # of a library that the reader uses
def test_the_delivery_cell_is_imported(scbm: Callable[..., Ran], tmp_path: Path) -> None:
    model = tmp_path / "cell.yaml"
    texts = (DELIVERY / "domain.pddl", DELIVERY / "problem.pddl")
    assert scbm("import", "pddl", *texts, "--resource", "robot", "--arguments", "-o", model).code == 0
    written, shipped = (path.read_text(encoding="utf-8").split("\n", 1) for path in (model, DELIVERY / "cell.yaml"))
    assert written[1] == shipped[1]  # the first line names the files
