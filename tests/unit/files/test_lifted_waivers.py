"""Waivers of entries with parameters, in a model file and in a file beside it: the same rules, names and errors."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TypeAlias

import pytest

from scbm.files import load_waivers, read_located, read_model
from scbm.model import Diagnostic, InputError, Slug, Waiver
from support.wording import Wording

TEXT = """behavior_model: line
types:
  station: [inlet, mill]
  machine: {objects: [drill], of: station}
  gripper: [jaw]
  gate: []
tables:
  next: {of: [station, station], rows: [[inlet, mill], [mill, drill]]}
variables:
  at: {domain: station, initial: inlet}
resources:
  spindle[machine]: {}
operations:
  move[from in station, to in station]:
    where: next(from, to)
    pre: {g: at == from}
    post: {g: true, a: [at <- to]}
  lift[g in gate]: {pre: {g: true}, post: {g: true}}
  work[m in machine]: {request: spindle.m, guard: at == m}
  rest: {pre: {g: true}, post: {g: true}}
goals:
  finished: at == drill
"""

Read: TypeAlias = tuple[tuple[Waiver, ...], tuple[Diagnostic, ...]]


def _entries(*waivers: str) -> str:
    reasons = (", reason: as planned" if "reason:" not in waiver else "" for waiver in waivers)
    pairs = zip(waivers, reasons, strict=True)
    listed = (f"  - {{{waiver}{reason}, author: Ada, date: 2026-11-20}}\n" for waiver, reason in pairs)
    return "waivers:\n" + "".join(listed)


def within(path: Path, *waivers: str) -> Read:
    """Read waivers within the model file."""
    del path
    model, places = read_located(TEXT + _entries(*waivers))
    return model.waivers, tuple(each for each in places.warnings if "waiver" in each.message)


def beside(path: Path, *waivers: str) -> Read:
    """Read waivers of a file beside the model."""
    path.write_text("waivers_of: line\n" + _entries(*waivers))
    return load_waivers(path, read_model(TEXT))


@pytest.fixture(params=[within, beside])
def read(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., Read]:
    """Return a function that reads waivers."""
    return partial(request.param, tmp_path / "waivers.yaml")


@pytest.mark.parametrize(
    ("waiver", "obligations"),
    [
        ("obligation: move/failed", ["move.inlet.mill/failed", "move.mill.drill/failed"]),
        ("obligation: work/queued", ["work.drill/queued"]),
        ("obligation: automatic/spindle_failed", ["automatic/spindle_failed.drill"]),
        ("obligation: 'move[a in station, b in machine]/failed'", ["move.mill.drill/failed"]),
        ("obligation: 'move[a in station, station]/failed', where: a != mill", ["move.inlet.mill/failed"]),
        ("obligation: 'move[a in station, b in station]/failed', where: 'next(b, drill)'", ["move.inlet.mill/failed"]),
        ("obligation: move.inlet.mill/failed", ["move.inlet.mill/failed"]),
        ("obligation: rest/failed", ["rest/failed"]),
    ],
)
def test_a_waiver_with_parameters_is_for_the_instances_that_it_names(
    read: Callable[..., Read], waiver: str, obligations: list[str]
) -> None:
    waivers, warnings = read(waiver)
    assert [each.obligation for each in waivers] == obligations
    assert warnings == ()
    is_lifted = "." not in waiver and "rest" not in waiver
    assert all(bool(each.lifted) is is_lifted for each in waivers)


def test_texts_of_a_waiver_name_its_objects(read: Callable[..., Read]) -> None:
    waivers, _ = read("obligation: 'work[m in machine]/failed', reason: 'as {m} says'")
    assert [each.reason for each in waivers] == ["as drill says"]


@pytest.mark.parametrize(
    ("waiver", "slug", "remedy"),
    [
        ("obligation: move/faild", Slug.UNKNOWN_OBLIGATION, "did you mean `move/failed`?"),
        ("obligation: mov/failed", Slug.UNKNOWN_OBLIGATION, "did you mean `move/failed`?"),
        ("obligation: move.inlet.drill/failed", Slug.UNKNOWN_OBLIGATION, None),
        ("obligation: 'mov[a in station, b in station]/failed'", Slug.UNKNOWN_OBLIGATION, "did you mean `move`?"),
        ("obligation: 'rest[a in station]/failed'", Slug.UNKNOWN_OBLIGATION, "it has none: write `rest/failed`"),
        ("obligation: 'automatic/spindle_failed[m in machine]/failed'", Slug.UNKNOWN_OBLIGATION, None),
        ("obligation: 'move[a in station]/failed'", Slug.WRONG_INDEX, "name a type for each, in their order"),
        (
            "obligation: 'move[station, a in gripper]/failed'",
            Slug.WRONG_INDEX,
            "the types that fit are: station, machine",
        ),
        ("obligation: 'move[a in sation, b in station]/failed'", Slug.UNKNOWN_TYPE, "did you mean `station`?"),
        ("obligation: 'work[m in machine]/failed', where: m == dril", Slug.UNKNOWN_OBJECT, "did you mean `drill`?"),
        ("obligation: 'work[m in machine]/failed', where: at == m", Slug.NOT_STATIC, None),
        ("obligation: work/failed, where: drill == drill", Slug.NOT_STATIC, None),
        ("obligation: 'work[m in machine]/failed', where: ''", Slug.PREDICATE_SYNTAX, None),
        ("obligation: 'work[m in machine]/failed', where: ", Slug.PREDICATE_SYNTAX, None),
        (
            "obligation: 'work[m in machine]/failed', reason: '{m} and {n}'",
            Slug.UNKNOWN_OBJECT,
            "the parameters here are: m",
        ),
        ("obligation: 'work[m in machine/failed'", Slug.BAD_NAME, "write `name[r in robot]`"),
    ],
)
def test_what_is_wrong_with_a_waiver_is_one_located_error(
    read: Callable[..., Read], waiver: str, slug: Slug, remedy: str | None
) -> None:
    with pytest.raises(InputError) as caught:
        read("obligation: rest/timedout", waiver)
    (found,) = caught.value.diagnostics
    assert found.slug is slug
    assert found.place.line == (25 if found.place.file == "model" else 4)
    assert remedy is None or found.remedy == remedy


@pytest.mark.parametrize(
    ("waiver", "reason"),
    [
        ("obligation: lift/failed", "`lift` has no instance"),
        ("obligation: 'move[a in machine, b in station]/failed'", "no instance of `move` has these objects"),
        ("obligation: 'work[m in machine]/failed', where: m != drill", "no instance of `work` has these objects"),
    ],
)
def test_a_waiver_for_no_instance_is_warned_of(
    read: Callable[..., Read], waiver: str, reason: str, wording: Wording
) -> None:
    waivers, (warning,) = read(waiver)
    assert waivers == ()
    assert (warning.slug, warning.message.endswith(f": {reason}")) == (Slug.NO_INSTANCE, True)
    wording(warning.message)


def test_two_waivers_for_instances_are_one_error(read: Callable[..., Read]) -> None:
    with pytest.raises(InputError) as caught:
        read("obligation: move/failed", "obligation: 'move[station, station]/failed'", "obligation: work/failed")
    (found,) = caught.value.diagnostics
    assert found.slug is Slug.DUPLICATE_VALUE


PARENTS = """behavior_model: parents
types: {thing: [], robot: {objects: [r1, r2], of: thing}, zone: {objects: [a, b], of: thing}, later: {of: zone}}
variables: {v: {domain: bool, initial: false}}
resources:
  arm[robot]: {}
