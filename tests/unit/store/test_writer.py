"""Adding runs to a store: what is there afterwards, who is refused, and who may write at the same time."""

from __future__ import annotations

import sqlite3
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from msgspec.structs import replace

from scbm.cases.coverage import Coverage, Obligations
from scbm.cases.trace import End
from scbm.model import Binding, InputError, Slug
from scbm.store import (
    Recipe,
    StoreWriter,
    Written,
    combine_stores,
    digest_of,
    drawn_recipe,
    key_of,
    read_history,
    write_store,
    written_recipe,
)
from scbm.testing import CaseResult, Tester, Verdict
from support.stores import a_run, cell, results, store
from support.wording import Wording

ROOT = Path(__file__).parents[3]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "cov.db"


def test_what_is_added_is_read_again(path: Path) -> None:
    pairs = results(1, 5)
    history = read_history(store(path, 1, pairs))
    assert history.model == cell()
    assert [(c.recipe, c.name, c.goal, c.verdict, c.ended_ns, c.requests, c.visited) for c in history.cases] == [
        (r, d.case.name, d.case.goal, d.verdict, d.ended_ns, d.requests, d.visited) for r, d in pairs
    ]
    assert [case.position for case in history.cases] == [1, 2, 3, 4, 5]
    run = history.runs[0]
    assert (run.cases, run.failed, run.visited) == (5, 0, history.coverage.visited)
    assert replace(run, cases=0, failed=0, visited=0, is_finished=False) == a_run(1, cell())
    assert not any(case.is_earlier for case in history.cases)


def test_the_keys_of_cases_are_part_of_the_format() -> None:
    """Another key would add a case again that a store has: a change of keys needs another version of the tables."""
    digest = digest_of(cell())
    assert [key_of(recipe, digest).hex() for recipe, _ in (*results(1, 2), *results(1, 1, "drawn"))] == [
        "67e1a95c00cf77718923601dbe2d05e7",
        "d798402f3adcc27ad9fddcb4ed146715",
        "a93c03850c4a43276225221b0b5af45f",
    ]


def test_the_figure_is_that_of_one_campaign(path: Path) -> None:
    pairs = results(1, 12)
    coverage = Coverage(Obligations.of(cell()), tuple((r.case.name, r.visited) for _, r in pairs))
    assert read_history(store(path, 1, pairs)).coverage == coverage


def test_nothing_stays_beside_the_file_when_the_last_writer_is_done(path: Path) -> None:
    store(path, 1, results(1, 3))
    assert [found.name for found in path.parent.iterdir()] == ["cov.db"]


def test_a_second_run_adds_to_the_first_and_knows_it(path: Path) -> None:
    store(path, 1, results(1, 4))
    model = cell()
    with write_store(path, model, a_run(2, model)) as writer:
        before = writer.before
        assert before is not None
        assert (before.id, before.cases) == (a_run(1, model).id, 4)
        for position, (recipe, result) in enumerate(results(2, 3), start=1):
            writer.add(position, recipe, result)
        totals = writer.totals()
        assert (totals.cases, totals.figure) == (7, read_history(path).coverage.figure)
    history = read_history(path)
    assert [(run.cases, run.command) for run in history.runs] == [(4, "scbm test 1"), (3, "scbm test 2")]
    assert [case.run for case in history.cases] == [0, 0, 0, 0, 1, 1, 1]


def test_the_first_run_has_none_before_it(path: Path) -> None:
    with write_store(path, cell(), a_run(1, cell())) as writer:
        assert writer.before is None


def test_the_same_case_is_there_once_and_belongs_to_the_later_run(path: Path) -> None:
    store(path, 1, results(1, 4))
    store(path, 2, results(1, 4))
    history = read_history(path)
    assert len(history.cases) == 4
    assert {history.runs[case.run].id for case in history.cases} == {a_run(2, cell()).id}
    store(path, 3, results(1, 2))
    assert [read_history(path).runs[case.run].command for case in read_history(path).cases] == [
        "scbm test 2", "scbm test 2", "scbm test 3", "scbm test 3",
    ]  # fmt: skip


def test_what_the_same_case_visits_in_two_runs_is_united_and_its_end_is_that_of_the_later(path: Path) -> None:
    (recipe, result), *_ = results(1, 1)
    first = replace(result, visited=0b101, verdict=Verdict(End.ABORTED), ended_ns=7)
    second = replace(result, visited=0b110, verdict=Verdict(End.REACHED), ended_ns=9)
    store(path, 1, [(recipe, first)])
    store(path, 2, [(recipe, second)])
    case = read_history(path).cases[0]
    assert (case.visited, case.verdict.end, case.ended_ns) == (0b111, End.REACHED, 9)


