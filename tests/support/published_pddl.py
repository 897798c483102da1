"""Published planning problems as PDDL: the facts are those of the competitions and of PlanSys2, the texts are ours.

Sources of the facts: https://github.com/potassco/pddl-instances (`ipc-1998` gripper, `ipc-2000` blocks and logistics,
`ipc-2002` rovers) and https://github.com/PlanSys2/ros2_planning_system_examples (`plansys2_simple_example`,
`plansys2_bt_example`).

The lengths of the competitions are those that A* with LM-cut proved to be optimal (Fast Downward, of `up-fast-downward`
1.0) on the published files, not on these texts. PlanSys2 publishes no lengths, so they were counted by hand: charge and
two moves; and move to the charger, recharge, three times move and transport, assemble.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise, permutations
from typing import NamedTuple


class PublishedProblem(NamedTuple):
    """A problem: the text of its domain, the text of its facts and goal, and the length of its shortest plans."""

    domain: str
    problem: str
    length: int


def _action(name: str, parameters: str, needs: str, effects: str) -> str:
    return (
        f"  (:action {name} :parameters ({parameters})\n    :precondition (and {needs})\n    :effect (and {effects}))\n"
    )


def _domain(name: str, types: str, predicates: str, *actions: str, requirements: str = ":strips :typing") -> str:
    head = f"(define (domain {name})\n  (:requirements {requirements})\n  (:types {types})\n"
    return f"{head}  (:predicates {predicates})\n{''.join(actions)})\n"


def _problem(name: str, domain: str, objects: str, init: list[str], goal: list[str]) -> str:
    facts = "\n    ".join(f"({fact})" for fact in init)
    wanted = " ".join(f"({fact})" for fact in goal)
    return (
        f"(define (problem {name})\n  (:domain {domain})\n  (:objects {objects})\n  (:init\n    {facts})\n"
        f"  (:goal (and {wanted})))\n"
    )


# Blocks, of the competition of 2000

BLOCKS = {
    "4-0": ("c a b d", "dcba", 6),
    "4-1": ("bcad", "dcab", 10),
    "4-2": ("a cb d", "abcd", 6),
    "5-0": ("d ceba", "aebdc", 12),
    "5-1": ("bad e c", "dcbae", 10),
    "5-2": ("decab", "dcbea", 16),
    "6-0": ("dac feb", "cbaefd", 12),
    "6-1": ("af b e c d", "efcbad", 10),
}
"""For each instance its towers, the tower of the goal, each from its top, and the length of the shortest plans."""

_BLOCKS = _domain(
    "blocks",
    "block",
    "(on ?x ?y - block) (on-table ?x - block) (clear ?x - block) (hand-empty) (holding ?x - block)",
    _action(
        "pick-up",
        "?x - block",
        "(clear ?x) (on-table ?x) (hand-empty)",
        "(holding ?x) (not (clear ?x)) (not (on-table ?x)) (not (hand-empty))",
    ),
    _action("put-down", "?x - block", "(holding ?x)", "(not (holding ?x)) (clear ?x) (on-table ?x) (hand-empty)"),
    _action(
        "stack",
        "?x ?y - block",
        "(holding ?x) (clear ?y)",
        "(not (holding ?x)) (not (clear ?y)) (on ?x ?y) (clear ?x) (hand-empty)",
    ),
    _action(
        "unstack",
        "?x ?y - block",
        "(on ?x ?y) (clear ?x) (hand-empty)",
        "(holding ?x) (clear ?y) (not (on ?x ?y)) (not (clear ?x)) (not (hand-empty))",
    ),
)


def _blocks(instance: str) -> PublishedProblem:
    towers, goal, length = BLOCKS[instance]
    init = ["hand-empty"]
    for tower in towers.split():
        init += [f"clear {tower[0]}", *(f"on {x} {y}" for x, y in pairwise(tower)), f"on-table {tower[-1]}"]
    wanted = [f"on {x} {y}" for x, y in pairwise(goal)]
    text = _problem(f"blocks-{instance}", "blocks", f"{' '.join(sorted(goal))} - block", init, wanted)
    return PublishedProblem(_BLOCKS, text, length)


# Gripper, of the competition of 1998; types stand for its predicates of one object

GRIPPER = {"1": (4, 11), "2": (6, 17), "3": (8, 23)}
"""For each instance the number of balls and the length of the shortest plans."""

_GRIPPER = _domain(
    "gripper",
    "hall ball gripper",
    "(at-robby ?h - hall) (at ?b - ball ?h - hall) (free ?g - gripper) (carry ?b - ball ?g - gripper)",
    _action("move", "?from ?to - hall", "(at-robby ?from)", "(at-robby ?to) (not (at-robby ?from))"),
    _action(
        "pick",
        "?b - ball ?h - hall ?g - gripper",
        "(at ?b ?h) (at-robby ?h) (free ?g)",
        "(carry ?b ?g) (not (at ?b ?h)) (not (free ?g))",
    ),
    _action(
        "drop",
        "?b - ball ?h - hall ?g - gripper",
        "(carry ?b ?g) (at-robby ?h)",
        "(at ?b ?h) (free ?g) (not (carry ?b ?g))",
    ),
)


def _gripper(instance: str) -> PublishedProblem:
    count, length = GRIPPER[instance]
    balls = [f"ball{number}" for number in range(1, count + 1)]
    init = ["at-robby halla", "free left", "free right", *(f"at {ball} halla" for ball in balls)]
    objects = f"halla hallb - hall left right - gripper {' '.join(balls)} - ball"
    text = _problem(f"gripper-{instance}", "gripper", objects, init, [f"at {ball} hallb" for ball in balls])
    return PublishedProblem(_GRIPPER, text, length)


# Logistics, of the competition of 2000: two cities, each with a truck and three packages; `23` is the third of city 2

LOGISTICS = {
    "4-0": (2, "11:apt1 23:pos1 13:apt1 21:pos1", 20),
    "4-1": (2, "12:apt2 13:apt1 21:apt2 11:pos2", 19),
    "4-2": (1, "21:apt1 11:pos2 23:pos2 12:pos1", 15),
    "5-1": (1, "23:pos1 11:pos1 22:apt2 21:apt2 12:apt1", 17),
    "5-2": (2, "21:apt2 12:apt1 13:pos1 22:pos2 23:apt2", 8),
}
"""For each instance the city where the airplane starts, the destinations, and the length of the shortest plans."""


def _carrying(vehicle: str) -> tuple[str, str]:
    parameters = f"?x - package ?v - {vehicle} ?l - place"
    return (
        _action(f"load-{vehicle}", parameters, "(at ?v ?l) (at ?x ?l)", "(not (at ?x ?l)) (in ?x ?v)"),
        _action(f"unload-{vehicle}", parameters, "(at ?v ?l) (in ?x ?v)", "(not (in ?x ?v)) (at ?x ?l)"),
    )


_LOGISTICS = _domain(
    "logistics",
    "truck airplane - vehicle package vehicle - thing airport location - place city place thing - object",
    "(in-city ?l - place ?c - city) (at ?x - thing ?l - place) (in ?p - package ?v - vehicle)",
    *_carrying("truck"),
    *_carrying("airplane"),
    _action(
        "drive-truck",
        "?t - truck ?from ?to - place ?c - city",
        "(at ?t ?from) (in-city ?from ?c) (in-city ?to ?c)",
        "(not (at ?t ?from)) (at ?t ?to)",
    ),
    _action("fly-airplane", "?a - airplane ?from ?to - airport", "(at ?a ?from)", "(not (at ?a ?from)) (at ?a ?to)"),
)


def _logistics(instance: str) -> PublishedProblem:
    plane, goals, length = LOGISTICS[instance]
    packages = [f"{city}{number}" for city in (1, 2) for number in (1, 2, 3)]
    init = [f"at apn1 apt{plane}"]
    init += [f"in-city {place}{city} cit{city}" for city in (1, 2) for place in ("pos", "apt")]
    init += [f"at tru{city} pos{city}" for city in (1, 2)] + [f"at obj{p} pos{p[0]}" for p in packages]
    objects = (
        f"apn1 - airplane apt1 apt2 - airport pos1 pos2 - location cit1 cit2 - city tru1 tru2 - truck"
        f" {' '.join(f'obj{p}' for p in packages)} - package"
    )
    wanted = [f"at obj{package} {place}" for package, place in (goal.split(":") for goal in goals.split())]
    return PublishedProblem(_LOGISTICS, _problem(f"logistics-{instance}", "logistics", objects, init, wanted), length)


# Rovers, of the competition of 2002


@dataclass(frozen=True)
class RoverMission:
    """An instance of rovers with four waypoints.

    Attributes:
        lander: the waypoint of the lander.
        hidden: the pair of waypoints that do not see each other, if there is one.
        rovers: for each rover its waypoint, its equipment (soil, rock, imaging), and its roads, both ways.
        soil, rock: the waypoints with a sample.
        cameras: for each camera its rover, its calibration target, and its modes.
        seen_from: for each objective the number of waypoints that see it: the first ones.
        goal: the waypoint of the soil, that of the rock, the objective and the mode of the image.
        length: the length of the shortest plans.
    """

    lander: int
    hidden: str
    rovers: tuple[tuple[int, str, str], ...]
    soil: str
    rock: str
    cameras: tuple[tuple[int, int, str], ...]
    seen_from: tuple[int, ...]
    goal: tuple[int, int, int, str]
    length: int


ALL = "soil rock imaging"
ROVERS = {
    "1": RoverMission(
        0, "", ((3, ALL, "30 31 12"),), "023", "123", ((0, 1, "colour high_res"),), (4, 4), (2, 3, 1, "high_res"), 10
    ),
    "2": RoverMission(
        1,
        "",
        ((0, ALL, "01 02 03"),),
        "0",
        "0",
        ((0, 0, "colour high_res low_res"), (0, 1, "high_res")),
        (1, 3),
        (0, 0, 1, "low_res"),
        8,
    ),
    "3": RoverMission(
        0,
        "",
        ((1, ALL, "10 13"), (3, ALL, "30 32 01")),
        "2",
        "012",
        ((0, 1, "low_res"), (1, 0, "colour high_res low_res")),
        (2, 2),
        (2, 0, 0, "colour"),
        11,
    ),
    "4": RoverMission(
        2,
        "03",
        ((3, "soil imaging", "31"), (2, ALL, "21 23 10")),
        "23",
        "13",
        ((1, 0, "colour high_res"), (0, 0, "colour low_res"), (0, 1, "low_res")),
        (4, 2, 3),
        (3, 1, 0, "high_res"),
        8,
    ),
}

_SEND = "?r - rover ?l - lander {what} ?x ?y - waypoint"
_LINK = "(at ?r ?x) (at_lander ?l ?y) (visible ?x ?y) (available ?r) (channel_free ?l)"
_ROVERS = _domain(
    "rovers",
    "rover waypoint store camera mode lander objective",
    "(at ?r - rover ?w - waypoint) (at_lander ?l - lander ?w - waypoint)"
    " (can_traverse ?r - rover ?x ?y - waypoint) (visible ?x ?y - waypoint) (available ?r - rover)"
    " (channel_free ?l - lander) (store_of ?s - store ?r - rover) (empty ?s - store) (full ?s - store)"
    + "".join(
        f" (equipped_for_{kind} ?r - rover) (at_{kind} ?w - waypoint) (have_{kind} ?r - rover ?w - waypoint)"
        f" (sent_{kind} ?w - waypoint)"
        for kind in ("soil", "rock")
    )
    + " (equipped_for_imaging ?r - rover) (on_board ?c - camera ?r - rover) (supports ?c - camera ?m - mode)"
    " (calibration_target ?c - camera ?o - objective) (calibrated ?c - camera ?r - rover)"
    " (visible_from ?o - objective ?w - waypoint) (have_image ?r - rover ?o - objective ?m - mode)"
    " (sent_image ?o - objective ?m - mode)",
    _action(
        "navigate",
        "?r - rover ?x ?y - waypoint",
        "(can_traverse ?r ?x ?y) (available ?r) (at ?r ?x) (visible ?x ?y)",
        "(not (at ?r ?x)) (at ?r ?y)",
    ),
    *(
        _action(
            f"sample_{kind}",
            "?r - rover ?s - store ?w - waypoint",
            f"(at ?r ?w) (at_{kind} ?w) (equipped_for_{kind} ?r) (store_of ?s ?r) (empty ?s)",
            f"(not (empty ?s)) (full ?s) (have_{kind} ?r ?w) (not (at_{kind} ?w))",
        )
        for kind in ("soil", "rock")
    ),
    _action("drop", "?r - rover ?s - store", "(store_of ?s ?r) (full ?s)", "(not (full ?s)) (empty ?s)"),
    _action(
        "calibrate",
        "?r - rover ?c - camera ?o - objective ?w - waypoint",
        "(equipped_for_imaging ?r) (calibration_target ?c ?o) (at ?r ?w) (visible_from ?o ?w) (on_board ?c ?r)",
        "(calibrated ?c ?r)",
    ),
    _action(
        "take_image",
        "?r - rover ?w - waypoint ?o - objective ?c - camera ?m - mode",
        "(calibrated ?c ?r) (on_board ?c ?r) (equipped_for_imaging ?r) (supports ?c ?m)"
        " (visible_from ?o ?w) (at ?r ?w)",
        "(have_image ?r ?o ?m) (not (calibrated ?c ?r))",
    ),
    *(
        _action(
            f"send_{kind}",
            _SEND.format(what="?w - waypoint"),
            f"{_LINK} (have_{kind} ?r ?w)",
            f"(sent_{kind} ?w)",
        )
        for kind in ("soil", "rock")
    ),
    _action(
        "send_image",
        _SEND.format(what="?o - objective ?m - mode"),
        f"{_LINK} (have_image ?r ?o ?m)",
        "(sent_image ?o ?m)",
    ),
)


def _rovers(instance: str) -> PublishedProblem:
    mission = ROVERS[instance]
    points, objectives = range(4), range(len(mission.seen_from))
    init = [f"at_lander general w{mission.lander}", "channel_free general"]
    seen = [(x, y) for x, y in permutations(points, 2) if {str(x), str(y)} != set(mission.hidden)]
    init += [f"visible w{x} w{y}" for x, y in seen]
    init += [f"at_soil w{w}" for w in mission.soil] + [f"at_rock w{w}" for w in mission.rock]
    for number, (start, equipment, roads) in enumerate(mission.rovers):
        rover = f"rover{number}"
        init += [
            f"at {rover} w{start}",
            f"available {rover}",
            f"store_of store{number} {rover}",
            f"empty store{number}",
        ]
        init += [f"equipped_for_{kind} {rover}" for kind in equipment.split()]
        init += [
            f"can_traverse {rover} w{x} w{y}" for road in roads.split() for x, y in (tuple(road), tuple(reversed(road)))
        ]
    for number, (on, target, modes) in enumerate(mission.cameras):
        init += [f"on_board camera{number} rover{on}", f"calibration_target camera{number} objective{target}"]
        init += [f"supports camera{number} {mode}" for mode in modes.split()]
    init += [f"visible_from objective{o} w{w}" for o in objectives for w in range(mission.seen_from[o])]
    kinds = {
        "lander": ["general"],
        "mode": ["colour", "high_res", "low_res"],
        "rover": [f"rover{number}" for number in range(len(mission.rovers))],
        "store": [f"store{number}" for number in range(len(mission.rovers))],
        "waypoint": [f"w{w}" for w in points],
        "camera": [f"camera{number}" for number in range(len(mission.cameras))],
        "objective": [f"objective{o}" for o in objectives],
    }
    objects = " ".join(f"{' '.join(names)} - {kind}" for kind, names in kinds.items())
    soil, rock, objective, mode = mission.goal
    wanted = [f"sent_soil w{soil}", f"sent_rock w{rock}", f"sent_image objective{objective} {mode}"]
    return PublishedProblem(_ROVERS, _problem(f"rovers-{instance}", "rovers", objects, init, wanted), mission.length)


# PlanSys2


def _timed(name: str, parameters: str, needs: str, effects: str) -> str:
    return (
        f"  (:durative-action {name} :parameters ({parameters}) :duration (= ?duration 5)\n"
        f"    :condition (and {needs})\n    :effect (and {effects}))\n"
    )


_SIMPLE = _domain(
    "simple",
    "robot place",
    "(robot_at ?r - robot ?p - place) (connected ?p1 ?p2 - place) (battery_full ?r - robot) (battery_low ?r - robot)"
    " (charging_point_at ?p - place)",
    _timed(
        "move",
        "?r - robot ?p1 ?p2 - place",
        "(at start (connected ?p1 ?p2)) (at start (robot_at ?r ?p1)) (over all (battery_full ?r))",
        "(at start (not (robot_at ?r ?p1))) (at end (robot_at ?r ?p2))",
    ),
    _timed(
        "ask_charge",
        "?r - robot ?p1 ?p2 - place",
        "(at start (robot_at ?r ?p1)) (at start (charging_point_at ?p2))",
        "(at start (not (robot_at ?r ?p1))) (at end (robot_at ?r ?p2))",
    ),
    _timed(
        "charge",
        "?r - robot ?p - place",
        "(at start (robot_at ?r ?p)) (at start (charging_point_at ?p))",
        "(at end (not (battery_low ?r))) (at end (battery_full ?r))",
    ),
    requirements=":strips :typing :durative-actions",
)


def _simple() -> PublishedProblem:
    ways = [("sitting", "corridor"), ("bedroom", "corridor"), ("bedroom", "bathroom"), ("sitting", "kitchen")]
    init = ["robot_at robot1 corridor", "charging_point_at corridor", "battery_low robot1"]
    init += [f"connected {x} {y}" for a, b in ways for x, y in ((a, b), (b, a))]
    objects = "robot1 - robot bedroom kitchen bathroom sitting corridor - place"
    return PublishedProblem(_SIMPLE, _problem("simple", "simple", objects, init, ["robot_at robot1 kitchen"]), 3)


_BUSY = "(at start (not (robot_available ?r))) (at end (robot_available ?r))"
_PIECES = (("?p1", "wheel"), ("?p2", "body_car"), ("?p3", "steering_wheel"))
_FACTORY = _domain(
    "factory",
    "robot zone piece car",
    "(battery_full ?r - robot) (robot_available ?r - robot) (robot_at ?r - robot ?z - zone)"
    " (piece_at ?p - piece ?z - zone) (piece_is_wheel ?p - piece) (piece_is_body_car ?p - piece)"
    " (piece_is_steering_wheel ?p - piece) (piece_not_used ?p - piece) (is_assembly_zone ?z - zone)"
    " (is_recharge_zone ?z - zone) (car_assembled ?c - car)",
    _timed(
        "move",
        "?r - robot ?z1 ?z2 - zone",
        "(at start (robot_at ?r ?z1)) (at start (robot_available ?r))",
        f"(at start (not (robot_at ?r ?z1))) (at end (robot_at ?r ?z2)) {_BUSY}",
    ),
    _timed(
        "transport",
        "?r - robot ?p - piece ?z1 ?z2 - zone",
        "(over all (battery_full ?r)) (at start (robot_at ?r ?z1)) (at start (piece_at ?p ?z1))"
        " (at start (robot_available ?r))",
        "(at start (not (robot_at ?r ?z1))) (at end (robot_at ?r ?z2)) (at start (not (piece_at ?p ?z1)))"
        f" (at end (piece_at ?p ?z2)) {_BUSY}",
    ),
    _timed(
        "recharge",
        "?r - robot ?z - zone",
        "(at start (is_recharge_zone ?z)) (over all (robot_at ?r ?z)) (at start (robot_available ?r))",
        f"(at end (battery_full ?r)) {_BUSY}",
    ),
    _timed(
        "assemble",
        "?r - robot ?z - zone ?p1 ?p2 ?p3 - piece ?c - car",
        "(over all (battery_full ?r)) (at start (is_assembly_zone ?z)) (at start (robot_at ?r ?z))"
        " (at start (robot_available ?r))"
        + "".join(
            f" (at start (piece_at {p} ?z)) (at start (piece_not_used {p})) (at start (piece_is_{kind} {p}))"
            for p, kind in _PIECES
        ),
        "".join(f"(at start (not (piece_not_used {p}))) " for p, _ in _PIECES) + f"(at end (car_assembled ?c)) {_BUSY}",
    ),
    requirements=":strips :typing :durative-actions",
)


def _factory() -> PublishedProblem:
    """Return one car of the factory with one robot: its published problem lacks the zone to recharge in."""
    init = ["robot_at r2d2 assembly_zone", "robot_available r2d2", "is_assembly_zone assembly_zone"]
    init.append("is_recharge_zone recharge_zone")
    zones = {"wheel": "wheels_zone", "body_car": "body_car_zone", "steering_wheel": "steering_wheels_zone"}
    for kind, zone in zones.items():
        init += [f"piece_at {kind}_1 {zone}", f"piece_is_{kind} {kind}_1", f"piece_not_used {kind}_1"]
    objects = (
        f"r2d2 - robot {' '.join(zones.values())} assembly_zone recharge_zone - zone"
        f" {' '.join(f'{kind}_1' for kind in zones)} - piece car_1 - car"
    )
    return PublishedProblem(_FACTORY, _problem("factory", "factory", objects, init, ["car_assembled car_1"]), 9)


PUBLISHED: dict[str, PublishedProblem] = {
    **{f"blocks-{instance}": _blocks(instance) for instance in BLOCKS},
    **{f"gripper-{instance}": _gripper(instance) for instance in GRIPPER},
    **{f"logistics-{instance}": _logistics(instance) for instance in LOGISTICS},
    **{f"rovers-{instance}": _rovers(instance) for instance in ROVERS},
    "plansys2-simple": _simple(),
    "plansys2-factory": _factory(),
}
"""20 problems of competitions and two of PlanSys2, by name."""
