"""A store has the cases of one lifted model under several lists of objects; only lifted figures unite (decision 55)."""

from __future__ import annotations

import sqlite3
from pathlib import Path

import pytest

from scbm.cases.coverage import Decision, Obligation
from scbm.cases.coverage.obligations import Aspect
from scbm.files import digest_of, read_model
from scbm.model import BehaviorModel, InputError, Slug
from scbm.store import combine_stores, drawn_recipe, read_history, write_store
from scbm.testing import RandomCases, Tester
from support.stores import a_run
from support.stores import store as add_run

TEXT = """behavior_model: doors
types:
  door: [d1]
  gate: []
tables:
  near: {of: [door, door], rows: [[d1, d1]]}
variables:
  open[door]: {domain: bool, initial: false}
  up[gate]: {domain: bool, initial: false}
operations:
  open_it[d in door]: {pre: {g: open.d == false}, post: {g: true, a: [open.d <- true]}}
  lift[g in gate]: {pre: {g: up.g == false}, post: {g: true, a: [up.g <- true]}}
  rest: {pre: {g: true}, post: {g: true}}
goals:
  entered: open.d1 == true
"""


def model(*replacements: tuple[str, str]) -> BehaviorModel:
    """Return the model of the doors with texts replaced."""
    text = TEXT
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    return read_model(text)


ONE = model()
TWO = model(("door: [d1]", "door: [d1, d2]"), ("open.d1 == true", "open.d2 == true"))
GATED = model(("gate: []", "gate: [g1]"), ("open.d1 == true", "up.g1 == true"))