def test_what_one_run_of_a_case_visits_freely_is_not_forced_though_another_run_forces_it(path: Path) -> None:
    """Each run visits one obligation freely that the other one visits by force."""
    (recipe, result), *_ = results(1, 1)
    runs = [replace(result, visited=0b01101, forced=0b01100), replace(result, visited=0b10111, forced=0b10011)]
    for number, each in enumerate(runs, start=1):
        store(path, number, [(recipe, each)])
    case = read_history(path).cases[0]
    assert (case.visited, case.forced) == (0b11111, 0b11010)
    assert read_history(path).forced == 0b11010


def test_cases_of_one_name_that_differ_are_kept_apart(path: Path) -> None:
    """The same number of a seed is another case on another network."""
    history = read_history(store(path, 1, [*results(1, 2), *results(1, 2, "drawn")]))
    assert len(history.cases) == 4
    assert len(dict.fromkeys(history.labels)) == 4
    assert all(label.startswith("seed-1-case-") for label in history.labels)
    assert history.labels[0] == f"seed-1-case-1.{history.cases[0].key.hex()[:8]}"


def test_the_place_of_a_file_does_not_make_another_case(path: Path) -> None:
    model = cell()
    _, result = results(1, 1)[0]
    here = written_recipe(result.case, model, "here/a.yaml")
    there = replace(here, path="there/a.yaml")
    history = read_history(store(path, 1, [(here, result), (there, result)]))
    assert [case.recipe for case in history.cases] == [there]
    assert isinstance(there, Written)


def test_a_large_seed_is_kept_exactly(path: Path) -> None:
    (_, result), *_ = results(1, 1)
    origin = result.case.origin
    assert origin is not None
    case = replace(result.case, origin=replace(origin, seed=10**40))
    recipe = drawn_recipe(case, "")
    assert read_history(store(path, 1, [(recipe, result)])).cases[0].recipe == recipe


def test_a_run_of_centuries_is_refused_in_words(path: Path) -> None:
    (recipe, result), *_ = results(1, 1)
    with pytest.raises(InputError) as caught:
        store(path, 1, [(recipe, replace(result, ended_ns=2**63))])
    assert caught.value.diagnostics[0].slug is Slug.STORE_UNUSABLE
    with pytest.raises(InputError):
        read_history(path)


def test_a_store_of_another_model_is_refused_with_the_differences(path: Path, wording: Wording) -> None:
    store(path, 1, results(1, 2))
    before = read_history(path)
    edited = cell(("gr: light != red", "gr: light == green"), ("goals:", "initial_states: light == green\ngoals:"))
    with pytest.raises(InputError) as caught, write_store(path, edited, a_run(2, edited)):
        pass
    found = caught.value.diagnostics[0]
    assert found.slug is Slug.STORE_OTHER_MODEL
    wording(found.message)
    assert read_history(path) == before


def test_comments_and_layout_do_not_make_another_model(path: Path) -> None:
    store(path, 1, results(1, 2))
    model = cell()
    with write_store(path, model, a_run(2, model, "# a comment")) as writer:
        writer.add(1, *results(2, 1)[0])
    assert read_history(path).source.text == "# a comment"


def test_a_store_is_read_where_the_types_of_bindings_are_not(path: Path) -> None:
    model = cell()
    binding = {"service": {"name": "/scan", "type": "my_pkg/srv/Scan", "request": {"go": True}}}
    bound = tuple(replace(resource, binding=Binding(binding)) for resource in model.resources)
    store(path, 1, results(1, 2), replace(model, resources=bound, interfaces=("interfaces",)))
    store(path, 2, results(2, 1), model)
    assert len(read_history(path).cases) == 3


@pytest.mark.parametrize("start", [b"", b"SQLite format 3\0"], ids=["nothing", "header"])
def test_a_file_with_nothing_in_it_becomes_a_store_only_if_it_is_empty(path: Path, start: bytes) -> None:
    path.write_bytes(start)
    if start:
        with pytest.raises(InputError):
            store(path, 1, results(1, 1))
        assert path.read_bytes() == start
    else:
        assert len(read_history(store(path, 1, results(1, 1))).cases) == 1


