"""Plants and cells: a car factory, a production line, transport on a grid, elevators, resources, a machining cell."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise, permutations, product
from typing import TYPE_CHECKING

from published.model_parts import (
    GOAL,
    all_equal,
    assigned,
    flag,
    free_operation,
    number,
    operation,
    planning_model,
    symbol,
)
from scbm.model import (
    Add,
    BehaviorModel,
    Constant,
    Latency,
    LatencyShape,
    Operation,
    Order,
    Outcome,
    Reference,
    Relation,
    Resource,
    Simulation,
    Transition,
    Truth,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from scbm.model import Value, Variable

_MS_NS = 1_000_000

# flags


def flags(count: int) -> BehaviorModel:
    """Return independent flags, each set by one operation: the largest graph for the shortest model."""
    names = [f"flag{index}" for index in range(1, count + 1)]
    variables = [flag(name, initial=False) for name in names]
    operations = [operation(f"set_{name}", {name: False}, {name: True}) for name in names]
    return planning_model(f"flags_all_{count}", variables, operations, dict.fromkeys(names, True))


# a car factory

ZONES = ("wheels_zone", "steering_wheels_zone", "body_car_zone", "assembly_zone", "recharge_zone")
KINDS = ("wheel", "body", "steering_wheel")


def factory(robots: int, cars: int) -> BehaviorModel:
    """Return the factory of PlanSys2's examples with four actions: move, transport, assemble and recharge.

    One robot and two cars are 157 operations; three robots are 246 for one car and 846 for three.
    """
    stores = dict(zip(KINDS, ("wheels_zone", "body_car_zone", "steering_wheels_zone"), strict=True))
    teams = [f"robot{robot}" for robot in range(1, robots + 1)]
    pieces = {f"{kind}{car}": kind for car in range(1, cars + 1) for kind in KINDS}
    finished = [f"car{car}_assembled" for car in range(1, cars + 1)]
    variables = [symbol(f"{robot}_at", ZONES, "assembly_zone") for robot in teams]
    variables += [flag(f"{robot}_charged", initial=False) for robot in teams]
    variables += [symbol(f"{piece}_at", (*ZONES, "used"), stores[kind]) for piece, kind in pieces.items()]
    variables += [flag(name, initial=False) for name in finished]
    operations = [each for robot in teams for each in _robot_operations(robot, pieces, finished)]
    return planning_model(f"factory_{len(operations)}", variables, operations, dict.fromkeys(finished, True))


def _robot_operations(robot: str, pieces: Mapping[str, str], finished: list[str]) -> Iterator[Operation]:
    at, charged = f"{robot}_at", f"{robot}_charged"
    for here, there in permutations(ZONES, 2):
        yield operation(f"move_{robot}_{here}_{there}", {at: here}, {at: there})
        for piece in pieces:
            ready: dict[str, Value] = {at: here, f"{piece}_at": here, charged: True}
            name = f"transport_{robot}_{piece}_{here}_{there}"
            yield operation(name, ready, {at: there, f"{piece}_at": there})
    yield operation(f"recharge_{robot}", {at: "recharge_zone"}, {charged: True})
    sets = product(*([piece for piece, kind in pieces.items() if kind == wanted] for wanted in KINDS))
    for parts, done in product(sets, finished):
        together: dict[str, Value] = {f"{piece}_at": "assembly_zone" for piece in parts}
        used: dict[str, Value] = {f"{piece}_at": "used" for piece in parts}
        name = f"assemble_{robot}_{'_'.join(parts)}_{done.removesuffix('_assembled')}"
        yield operation(name, {at: "assembly_zone", **together}, {**used, done: True})


# a production line


def line(stations: int, parts: int, trolleys: int) -> BehaviorModel:
    """Return trolleys on a line of stations; half of the parts go from the first station to the last, half back.

    Seven stations, four parts and two trolleys are 136 operations and a shortest plan of 32 steps.
    """
    stops = [f"s{station}" for station in range(1, stations + 1)]
    carts = [f"trolley{trolley}" for trolley in range(1, trolleys + 1)]
    goods = [f"part{part}" for part in range(1, parts + 1)]
    variables = [symbol(f"{cart}_at", stops, stops[0]) for cart in carts]
    variables += [flag(f"{cart}_free", initial=True) for cart in carts]
    starts = {part: stops[0] if index < parts // 2 else stops[-1] for index, part in enumerate(goods)}
    variables += [symbol(f"{part}_at", (*stops, *carts), start) for part, start in starts.items()]
    operations = [each for cart in carts for each in _cart_operations(cart, stops, goods)]
    wanted: dict[str, Value] = {f"{p}_at": stops[-1] if start == stops[0] else stops[0] for p, start in starts.items()}
    return planning_model(f"line_s{stations}p{parts}t{trolleys}", variables, operations, wanted)


def _cart_operations(cart: str, stops: list[str], goods: list[str]) -> Iterator[Operation]:
    at, free = f"{cart}_at", f"{cart}_free"
    for left, right in pairwise(stops):
        yield operation(f"{cart}_{left}_{right}", {at: left}, {at: right})
        yield operation(f"{cart}_{right}_{left}", {at: right}, {at: left})
    for part, stop in product(goods, stops):
        here: dict[str, Value] = {f"{part}_at": stop, free: True}
        held: dict[str, Value] = {f"{part}_at": cart, free: False}
        yield operation(f"load_{part}_{cart}_{stop}", {at: stop, **here}, held)
        yield operation(f"unload_{part}_{cart}_{stop}", {at: stop, f"{part}_at": cart}, here)


# an AGV on a grid


def agv_grid(width: int, height: int) -> BehaviorModel:
    """Return an AGV on a grid that fetches a pallet from one corner to the opposite one, with counters and order."""
    variables: list[Variable] = [number("x", width - 1), number("y", height - 1), flag("loaded", initial=False)]
    variables.append(flag("delivered", initial=False))
    operations = [
        free_operation("right", _below("x", width - 1), (Add("x", 1),)),
        free_operation("left", _above("x"), (Add("x", -1),)),
        free_operation("up", _below("y", height - 1), (Add("y", 1),)),
        free_operation("down", _above("y"), (Add("y", -1),)),
        operation("load", {"x": width - 1, "y": 0, "loaded": False, "delivered": False}, {"loaded": True}),
        operation("unload", {"x": 0, "y": height - 1, "loaded": True}, {"loaded": False, "delivered": True}),
    ]
    return planning_model(f"agv_{width}x{height}", variables, operations, {"x": 0, "y": 0, "delivered": True})


def _below(name: str, limit: int) -> Order:
    return Order(Reference(name), Relation.LESS, Constant(limit))


def _above(name: str) -> Order:
    return Order(Reference(name), Relation.GREATER, Constant(0))


def agv_with_pallets(size: int) -> BehaviorModel:
    """Return an AGV on a square that takes as many pallets from one side to the other: 6 size - 4 operations.

    Each move from one column or row to the next is an operation, as is each pallet that is loaded or unloaded.
    """
    pallets = [f"pallet{row}" for row in range(1, size + 1)]
    places = ("store", "agv", "dock")
    variables = [number("x", size - 1), number("y", size - 1), flag("is_free", initial=True)]
    variables += [symbol(f"{pallet}_at", places, "store") for pallet in pallets]
    operations = [
        _requesting(f"{axis}_{here}_to_{there}", "agv", {axis: here}, {axis: there})
        for near, far in pairwise(range(size))
        for axis in "xy"
        for here, there in ((near, far), (far, near))
    ]
    for row, pallet in enumerate(pallets):
        stored: dict[str, Value] = {"x": size - 1, "y": row, "is_free": True, f"{pallet}_at": "store"}
        docked: dict[str, Value] = {"x": 0, "y": size - 1 - row, f"{pallet}_at": "agv"}
        operations.append(_requesting(f"load_{pallet}", "agv", stored, {"is_free": False, f"{pallet}_at": "agv"}))
        operations.append(_requesting(f"unload_{pallet}", "agv", docked, {"is_free": True, f"{pallet}_at": "dock"}))
    goal: dict[str, Value] = {f"{pallet}_at": "dock" for pallet in pallets}
    return _cell(f"agv_pallets_{size}", tuple(variables), tuple(operations), ["agv"], goal)


# resources


def independent(resources: int, steps: int) -> BehaviorModel:
    """Return resources that each do a sequence of steps on their own; each step is one request."""
    names = [f"r{index}" for index in range(1, resources + 1)]
    counters = {name: f"{name}_steps" for name in names}
    operations = [
        _requesting(f"{name}_step{step}", name, {counters[name]: step - 1}, {counters[name]: step})
        for name in names
        for step in range(1, steps + 1)
    ]
    variables = tuple(number(counter, steps) for counter in counters.values())
    goal: dict[str, Value] = dict.fromkeys(counters.values(), steps)
    return _cell(f"independent_{resources}x{steps}", variables, tuple(operations), names, goal)


def _requesting(
    name: str, resource: str, guard: Mapping[str, Value], effect: Mapping[str, Value], seconds: int = 10
) -> Operation:
    """Return an operation that sends a request, and completes once it has succeeded."""
    trigger, state = f"{resource}_req_trigger", f"{resource}_req_state"
    ready = all_equal({state: "initial", trigger: False, **guard})
    start = Transition(f"start_{name}", ready, a=assigned({trigger: True}))
    done = assigned({state: "initial", trigger: False, **effect})
    complete = Transition(f"complete_{name}", Truth(True), all_equal({state: "succeeded"}), done)
    return Operation(name, start, complete, seconds * 1_000 * _MS_NS, timedout=assigned({trigger: False}))


def _cell(
    name: str,
    variables: tuple[Variable, ...],
    operations: tuple[Operation, ...],
    resources: list[str],
    goal: Mapping[str, Value],
) -> BehaviorModel:
    """Return a model of resources whose requests fail once in ten times."""
    tenth = Fraction(1, 10)
    latency = Latency(LatencyShape.UNIFORM, (200 * _MS_NS, 1_500 * _MS_NS))
    simulation = Simulation(latency, ((Outcome.SUCCEED, 1 - tenth), (Outcome.FAIL, tenth)))
    return BehaviorModel(
        name,
        variables,
        operations,
        resources=tuple(Resource(resource, simulation=simulation) for resource in resources),
        automatic_transitions=tuple(_failing(resource) for resource in resources),
        goals=((GOAL, all_equal(goal)),),
    )


def _failing(resource: str) -> Transition:
    """Return the transition that fails the operation whose request has failed."""
    state = f"{resource}_req_state"
    failed = all_equal({state: "failed", "current.state": "executing"})
    reset = assigned({"current.state": "failed", state: "initial", f"{resource}_req_trigger": False})
    return Transition(f"{resource}_failed", failed, a=reset)


# elevators


def elevators(floors: int, passengers: int) -> BehaviorModel:
    """Return two elevators that take passengers half of the floors up or down, whichever of them comes first."""
    cabins, stops = ("cabin1", "cabin2"), [f"floor{floor}" for floor in range(1, floors + 1)]
    trips = {f"passenger{n + 1}": (stops[n % floors], stops[(n + floors // 2) % floors]) for n in range(passengers)}
    variables = [symbol(f"{cabin}_at", stops, stops[0]) for cabin in cabins]
    variables += [symbol(f"{who}_at", (*stops, *cabins), begin) for who, (begin, _) in trips.items()]
    operations = []
    for cabin in cabins:
        at = f"{cabin}_at"
        for below, above in pairwise(stops):
            operations.append(_requesting(f"{cabin}_up_to_{above}", cabin, {at: below}, {at: above}))
            operations.append(_requesting(f"{cabin}_down_to_{below}", cabin, {at: above}, {at: below}))
        for who, (begin, end) in trips.items():
            enters: dict[str, Value] = {at: begin, f"{who}_at": begin}
            operations.append(_requesting(f"{who}_enters_{cabin}", cabin, enters, {f"{who}_at": cabin}))
            operations.append(
                _requesting(f"{who}_leaves_{cabin}", cabin, {at: end, f"{who}_at": cabin}, {f"{who}_at": end})
            )
    goal: dict[str, Value] = {f"{who}_at": end for who, (_, end) in trips.items()}
    return _cell(f"elevators_{floors}x{passengers}", tuple(variables), tuple(operations), [*cabins], goal)


# a machining cell

MACHINES = ("cnc1", "cnc2")
POINTS = ("home", "inlet", *MACHINES, "outlet")


def machining_cell() -> BehaviorModel:
    """Return a cell of 21 operations: a robot tends two CNC machines with a door, a clamp and a program each."""
    symbols = [
        symbol("robot_at", POINTS, "home"),
        symbol("gripper", ("empty", "raw", "finished"), "empty"),
        *(symbol(f"{m}_part", ("none", "raw", "finished"), "none") for m in MACHINES),
    ]
    doors = [flag(f"{m}_{what}", initial=False) for m in MACHINES for what in ("door_open", "clamped")]
    variables = (*symbols, *doors, number("delivered", 2))
    operations = (*_robot_moves(), *(each for m in MACHINES for each in _machine_operations(m)))
    return _cell("machining_cell", variables, operations, ["robot", *MACHINES], {"delivered": 2, "robot_at": "home"})


def _robot_moves() -> Iterator[Operation]:
    for point in POINTS:
        yield _requesting(f"move_to_{point}", "robot", {}, {"robot_at": point})
    yield _requesting("pick_raw", "robot", {"robot_at": "inlet", "gripper": "empty"}, {"gripper": "raw"})
    place = _requesting("place_finished", "robot", {"robot_at": "outlet", "gripper": "finished"}, {"gripper": "empty"})
    counted = Transition(place.post.name, place.post.g, place.post.gr, (*place.post.a, Add("delivered", 1)))
    yield Operation(place.name, place.pre, counted, place.deadline_ns, timedout=place.timedout)


def _machine_operations(machine: str) -> Iterator[Operation]:
    door, clamped, part = f"{machine}_door_open", f"{machine}_clamped", f"{machine}_part"
    yield _requesting(f"{machine}_open", machine, {door: False}, {door: True})
    yield _requesting(f"{machine}_close", machine, {door: True}, {door: False})
    yield _requesting(f"{machine}_clamp", machine, {clamped: False}, {clamped: True})
    yield _requesting(f"{machine}_unclamp", machine, {clamped: True}, {clamped: False})
    yield _requesting(f"{machine}_run", machine, {door: False, clamped: True, part: "raw"}, {part: "finished"})
    reaching: dict[str, Value] = {"robot_at": machine, door: True, clamped: False}
    yield _requesting(
        f"load_{machine}", "robot", {**reaching, "gripper": "raw", part: "none"}, {"gripper": "empty", part: "raw"}
    )
    taken: dict[str, Value] = {"gripper": "finished", part: "none"}
    yield _requesting(f"unload_{machine}", "robot", {**reaching, "gripper": "empty", part: "finished"}, taken)
