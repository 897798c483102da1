"""The example cells that `scbm init` starts a project from, and where an installation has them."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import scbm


@dataclass(frozen=True, slots=True)
class ExampleCell:
    """One example.

    Attributes:
        model: its model file in the folder of examples; cases stand in `cases` beside it.
        goal: a goal of the model that a run reaches.
        about: what the cell is, for the help and the README of a project.
    """

    model: str
    goal: str
    about: str


EXAMPLES: dict[str, ExampleCell] = {
    "gripper": ExampleCell(
        "gripper/cell.yaml", "loaded", "a robot with a gripper that loads a machine; the smallest one"
    ),
    "packml": ExampleCell(
        "packml/cell.yaml", "pallet_full", "a packaging machine by ISA-TR88 (PackML) with an emergency stop, of parts"
    ),
    "agv": ExampleCell(
        "agv_line/cell.yaml", "delivered", "an AGV with orders that fail, a protective field and a lost position"
    ),
    "cnc": ExampleCell(
        "dual_cnc/cell.yaml", "pallet_finished", "two CNC machines and a robot, with stop, light curtain and recovery"
    ),
    "paper": ExampleCell(
        "robot_in_the_air/after.yaml", "item_a_scanned", "the robot on a gantry of the paper about SCBM-IAS, repaired"
    ),
    "delivery": ExampleCell(
        "delivery/cell.yaml", "goal", "two robots that carry crates through a warehouse, imported from PDDL"
    ),
}
"""The examples by name, in the order of the help."""


def examples_folder() -> Path:
    """Return the folder of the examples: in the package if it was installed, else in the checkout."""
    package = Path(scbm.__file__).parent
    installed = package / "examples"
    return installed if installed.is_dir() else package.parents[1] / "examples"
