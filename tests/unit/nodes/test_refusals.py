"""The errors of measured values that cannot be converted."""

from __future__ import annotations

import pytest

from scbm.files import read_bindings, read_model
from scbm.model import Value
from scbm.nodes.links.measured_topics import Refusals
from scbm.running import Program
from support.wording import Wording

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
    ("name", "value", "is_refused"),
    [
        ("zone", "near", False),
        ("zone", "+nan", True),
        ("item", '"CAN"', True),
        ("level", 5, False),
        ("level", 6, True),
        ("level", True, True),
        ("lit", True, True),
        ("presure", 1, True),
        ("level", "a\n\x1b[31mb", True),
        ("level", "a" * 1_000, True),
        ("b" * 1_000, 1, True),
    ],
    ids=lambda value: ascii(value)[:40],
)
def test_what_is_refused_is_reported_and_why(name: str, value: Value, *, is_refused: bool, wording: Wording) -> None:
    complaints: list[str] = []
    Refusals(Program(BOUND), complaints.append).look("scanner", ((name, value),), SCANNER)
    assert len(complaints) == is_refused
    for complaint in complaints:
        assert complaint.startswith(f"`{name[:40]}")
        wording(complaint)


def test_each_variable_is_reported_once_for_each_resource() -> None:
    complaints: list[str] = []
    refusals = Refusals(Program(BOUND), complaints.append)
    for value in (7, 8, 3, 9):
        refusals.look("scanner", (("level", value), ("zone", "+nan")), SCANNER)
    refusals.look("lamp", (("level", 7),), ("level", "lit"))
    assert [line.split()[:2] for line in complaints] == [
        ["`level`:", "7"],
        ["`zone`:", "+nan"],
        ["`level`:", "7"],
    ]


def test_a_driver_that_never_ends_is_reported_for_a_while() -> None:
    complaints: list[str] = []
    refusals = Refusals(Program(BOUND), complaints.append)
    for number in range(1_000):
        refusals.look("scanner", ((f"v{number}", 1),), SCANNER)
    assert len(complaints) == 100
