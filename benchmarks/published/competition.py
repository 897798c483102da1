"""Problems of the planning competitions: blocks and logistics (2000), gripper (1998).

The facts are those of the published instances. Variables have many values: the place of a block, of a package or of a
ball is one variable, where PDDL has one fact for each place.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, permutations
from typing import TYPE_CHECKING

from published.model_parts import flag, operation, planning_model, symbol

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.model import BehaviorModel, Operation, Value

# blocks

BLOCKS = {
    "6-0": ("dac feb", "cbaefd"),
    "8-0": ("age dhf b c", "dfehcagb"),
    "9-0": ("c fgeaidhb", "gdbcaifeh"),
    "10-0": ("cejbghadi f", "dcfjehbagi"),
    "12-0": ("hagkebdic lf j", "icbldjekfahg"),
    "17-0": ("qajibm lfek gdco hn p", "qnlojhcempagbikfd"),
}
"""For each instance its towers and the tower of the goal, each tower from its top."""

TABLE, HAND = "table", "hand"


def blocks(instance: str) -> BehaviorModel:
    """Return the blocks world with four operators: pick up, put down, stack and unstack."""
    towers, goal = BLOCKS[instance]
    names = sorted(goal)
    below = {block: under for tower in towers.split() for block, under in zip(tower, [*tower[1:], TABLE], strict=True)}
    tops = [tower[0] for tower in towers.split()]
    variables = [symbol(f"at_{x}", (TABLE, HAND, *(f"on_{y}" for y in names if y != x)), _on(below[x])) for x in names]
    variables += [flag(f"clear_{x}", initial=x in tops) for x in names]
    variables.append(flag("hand_empty", initial=True))
    wanted: dict[str, Value] = {f"at_{x}": _on(y) for x, y in pairwise(goal)}
    return planning_model(f"blocks_{instance.replace('-', '_')}", variables, _block_operations(names), wanted)


def _on(block: str) -> str:
    return block if block == TABLE else f"on_{block}"


def _block_operations(names: Iterable[str]) -> Iterator[Operation]:
    names = list(names)
    for x in names:
        held: dict[str, Value] = {f"at_{x}": HAND, f"clear_{x}": False, "hand_empty": False}
        down: dict[str, Value] = {f"at_{x}": TABLE, f"clear_{x}": True, "hand_empty": True}
        yield operation(f"pick_up_{x}", down, held)
        yield operation(f"put_down_{x}", {f"at_{x}": HAND}, down)
    for x, y in permutations(names, 2):
        placed: dict[str, Value] = {f"at_{x}": f"on_{y}", f"clear_{x}": True, "hand_empty": True}
        lifted: dict[str, Value] = {f"at_{x}": HAND, f"clear_{x}": False, "hand_empty": False}
        yield operation(f"stack_{x}_{y}", {f"at_{x}": HAND, f"clear_{y}": True}, {**placed, f"clear_{y}": False})
        yield operation(f"unstack_{x}_{y}", placed, {**lifted, f"clear_{y}": True})


# logistics


@dataclass(frozen=True)
class Deliveries:
    """An instance of logistics: in each city a truck and three packages start at its post office, `pos`.

    Attributes:
        cities: the number of cities; each has a post office and an airport.
        planes: the city at whose airport each airplane starts.
        goals: the destination of each package that has one; package `23` is the third of city 2.
    """

    cities: int
    planes: tuple[int, ...]
    goals: str


LOGISTICS = {
    "8-0": Deliveries(3, (1,), "11:pos3 21:pos2 31:apt3 22:pos3 12:pos1 23:apt2 13:apt2 32:apt1"),
    "10-0": Deliveries(4, (1,), "31:pos3 33:apt3 41:apt3 23:pos4 11:pos3 22:apt2 12:apt1 21:pos4 42:pos4 32:pos1"),
    "15-0": Deliveries(
        5,
        (5, 2),
        "22:apt4 31:apt4 43:pos5 13:apt1 23:pos4 12:pos2 51:pos3 32:pos3 11:apt3 42:apt2 52:apt4 33:apt3 21:pos3"
        " 53:apt2 41:apt1",
    ),
}


def logistics(instance: str) -> BehaviorModel:
    """Return packages, trucks and airplanes; packages without a destination are left out."""
    facts = LOGISTICS[instance]
    goals = dict(goal.split(":") for goal in sorted(facts.goals.split()))
    cities = range(1, facts.cities + 1)
    airports = [f"apt{city}" for city in cities]
    reach = {f"truck{city}": [f"pos{city}", f"apt{city}"] for city in cities}
    starts = {f"truck{city}": f"pos{city}" for city in cities}
    for index, city in enumerate(facts.planes, 1):
        reach[f"plane{index}"] = airports
        starts[f"plane{index}"] = f"apt{city}"
    places = [place for city in cities for place in reach[f"truck{city}"]]
    variables = [symbol(f"{vehicle}_at", stops, starts[vehicle]) for vehicle, stops in reach.items()]
    variables += [symbol(f"package{p}_at", (*places, *reach), f"pos{p[0]}") for p in goals]
    operations = _logistics_operations(list(goals), reach)
    wanted: dict[str, Value] = {f"package{p}_at": place for p, place in goals.items()}
    return planning_model(f"logistics_{instance.replace('-', '_')}", variables, operations, wanted)


def _logistics_operations(packages: list[str], reach: dict[str, list[str]]) -> Iterator[Operation]:
    for vehicle, stops in reach.items():
        for here, there in permutations(stops, 2):
            yield operation(f"move_{vehicle}_{here}_{there}", {f"{vehicle}_at": here}, {f"{vehicle}_at": there})
        for package in packages:
            for stop in stops:
                name, at = f"{package}_{vehicle}_{stop}", f"package{package}_at"
                yield operation(f"load_{name}", {at: stop, f"{vehicle}_at": stop}, {at: vehicle})
                yield operation(f"unload_{name}", {at: vehicle, f"{vehicle}_at": stop}, {at: stop})


# gripper


def gripper(balls: int) -> BehaviorModel:
    """Return a robot with two grippers that carries balls from one place to another; instance n has 2n + 2 balls."""
    sides, hands = ("a", "b"), ("left", "right")
    names = [f"ball{ball}" for ball in range(1, balls + 1)]
    variables = [symbol("robot_at", sides, "a"), *(flag(f"{hand}_free", initial=True) for hand in hands)]
    variables += [symbol(f"{ball}_at", (*sides, *hands), "a") for ball in names]
    operations = [operation(f"move_{a}_{b}", {"robot_at": a}, {"robot_at": b}) for a, b in permutations(sides)]
    for ball in names:
        for side in sides:
            for hand in hands:
                here: dict[str, Value] = {f"{ball}_at": side, f"{hand}_free": True}
                held: dict[str, Value] = {f"{ball}_at": hand, f"{hand}_free": False}
                name = f"{ball}_{side}_{hand}"
                operations.append(operation(f"pick_{name}", {"robot_at": side, **here}, held))
                operations.append(operation(f"drop_{name}", {"robot_at": side, f"{ball}_at": hand}, here))
    return planning_model(f"gripper_{balls}", variables, operations, {f"{ball}_at": "b" for ball in names})
