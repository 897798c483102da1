"""The errors of measured values that cannot be converted."""

from __future__ import annotations

import pytest

from scbm.files import read_bindings, read_model
from scbm.model import Value
from scbm.nodes.links.measured_topics import Refusals
from scbm.running import Program

MODEL = read_model("""
behavior_model: measuring
variables:
  zone: {domain: [near, far], initial: near}
  item: {domain: [none, box], initial: none}
  level: {domain: 0..5, initial: 0}
  lit: {domain: bool, initial: false}
resources:
  scanner: {measures: [zone, item, level]}
  lamp: {measures: [lit]}
operations: {}
""")
BOUND = read_bindings(
    """
bindings_of: measuring
resources:
  scanner:
    measured:
      zone: {topic: /distance, type: std_msgs/msg/Float64, ranges: {near: 0..0.5, far: 0.5..2}}
      item: {topic: /item, type: std_msgs/msg/String, values: {BOX: box, "": none}}
      level: {topic: /level, type: std_msgs/msg/Int64}
""",
    MODEL,
)
SCANNER = ("zone", "item", "level")


@pytest.mark.parametrize(
    ("name", "value", "told"),
    [
        ("zone", "near", None),
        ("zone", "+nan", "`zone`: +nan is refused: in no range of its binding"),
        ("item", '"CAN"', '`item`: "CAN" is refused: no text of its binding'),
        ("level", 5, None),
        ("level", 6, "`level`: 6 is refused: not in its domain"),
        ("level", True, "`level`: true is refused: not in its domain"),
        ("lit", True, "`lit`: true is refused: that is no variable that `scanner` may measure"),
        ("presure", 1, "`presure`: 1 is refused: that is no variable that `scanner` may measure"),
        ("level", "a\n\x1b[31mb", '`level`: "a\\n\\u001b[31mb" is refused: not in its domain'),
        ("level", "a" * 1_000, f"`level`: {'a' * 40}… is refused: not in its domain"),
        ("b" * 1_000, 1, f"`{'b' * 40}…`: 1 is refused: that is no variable that `scanner` may measure"),
    ],
)
def test_what_is_refused_is_told_and_why(name: str, value: Value, told: str | None) -> None:
    complaints: list[str] = []
    Refusals(Program(BOUND), complaints.append).look("scanner", ((name, value),), SCANNER)
    assert complaints == ([] if told is None else [told])


def test_each_variable_is_told_of_once_for_each_resource() -> None:
    complaints: list[str] = []
    refusals = Refusals(Program(BOUND), complaints.append)
    for value in (7, 8, 3, 9):
        refusals.look("scanner", (("level", value), ("zone", "+nan")), SCANNER)
    refusals.look("lamp", (("level", 7),), ("lit",))
    assert [told.partition(" is")[0] for told in complaints] == ["`level`: 7", "`zone`: +nan", "`level`: 7"]


def test_a_driver_that_goes_on_for_ever_is_told_of_for_a_while() -> None:
    complaints: list[str] = []
    refusals = Refusals(Program(BOUND), complaints.append)
    for number in range(1_000):
        refusals.look("scanner", ((f"v{number}", 1),), SCANNER)
    assert len(complaints) == 100
