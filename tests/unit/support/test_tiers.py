"""What a usual run of the tests leaves out, and the golden files of wording."""

from __future__ import annotations

from pathlib import Path

import pytest

from support.tiers import counts, sample, sample_summary, split, summary, tier_of
from support.wording import Wording, read_sections, write_sections


def item(request: pytest.FixtureRequest, name: str, tier: str | None = None) -> pytest.Item:
    """Return a test of this module with the mark of a tier, which no run collects."""

    def test() -> None:
        pass

    marked = test if tier is None else getattr(pytest.mark, tier)(test)
    return pytest.Function.from_parent(request.node.parent, name=name, callobj=marked)


@pytest.fixture
def items(request: pytest.FixtureRequest) -> list[pytest.Item]:
    pages = [item(request, name, "browser") for name in ("test_page", "test_other_page")]
    return [item(request, "test_plain"), item(request, "test_long", "slow"), *pages]


def test_tests_with_the_mark_of_a_tier_are_left_out(items: list[pytest.Item]) -> None:
    kept, left_out = split(items, [])
    assert [each.name for each in kept] == ["test_plain"]
    assert counts(left_out) == {"slow": 1, "browser": 2}


def test_a_test_that_is_named_runs_in_whatever_tier_it_is(items: list[pytest.Item]) -> None:
    named = next(each.nodeid for each in items if each.name == "test_page")
    kept, left_out = split(items, [named])
    assert [each.name for each in kept] == ["test_plain", "test_page"]
    assert counts(left_out) == {"slow": 1, "browser": 1}


def test_a_longer_test_whose_parameter_is_slow_is_slow(request: pytest.FixtureRequest) -> None:
    both = item(request, "test_both", "longer")
    both.add_marker("slow")
    assert [tier_of(each) for each in (item(request, "test_one", "longer"), both)] == ["longer", "slow"]


def test_longer_tests_run_where_golden_files_are_written(request: pytest.FixtureRequest) -> None:
    items = [item(request, "test_long", "longer"), item(request, "test_very_long", "slow")]
    assert [len(each) for each in split(items, [])] == [0, 2]
    assert [each.name for each in split(items, [], runs_longer=True)[0]] == ["test_long"]


def test_a_sample_has_a_fixed_part_of_the_slow_tests_and_all_others(request: pytest.FixtureRequest) -> None:
    items = [item(request, "test_plain"), *(item(request, f"test_long_{number}", "slow") for number in range(30))]
    kept, left_out = sample(items, 3)
    assert "test_plain" in [each.name for each in kept]
    assert {*kept, *left_out} == {*items}
    assert 0 < len(kept) < len(items)
    assert [*map(str, sample(items[::-1], 3)[0])] == [*map(str, kept[::-1])]
    assert sample(items, 1) == (items, [])


def test_the_summary_of_a_sample_says_how_to_run_all() -> None:
    text = sample_summary({"slow": 3})
    assert "3 slow" in text
    assert "pytest -m slow" in text


def test_the_summary_says_how_to_run_what_was_left_out() -> None:
    text = summary({"slow": 3, "browser": 7})
    assert "3 slow, 7 browser" in text
    assert "pytest -m slow" in text
    assert "pytest --full" in text


def test_sections_of_wording_are_read_as_they_are_written(tmp_path: Path) -> None:
    path, sections = tmp_path / "below" / "a.txt", {"a": "", "b": "one\n\ntwo\n", "c": "== no head"[3:]}
    write_sections(path, sections)
    assert read_sections(path) == sections


def test_wording_is_written_on_request_and_compared_otherwise(tmp_path: Path, wording: Wording) -> None:
    path = tmp_path / "a.txt"
    for is_update in (True, False):
        wording = Wording(path, "test_it", {str(tmp_path): "TMP"}, is_update)
        wording(f"{tmp_path}/x is missing")
        wording(["one", "two"])
    assert read_sections(path) == {"test_it": "TMP/x is missing", "test_it (2)": "one\ntwo"}
    with pytest.raises(AssertionError):
        Wording(path, "test_it", {}, is_update=False)("another text")


def _refuse(message: str, kind: type[Exception] = ValueError) -> None:
    raise kind(message)


def test_the_message_of_an_exception_is_compared(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    for is_update in (True, False):
        with Wording(path, "test_it", {}, is_update).raises(ValueError) as raised:
            _refuse("no such thing")
        assert str(raised.value) == read_sections(path)["test_it"]
    with pytest.raises(AssertionError), Wording(path, "test_it", {}, is_update=False).raises(ValueError):
        _refuse("another message")
    with pytest.raises(KeyError), Wording(path, "test_it", {}, is_update=False).raises(ValueError):
        _refuse("no such thing", KeyError)


def test_long_heads_of_wording_are_cut_and_stay_unique(tmp_path: Path) -> None:
    """Parameters of tests can be whole files."""
    path = tmp_path / "a.txt"
    names = [f"test_it[{'x' * 1000}{n}]" for n in range(2)]
    for name in names:
        Wording(path, name, {}, is_update=True)(name[-2:])
    assert sorted(read_sections(path).values()) == ["0]", "1]"]
    assert max(map(len, read_sections(path))) < 150
    for name in names:
        Wording(path, name, {}, is_update=False)(name[-2:])
