"""Habits of other languages and misspelt words in models with parameters: one error, which says what to write."""

from __future__ import annotations

import pytest

from scbm.files import read_model
from scbm.model import InputError

MODEL = """\
behavior_model: cell
types: {zone: [dock, shelf], charger: {objects: [plug], of: zone}, robot: [r1, r2]}
tables:
  near: {of: [zone, zone], rows: [[dock, shelf]]}
variables:
  at[robot]: {domain: zone, initial: dock}
operations:
  go[r in robot, a in zone, b in zone]:
    where: near(a, b)
    pre: {g: at.r == a, a: [at.r <- b]}
    post: {g: true}
goals:
  away: forall r in robot. (at[r] != dock)
requirements:
  few: always count r in robot. (at[r] == dock) <= 1
"""


@pytest.mark.parametrize(
    ("right", "wrong", "error"),
    [
        ("go[r in robot, a in zone, b in zone]", "go(r in robot, a in zone, b in zone)", "8:3 bad-name"),
        ("at[robot]", "at(robot)", "6:3 bad-name"),
        ("forall r in robot. (", "forall (r in robot) (", "13:9 predicate-syntax"),
        ("always", "allways", "15:8 requirement-syntax"),
        ("always count r in robot. (at[r] == dock) <= 1", "nevr at[r1] == dock", "15:8 requirement-syntax"),
        ("near(a, b)", "near(a, b) && a in chargers", "9:31 unknown-type"),
        ("at.r == a,", "at.r in chargers,", "10:22 unknown-type"),
        ("domain: zone", "domain: zonee", "6:23 bad-domain"),
    ],
)
def test_a_slip_is_one_error_with_a_remedy(right: str, wrong: str, error: str) -> None:
    assert right in MODEL
    with pytest.raises(InputError) as raised:
        read_model(MODEL.replace(right, wrong, 1))
    assert [f"{each.place.line}:{each.place.column} {each.slug}" for each in raised.value.diagnostics] == [error]
    assert all(each.remedy for each in raised.value.diagnostics)


def test_the_model_is_right() -> None:
    assert read_model(MODEL).name == "cell"