def add(path: Path, number: int, of: BehaviorModel, count: int = 1) -> Path:
    """Add a run with random cases of a model to a store."""
    tester = Tester(of)
    pairs = [(drawn_recipe(case, ""), tester.execute(case).result) for case in RandomCases(of).first(count, number)]
    return add_run(path, number, pairs, of)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Return the path of a store that does not exist yet."""
    return tmp_path / "cov.db"


def lifted(path: Path, name: str, aspect: Aspect = Aspect.EXECUTING) -> tuple[Decision, bool]:
    """Return the status of a lifted obligation in a store, and whether it was visited under other objects."""
    statuses = read_history(path).lifted
    assert statuses is not None
    (entry,) = (each for each in statuses.entries if each.obligation == Obligation(name, aspect))
    return entry.decision, bool(entry.elsewhere)


# the same lifted model


@pytest.mark.parametrize(
    "replacements",
    [
        [("door: [d1]", "door: {objects: [d1, d2]}")],
        [("[[d1, d1]]", "[]")],
        [("initial: false}\n  up", "initial: true, random: [true, false]}\n  up"), ("[d1]\n", "[d1, d2]\n")],
        [("open.d1 == true", "{goal: open.d1 == true, may_end: [aborted]}"), ("[d1]\n", "[d1, d2]\n")],
        [("open.d == false", "open.d==false"), ("operations:", "operations:  # of doors"), ("[d1]\n", "[d1, d2]\n")],
    ],
)
def test_objects_rows_initial_values_and_goals_may_differ(replacements: list[tuple[str, str]]) -> None:
    other = model(*replacements)
    assert ONE.objects is not None
    assert other.objects is not None
    assert ONE.objects.is_other_list(other.objects)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("behavior_model: doors", "behavior_model: gates"),
        ("g: open.d == false", "g: true"),
        ("gate: []", "gate: {objects: [], of: door}"),
        ("of: [door, door], rows: [[d1, d1]]", "of: [door], rows: [[d1]]"),
        ("up[gate]: {domain: bool", "up[gate]: {source: state, domain: bool"),
        ("  rest: {pre", "  pause: {pre"),
        ("goals:", "requirements:\n  shut: never open.d1 == true\ngoals:"),
    ],
)
def test_another_declaration_makes_another_lifted_model(old: str, new: str) -> None:
    first = model(("[d1]\n", "[d1, d2]\n"))
    other = model((old, new))
    assert first.objects is not None
    assert other.objects is not None
    assert first.objects.lifted != other.objects.lifted


def test_a_model_without_types_has_no_objects() -> None:
    assert read_model("behavior_model: m\nvariables: {}\noperations: {}\n").objects is None


# one store


def test_a_run_with_other_objects_keeps_the_cases_of_both_apart(path: Path) -> None:
    add(path, 1, ONE, 2)
    add(path, 2, TWO, 3)
    history = read_history(path)
    assert digest_of(history.model) == digest_of(TWO)
    assert (len(history.cases), len(history.runs)) == (3, 1)
    assert [(each.objects, each.cases) for each in history.others] == [(ONE.objects, 2)]
    assert history.coverage.figure.of == 15


def test_a_run_with_earlier_objects_brings_their_cases_back(path: Path) -> None:
    before = read_history(add(path, 1, ONE, 2))
    add(path, 2, TWO, 3)
    add(path, 3, ONE, 1)
    history = read_history(path)
    assert history.cases[: len(before.cases)] != ()
    assert {case.key for case in before.cases} <= {case.key for case in history.cases}
    assert len(history.runs) == 2
    assert [each.cases for each in history.others] == [3]


def test_visits_of_instances_under_other_objects_cover_a_lifted_obligation(path: Path) -> None:
    add(path, 1, GATED)
    add(path, 2, ONE)
    assert lifted(path, "open_it") == (Decision.COVERED, False)
    add(path, 4, model(("[d1]\n", "[d1, d2]\n"), ("open.d1 == true", "open.d1 == false")))
    assert lifted(path, "open_it") == (Decision.COVERED, True)
    history = read_history(path)
    assert history.coverage.figure.visited == 0
    assert history.lifted is not None
    assert history.lifted.alone.figure.visited == 0
    assert history.lifted.figure.visited == 2


def test_an_entry_without_instances_is_no_obligation_whatever_other_objects_visited(path: Path) -> None:
    add(path, 1, GATED)
    add(path, 2, ONE)
    history = read_history(path)
    assert history.lifted is not None
    assert {each.obligation.subject for each in history.lifted.entries} == {"open_it", "rest"}
    assert history.lifted.figure.of == 10
    add(path, 3, GATED)
    assert lifted(path, "lift") == (Decision.COVERED, False)


def test_a_model_of_another_domain_is_refused(path: Path) -> None:
    add(path, 1, ONE)
    with pytest.raises(InputError) as caught:
        add(path, 2, model(("g: open.d == false", "g: true"), ("[d1]\n", "[d1, d2]\n")))
    assert caught.value.diagnostics[0].slug is Slug.STORE_OTHER_MODEL


def test_a_model_with_other_goals_and_the_same_objects_is_an_edit(path: Path) -> None:
    add(path, 1, ONE)
    with pytest.raises(InputError):
        add(path, 2, model(("open.d1 == true", "open.d1 == false")))


def test_the_view_of_visits_has_those_of_the_current_model(path: Path) -> None:
    add(path, 1, GATED)
    add(path, 2, TWO)
    connection = sqlite3.connect(path)
    names = {name for (name,) in connection.execute("SELECT DISTINCT obligation FROM visit")}
    connection.close()
    assert names == {"open_it.d2/executing", "open_it.d2/completed", "open_it.d2/queued"}


@pytest.mark.parametrize("text", ["{", "[1, 2, 3]", '{"lifted": "a", "types": 1}'])
def test_damaged_objects_are_an_error(path: Path, text: str) -> None:
    add(path, 1, ONE)
    add(path, 2, TWO)
    with sqlite3.connect(path) as connection:
        connection.execute("UPDATE model SET objects = ?", (text,))
    connection.close()
    with pytest.raises(InputError) as caught:
        read_history(path)
    assert caught.value.diagnostics[0].slug is Slug.STORE_DAMAGED


# combining


def _rows(path: Path) -> list[tuple[object, ...]]:
    connection = sqlite3.connect(path)
    query = (
        "SELECT key, test_case.name, model.digest, obligations_of, visited FROM test_case"
        " JOIN model ON model.id = test_case.model ORDER BY key"
    )
    found = connection.execute(query).fetchall()
    connection.close()
    return found


def test_stores_with_other_objects_are_united_without_an_option(tmp_path: Path) -> None:
    one, two = add(tmp_path / "1.db", 1, ONE, 2), add(tmp_path / "2.db", 2, TWO, 3)
    combined = combine_stores([one, two], tmp_path / "all.db")
    assert (combined.totals.cases, combined.apart, combined.dropped) == (3, (one,), ())
    assert combined.totals.lifted is not None
    assert [each.cases for each in combined.totals.lifted.others] == [2]
    assert read_history(tmp_path / "all.db").others == combined.totals.lifted.others
    again = combine_stores([tmp_path / "all.db", one, two, tmp_path / "all.db"], tmp_path / "again.db")
    assert again.totals.lifted == combined.totals.lifted
    assert _rows(tmp_path / "again.db") == _rows(tmp_path / "all.db")


def test_of_the_united_models_the_last_one_counts(tmp_path: Path) -> None:
    one, two = add(tmp_path / "1.db", 1, ONE, 2), add(tmp_path / "2.db", 2, TWO, 3)
    both = tmp_path / "both.db"
    combine_stores([two, one], both)
    assert [len(read_history(both).cases), *(each.cases for each in read_history(both).others)] == [2, 3]
    third = add(tmp_path / "3.db", 3, GATED, 1)
    combined = combine_stores([both, third], third)
    assert combined.totals.lifted is not None
    assert sorted(each.cases for each in combined.totals.lifted.others) == [2, 3]


def test_the_order_of_the_other_stores_does_not_matter(tmp_path: Path) -> None:
    one, two = add(tmp_path / "1.db", 1, ONE, 2), add(tmp_path / "2.db", 2, TWO, 3)
    three = add(tmp_path / "3.db", 3, GATED, 1)
    first = combine_stores([one, two, three], tmp_path / "first.db")
    second = combine_stores([two, one, two, three], tmp_path / "second.db")
    assert first.totals.lifted == second.totals.lifted
    assert _rows(tmp_path / "first.db") == _rows(tmp_path / "second.db")


def test_across_edits_ground_visits_go_over_instead(tmp_path: Path) -> None:
    one, two = add(tmp_path / "1.db", 1, ONE, 2), add(tmp_path / "2.db", 2, TWO, 3)
    combined = combine_stores([one, two], tmp_path / "all.db", across_edits=True)
    assert (combined.totals.cases, combined.apart) == (5, ())
    assert combined.totals.lifted is not None
    assert combined.totals.lifted.others == ()
    with pytest.raises(InputError) as caught:
        combine_stores([one, tmp_path / "all.db"], tmp_path / "more.db")
    assert caught.value.diagnostics[0].remedy == "combine them with --across-edits"
    with pytest.raises(InputError):
        add(tmp_path / "all.db", 4, ONE)


def test_across_edits_of_the_domain_other_objects_are_left_out(tmp_path: Path) -> None:
    one, two = add(tmp_path / "1.db", 1, ONE, 2), add(tmp_path / "2.db", 2, TWO, 3)
    both = tmp_path / "both.db"
    combine_stores([one, two], both)
    edited = add(tmp_path / "3.db", 3, model(("g: open.d == false", "g: true")))
    combined = combine_stores([both, edited], tmp_path / "all.db", across_edits=True)
    assert combined.totals.cases == 4
    assert combined.left_out == ((both, 2),)
    assert combined.totals.lifted is not None
    assert combined.totals.lifted.others == ()


def test_a_store_that_is_named_twice_or_by_a_link_counts_once(tmp_path: Path) -> None:
    one, two = add(tmp_path / "1.db", 1, ONE, 2), add(tmp_path / "2.db", 2, TWO, 3)
    both, link = tmp_path / "both.db", tmp_path / "link.db"
    combine_stores([one, two], both)
    link.symlink_to(both)
    edited = add(tmp_path / "3.db", 3, model(("g: open.d == false", "g: true")))
    combined = combine_stores([both, link, both, edited], tmp_path / "all.db", across_edits=True)
    assert (combined.totals.cases, [count for _, count in combined.left_out]) == (4, [2])
    assert len(combined.dropped) == 1
    three = add(tmp_path / "4.db", 4, GATED)
    combined = combine_stores([link, both, three], tmp_path / "apart.db")
    assert (combined.totals.cases, len(combined.apart)) == (1, 1)
    assert combined.totals.lifted is not None
    assert sorted(each.cases for each in combined.totals.lifted.others) == [2, 3]


def test_of_a_store_that_is_named_twice_the_last_place_decides_which_model_counts(tmp_path: Path) -> None:
    one, two = add(tmp_path / "1.db", 1, ONE, 2), add(tmp_path / "2.db", 2, TWO, 3)
    combine_stores([one, two, one], tmp_path / "all.db")
    assert len(read_history(tmp_path / "all.db").cases) == 2


def test_two_processes_may_add_under_different_objects_at_the_same_time(path: Path) -> None:
    """The model of the writer that began last is the current one; each writer sees the figures of its own."""
    case = next(iter(RandomCases(ONE).first(1, 1)))
    with write_store(path, ONE, a_run(1, ONE)) as writer:
        writer.add(1, drawn_recipe(case, ""), Tester(ONE).execute(case).result)
        add(path, 2, TWO, 3)
        other = next(iter(RandomCases(ONE).first(1, 2)))
        writer.add(2, drawn_recipe(other, ""), Tester(ONE).execute(other).result)
        totals = writer.totals()
        assert totals.cases == 2
        assert totals.lifted is not None
        assert [each.cases for each in totals.lifted.others] == [3]
    assert len(read_history(path).cases) == 3
