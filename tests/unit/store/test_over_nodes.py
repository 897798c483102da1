"""What a store keeps of cases that ran over nodes."""

from __future__ import annotations

import json
import sqlite3
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from msgspec.structs import replace

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
from scbm.testing import Execution, RandomCases, Tester
from support.real_runs import WHERE, log_of, log_text, real_run
from support.stores import a_run, cell, results, store
from support.wording import Wording

MODEL = cell()


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "cov.db"


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
    monkeypatch.setattr("scbm.store.packed_logs.MAX_LOG_BYTES", size)
    assert shown(read_history(path)) == [execution.digest]
    monkeypatch.setattr("scbm.store.packed_logs.MAX_LOG_BYTES", size - 1)
    complaint(path)


def test_a_log_that_is_too_large_is_not_kept(path: Path, monkeypatch: pytest.MonkeyPatch, wording: Wording) -> None:
    monkeypatch.setattr("scbm.store.packed_logs.MAX_LOG_BYTES", 10)
    with wording.raises(InputError):
        add(path, nodes_run(1), real_run(MODEL, drawn()[0]))


# planners


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