def test_the_database_of_someone_else_is_left_alone(path: Path) -> None:
    with sqlite3.connect(path) as other:
        other.execute("CREATE TABLE arc (x)")
    other.close()
    before = path.read_bytes()
    with pytest.raises(InputError) as caught:
        store(path, 1, results(1, 1))
    assert caught.value.diagnostics[0].slug is Slug.NOT_A_STORE
    assert path.read_bytes() == before


def test_a_directory_that_is_not_there_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        store(tmp_path / "nowhere" / "cov.db", 1, results(1, 1))
    assert caught.value.diagnostics[0].slug is Slug.STORE_UNUSABLE


def test_an_error_in_between_loses_no_case_that_was_added(path: Path) -> None:
    def breaking() -> Iterator[tuple[Recipe, CaseResult]]:
        yield from results(1, 3)
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        store(path, 1, breaking())
    assert len(read_history(path).cases) == 3


@pytest.mark.slow
def test_several_processes_add_to_one_store_at_the_same_time(path: Path) -> None:
    command = [sys.executable, str(ROOT / "tests/support/adding.py"), str(path)]
    seeds = [1, 2, 3, 3]
    processes = [subprocess.Popen([*command, str(n), str(seed), "25"]) for n, seed in enumerate(seeds, start=1)]
    assert [process.wait() for process in processes] == [0, 0, 0, 0]
    history = read_history(path)
    assert len(history.cases) == 75
    assert [run.cases for run in history.runs] == [25, 25, 25, 25]
    digest = digest_of(cell())
    expected = {key_of(recipe, digest): result.visited for seed in (1, 2, 3) for recipe, result in results(seed, 25)}
    assert {case.key: case.visited for case in history.cases} == expected


@pytest.mark.slow
def test_a_hundred_writers_that_are_killed_leave_whole_stores(tmp_path: Path) -> None:
    """By SIGKILL, at moments that are drawn; the reported cases are there once, and nothing by halves."""
    done = subprocess.run(
        [sys.executable, str(ROOT / "tests/support/kills.py"), str(tmp_path), "100"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    kills, cases, waited = map(int, done.stdout.split())
    assert kills == 100
    assert cases >= waited > 1000


def _add_all(writer: StoreWriter, pairs: Iterator[tuple[int, tuple[Recipe, CaseResult]]]) -> None:
    for position, pair in pairs:
        writer.add(position, *pair)


def test_a_full_disk_is_reported_as_what_it_is(path: Path, wording: Wording) -> None:
    model = cell()
    pairs = iter(enumerate(results(1, 100), start=1))
    with write_store(path, model, a_run(1, model)) as writer:
        connection = writer._connection
        writer.add(*next(((n, *pair) for n, pair in pairs)))
        (pages,) = connection.execute("PRAGMA page_count").fetchone()
        connection.execute(f"PRAGMA max_page_count = {pages}")
        with wording.raises(InputError):
            _add_all(writer, pairs)
    history = read_history(path)
    assert history.cases
    assert [run.is_finished for run in history.runs] == [False]


def test_a_run_without_cases_leaves_no_run(path: Path) -> None:
    store(path, 1, results(1, 2))
    before = read_history(path)
    with write_store(path, cell(), a_run(2, cell())) as writer:
        assert writer.totals().cases == 2
    assert read_history(path) == before


def test_a_run_is_compared_with_the_last_that_was_finished(path: Path) -> None:
    def ends_early() -> Iterator[tuple[Recipe, CaseResult]]:
        yield from results(2, 1)
        raise ZeroDivisionError

    store(path, 1, results(1, 2))
    with pytest.raises(ZeroDivisionError):
        store(path, 2, ends_early())
    assert [run.is_finished for run in read_history(path).runs] == [True, False]
    with write_store(path, cell(), a_run(3, cell())) as writer:
        assert writer.before is not None
        assert writer.before.command == "scbm test 1"


def _written(text: str, path: str, visited: int, limit_ns: int | None = None) -> tuple[Recipe, CaseResult]:
    (_, result), *_ = results(1, 1)
    return Written(text, path, time_limit_ns=limit_ns), replace(
        result, case=replace(result.case, name="a"), visited=visited
    )


def test_of_a_case_file_that_was_edited_the_last_version_counts(path: Path) -> None:
    store(path, 1, [_written("case: a # broken", "a.yaml", 2)])
    store(path, 2, [_written("case: a # mended", "a.yaml", 1)])
    history = read_history(path)
    assert [(case.recipe, case.visited) for case in history.cases] == [(Written("case: a # mended", "a.yaml"), 1)]
    assert history.outdated == 1
    with write_store(path, cell(), a_run(3, cell())) as writer:
        totals = writer.totals()
        assert (totals.cases, totals.figure) == (1, history.coverage.figure)
    store(path, 4, [_written("case: a # broken", "a.yaml", 2)])
    assert [case.visited for case in read_history(path).cases] == [2]


def test_the_order_of_writing_decides_and_not_the_clock(path: Path) -> None:
    store(path, 9, [_written("case: a # broken", "a.yaml", 2)])
    store(path, 2, [_written("case: a # mended", "a.yaml", 1)])
    store(path, 3, [_written("case: b", "b.yaml", 4)])
    history = read_history(path)
    assert [(case.visited, case.run) for case in history.cases] == [(1, 1), (4, 2)]
    assert [run.started for run in history.runs] == [a_run(number, cell()).started for number in (9, 2, 3)]
    store(path, 1, [_written("case: a # broken", "a.yaml", 2)])
    assert [case.visited for case in read_history(path).cases] == [4, 2]


def test_a_store_in_which_the_clock_went_back_is_combined_in_any_order(path: Path) -> None:
    store(path, 9, [_written("case: a # broken", "a.yaml", 2)])
    store(path, 2, [_written("case: a # mended", "a.yaml", 1)])
    other = store(path.with_name("other.db"), 5, [_written("case: a # old", "a.yaml", 4)])
    united = [
        combine_stores(paths, path.with_name("all.db")).history
        for paths in ([path, other], [other, path], [other, path, other])
    ]
    assert [case.visited for case in united[0].cases] == [1]
    assert united[0] == united[1] == united[2]


def test_a_clock_that_went_back_is_reported(path: Path) -> None:
    later = replace(a_run(1, cell()), started="9998-01-01T00:00:00.000000Z")
    with write_store(path, cell(), later) as writer:
        writer.add(1, *_written("1", "a.yaml", 1))
        assert writer.later_start is None
    with write_store(path, cell(), a_run(2, cell())) as writer:
        assert writer.later_start == later.started
    with write_store(path, cell(), replace(later, id="f" * 32)) as writer:
        assert writer.later_start is None


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (_written("1", "a.yaml", 1), _written("2", "b.yaml", 2)),
        (_written("1", "test_a.py", 1), _written("2", "test_a.py", 2)),
        (_written("1", "a.yaml", 1), _written("2", "a.yaml", 2, limit_ns=5)),
    ],
    ids=["another file", "cases of a test", "other options"],
)
def test_other_cases_of_that_name_count_too(
    path: Path, one: tuple[Recipe, CaseResult], other: tuple[Recipe, CaseResult]
) -> None:
    store(path, 1, [one])
    store(path, 2, [other])
    assert read_history(path).outdated == 0
    assert len(read_history(path).cases) == 2


