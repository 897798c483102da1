"""From a model back to a text that the loader reads as the same model."""

from __future__ import annotations

from dataclasses import replace
from hashlib import sha256
from typing import TYPE_CHECKING, Any

from scbm.files.codec.bindings.binding_writer import written_binding
from scbm.files.yaml.yaml_writer import dump
from scbm.model import LatencyShape, Truth, format_duration

if TYPE_CHECKING:
    from scbm.model import (
        Action,
        BehaviorModel,
        Domain,
        Latency,
        Operation,
        Predicate,
        Resource,
        Transition,
        Value,
        Variable,
    )


def write_model(model: BehaviorModel) -> str:
    """The model as YAML, with every key that says more than its default."""
    sections = {
        "behavior_model": model.name,
        "variables": {variable.name: _variable(variable) for variable in model.variables},
        "resources": {resource.name: _resource(resource) for resource in model.resources},
        "operations": {operation.name: _operation(operation) for operation in model.operations},
        "automatic_transitions": {t.name: _transition(t, t.name) for t in model.automatic_transitions},
        "initial_states": _predicate(model.initial_states),
        "goals": {name: _predicate(goal) for name, goal in model.goals},
        "requirements": {requirement.name: str(requirement.sentence) for requirement in model.requirements},
    }
    return dump(
        {key: value for key, value in sections.items() if value or key in ("variables", "operations")},
        short_in_flow=True,
    )


def digest_of(model: BehaviorModel) -> str:
    """What tells models apart: the SHA-256 of all that the model says, but for comments, layout and bindings.

    How resources are reached when they are real says nothing about what the model means.
    """
    resources = tuple(replace(resource, binding=None) for resource in model.resources)
    return sha256(write_model(replace(model, resources=resources)).encode()).hexdigest()


def write_operation(operation: Operation) -> str:
    """One operation as it stands under `operations:` in a model file."""
    return dump({operation.name: _operation(operation)}, short_in_flow=True)


def _variable(variable: Variable) -> dict[str, Any]:
    written: dict[str, Any] = {"domain": _domain(variable.domain), "initial": variable.initial}
    if variable.random != (variable.initial,):
        written["random"] = list(variable.random)
    return written


def _domain(domain: Domain) -> str | list[Value]:
    return str(domain) if not isinstance(domain.values[0], str) else list(domain.values)


def _predicate(predicate: Predicate) -> bool | str:
    return predicate.truth if isinstance(predicate, Truth) else str(predicate)


def _actions(actions: tuple[Action, ...]) -> list[str]:
    return [str(action) for action in actions]


def _transition(transition: Transition, default_name: str) -> dict[str, Any]:
    written: dict[str, Any] = {} if transition.name == default_name else {"name": transition.name}
    written |= {"g": _predicate(transition.g), "gr": _predicate(transition.gr)}
    return written | {"a": _actions(transition.a), "ar": _actions(transition.ar)}


def _operation(operation: Operation) -> dict[str, Any]:
    written: dict[str, Any] = {}
    if operation.deadline_ns is not None:
        written["deadline"] = format_duration(operation.deadline_ns)
    written["pre"] = _transition(operation.pre, f"start_{operation.name}")
    written["post"] = _transition(operation.post, f"complete_{operation.name}")
    if operation.failed is not None:
        written["failed"] = _transition(operation.failed, f"fail_{operation.name}")
    if operation.timedout:
        written["timedout"] = _actions(operation.timedout)
    if operation.disabled_deadline_ns is not None:
        written["disabled_deadline"] = format_duration(operation.disabled_deadline_ns)
    return written


def _resource(resource: Resource) -> dict[str, Any]:
    simulation = resource.simulation
    simulated: dict[str, Any] = {
        "latency": _latency(simulation.latency),
        "outcomes": {outcome.value: float(probability) for outcome, probability in simulation.outcomes},
    }
    if simulation.measured:
        simulated["measured"] = {name: list(values) for name, values in simulation.measured}
    written = {"request": list(resource.request), "measures": list(resource.measures), "simulation": simulated}
    return written if resource.binding is None else {**written, "ros": written_binding(resource.binding)}


def _latency(latency: Latency) -> dict[str, Any]:
    points = [format_duration(point_ns) for point_ns in latency.points_ns]
    return {latency.shape.value: points[0] if latency.shape is LatencyShape.FIXED else points}
