"""The list of the core tier fits the tests, and those that run most new lines in little time are chosen."""

from __future__ import annotations

import pytest

from core_tier.choose_core_tier import ALWAYS, Candidate, Tier, candidates_of, choose
from support.core_tier import MISSING, ROOT, CoreList, function_of, read_core_list

LISTED = CoreList(["tests/property", "tests/unit/a/test_a.py::test_all", "tests/unit/a/test_a.py::test_some[1-x]"])


def text_of(file: str) -> str:
    path = ROOT / file
    return path.read_text(encoding="utf-8") if path.is_file() else ""


def test_each_listed_test_exists(pytestconfig: pytest.Config) -> None:
    """In a run of the core tier also each listed parameter."""
    lines = read_core_list().lines
    texts = {file: text_of(file) for file in dict.fromkeys(line.partition("::")[0] for line in lines)}
    lost = [line for line in lines if "::" not in line and not (ROOT / line).is_dir()]
    for line in lines:
        file, _, name = function_of(line).partition("::")
        lost += [line] if name and f"def {name}(" not in texts[file] else []
    lost += [line for line in pytestconfig.stash.get(MISSING, ()) if line not in lost]
    assert lost == [], "delete these lines of core_tests.txt, or run choose_core_tier.py --write"


def test_the_list_is_sorted_and_has_what_is_always_in_the_tier() -> None:
    lines = list(read_core_list().lines)
    assert lines == sorted(dict.fromkeys(lines))
    assert [folder for folder in ALWAYS if folder not in lines] == []


@pytest.mark.parametrize(
    ("path", "is_collected"),
    [
        ("tests", True),
        ("tests/property/test_b.py", True),
        ("tests/unit/a", True),
        ("tests/unit/a/test_a.py", True),
        ("tests/unit/a/test_b.py", False),
        ("tests/unit/b", False),
        ("tests/property_of_others", False),
    ],
)
def test_files_without_listed_tests_are_not_collected(path: str, *, is_collected: bool) -> None:
    assert LISTED.may_hold(path) == is_collected


@pytest.mark.parametrize(
    ("name", "is_listed"),
    [
        ("tests/property/test_b.py::test_c[2]", True),
        ("tests/unit/a/test_a.py::test_all[2]", True),
        ("tests/unit/a/test_a.py::test_all", True),
        ("tests/unit/a/test_a.py::test_some[1-x]", True),
        ("tests/unit/a/test_a.py::test_some[1-y]", False),
        ("tests/unit/a/test_a.py::test_other", False),
    ],
)
def test_a_line_stands_for_a_folder_for_all_parameters_or_for_one(name: str, *, is_listed: bool) -> None:
    assert LISTED.has(name) == is_listed


def test_tests_with_the_mark_of_another_tier_are_not_in_the_core(request: pytest.FixtureRequest) -> None:
    core = CoreList(["tests/core_tier"])
    items = [pytest.Function.from_parent(request.node.parent, name=name, callobj=text_of) for name in ("a", "b")]
    items[1].add_marker("slow")
    assert core.of_tier(items) == (items[:1], items[1:])


def test_lines_without_a_test_are_missing() -> None:
    tests = ["tests/unit/a/test_a.py::test_all[2]", "tests/unit/a/test_a.py::test_some[1]"]
    assert LISTED.missing(tests) == ("tests/unit/a/test_a.py::test_some[1-x]",)


def candidate(name: str, seconds: float, *lines: int) -> Candidate:
    return Candidate(name, seconds, frozenset(("a.py", line) for line in lines))


def chosen(candidates: list[Candidate], max_seconds: float, listed: tuple[str, ...] = ()) -> list[str]:
    tier = Tier(listed)
    choose(candidates, tier, max_seconds)
    return tier.names


def test_tests_with_most_new_lines_for_their_time_are_taken_until_the_time_is_used() -> None:
    many, few, same = candidate("m", 2.0, *range(60)), candidate("f", 1.0, 60), candidate("s", 1.0, *range(20))
    assert chosen([few, same, many], 1.0) == ["m"]
    assert chosen([few, same, many], 9.0) == ["m", "s", "f"]
    assert chosen([candidate("t", 1.0)], 9.0) == []


def test_properties_and_contracts_are_always_taken() -> None:
    always = candidate("tests/contract/test_buses.py::test_order", 100.0)
    assert chosen([candidate("a", 0.1, 1), always], 1.0) == [always.name]


def test_a_listed_test_stays_unless_another_one_is_clearly_better() -> None:
    listed, better, best = (candidate(name, seconds, 1, 2) for name, seconds in (("a", 1.0), ("b", 0.6), ("c", 0.1)))
    assert chosen([listed, better], 0.1) == ["b"]
    assert chosen([listed, better], 0.1, ("a",)) == ["a"]
    assert chosen([listed, best], 0.1, ("a",)) == ["c"]


def test_a_test_that_takes_little_is_taken_with_all_parameters_and_none_by_the_line_of_a_page() -> None:
    seconds = {"a[1]": 0.01, "a[2]": 0.02, "b[1]": 0.2, "b[2]": 0.01, "c[page.md:12]": 0.01}
    found = candidates_of(seconds, {"a[1]": frozenset([("a.py", 1)]), "a[2]": frozenset([("a.py", 2)])})
    assert [(each.name, len(each.lines)) for each in found] == [("a", 2), ("b[1]", 0), ("b[2]", 0)]
