"""Problems that others published, and plants of known size, as models: for benchmarks and their peers.

`PROBLEMS` has a function for each; `write_model` of `scbm.files` writes one as YAML.
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from published.competition import BLOCKS, LOGISTICS, blocks, gripper, logistics
from published.model_parts import GOAL
from published.plants import agv_grid, agv_with_pallets, elevators, factory, flags, independent, line, machining_cell
from published.rovers import ROVERS, rovers

if TYPE_CHECKING:
    from collections.abc import Callable

    from scbm.model import BehaviorModel

__all__ = [
    "GOAL",
    "PROBLEMS",
    "agv_grid",
    "agv_with_pallets",
    "blocks",
    "elevators",
    "factory",
    "flags",
    "gripper",
    "independent",
    "line",
    "logistics",
    "machining_cell",
    "rovers",
]

PROBLEMS: dict[str, Callable[[], BehaviorModel]] = {
    **{f"blocks-{instance}": partial(blocks, instance) for instance in BLOCKS},
    **{f"logistics-{instance}": partial(logistics, instance) for instance in LOGISTICS},
    **{f"rovers-{instance}": partial(rovers, instance) for instance in ROVERS},
    **{f"gripper-{balls}": partial(gripper, balls) for balls in (6, 8, 14, 42)},
    "factory-157": partial(factory, 1, 2),
    "factory-246": partial(factory, 3, 1),
    "factory-846": partial(factory, 3, 3),
    "flags_all_16": partial(flags, 16),
    "line_s7p4t2": partial(line, 7, 4, 2),
    "independent-10x10": partial(independent, 10, 10),
    "agv-5x5": partial(agv_grid, 5, 5),
    "agv-pallets-4": partial(agv_with_pallets, 4),
    "agv-pallets-5": partial(agv_with_pallets, 5),
    "elevators-3x2": partial(elevators, 3, 2),
    "elevators-4x4": partial(elevators, 4, 4),
    "machining_cell": machining_cell,
}
"""A function for each problem, by its name. Every model has one goal, `GOAL`."""
