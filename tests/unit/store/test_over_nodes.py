"""What a store keeps of cases that ran over nodes, and stores of version 1, which did not distinguish them."""

from __future__ import annotations

import json
import shutil
import sqlite3
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from scbm.cases import Case, Network
from scbm.files import Scope, parse_requirement
from scbm.model import InputError, PlannerChoice, PlannerIdentity, Requirement, Slug
from scbm.store import (
    History,
    Recipe,
    Replays,
    StoredRun,
    combine_stores,
    digest_of,
    drawn_recipe,
    key_of,
    read_history,
    write_store,
)
from scbm.store.store_tables import Tables
from scbm.testing import Execution, RandomCases, Tester
from support.real_runs import WHERE, log_of, log_text, real_run
from support.stores import a_run, cell, results, store
from support.wording import Wording

MODEL = cell()
VERSION_1 = Path(__file__).parent / "version_1.db"
KEYS = [
    "67e1a95c00cf77718923601dbe2d05e7",
    "d798402f3adcc27ad9fddcb4ed146715",
    "92dafaf8b0b64d53cfac61fb04c35370",
    "a93c03850c4a43276225221b0b5af45f",
    "c2c1c6eaf525ad9c5038e5b96b3c7344",
    "c5f76802511cb08ace3bbf3eaaf3fc25",
]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "cov.db"


@pytest.fixture
def old(tmp_path: Path) -> Path:
    return Path(shutil.copy(VERSION_1, tmp_path / "old.db"))


def drawn(count: int = 1, seed: int = 1) -> list[Case]:
    return list(RandomCases(MODEL, network=Network()).first(count, seed))


def nodes_run(number: int, where: str = WHERE) -> StoredRun:
    return replace(a_run(number, MODEL), nodes=where)


def add(path: Path, run: StoredRun, *came: Execution, real: tuple[str, ...] = ()) -> Path:
    """Adds cases that ran over nodes."""
    with write_store(path, MODEL, run) as writer:
        for position, execution in enumerate(came, start=1):
            writer.add(position, recipe_of(execution.case, real), execution.result, log_text(MODEL, execution))
    return path


def recipe_of(case: Case, real: tuple[str, ...] = ()) -> Recipe:
    return drawn_recipe(case, "", real)


def shown(history: History) -> list[str | None]:
    """The digests of the traces that a history shows."""
    replays = Replays(history)
    return [None if run is None else run.digest for run in map(replays.execute, history.cases)]


