"""The keys of a resource in a model file, and how the resource behaves when it is simulated."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import TYPE_CHECKING, Any

from scbm.files.codec.binding_keys import RosKeys
from scbm.files.codec.key_types import (
    DURATION,
    DURATION_SCHEMA,
    VARIABLES,
    MappingType,
    NamesType,
    ScalarListType,
    ScalarOrMappingType,
    ScalarType,
    node_of,
    scalar_node,
)
from scbm.files.codec.keys import DefaultKey, Key, Keys
from scbm.files.codec.variable_keys import VALUES, read_values
from scbm.files.spelling import suggestion
from scbm.model import Slug
from scbm.model.durations import format_duration
from scbm.model.resources import Latency, LatencyShape, Outcome, Resource, Simulation
from scbm.model.variables import Role

if TYPE_CHECKING:
    from scbm.files.codec.keys import Definitions
    from scbm.files.yaml.document import YamlNode
    from scbm.model.values import Value

_NUMBER = re.compile(r"\+?(\d{1,18}(\.\d{0,18})?|\.\d{1,18})(e[-+]?\d{1,2})?", re.ASCII | re.IGNORECASE)
_POINTS = {LatencyShape.FIXED: 1, LatencyShape.UNIFORM: 2, LatencyShape.TRIANGULAR: 3}
_DEFAULT = Simulation()

_DURATIONS = ScalarListType(
    "list of durations",
    "a list of durations",
    {"type": "array", "items": DURATION_SCHEMA},
    "a duration such as `10 s`",
    node_of,
)
_DURATION_NODE = ScalarType("duration", "a duration such as `10 s`", DURATION_SCHEMA, scalar_node)


class LatencyKeys(Keys):
    """A distribution of latencies."""

    fixed = Key(_DURATION_NODE, "Always this latency.")
    uniform = Key(_DURATIONS, "`[lowest, highest]`: any latency between these two, each equally probable.")
    triangular = Key(_DURATIONS, "`[lowest, most probable, highest]`: a triangular distribution.")

    def latency(self) -> Latency:
        """Return the distribution; the default if it is wrong."""
        node = self.node
        if not isinstance(node.plain, dict):
            value_ns = DURATION.read(node, self.reader)
            return _DEFAULT.latency if value_ns is None else Latency(LatencyShape.FIXED, (value_ns,))
        if len(node.items) != 1:
            found = "here are several" if node.items else "here is none"
            remedy = f"write one of {', '.join(f'`{shape}`' for shape in LatencyShape)}"
            self.reader.add(Slug.BAD_LATENCY, f"a latency has one distribution, and {found}", node.place, remedy)
            return _DEFAULT.latency
        key, points = next(iter(node.items.items()))
        found_latency = self._distribution(LatencyShape(key), points) if key in self.declared else None
        return found_latency or _DEFAULT.latency

    def _distribution(self, shape: LatencyShape, points: YamlNode) -> Latency | None:
        if isinstance(points.plain, list) is (shape is LatencyShape.FIXED):
            return None
        nodes = [points] if shape is LatencyShape.FIXED else points.elements
        points_ns = [point_ns for node in nodes if (point_ns := DURATION.read(node, self.reader)) is not None]
        wanted = _POINTS[shape]
        if len(nodes) != wanted:
            message = f"`{shape}` takes {wanted} durations, and this is a list of {len(nodes)}"
            self.reader.add(Slug.BAD_LATENCY, message, points.place)
        elif len(points_ns) == wanted and points_ns != sorted(points_ns):
            remedy = "write the shortest first"
            self.reader.add(Slug.BAD_LATENCY, f"the durations of `{shape}` must not fall", points.place, remedy)
        return Latency(shape, tuple(points_ns)) if len(points_ns) == wanted else None


def _latency_data(latency: Latency) -> dict[str, Any]:
    points = [format_duration(point_ns) for point_ns in latency.points_ns]
    return {latency.shape.value: points[0] if latency.shape is LatencyShape.FIXED else points}


class _LatencyType(ScalarOrMappingType[LatencyKeys]):
    """A latency: its JSON Schema also limits how many distributions there are, and their points."""

    def schema(self, definitions: Definitions) -> dict[str, Any]:  # noqa: ARG002 - refers to no definition
        """Return the JSON Schema."""
        distributions: dict[str, Any] = {
            shape.value: {"type": "array", "items": DURATION_SCHEMA, "minItems": points, "maxItems": points}
            for shape, points in _POINTS.items()
            if shape is not LatencyShape.FIXED
        }
        distribution = {
            "type": "object",
            "minProperties": 1,
            "maxProperties": 1,
            "additionalProperties": False,
            "properties": {LatencyShape.FIXED.value: DURATION_SCHEMA, **distributions},
        }
        description = "A duration, or `{fixed: d}`, `{uniform: [low, high]}`, `{triangular: [low, mode, high]}`."
        return {"description": description, "anyOf": [DURATION_SCHEMA, distribution]}


_LATENCY = _LatencyType(
    LatencyKeys,
    "duration or distribution",
    "a duration or a distribution such as `{uniform: [200 ms, 1 s]}`",
    writer=_latency_data,
)
_PROBABILITY = ScalarType(
    "probability", "a probability", {"type": "number", "minimum": 0, "maximum": 1}, scalar_node, float
)


def _probability(outcome: Outcome) -> Any:  # noqa: ANN401 - a source of data
    return lambda outcomes: dict(outcomes).get(outcome)


class OutcomesKeys(Keys):
    """The probabilities of the outcomes of a request; they add up to 1."""

    succeed = Key(
        _PROBABILITY, "The probability of a reply that reports success.", source=_probability(Outcome.SUCCEED), shown=0
    )
    fail = Key(
        _PROBABILITY, "The probability of a reply that reports a failure.", source=_probability(Outcome.FAIL), shown=0
    )
    timeout = Key(_PROBABILITY, "The probability of no reply.", source=_probability(Outcome.TIMEOUT), shown=0)

    def outcomes(self) -> tuple[tuple[Outcome, Fraction], ...]:
        """Return the probabilities of the outcomes that are named."""
        outcomes: list[tuple[Outcome, Fraction]] = []
        sound = self.is_clear
        for outcome in Outcome:
            value = self.node.get(outcome.value)
            if value is None:
                continue
            if value.text is None or value.plain is None:
                sound = False
                continue
            probability = Fraction(value.text) if _NUMBER.fullmatch(value.text) else None
            if probability is None or probability > 1:
                message = f"`{value.text}` is not a probability"
                self.reader.add(Slug.NOT_A_DISTRIBUTION, message, value.place, "write a number from 0 to 1")
                sound = False
                continue
            outcomes.append((outcome, probability))
        total = sum(probability for _, probability in outcomes)
        if sound and total != 1:
            message = f"the probabilities add up to {float(total):g}, not to 1"
            self.reader.add(Slug.NOT_A_DISTRIBUTION, message, self.node.place)
        return tuple(outcomes)


class SimulationKeys(Keys):
    """How a simulated resource behaves."""

    latency = Key(_LATENCY, "The time from a request to its reply.", always_written=True, absent="`0 s`")
    outcomes = Key(
        MappingType(OutcomesKeys),
        "The probabilities of the outcomes of a request.",
        always_written=True,
        absent="`{succeed: 1}`",
    )
    measured = DefaultKey(
        NamesType(VALUES, "variable → `any` or a list of values"),
        "For variables under `measures`: the values that a successful reply draws from, each equally probable.",
        default=(),
    )

    def simulation(self, measures: tuple[str, ...]) -> Simulation:
        """Return the behavior of a resource that measures these variables."""
        return Simulation(
            _DEFAULT.latency if self.latency is None else self.latency.latency(),
            _DEFAULT.outcomes if self.outcomes is None else self.outcomes.outcomes(),
            tuple(self._measured(measures)),
        )

    def _measured(self, measures: tuple[str, ...]) -> list[tuple[str, tuple[Value, ...]]]:
        drawn: list[tuple[str, tuple[Value, ...]]] = []
        for entry in self.measured:
            variable = self.reader.scope.variables.get(entry.name)
            if entry.name not in measures:
                message = f"this resource does not measure `{entry.name}`"
                remedy = suggestion(entry.name, measures, "it measures")
                remedy = remedy or f"add `measures: [{entry.name}]` to the resource"
                self.reader.add(Slug.UNKNOWN_VARIABLE, message, entry.place, remedy)
            elif variable is not None:
                node = entry.value
                values = () if node is None else read_values(self.reader, node, variable.domain, entry.name)
                drawn.append((entry.name, values))
        return drawn


class ResourceKeys(Keys):
    """A resource that requests are sent to. It owns the variables `<name>_req_trigger` and `<name>_req_state`."""

    request = DefaultKey(
        VARIABLES, "The variables whose values a request carries.", default=(), always_written=True, absent="`[]`"
    )
    measures = DefaultKey(
        VARIABLES, "The variables whose values a reply may carry.", default=(), always_written=True, absent="`[]`"
    )
    simulation = Key(
        MappingType(SimulationKeys, "simulation"),
        "How the simulated resource behaves.",
        absent="success after `0 s`",
        always_written=True,
    )
    ros = Key(MappingType(RosKeys, "binding"), "How the real resource is reached.", source="binding")

    def resource(self, name: str) -> Resource:
        """Return the resource without its binding, which needs the actions of the whole model."""
        self._refuse_to_measure_requests()
        simulation = self.simulation
        measures = self.as_written(name).measures
        simulated = Simulation() if simulation is None else simulation.simulation(measures)
        return Resource(name, self.request, self.measures, simulated)

    def as_written(self, name: str) -> Resource:
        """Return a resource with all that its lists name, even if that is no variable: an error says so there."""
        request, measures = (self._listed(key) for key in ("request", "measures"))
        return Resource(name, request, measures)

    def _listed(self, key: str) -> tuple[str, ...]:
        node = self.node.get(key)
        return tuple(element.text for element in (node.elements if node else ()) if element.text is not None)

    def _refuse_to_measure_requests(self) -> None:
        """Note measured variables that follow requests: a measured value must not change a trigger or a state."""
        node = self.node.get("measures")
        for element in node.elements if node is not None else ():
            variable = self.reader.scope.variables.get(element.text or "")
            if variable is not None and variable.role is Role.RESOURCE:
                message = f"`{variable.name}` follows the requests of a resource, and cannot be measured"
                self.reader.add(Slug.NOT_ASSIGNABLE, message, element.place, "measure a variable of the model")
