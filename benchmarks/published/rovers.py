"""Rovers (planning competition of 2002): rovers sample soil and rock, take images, and send the data to a lander."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from published.model_parts import flag, operation, planning_model, symbol

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.model import BehaviorModel, Operation, Value, Variable


@dataclass(frozen=True)
class Rover:
    """A rover.

    Attributes:
        start: its waypoint at the beginning.
        equipment: what it can do, of `soil`, `rock` and `imaging`.
        roads: the pairs of waypoints between which it drives, both ways; `0:1,3` stands for 0-1 and 0-3.
    """

    start: int
    equipment: str
    roads: str


@dataclass(frozen=True)
class Camera:
    """A camera: the rover and the objective that it is calibrated at, by their numbers, and its modes."""

    rover: int
    target: int
    modes: str


@dataclass(frozen=True)
class Mission:
    """An instance.

    Attributes:
        lander: the waypoint of the lander.
        visible: the pairs of waypoints that see each other, as the roads of rovers.
        rovers: the rovers.
        soil: the waypoints with a sample of soil.
        rock: the waypoints with a sample of rock.
        cameras: the cameras.
        seen_from: for each objective the number of waypoints that see it: the first ones.
        soil_goals: the waypoints whose soil is analyzed.
        rock_goals: the waypoints whose rock is analyzed.
        image_goals: the images to take.
    """

    lander: int
    visible: str
    rovers: tuple[Rover, ...]
    soil: str
    rock: str
    cameras: tuple[Camera, ...]
    seen_from: tuple[int, ...]
    soil_goals: str
    rock_goals: str
    image_goals: tuple[tuple[int, str], ...]


ROVERS = {
    "05": Mission(
        lander=3,
        visible="0:1,2,3 1:2,3 2:3",
        rovers=(
            Rover(0, "rock imaging", "0:1,3"),
            Rover(0, "soil imaging", "0:1 1:2,3"),
        ),
        soil="1 2 3",
        rock="0 1",
        cameras=(
            Camera(1, 1, "high_res low_res"),
            Camera(1, 1, "colour high_res"),
            Camera(0, 1, "colour high_res low_res"),
        ),
        seen_from=(4, 3, 3),
        soil_goals="1 2",
        rock_goals="0 1",
        image_goals=((0, "high_res"), (2, "high_res"), (0, "colour")),
    ),
    "07": Mission(
        lander=3,
        visible="0:1,2,3,4,5 1:2,5 2:3,5 3:4 4:5",
        rovers=(
            Rover(2, "soil rock imaging", "0:2,4 1:2 2:3,5"),
            Rover(3, "rock", "0:1,3,5 2:3 3:4"),
            Rover(4, "soil rock imaging", "0:1,3,4 2:5 4:5"),
        ),
        soil="1 4",
        rock="2 3 4 5",
        cameras=(
            Camera(0, 0, "colour high_res"),
            Camera(2, 1, "high_res"),
        ),
        seen_from=(5, 4),
        soil_goals="1 4",
        rock_goals="2 3 4",
        image_goals=((0, "high_res"),),
    ),
    "20": Mission(
        lander=1,
        visible=(
            "0:5,7,14,15,18,23 1:2,3,4,5,14,15,18,23 2:5,6,9,14,16,23 3:12,13,15,18,20 4:5,6,7,8,13,16,19,20,21 "
            "5:6,8,9,14,16,21,24 6:8,9,11,12,14,15,18,19,21 7:8,9,16,17,24 8:11,14,16,17,18,21 9:14,17,18 "
            "10:11,15,16,18,23 11:12,17,19,21,22 12:13,14,15,19,22,23,24 13:14,15,20,21 14:17,20 15:16,17 16:20,22 "
            "17:18,20,21 18:21,23,24 19:20,21 20:23,24 21:22 23:24"
        ),
        rovers=(
            Rover(
                22,
                "soil imaging",
                (
                    "0:5 1:15 2:6 3:13 4:21 5:21 6:9,11,14 7:8 8:11 10:11 11:17,19,22 12:13,15,22,24 15:16 17:20 18:21 "
                    "21:22 23:24"
                ),
            ),
            Rover(
                4,
                "imaging",
                "0:5,7 1:4,14,15,18 2:5 3:13 4:5,6,13,16,19,20,21 5:8,9,24 6:11,12 10:18 16:22 17:20 18:23",
            ),
            Rover(
                3,
                "rock imaging",
                (
                    "0:5 1:2,3,5,14,15 3:13,18,20 4:7,13 5:8 6:18 9:18 10:15 11:21 12:14 13:21 16:20 17:18 18:23,24 "
                    "19:20 21:22"
                ),
            ),
            Rover(
                3,
                "soil rock",
                "0:18 1:2,3,4,5,14,15,23 3:12,13,18,20 4:7,8 6:11,12 9:18 10:16 12:19,22,24 13:21 16:20 17:18",
            ),
            Rover(
                16,
                "rock imaging",
                (
                    "0:5 1:4 2:9,14,16 3:15 4:13,16,20 5:16,21,24 6:15 7:16,17 8:11,16,18 10:16 12:15 15:16 16:22 "
                    "19:21 20:23"
                ),
            ),
            Rover(
                10,
                "imaging",
                (
                    "0:15 1:15 2:16 3:18 4:16 5:6 6:9,11,14,19 7:16 8:11 10:11,15,16,18,23 11:12,21,22 13:15 15:17 "
                    "20:23 23:24"
                ),
            ),
            Rover(
                4,
                "soil imaging",
                "0:23 1:3,4,5,14,18,23 2:6 4:6,8,13,16,19,20 6:9,11,12,15,21 7:16 8:17 10:16 16:22 20:24",
            ),
            Rover(
                16,
                "rock",
                "0:14 1:14 2:5,6,9,14,16,23 3:20 4:13,16,19 5:21 6:12 7:8 8:16,17,18 10:11,15,16 16:20 20:24",
            ),
        ),
        soil="0 1 7 8 9 11 13 15 17 18 20 22 23 24",
        rock="7 9 10 12 14 16 18 21 22",
        cameras=(
            Camera(0, 6, "colour high_res"),
            Camera(1, 1, "colour high_res"),
            Camera(4, 0, "colour high_res low_res"),
            Camera(2, 2, "high_res low_res"),
            Camera(1, 4, "colour high_res"),
            Camera(5, 4, "high_res"),
            Camera(6, 5, "colour high_res low_res"),
        ),
        seen_from=(17, 4, 18, 20, 24, 15, 11, 21),
        soil_goals="7 8 11 13 20 23",
        rock_goals="7 9 10 12 14 16 18 21 22",
        image_goals=((2, "high_res"), (0, "high_res"), (3, "colour"), (7, "colour"), (5, "high_res")),
    ),
}


def rovers(instance: str) -> BehaviorModel:
    """Return an instance of rovers. Data without a goal are not sent, and waypoints out of reach are left out."""
    grounded = _Grounded(ROVERS[instance])
    return planning_model(f"rovers_{instance}", grounded.variables(), grounded.operations(), grounded.goal())


class _Grounded:
    """The variables and operations of a mission."""

    def __init__(self, mission: Mission) -> None:
        self._mission = mission
        self._visible = _neighbours(mission.visible)
        self._roads = [_neighbours(rover.roads) for rover in mission.rovers]
        self._reach = [_reachable(rover.start, roads) for rover, roads in zip(mission.rovers, self._roads, strict=True)]
        self._samples = [("soil", point) for point in _numbers(mission.soil)]
        self._samples += [("rock", point) for point in _numbers(mission.rock)]

    def goal(self) -> dict[str, Value]:
        """Return the goal: everything is communicated."""
        sent = [f"soil{point}_sent" for point in _numbers(self._mission.soil_goals)]
        sent += [f"rock{point}_sent" for point in _numbers(self._mission.rock_goals)]
        sent += [f"image{objective}_{mode}_sent" for objective, mode in self._mission.image_goals]
        return dict.fromkeys(sent, True)

    def variables(self) -> Iterator[Variable]:
        """Yield the places of rovers and samples, stores, calibrations, images, and what was sent."""
        for index, (rover, reach) in enumerate(zip(self._mission.rovers, self._reach, strict=True)):
            yield symbol(f"rover{index}_at", (f"w{point}" for point in reach), f"w{rover.start}")
            if any(True for _ in self._sampling(index)):
                yield flag(f"store{index}_empty", initial=True)
            for objective, mode in self._images(index):
                yield flag(f"rover{index}_has_image{objective}_{mode}", initial=False)
        for kind, point in self._samples:
            takers = (f"rover{r}" for r in range(len(self._mission.rovers)) if (kind, point) in self._sampling(r))
            yield symbol(f"{kind}{point}_at", ("ground", *takers), "ground")
        for index, camera in enumerate(self._mission.cameras):
            if any(True for _ in self._images(camera.rover)):
                yield flag(f"camera{index}_calibrated", initial=False)
        for name in self.goal():
            yield flag(name, initial=False)

    def operations(self) -> Iterator[Operation]:
        """Yield the operations of all rovers."""
        for index in range(len(self._mission.rovers)):
            yield from self._navigate(index)
            yield from self._sample(index)
            yield from self._take_images(index)
            yield from self._communicate(index)

    def _navigate(self, rover: int) -> Iterator[Operation]:
        at = f"rover{rover}_at"
        for here in self._reach[rover]:
            for there in self._roads[rover][here]:
                yield operation(f"navigate_{rover}_{here}_{there}", {at: f"w{here}"}, {at: f"w{there}"})

    def _sampling(self, rover: int) -> Iterator[tuple[str, int]]:
        """Yield the samples that a rover can take."""
        for kind, point in self._samples:
            if kind in self._mission.rovers[rover].equipment and point in self._reach[rover]:
                yield kind, point

    def _sample(self, rover: int) -> Iterator[Operation]:
        store = f"store{rover}_empty"
        for kind, point in self._sampling(rover):
            free: dict[str, Value] = {f"rover{rover}_at": f"w{point}", f"{kind}{point}_at": "ground", store: True}
            taken: dict[str, Value] = {f"{kind}{point}_at": f"rover{rover}", store: False}
            yield operation(f"sample_{kind}_{rover}_{point}", free, taken)
        if any(True for _ in self._sampling(rover)):
            yield operation(f"drop_{rover}", {store: False}, {store: True})

    def _cameras(self, rover: int) -> Iterator[tuple[int, Camera]]:
        if "imaging" in self._mission.rovers[rover].equipment:
            yield from ((index, each) for index, each in enumerate(self._mission.cameras) if each.rover == rover)

    def _images(self, rover: int) -> Iterator[tuple[int, str]]:
        """Yield the images that a rover can take."""
        modes = dict.fromkeys(mode for _, camera in self._cameras(rover) for mode in camera.modes.split())
        for objective in range(len(self._mission.seen_from)):
            if self._seeing(rover, objective):
                yield from ((objective, mode) for mode in modes)

    def _take_images(self, rover: int) -> Iterator[Operation]:
        images, at = list(self._images(rover)), f"rover{rover}_at"
        for index, camera in self._cameras(rover) if images else ():
            calibrated = f"camera{index}_calibrated"
            for point in self._seeing(rover, camera.target):
                yield operation(f"calibrate_{index}_{point}", {at: f"w{point}"}, {calibrated: True})
            for objective, mode in images:
                for point in self._seeing(rover, objective) if mode in camera.modes.split() else ():
                    yield operation(
                        f"take_image{objective}_{mode}_{index}_{point}",
                        {at: f"w{point}", calibrated: True},
                        {f"rover{rover}_has_image{objective}_{mode}": True, calibrated: False},
                    )

    def _seeing(self, rover: int, objective: int) -> list[int]:
        """Return the waypoints in reach of a rover that see an objective."""
        return [point for point in self._reach[rover] if point < self._mission.seen_from[objective]]

    def _communicate(self, rover: int) -> Iterator[Operation]:
        held: dict[str, tuple[str, Value]] = {
            f"{kind}{point}": (f"{kind}{point}_at", f"rover{rover}") for kind, point in self._sampling(rover)
        }
        for objective, mode in self._images(rover):
            held[f"image{objective}_{mode}"] = (f"rover{rover}_has_image{objective}_{mode}", True)
        goal = self.goal()
        for data, (holder, value) in held.items():
            for point in self._reach[rover] if f"{data}_sent" in goal else ():
                if self._mission.lander in self._visible.get(point, ()):
                    yield operation(
                        f"send_{data}_{rover}_{point}",
                        {f"rover{rover}_at": f"w{point}", holder: value},
                        {f"{data}_sent": True},
                    )


def _numbers(text: str) -> list[int]:
    return [int(number) for number in text.split()]


def _neighbours(roads: str) -> dict[int, list[int]]:
    """Return the neighbours of each waypoint, ascending."""
    found: dict[int, list[int]] = {}
    for part in roads.split():
        here, others = part.split(":")
        for there in others.split(","):
            found.setdefault(int(here), []).append(int(there))
            found.setdefault(int(there), []).append(int(here))
    return {point: sorted(found[point]) for point in sorted(found)}


def _reachable(start: int, roads: dict[int, list[int]]) -> list[int]:
    """Return the waypoints that roads reach, ascending."""
    found, waiting = {start}, [start]
    while waiting:
        for there in roads[waiting.pop()]:
            if there not in found:
                found.add(there)
                waiting.append(there)
    return sorted(found)
