"""Types of integers: their parameters are terms, and `full[i + 1]` names the next one."""

from __future__ import annotations

import pytest

from scbm.files import read_case, read_model, write_model
from scbm.model import InputError

MODEL = """\
behavior_model: cell
types: {slot: 1..4, robot: [r1]}
tables: {jump: {of: [slot, slot], rows: [[1, 3], [2, 4]]}}
variables:
  'full[slot]': {domain: bool, initial: false}
  head: {domain: slot, initial: 2}
  n: {domain: 0..9, initial: 0}
operations:
  move[i in slot]:
    where: WHERE
    pre: {g: 'GUARD', a: ['ACTION']}
    post: {g: true}
goals:
  goal: GOAL
"""


def text(where: str = "i < 4", guard: str = "full[i] == true", action: str = "n <- 1", goal: str = "n == 1") -> str:
    filled = MODEL.replace("WHERE", where).replace("GUARD", guard).replace("ACTION", action)
    return filled.replace("GOAL", f"'{goal}'")


@pytest.mark.parametrize(
    ("where", "objects"),
    [
        ("i < 4", [1, 2, 3]),
        ("i + 1 == 4 || i == 1", [1, 3]),
        ("i in {2, 4}", [2, 4]),
        ("jump(1, i)", [3]),
        ("exists j in slot. (jump(j, i) && j > 1)", [4]),
        ("min(i, 3) != 3 && 0 < i - 1", [2]),
        ("i in slot && i >= 4", [4]),
    ],
)
def test_conditions_compare_and_add_integers(where: str, objects: list[int]) -> None:
    model = read_model(text(where=where))
    assert [operation.name for operation in model.operations] == [f"move.{each}" for each in objects]


@pytest.mark.parametrize(
    ("goal", "ground"),
    [
        ("forall i in slot. (i < 4 -> full[i + 1] == true)", "full.2 == true && full.3 == true && full.4 == true"),
        ("exists i in slot. (i > 1 && full[i - 1] == true)", "full.1 == true || full.2 == true || full.3 == true"),
        ("forall i in slot. (i >= 3 || full.i != full[i+1])", "full.1 != full.2 && full.2 != full.3"),
        ("full[2] == true && full.3 == true", "full.2 == true && full.3 == true"),
        ("exists i in slot. (head == i && full[i] == true && i > 3)", "head == 4 && full.4 == true"),
        ("n + sum i in slot. (i) == 12", "n + 10 == 12"),
    ],
)
def test_a_parameter_is_a_term_and_an_index(goal: str, ground: str) -> None:
    assert str(read_model(text(goal=goal)).goal("goal")) == ground


def test_the_model_written_out_is_the_same_model() -> None:
    model = read_model(text(guard="full[i] == true && full[i + 1] == false && head == i", action="head <- i"))
    again = read_model(write_model(model))
    assert (again.variables, again.operations) == (model.variables, model.operations)
    assert [str(each.pre.a[0]) for each in model.operations] == ["head <- 1", "head <- 2", "head <- 3"]


def test_cases_name_variables_of_integers() -> None:
    model = read_model(text())
    case = read_case("case: one\nmodel: cell\ninitial: {'full[2]': true, full.3: true}\ngoal: n == 1\n", model)
    assert {name: case.initial[name] for name in ("full.2", "full.3")} == {"full.2": True, "full.3": True}


@pytest.mark.parametrize(
    ("wrong", "error"),
    [
        (text(where="true", guard="full[i + 1] == true"), "11:15+11 wrong-index"),
        (text(goal="forall i in slot. (full[i + 1] == true && i < 4)"), "14:29+11 wrong-index"),
        (text(goal="exists r in robot. (full[r + 1] == true)"), "14:35+5 wrong-index"),
        (text(goal="full[j + 1] == true"), "14:15+1 unknown-object"),
        (text(goal="full[5] == true"), "14:15+1 unknown-object"),
        (text(where="i == 9"), "10:17+1 value-outside-domain"),
        (text(where="i < n"), "10:12+5 not-static"),
        (text(where="i == r1"), "10:12+7 disjoint-domains"),
        (text(where="i == true"), "10:17+4 different-kinds"),
        (text(where="i < true"), "10:16+4 different-kinds"),
        (text(goal="exists i in slot. (full[1 + i] == true)"), "14:34+5 wrong-index"),
        (text(goal="exists i in slot. (full[i * 2] == true)"), "14:34+5 wrong-index"),
        (text(goal="exists i in slot. (full[i 2] == true)"), "14:34+3 wrong-index"),
        (text(goal="full[r1 + 1] == true"), "14:15+6 wrong-index"),
        (text(goal="exists i in slot. (n == i + 9)"), "14:34+5 value-outside-domain"),
        (text(guard="full[j] == true && i < 4", where="true", action="full[i + 1] <- true"), "11:20+1 unknown-object"),
        (text(where="jump[i, 3]"), "10:12+4 wrong-index"),
        (text(goal="count(full[1] == true) >= 1"), "14:10+5 predicate-syntax"),
        (text().replace("1..4", "4..1"), "2:15+4 bad-domain"),
        (text().replace("1..4", "1..x"), "2:15+4 wrong-shape"),
        (text().replace("1..4", "-1..4"), "2:15+5 wrong-shape"),
        (text().replace("1..4", "[1, 2, 3, 4]"), "2:15+1 wrong-shape"),
        (text().replace("1..4", "{objects: 1..4}"), "2:25+4 wrong-shape"),
        (text(action="head <- i + 4"), "11:46+5 value-outside-domain"),
    ],
)
def test_a_wrong_use_of_integers_is_one_error(wrong: str, error: str) -> None:
    with pytest.raises(InputError) as raised:
        read_model(wrong)
    found = [(each.place, each.slug) for each in raised.value.diagnostics]
    assert [f"{place.line}:{place.column}+{place.length} {slug}" for place, slug in found] == [error]


def test_a_range_with_too_many_integers_is_refused_before_they_are_listed() -> None:
    with pytest.raises(InputError) as raised:
        read_model(text().replace("1..4", "1..999999999"))
    assert "too-many-instances" in [each.slug.value for each in raised.value.diagnostics]
