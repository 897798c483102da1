"""The models of the study: written from public sources, generated from seeds, and planning problems as a control."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from hashlib import sha256
from pathlib import Path
from random import Random
from typing import TYPE_CHECKING

from msgspec.structs import replace
from published import agv_grid, blocks, factory, flags, gripper, line, logistics

from scbm.files import load_model
from scbm.model import (
    Assign,
    BehaviorModel,
    Constant,
    Domain,
    Equal,
    Latency,
    LatencyShape,
    Operation,
    Outcome,
    Reference,
    Resource,
    Simulation,
    Transition,
    Truth,
    Variable,
    conjunction,
)

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from scbm.model import Action, Predicate, Value

GROUPS = WRITTEN, GENERATED, CONTROL = "written", "generated", "control"

_MS_NS = 1_000_000
_GENERATED = 60
_FEW = 2
"""A job with more steps has half of it as a second goal."""
_SIMULATION = Simulation(
    Latency(LatencyShape.UNIFORM, (200 * _MS_NS, 1_500 * _MS_NS)),
    (
        (Outcome.SUCCEED, Fraction(8, 10)),
        (Outcome.FAIL, Fraction(1, 10)),
        (Outcome.TIMEOUT, Fraction(1, 10)),
    ),
)


@dataclass(frozen=True, slots=True)
class Subject:
    """A model of the study.

    Attributes:
        name: its name in the results.
        group: `WRITTEN`, `GENERATED` or `CONTROL`.
        model: makes the model.
        file: the file of the model, if it has one.
    """

    name: str
    group: str
    model: Callable[[], BehaviorModel]
    file: Path | None = None

    def file_digest(self) -> str:
        """Return the SHA-256 of the file; an empty text if there is none."""
        return "" if self.file is None else sha256(self.file.read_bytes()).hexdigest()


def subjects() -> tuple[Subject, ...]:
    """Return all models: those of files by their names, then the generated ones, then the control."""
    files = sorted((Path(__file__).parent / "models").glob("*.yaml"))
    written = (Subject(path.stem, WRITTEN, partial(load_model, path), path) for path in files)
    generated = (Subject(f"generated-{seed}", GENERATED, partial(generated_model, seed)) for seed in _seeds())
    return (*written, *generated, *_controls())


def _seeds() -> range:
    return range(1, _GENERATED + 1)


# generated models


def generated_model(seed: int) -> BehaviorModel:
    """Return a model with failure handling: steps of a job on a few resources, each with its own way to recover."""
    random = Random(seed)
    resources = [f"r{index}" for index in range(random.randint(1, 3))]
    steps = [f"step{index}" for index in range(random.randint(2, 6))]
    users = {step: random.choice(resources) for step in steps}
    operations = [_calm()]
    for index, step in enumerate(steps):
        needed: dict[str, Value] = {f"{step}_done": False}
        if index:
            needed[f"{steps[index - 1]}_done"] = True
            needed |= random.choice([{}, {}, {"tries": 0}])
        operations.append(_step(step, users[step], needed, random))
    flags = tuple(Variable(f"{step}_done", Domain.boolean(), False, (False,)) for step in steps)
    tries = Variable("tries", Domain.integers(0, 3), 0, (0,))
    automatic = [_failing(resource, counts=random.random() < 1 / 2) for resource in resources]
    automatic.append(_give_up())
    goals = [("all_done", equal({f"{step}_done": True for step in steps}))]
    if len(steps) > _FEW:
        goals.append(("half_done", equal({f"{steps[len(steps) // 2]}_done": True})))
    return BehaviorModel(
        f"generated_{seed}",
        (*flags, tries),
        tuple(operations),
        resources=tuple(Resource(name, simulation=_SIMULATION) for name in resources),
        automatic_transitions=tuple(automatic),
        goals=tuple(goals),
        may_end=("aborted",),
    )


def _step(name: str, resource: str, needed: Mapping[str, Value], random: Random) -> Operation:
    """Return a step that sends a request; a third of the steps undo an earlier step when they time out."""
    trigger, state = f"{resource}_req_trigger", f"{resource}_req_state"
    pre = Transition(f"start_{name}", equal({state: "initial", trigger: False, **needed}), a=assigned({trigger: True}))
    done = assigned({state: "initial", trigger: False, f"{name}_done": True})
    post = Transition(f"complete_{name}", Truth(True), equal({state: "succeeded"}), done)
    timedout = list(assigned({trigger: False}))
    earlier = [key for key, value in needed.items() if value is True]
    if earlier and random.random() < 1 / 3:
        timedout += assigned({earlier[0]: False})
    if "tries" in needed or random.random() < 1 / 2:
        timedout += assigned({"tries": random.randint(1, 3)})
    seconds = random.choice([2, 5, 10])
    return Operation(name, pre, post, seconds * 1_000 * _MS_NS, timedout=tuple(timedout))


def _calm() -> Operation:
    """Return an operation that completes at once and makes the job ready after a failure."""
    begin = Transition("start_calm", equal({"tries": 1}))
    return Operation("calm", begin, Transition("complete_calm", Truth(True), a=assigned({"tries": 0})))


def _failing(resource: str, *, counts: bool) -> Transition:
    """Return the transition that fails the operation whose request has failed; it `counts` as a try, or not."""
    state = f"{resource}_req_state"
    failed = equal({state: "failed", "current.state": "executing"})
    reset: dict[str, Value] = {"current.state": "failed", state: "initial", f"{resource}_req_trigger": False}
    if counts:
        reset["tries"] = 1
    return Transition(f"{resource}_failed", failed, a=assigned(reset))


def _give_up() -> Transition:
    return Transition("give_up", equal({"tries": 3}), a=assigned({"plan.state": "aborted", "tries": 0}))


# planning problems


def _controls() -> Iterator[Subject]:
    """Yield 30 planning problems of seven domains, small enough that a random case takes less than 2 s."""
    lines = ((2, 1, 1), (3, 1, 1), (3, 2, 1), (4, 2, 1), (4, 1, 2), (5, 2, 1))
    problems: dict[str, Callable[[], BehaviorModel]] = {
        **{f"gripper-{balls}": partial(gripper, balls) for balls in range(2, 8)},
        **{f"agv-{wide}x{high}": partial(agv_grid, wide, high) for wide in (2, 3, 4) for high in (2, 3, 4)},
        **{f"flags-{count}": partial(flags, count) for count in range(3, 9)},
        **{f"line-{'-'.join(map(str, sizes))}": partial(line, *sizes) for sizes in lines},
        "blocks-6-0": partial(blocks, "6-0"),
        "logistics-8-0": partial(logistics, "8-0"),
        "factory-1-1": partial(factory, 1, 1),
    }
    for name, problem in problems.items():
        yield Subject(name, CONTROL, partial(with_requests, problem))


def with_requests(problem: Callable[[], BehaviorModel]) -> BehaviorModel:
    """Return a planning problem whose operations send requests to one resource; failed ones are tried again."""
    model = problem()
    free: dict[str, Value] = {"actor_req_state": "initial", "actor_req_trigger": False}
    operations = tuple(
        replace(
            operation,
            pre=replace(
                operation.pre,
                g=conjunction([equal(free), operation.pre.g]),
                a=(*operation.pre.a, *assigned({"actor_req_trigger": True})),
            ),
            post=replace(
                operation.post,
                gr=equal({"actor_req_state": "succeeded"}),
                a=(*operation.post.a, *assigned(free)),
            ),
            deadline_ns=10_000 * _MS_NS,
            timedout=assigned({"actor_req_trigger": False}),
        )
        for operation in model.operations
    )
    actor = Resource("actor", simulation=_SIMULATION)
    failing = _failing("actor", counts=False)
    return replace(model, operations=operations, resources=(actor,), automatic_transitions=(failing,))


# predicates and actions


def equal(values: Mapping[str, Value]) -> Predicate:
    """Return the conjunction of `variable == value`."""
    return conjunction(Equal(Reference(name), Constant(value)) for name, value in values.items())


def assigned(values: Mapping[str, Value]) -> tuple[Action, ...]:
    """Return `variable <- value` for each variable."""
    return tuple(Assign(name, Constant(value)) for name, value in values.items())