def test_one_text_of_a_model_under_two_paths_is_two_sources(path: Path) -> None:
    model = cell()
    runs = [a_run(1, model), a_run(2, model), a_run(3, model)]
    runs[1] = replace(runs[1], source=replace(runs[1].source, path="other/cell.yaml"))
    for run, (recipe, result) in zip(runs, results(1, 3), strict=True):
        with write_store(path, model, run) as writer:
            writer.add(1, recipe, result)
    assert [run.source for run in read_history(path).runs] == [run.source for run in runs]
    with sqlite3.connect(path) as connection:
        assert connection.execute("SELECT count(*) FROM source").fetchone() == (2,)
    connection.close()


def test_a_case_that_was_lost_is_not_added_and_its_run_is_not_finished(path: Path) -> None:
    (first, second, third) = results(1, 3)
    lost = Tester(cell()).lost(second[1].case, "the controller was lost").result
    with write_store(path, cell(), a_run(1, cell())) as writer:
        for position, (recipe, result) in enumerate([first, (second[0], lost), third], start=1):
            writer.add(position, recipe, result)
        assert writer.lost == 1
        assert writer.totals().cases == 2
    history = read_history(path)
    assert [case.recipe for case in history.cases] == [first[0], third[0]]
    (run,) = history.runs
    assert (run.cases, run.failed, run.is_finished) == (2, 0, False)


def test_a_run_of_nothing_but_lost_cases_makes_no_store_of_cases(path: Path) -> None:
    ((recipe, result),) = results(1, 1)
    lost = Tester(cell()).lost(result.case, "the controller was lost").result
    with write_store(path, cell(), a_run(1, cell())) as writer:
        writer.add(1, recipe, lost)
        assert writer.totals().cases == 0
