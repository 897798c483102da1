"""How the figure grew with the cases: a point for each case that added something, and nothing else."""

from collections.abc import Sequence

import pytest
from lxml import etree
from msgspec.structs import replace

from scbm.cases.coverage import Figure
from scbm.reports.html.diagrams import growth_svg
from scbm.store import History, StoredRun
from support.histories import EXAMPLE, history_of
from support.wording import Wording

SVG = "{http://www.w3.org/2000/svg}"


@pytest.fixture(scope="module")
def history() -> History:
    return history_of(EXAMPLE / "before.yaml", 20)


def _visiting(history: History, visits: Sequence[int], runs: Sequence[int] | None = None) -> History:
    """Cases `case-1`, `case-2`, … that visit these bits, in these runs."""
    like = history.cases[0]
    kept = (
        replace(like, name=f"case-{i}", position=i, visited=visited, run=0 if runs is None else runs[i - 1])
        for i, visited in enumerate(visits, start=1)
    )
    return replace(history, cases=tuple(kept))


def _parsed(history: History) -> etree._Element:
    return etree.fromstring(growth_svg(history))


def _points(root: etree._Element) -> list[str]:
    return [point.findtext(f"{SVG}title") or "" for point in root.iter(f"{SVG}circle")]


def test_each_case_that_added_something_is_a_point_that_names_what(history: History) -> None:
    names = history.obligations.names(0b1011)
    grown = _visiting(history, [0b0001, 0b0001, 0b1010, 0])
    figures = [Figure(count, 86) for count in (1, 3)]
    assert _points(_parsed(grown)) == [
        f"case-1, case 1: {figures[0]}, 1 more\n{names[0]}",
        f"case-3, case 3: {figures[1]}, 2 more\n{names[1]}\n{names[2]}",
    ]


def test_what_is_beside_the_figure_adds_nothing(history: History) -> None:
    beside = (1 << len(history.obligations.all)) - 1 & ~history.obligations.counted
    assert beside
    assert _points(_parsed(_visiting(history, [1, beside]))) == _points(_parsed(_visiting(history, [1, 0])))


def test_the_last_point_and_the_text_are_the_figure_of_the_history(history: History) -> None:
    root = _parsed(history)
    figure = history.coverage.figure
    assert f": {figure}, " in _points(root)[-1]
    assert [text.text for text in root.iter(f"{SVG}text")].count(str(figure)) == 1


def test_the_curve_rises_where_the_points_are_and_ends_with_the_last_case(history: History) -> None:
    root = _parsed(_visiting(history, [1, 0, 0b110, 0]))
    _, line = (str(path.get("d")) for path in root.iter(f"{SVG}path"))
    assert line == f"M0 1 H0.25000 V{1 - 1 / 86:.5f} H0.75000 V{1 - 3 / 86:.5f} H1"


def test_the_axis_of_many_cases_is_logarithmic(history: History) -> None:
    root = _parsed(_visiting(history, [1, 0b10, *[0] * 998]))
    first, second = (float(str(point.get("cx")).rstrip("%")) for point in root.iter(f"{SVG}circle"))
    assert first > 12 + 5
    assert second > first + 4


def test_a_point_leads_to_its_case(history: History) -> None:
    nasty = replace(history.cases[0], name="a/b <&> é", visited=1)
    root = _parsed(replace(history, cases=(nasty,)))
    assert [link.get("href") for link in root.iter(f"{SVG}a")] == ["#/case/a%2Fb%20%3C%26%3E%20%C3%A9"]
    assert _points(root)[0].startswith("a/b <&> é, case 1: ")


def test_ten_thousand_cases_have_as_many_points_as_steps(history: History) -> None:
    grown = _visiting(history, [1 << min(i // 1000, 9) for i in range(10_000)])
    text = growth_svg(grown)
    assert len(_points(etree.fromstring(text))) == 10
    assert len(text) < 10_000


def test_of_many_obligations_a_point_names_some(history: History, wording: Wording) -> None:
    (shown,) = _points(_parsed(_visiting(history, [(1 << 40) - 1])))
    assert shown.count("\n") == 13
    wording(shown.splitlines()[-1])


def test_each_run_but_the_first_is_marked_where_it_begins(history: History) -> None:
    first = history.runs[0]
    second = StoredRun("2" * 32, "2026-12-24T08:00:00.000000Z", "scbm test <x> & 'y'", first.source)
    grown = replace(_visiting(history, [1, 2, 4, 8], [0, 0, 1, 1]), runs=(first, second))
    (mark,) = (group for group in _parsed(grown).iter(f"{SVG}g") if group.get("class") == "run")
    assert mark.findtext(f"{SVG}title") == "run 2, 2026-12-24: scbm test <x> & 'y'"
    assert mark.findtext(f"{SVG}text") == "run 2"
    line = mark.find(f"{SVG}line")
    assert line is not None
    assert line.get("x1") == "54.500%"  # half way between 12 and 97


def test_a_history_without_cases_says_so(history: History, wording: Wording) -> None:
    root = _parsed(replace(history, cases=()))
    assert _points(root) == []
    wording(text.text for text in root.iter(f"{SVG}text"))


def test_a_model_without_obligations_says_so(history: History, wording: Wording) -> None:
    model = replace(history.model, operations=(), automatic_transitions=())
    root = _parsed(replace(_visiting(history, [0]), model=model))
    wording(text.text for text in root.iter(f"{SVG}text"))


@pytest.mark.parametrize("total", [1, 2, 3, 9, 10, 11, 19, 50, 99, 100, 1234, 10_000])
def test_the_axis_has_a_few_numbers_and_the_last_case(history: History, total: int) -> None:
    root = _parsed(_visiting(history, [0] * total))
    numbers = [str(text.text) for text in root.iter(f"{SVG}text") if str(text.text).replace(",", "").isdigit()]
    assert numbers[-1] == f"{total:,}"
    assert numbers[0] == ("0" if total < 1000 else "1")
    assert len(numbers) == len({*numbers}) <= 7
