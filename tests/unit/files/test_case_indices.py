"""Case files with names that have an index: `level[t1]` is `level.t1` wherever a name of the model stands."""

from __future__ import annotations

import pytest

from scbm.files import read_case, read_model, write_case
from scbm.model import InputError, Slug

MODEL = read_model("""behavior_model: tanks
types: {tank: [t1, t2]}
variables:
  level[tank]: {domain: 0..3, initial: 0}
  joined[tank, tank]: {domain: bool, initial: false}
  tint[tank]: {domain: [red, blue], initial: red}
resources:
  pump[t in tank]: {}
operations:
  fill[t in tank]: {request: pump.t, effects: [level.t += 1]}
goals:
  full[t in tank]: level.t == 3
""")

WRITTEN = """case: first
goals:
  - goal: full[t1]
    expect: {visits: ["fill[t1]/failed"], order: ["fill[t1]", "fill[ t1 ]"], final: ["level[t1] == 3"]}
  - goal: level[t2] == 1 && !(joined[t1, t2] == true)
    when: fill[t1].state == initial
initial:
  level[t1]: 1
  joined[t1, t1]: true
outcomes:
  pump[t1]: fail
injections:
  - name: blue_one
    when: pump[t1]_req_state == initial && level[t1] == 2
    set: {"tint[t1]": blue}
  - resource: pump[t2]
    becomes: dead
    at: 1 s
requirements:
  never_both: always level[t1] + level[t2] <= 5
"""

DOTTED = """case: first
goals:
  - goal: full.t1
    expect: {visits: [fill.t1/failed], order: [fill.t1, fill.t1], final: [level.t1 == 3]}
  - goal: level.t2 == 1 && !(joined.t1.t2 == true)
    when: fill.t1.state == initial
initial:
  level.t1: 1
  joined.t1.t1: true
outcomes:
  pump.t1: fail
injections:
  - name: blue_one
    when: pump.t1_req_state == initial && level.t1 == 2
    set: {tint.t1: blue}
  - resource: pump.t2
    becomes: dead
    at: 1 s
requirements:
  never_both: always level.t1 + level.t2 <= 5
"""


def test_an_index_and_a_dot_are_one_name_in_the_whole_case() -> None:
    case = read_case(WRITTEN, MODEL)
    assert case == read_case(DOTTED, MODEL)
    assert "[t1" not in write_case(case, MODEL, None)


@pytest.mark.parametrize(
    ("lines", "slug", "line", "column", "length"),
    [
        ("goal: level[t1] == 2 && level[t2] == x", Slug.UNKNOWN_NAME, 2, 38, 1),
        ("goal: level[t1] == 2 && levl[t2] == 1", Slug.UNKNOWN_VARIABLE, 2, 25, 8),
        ("goal: full[t9]", Slug.UNKNOWN_GOAL, 2, 7, 8),
        ("goal: full[t1]\ninitial:\n  levle[t1]: 2", Slug.UNKNOWN_VARIABLE, 4, 3, 9),
        ("goal: full[t1]\ninitial:\n  level[t1]: 9", Slug.VALUE_OUTSIDE_DOMAIN, 4, 14, 1),
        ("goal: full[t1]\ninitial:\n  level[t1]: 2\n  level.t1: 1", Slug.DUPLICATE_KEY, 5, 3, 8),
        ("goal: full[t1]\nexpect: {visits: ['fil[t1]/failed']}", Slug.UNKNOWN_OBLIGATION, 3, 19, 16),
        ("goal: full[t1]\ninjections: [{name: 'a[b]', set: {level.t1: 1}}]", Slug.BAD_NAME, 3, 21, 6),
    ],
)
def test_an_error_stands_where_the_name_is_written(lines: str, slug: Slug, line: int, column: int, length: int) -> None:
    with pytest.raises(InputError) as raised:
        read_case(f"case: first\n{lines}\n", MODEL)
    (found,) = raised.value.diagnostics
    assert (found.slug, found.place.line, found.place.column, found.place.length) == (slug, line, column, length)
