"""The table of mutants fits the source, and the tool tells mutants that tests notice from others."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from source_mutants.source_mutants import ROOT, SOURCE, PackageCopy, SourceMutant, read_mutants

MUTANTS = read_mutants()
ALL = [*MUTANTS, *read_mutants("equivalent")]


def test_each_mutant_changes_a_text_that_occurs_once() -> None:
    sources = {mutant.file: (SOURCE / mutant.file).read_text(encoding="utf-8") for mutant in ALL}
    times = {f"{each.file}: {each.why}": sources[each.file].count(each.old) for each in ALL}
    assert {name: number for name, number in times.items() if number != 1} == {}
    assert [each.why for each in ALL if each.old == each.new] == []


def test_no_mutant_is_in_the_table_twice() -> None:
    changes = Counter((mutant.file, mutant.old, mutant.new) for mutant in ALL)
    reasons = Counter((mutant.file, mutant.why) for mutant in ALL)
    assert [each for counts in (changes, reasons) for each, times in counts.items() if times > 1] == []


def test_the_tests_of_each_mutant_exist() -> None:
    tests = dict.fromkeys(test for mutant in MUTANTS for test in mutant.tests)
    assert tests
    assert [test for test in tests if not (ROOT / test).is_file()] == []


def test_each_module_of_the_checker_has_mutants() -> None:
    modules = [path.name for path in (SOURCE / "proofcheck").glob("*.py") if path.name != "__init__.py"]
    assert [name for name in modules if not any(each.file == f"proofcheck/{name}" for each in MUTANTS)] == []


@pytest.mark.slow
def test_a_mutant_is_noticed_by_its_tests_or_survives_them(tmp_path: Path) -> None:
    tests = ("tests/unit/proofcheck/test_valuations.py",)
    copy = PackageCopy(tmp_path)
    copy.check(tests)
    mutant = SourceMutant("proofcheck/valuations.py", "        steps += 1\n", "        steps += 2\n", "", tests)
    assert (copy.failed(mutant) or "").startswith(f"{tests[0]}::")
    assert copy.failed(replace(mutant, new="        steps = steps + 1\n")) is None
    with pytest.raises(RuntimeError):
        copy.failed(replace(mutant, new="        steps +=\n"))
    copy.check(tests)  # the source is whole again
