"""The broken files of `tests/models/rejected_pddl` get exactly the errors beside them.

`NAME.domain.pddl` and `NAME.problem.pddl` replace those of `right`. `--update-golden` writes the expectations.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from scbm.model import InputError, Slug
from scbm.pddl import PddlImportOptions, PddlText, imported_model, read_pddl

# the reader of `unified-planning` 1.3 calls old names of a library of its own
pytestmark = pytest.mark.filterwarnings("ignore:.* deprecated - use:DeprecationWarning")

FOLDER = Path(__file__).parents[2] / "models" / "rejected_pddl"
NAMES = sorted({path.name.partition(".")[0] for path in FOLDER.glob("*.pddl")} - {"right"})


def texts(name: str) -> tuple[PddlText, PddlText]:
    found = []
    for kind in ("domain", "problem"):
        own = FOLDER / f"{name}.{kind}.pddl"
        path = own if own.exists() else FOLDER / f"right.{kind}.pddl"
        found.append(PddlText(path.name, path.read_text(encoding="utf-8")))
    return found[0], found[1]


def errors_of(name: str) -> InputError:
    domain, problem = texts(name)
    with pytest.raises(InputError) as raised:
        imported_model(read_pddl(domain, problem), domain, problem, PddlImportOptions())
    return raised.value


@pytest.mark.parametrize("name", NAMES)
def test_broken_files_get_exactly_these_errors(name: str, request: pytest.FixtureRequest) -> None:
    shown, expected = f"{errors_of(name)}\n", FOLDER / f"{name}.expected"
    if request.config.getoption("--update-golden"):
        expected.write_text(shown, encoding="utf-8")
    assert shown == expected.read_text(encoding="utf-8")
    by_file = {text.file: text.text.split("\n") for text in texts(name)}
    for each in errors_of(name).diagnostics:
        assert each.slug in {Slug.BAD_PDDL, Slug.PDDL_NOT_EXPRESSIBLE}
        assert each.source_line == by_file[each.place.file][each.place.line - 1]
        assert 1 <= each.place.column <= len(each.source_line) + 1
        assert not re.search(r"Error|Traceback|FNode|\bo-|\bf-|\bt-", f"{each.message} {each.remedy}")


def test_the_files_that_the_others_are_made_from_are_right() -> None:
    domain, problem = texts("right")
    assert "load[" in imported_model(read_pddl(domain, problem), domain, problem, PddlImportOptions()).text


def test_each_expectation_has_its_files() -> None:
    assert [path.stem for path in sorted(FOLDER.glob("*.expected"))] == NAMES