operations:
  take[r in robot]: {request: arm.r, guard: v == false}
  wait[l in later]: {pre: {g: v == false}, post: {g: true}}
automatic_transitions:
  arm_failed[r in robot]: {where: r == r1, g: v == true, a: [v <- false]}
goals: {g: v == true}
waivers:
  - {obligation: "%s", reason: as planned, author: Ada, date: 2026-11-20}
"""


def test_types_without_a_common_object_are_an_error_if_they_have_a_common_parent() -> None:
    with pytest.raises(InputError) as caught:
        read_located(PARENTS % "take[z in zone]/failed")
    (found,) = caught.value.diagnostics
    assert (found.slug, found.place.line) == (Slug.WRONG_INDEX, 13)


@pytest.mark.parametrize(
    ("obligation", "count"),
    [("take[t in thing]/failed", 2), ("wait[z in zone]/failed", 0), ("automatic/arm_failed[r in robot]", 2)],
)
def test_a_type_fits_that_has_or_may_get_a_common_object(obligation: str, count: int) -> None:
    model, _ = read_located(PARENTS % obligation)
    assert len(model.waivers) == count


@pytest.mark.parametrize("obligation", ["move/failed", "automatic/spindle_failed"])
def test_a_reason_of_several_instances_has_no_unknown_parameter(read: Callable[..., Read], obligation: str) -> None:
    with pytest.raises(InputError) as caught:
        read(f'obligation: {obligation}, reason: "no {{x}}"')
    (found,) = caught.value.diagnostics
    assert (found.slug, found.place.length) == (Slug.UNKNOWN_OBJECT, 1)