def complaint(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_history(path)
    (diagnostic,) = caught.value.diagnostics
    assert diagnostic.slug is Slug.STORE_DAMAGED
    return diagnostic.message


def changed(path: Path, change: str, *values: object) -> None:
    with sqlite3.connect(path) as connection:
        connection.execute(change, values)
    connection.close()


def version(path: Path) -> int:
    connection = sqlite3.connect(path)
    try:
        found: int = connection.execute("PRAGMA user_version").fetchone()[0]
    finally:
        connection.close()
    return found


# what is kept


def test_where_a_case_ran_and_what_was_real_is_kept(path: Path) -> None:
    (case,) = drawn()
    execution = real_run(MODEL, case)
    add(path, nodes_run(1), execution, real=("scan",))
    history = read_history(path)
    (stored,) = history.cases
    assert stored.is_over_nodes
    assert (stored.recipe.real, history.where(stored), history.runs[0].nodes) == (("scan",), WHERE, WHERE)
    assert stored.recipe == recipe_of(case, ("scan",))
    assert (history.ended_ns, history.over_nodes_ns) == (execution.ended_ns, execution.ended_ns)


def test_a_case_in_simulation_and_over_nodes_is_two_and_with_other_real_resources_three(path: Path) -> None:
    (case,) = drawn()
    simulated, real = Tester(MODEL).execute(case), real_run(MODEL, case)
    store(path, 1, [(drawn_recipe(case, ""), simulated.result)])
    add(path, nodes_run(2), real)
    add(path, nodes_run(3), real, real=("scan",))
    history = read_history(path)
    assert [stored.recipe.real for stored in history.cases] == [None, (), ("scan",)]
    assert [history.where(stored) for stored in history.cases] == [None, WHERE, WHERE]
    assert [stored.visited for stored in history.cases] == [simulated.visited, real.visited, real.visited]
    assert (history.ended_ns, history.over_nodes_ns) == (
        simulated.ended_ns + 2 * real.ended_ns,
        2 * real.ended_ns,
    )


@pytest.mark.parametrize("order", [(1, 2), (2, 1)])
def test_where_nodes_met_and_how_fast_makes_no_other_case_and_the_last_run_is_shown(
    path: Path, order: tuple[int, int]
) -> None:
    (case,) = drawn()
    one, two = real_run(MODEL, case), real_run(MODEL, case, chance=78)
    assert one.digest != two.digest
    add(path, nodes_run(order[0]), one)
    add(path, nodes_run(order[1], "over loopback, 20 times faster than the wall clock"), two)
    history = read_history(path)
    (stored,) = history.cases
    assert stored.visited == one.visited | two.visited
    assert history.where(stored) == "over loopback, 20 times faster than the wall clock"
    assert shown(history) == [two.digest]


def test_what_is_shown_is_the_run_of_the_log_and_not_that_of_the_case(path: Path) -> None:
    cases = drawn(5)
    came = [real_run(MODEL, case) for case in cases]
    add(path, nodes_run(1), *came)
    history = read_history(path)
    replays = Replays(history)
    simulated = [Tester(MODEL).execute(case).digest for case in cases]
    for stored, execution in zip(history.cases, came, strict=True):
        again = replays.execute(stored)
        assert again is not None
        assert again.trace == execution.trace
        assert (again.digest, again.verdict, again.visited, again.reactions, again.violations) == (
            log_of(execution).trace, execution.verdict, execution.visited, execution.reactions, execution.violations,
        )  # fmt: skip
    assert [execution.digest for execution in came] != simulated


def test_what_the_command_line_required_is_judged_as_it_was(path: Path) -> None:
    (case,) = drawn()
    sentence = parse_requirement("never scan_req_state == executing", Scope.of(MODEL), file="--require")
    limits = replace(case.limits, time_ns=10**10)
    asked = replace(case, requirements=(Requirement("required_1", sentence),), limits=limits)
    execution = real_run(MODEL, asked)
    assert execution.violations
    add(path, nodes_run(1), execution)
    history = read_history(path)
    again = Replays(history).execute(history.cases[0])
    assert again is not None
    assert (again.violations, again.verdict) == (execution.violations, execution.verdict)
    assert again.verdict == history.cases[0].verdict
    assert again.case.limits.time_ns == history.cases[0].recipe.time_limit_ns == 10**10


def test_a_case_of_an_earlier_model_has_no_run(path: Path) -> None:
    add(path, nodes_run(1), real_run(MODEL, drawn()[0]))
    history = read_history(path)
    assert Replays(history).execute(replace(history.cases[0], is_earlier=True)) is None


def _without_end(text: str) -> str:
    return text[: len(text) // 2]


def _of_another_scbm(text: str) -> str:
    """The events are the same, and what came of them was something else."""
    head, trace, rest = text.partition('"trace":"')
    return f"{head}{trace}{'0' * 64}{rest[64:]}"


@pytest.mark.parametrize("change", [_without_end, _of_another_scbm])
def test_a_log_that_does_not_give_its_run_again_is_not_shown_as_something_else(
    path: Path, change: Callable[[str], str]
) -> None:
    execution = real_run(MODEL, drawn()[0])
    with write_store(path, MODEL, nodes_run(1)) as writer:
        writer.add(1, recipe_of(execution.case), execution.result, change(log_text(MODEL, execution)))
    assert shown(read_history(path)) == [None]


# what is no log


@pytest.mark.parametrize(
    "log",
    [b"", b"no log", zlib.compress(b"a log")[:-1], zlib.compress(b"a log") + b"x", zlib.compress(b"\xff"), 1, None],
    ids=["empty", "not compressed", "cut off", "too long", "not UTF-8", "number", "none"],
)
def test_a_damaged_log_is_a_damaged_store(path: Path, tmp_path: Path, log: object, wording: Wording) -> None:
    add(path, nodes_run(1), real_run(MODEL, drawn()[0]))
    changed(path, "UPDATE test_case SET log = ?", log)
    wording(complaint(path))
    with pytest.raises(InputError):
        combine_stores([path], tmp_path / "all.db")


def test_a_log_of_a_simulated_case_is_damage_and_so_is_a_place_that_is_not_reported(path: Path, tmp_path: Path) -> None:
    store(path, 1, results(1, 1))
    changed(path, "UPDATE test_case SET log = ?", zlib.compress(b"a log"))
    complaint(path)
    other = add(tmp_path / "other.db", nodes_run(1), real_run(MODEL, drawn()[0]))
    changed(other, "UPDATE run SET nodes = NULL")
    complaint(other)


@pytest.mark.parametrize("real", ["scan", [1], None])
def test_real_resources_that_are_no_names_are_damage(path: Path, real: object) -> None:
    add(path, nodes_run(1), real_run(MODEL, drawn()[0]))
    options = {"network": "", "requirements": [], "time_limit_ns": None, "real": real}
    changed(path, "UPDATE setting SET options = ?", json.dumps(options))
    complaint(path)


def test_a_log_that_grows_too_large_is_damage(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    execution = real_run(MODEL, drawn()[0])
    size = len(log_text(MODEL, execution).encode())
    add(path, nodes_run(1), execution)
    monkeypatch.setattr("scbm.store.history.MAX_LOG_BYTES", size)
    assert shown(read_history(path)) == [execution.digest]
    monkeypatch.setattr("scbm.store.history.MAX_LOG_BYTES", size - 1)
    complaint(path)


def test_a_log_that_is_too_large_is_not_kept(path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setattr("scbm.store.history.MAX_LOG_BYTES", 10)
    with wording.raises(InputError):
        add(path, nodes_run(1), real_run(MODEL, drawn()[0]))


# version 1


def test_a_store_of_version_1_is_read_and_left_as_it_is(old: Path) -> None:
    history = read_history(old)
    assert [stored.key.hex() for stored in history.cases] == KEYS
    digest = digest_of(history.model)
    assert [key_of(stored.recipe, digest).hex() for stored in history.cases] == KEYS
    assert not any(stored.is_over_nodes for stored in history.cases)
    assert [run.nodes for run in history.runs] == [None, None]
    assert None not in shown(history)
    assert old.read_bytes() == VERSION_1.read_bytes()


def test_simulated_cases_are_what_they_were_in_version_1(old: Path, path: Path) -> None:
    """Else the same case would be there twice, once of each version."""
    store(path, 1, results(1, 2))
    store(path, 2, results(1, 3, "drawn"))
    store(old, 3, [*results(1, 2), *results(1, 3, "drawn")])
    assert [stored.key.hex() for stored in read_history(path).cases] == [*KEYS[:2], *KEYS[3:]]
    assert len(read_history(old).cases) == len(KEYS)


def _tables(path: Path) -> dict[str, list[tuple[object, ...]]]:
    connection = sqlite3.connect(path)
    try:
        names = [row[0] for row in connection.execute("SELECT name FROM sqlite_schema WHERE sql IS NOT NULL")]
        return {name: list(connection.execute(f"PRAGMA table_info({name})")) for name in names}
    finally:
        connection.close()


def test_who_writes_to_a_store_of_version_1_makes_it_one_of_the_newest(old: Path, path: Path) -> None:
    before = read_history(old)
    execution = real_run(MODEL, drawn(9)[8])
    with write_store(old, MODEL, nodes_run(5)) as writer:
        assert writer.before == before.runs[-1]
        assert version(old) == 1
        assert writer.totals().cases == len(KEYS)
        writer.add(1, recipe_of(execution.case), execution.result, log_text(MODEL, execution))
    history = read_history(old)
    assert version(old) == 9
    assert history.cases[:-1] == before.cases
    assert shown(history)[-1] == execution.digest
    assert _tables(old) == _tables(store(path, 1, results(1, 1)))


def test_an_error_while_a_store_becomes_one_of_the_newest_leaves_it_as_it_was(
    old: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(*_: object) -> None:
        raise ZeroDivisionError

    monkeypatch.setattr(Tables, "put_case", broken)
    with pytest.raises(ZeroDivisionError):
        store(old, 5, results(2, 1))
    monkeypatch.undo()
    assert version(old) == 1
    assert [stored.key.hex() for stored in read_history(old).cases] == KEYS


def test_a_refused_model_leaves_a_store_of_version_1(old: Path) -> None:
    other = cell(("gr: light != red", "gr: light == green"))
    with pytest.raises(InputError), write_store(old, other, a_run(3, other)):
        pass
    assert version(old) == 1


@pytest.mark.parametrize("is_old_first", [True, False])
def test_stores_of_both_versions_are_united(old: Path, path: Path, tmp_path: Path, is_old_first: bool) -> None:  # noqa: FBT001
    execution = real_run(MODEL, drawn(9)[8])
    add(path, nodes_run(5), execution)
    target = tmp_path / "all.db"
    history = combine_stores([old, path] if is_old_first else [path, old], target).history
    assert read_history(target) == history
    assert [stored.key.hex() for stored in history.cases[:-1]] == KEYS
    assert shown(history)[-1] == execution.digest
    assert (version(target), version(old)) == (9, 1)


def test_a_store_of_version_1_may_be_the_target(old: Path, path: Path) -> None:
    add(path, nodes_run(5), real_run(MODEL, drawn(9)[8]))
    history = combine_stores([old, path], old).history
    assert (version(old), read_history(old)) == (9, history)
    assert len(history.cases) == len(KEYS) + 1


# version 2


def test_the_cases_of_a_store_of_version_2_were_planned_by_the_canonical_planner(path: Path) -> None:
    before = store(path, 1, results(1, 2))
    changed(path, "ALTER TABLE run DROP COLUMN planner")
    changed(path, "ALTER TABLE run DROP COLUMN order_time")
    changed(path, "ALTER TABLE run DROP COLUMN waivers")
    changed(path, "ALTER TABLE test_case DROP COLUMN forced")
    changed(path, "ALTER TABLE test_case DROP COLUMN excuses")
    changed(path, "DROP VIEW visit")
    for column in ("lifted", "objects", "obligations_of"):
        changed(path, f"ALTER TABLE model DROP COLUMN {column}")
    for table in ("certificate", "mutation", "mutant"):
        changed(path, f"DROP TABLE {table}")
    changed(path, "PRAGMA user_version = 2")
    assert [run.planner for run in read_history(path).runs] == ["canonical 1"]
    assert version(path) == 2
    store(path, 2, results(1, 3, "drawn"))
    assert (version(path), _tables(path)) == (9, _tables(before))
    assert [run.planner for run in read_history(path).runs] == ["canonical 1"] * 2


def test_cases_of_another_planner_are_other_cases_and_shown_by_it(path: Path) -> None:
    greedy = replace(MODEL, planner=PlannerChoice("greedy"))
    for number, model in enumerate((MODEL, greedy), start=1):
        with write_store(path, model, a_run(number, model)) as writer:
            for position, case in enumerate(drawn(2), start=1):
                writer.add(position, drawn_recipe(case, ""), Tester(model).execute(case).result)
    history = read_history(path)
    assert [run.planner for run in history.runs] == ["canonical 1", "greedy 1"]
    assert len(history.cases) == 4
    replays = Replays(history)
    executions = [execution for stored in history.cases if (execution := replays.execute(stored)) is not None]
    assert sorted(execution.trace.planner.name for execution in executions) == ["canonical"] * 2 + ["greedy"] * 2


def test_a_run_over_nodes_has_the_planner_that_the_controller_reported(path: Path) -> None:
    pairs = results(1, 2, "drawn")
    with write_store(path, MODEL, a_run(1, MODEL)) as writer:
        for position, (recipe, result) in enumerate(pairs, start=1):
            writer.add(position, recipe, result, planner=PlannerIdentity("greedy", "1", 9))
    history = read_history(path)
    assert [run.planner for run in history.runs] == ["greedy 1, max_length 9"]
    digest = digest_of(MODEL)
    keys = [key_of(recipe, digest, "greedy, max_length 9") for recipe, _ in pairs]
    assert sorted(case.key for case in history.cases) == sorted(keys)
