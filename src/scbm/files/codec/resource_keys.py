"""The keys of a resource in a model file, and how the resource behaves when it is simulated.

Distributions of times are those of latencies, and of the rates of environment transitions.
"""

from __future__ import annotations

import re
from fractions import Fraction
from typing import TYPE_CHECKING, Any, NamedTuple

from scbm.files.codec.key_types import (
    DURATION,
    DURATION_SCHEMA,
    VARIABLES,
    MappingType,
    NamedMappingType,
    NamesType,
    ScalarListType,
    ScalarOrMappingType,
    ScalarType,
)
from scbm.files.codec.keys import DefaultKey, Key, Keys, KeyType
from scbm.files.codec.lifted.object_keys import where_key
from scbm.files.codec.variable_keys import VALUES, read_values
from scbm.files.expansion.expanded_nodes import text_node
from scbm.files.spelling import suggestion
from scbm.files.yaml.yaml_writer import FlowMapping
from scbm.model import Slug
from scbm.model.durations import format_duration
from scbm.model.resources import DrawnVariable, Latency, LatencyShape, Outcome, Resource, Simulation
from scbm.model.values import format_value
from scbm.model.variables import Role

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from scbm.files.codec.keys import Data, Definitions, ShapeCheck, Spot
    from scbm.files.codec.value_reader import Entry, ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model import Place
    from scbm.model.values import Value
    from scbm.model.variables import Variable

_NUMBER = re.compile(r"\+?(\d{1,18}(\.\d{0,18})?|\.\d{1,18})(e[-+]?\d{1,2})?", re.ASCII | re.IGNORECASE)
_POINTS = {LatencyShape.FIXED: 1, LatencyShape.EXPONENTIAL: 1, LatencyShape.UNIFORM: 2, LatencyShape.TRIANGULAR: 3}
_DEFAULT = Simulation()


# latencies


def _read_fixed(reader: ValueReader, node: YamlNode, text: str) -> tuple[int, ...] | None:
    latency_ns = reader.duration(node, text)
    return None if latency_ns is None else (latency_ns,)


def _points_type(shape: LatencyShape) -> ScalarListType[tuple[int, ...]]:
    """Return the type of the parameters of a distribution."""
    count = _POINTS[shape]

    def read(reader: ValueReader, node: YamlNode) -> tuple[int, ...] | None:
        points_ns = [ns for element in node.elements if (ns := DURATION.read(element, reader)) is not None]
        if len(node.elements) != count:
            message = f"`{shape}` takes {count} durations, and this is a list of {len(node.elements)}"
            reader.add(Slug.BAD_LATENCY, message, node.place)
        elif len(points_ns) == count and points_ns != sorted(points_ns):
            message = f"the durations of `{shape}` must not fall"
            reader.add(Slug.BAD_LATENCY, message, node.place, "write the shortest first")
        return tuple(points_ns) if len(points_ns) == count else None

    schema = {"type": "array", "items": DURATION_SCHEMA, "minItems": count, "maxItems": count}
    element, words = "a duration such as `10 s`", f"list of {count} durations"
    return ScalarListType(words, "a list of durations", schema, element, read, lambda ns: [*map(format_duration, ns)])


def _points_of(shape: LatencyShape) -> Callable[[Latency], object]:
    """Return the source of the parameters of a distribution; other distributions have none of these."""
    return lambda latency: latency.points_ns if latency.shape is shape else None


class LatencyKeys(Keys):
    """A distribution of latencies."""

    fixed = Key(
        ScalarType(
            "duration", "a duration such as `10 s`", DURATION_SCHEMA, _read_fixed, lambda ns: format_duration(ns[0])
        ),
        "Always this latency.",
        source=_points_of(LatencyShape.FIXED),
    )
    uniform = Key(
        _points_type(LatencyShape.UNIFORM),
        "`[lowest, highest]`: any latency between these two, each equally probable.",
        source=_points_of(LatencyShape.UNIFORM),
    )
    triangular = Key(
        _points_type(LatencyShape.TRIANGULAR),
        "`[lowest, most probable, highest]`: a triangular distribution.",
        source=_points_of(LatencyShape.TRIANGULAR),
    )
    exponential = Key(
        ScalarType(
            "duration", "a duration such as `10 s`", DURATION_SCHEMA, _read_fixed, lambda ns: format_duration(ns[0])
        ),
        "An exponential distribution with this mean: of independent events, the time until the next one.",
        source=_points_of(LatencyShape.EXPONENTIAL),
    )

    @classmethod
    def schema(cls, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema of the mapping, which has one key."""
        return {**super().schema(definitions), "minProperties": 1, "maxProperties": 1}

    def latency(self) -> Latency:
        """Return the distribution; the default if it is wrong."""
        return self.distribution() or _DEFAULT.latency

    def distribution(self) -> Latency | None:
        """Return the distribution; `None` if it is wrong."""
        node = self.node
        if not isinstance(node.plain, dict):
            fixed_ns = DURATION.read(node, self.reader)
            return None if fixed_ns is None else Latency(LatencyShape.FIXED, (fixed_ns,))
        if len(node.items) != 1:
            found = "here are several" if node.items else "here is none"
            remedy = f"write one of {', '.join(f'`{shape}`' for shape in LatencyShape)}"
            self.reader.add(Slug.BAD_LATENCY, f"a latency has one distribution, and {found}", node.place, remedy)
            return None
        points_ns = zip(LatencyShape, (self.fixed, self.uniform, self.triangular, self.exponential), strict=True)
        return next((Latency(shape, ns) for shape, ns in points_ns if ns is not None), None)


LATENCY = ScalarOrMappingType(
    LatencyKeys,
    "duration or distribution",
    "a duration or a distribution such as `{uniform: [200 ms, 1 s]}`",
    DURATION_SCHEMA,
)


# outcomes


def _read_probability(reader: ValueReader, node: YamlNode, text: str) -> Fraction | None:
    probability = Fraction(text) if _NUMBER.fullmatch(text) else None
    if probability is not None and probability <= 1:
        return probability
    reader.add(Slug.NOT_A_DISTRIBUTION, f"`{text}` is not a probability", node.place, "write a number from 0 to 1")
    return None


_PROBABILITY = ScalarType(
    "probability", "a probability", {"type": "number", "minimum": 0, "maximum": 1}, _read_probability, float
)


def _probability(outcome: Outcome) -> Callable[[tuple[tuple[Outcome, Fraction], ...]], object]:
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
        named = zip(Outcome, (self.succeed, self.fail, self.timeout), strict=True)
        outcomes = tuple((outcome, probability) for outcome, probability in named if probability is not None)
        total = sum(probability for _, probability in outcomes)
        if self.is_clear and len(outcomes) == len(self.node.items) and total != 1:
            message = f"the probabilities add up to {float(total):g}, not to 1"
            self.reader.add(Slug.NOT_A_DISTRIBUTION, message, self.node.place)
        return outcomes


# variables with values


def _read_weight(reader: ValueReader, node: YamlNode, text: str) -> Fraction | None:
    if _NUMBER.fullmatch(text):
        return Fraction(text)
    remedy = "write a finite number from 0 on, such as `0.8`"
    reader.add(Slug.NOT_A_DISTRIBUTION, f"`{text}` is not a weight", node.place, remedy)
    return None


def _weight_data(weight: Fraction) -> int | float:
    return int(weight) if weight.denominator == 1 else float(weight)


_WEIGHTS = NamesType(
    ScalarType("weight", "a weight", {"type": "number", "minimum": 0}, _read_weight, _weight_data), "value → weight"
)


class DrawnType(KeyType["YamlNode | None"], frozen=True):
    """The values of a variable that replies draw from, or a mapping from values to weights."""

    words = "`any`, a list of values, or value → weight"

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Check the values or the weights."""
        (_WEIGHTS if isinstance(spot.node.plain, dict) else VALUES).check(spot, check)

    def read(self, node: YamlNode, reader: ValueReader) -> YamlNode | None:
        """Return the node: what it means depends on the variable."""
        return node if isinstance(node.plain, dict) else VALUES.read(node, reader)

    def write(self, value: object) -> Data:
        """Return the list or the mapping."""
        drawn: Any = value
        pairs = zip(drawn.values, drawn.weights, strict=True) if drawn.weights else ()
        return FlowMapping(_WEIGHTS.write(pairs)) if drawn.weights else list(drawn.values)

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the schema of both."""
        return {"anyOf": [VALUES.schema(definitions), {**_WEIGHTS.schema(definitions), "minProperties": 1}]}


DRAWN = NamesType(DrawnType(), f"variable → {DrawnType.words}")


class SentVariables(NamedTuple):
    """The variables that a resource sends, under one key.

    Attributes:
        names: the variables.
        values: for some of them the only values that it sends, as they are listed.
    """

    names: tuple[str, ...]
    values: tuple[tuple[str, tuple[Value, ...]], ...] = ()

    @property
    def data(self) -> Data:
        """The list of the variables, or a mapping to values if there are some."""
        known = dict(self.values)
        return {name: list(known.get(name, ())) or "any" for name in self.names} if known else list(self.names)


class SentType(KeyType[SentVariables | None], frozen=True):
    """A list of variables, or a mapping from variables to the values that a resource sends."""

    words = "list of variables, or variable → `any` or a list of values"
    _list = VARIABLES
    _mapping = NamesType(VALUES, "variable → `any` or a list of values", lambda _: True)

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Check the list or the mapping."""
        (self._mapping if isinstance(spot.node.plain, dict) else self._list).check(spot, check)

    def read(self, node: YamlNode, reader: ValueReader) -> SentVariables | None:
        """Return the variables with their values."""
        if not isinstance(node.plain, dict):
            names = self._list.read(node, reader)
            return None if names is None else SentVariables(names)
        entries = [entry for entry in self._mapping.read(node, reader) if reader.is_of_world(entry.name, entry.place)]
        values = []
        for entry in entries:
            variable = reader.scope.variables.get(entry.name)
            if entry.value is not None and entry.value.text != "any" and variable is not None:
                known = read_values(reader, entry.value, variable.domain, entry.name)
                values += [(entry.name, known)] if known else []
        return SentVariables(tuple(entry.name for entry in entries), tuple(values))

    def write(self, value: object) -> Data:
        """Return the list or the mapping."""
        sent: Any = value
        return self._mapping.write(sent.data) if isinstance(sent.data, dict) else self._list.write(sent.data)

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the schema of both."""
        return {"anyOf": [self._list.schema(definitions), self._mapping.schema(definitions)]}


def _sent(key: str) -> Callable[[Resource], SentVariables]:
    """Return the source of the variables under a key."""

    def source(resource: Resource) -> SentVariables:
        names: tuple[str, ...] = getattr(resource, key)
        return SentVariables(names, tuple((name, values) for name, values in resource.values if name in names))

    return source


def _flag(key: str) -> ScalarType[bool]:
    """Return the type of a key that is true or false."""

    def read(reader: ValueReader, node: YamlNode, text: str) -> bool:
        if not isinstance(node.plain, bool):
            reader.add(Slug.WRONG_TYPE, f"`{key}` must be true or false, not `{text}`", node.place)
        return node.plain is True

    return ScalarType("`true` or `false`", "`true` or `false`", {"type": "boolean"}, read)


# the resource


class SimulationKeys(Keys):
    """How a simulated resource behaves."""

    latency = Key(LATENCY, "The time from a request to its reply.", always_written=True, absent="`0 s`")
    outcomes = Key(
        MappingType(OutcomesKeys),
        "The probabilities of the outcomes of a request.",
        always_written=True,
        absent="`{succeed: 1}`",
    )
    measured = DefaultKey(
        DRAWN,
        "For variables under `measures`: the values that successful replies draw from. Without weights, all "
        "are equally likely.",
        default=(),
        absent="the values listed under `measures`",
        source=lambda simulation: {drawn.name: drawn for drawn in simulation.measured},
    )
    failed = DefaultKey(
        DRAWN,
        "The same for failed replies, such as the cause of the failure. Successful replies do not carry such a "
        "variable, unless it stands under `measured`, too.",
        default=(),
        absent="nothing",
        source=lambda simulation: {drawn.name: drawn for drawn in simulation.failed},
    )

    def simulation(self, measures: tuple[str, ...], sent: SentVariables) -> Simulation:
        """Return the behavior of a resource that measures these variables, and sends these values."""
        return Simulation(
            _DEFAULT.latency if self.latency is None else self.latency.latency(),
            _DEFAULT.outcomes if self.outcomes is None else self.outcomes.outcomes(),
            *(tuple(self._drawn(entries, measures, dict(sent.values))) for entries in (self.measured, self.failed)),
        )

    def _drawn(
        self,
        entries: tuple[Entry[YamlNode | None], ...],
        measures: tuple[str, ...],
        sent: dict[str, tuple[Value, ...]],
    ) -> Iterator[DrawnVariable]:
        """Yield what replies with one outcome measure."""
        for entry in entries:
            variable = self.reader.scope.variables.get(entry.name)
            if entry.name not in measures:
                message = f"this resource does not measure `{entry.name}`"
                remedy = suggestion(entry.name, measures, "it measures")
                remedy = remedy or f"add `measures: [{entry.name}]` to the resource"
                self.reader.add(Slug.UNKNOWN_VARIABLE, message, entry.place, remedy)
            elif variable is not None and entry.value is not None:
                values, weights = self._values(entry.value, variable)
                yield DrawnVariable(entry.name, self._refuse_unsent(entry, values, sent.get(entry.name)), weights)

    def _values(self, node: YamlNode, variable: Variable) -> tuple[tuple[Value, ...], tuple[Fraction, ...]]:
        """Return the values that a list, `any` or a mapping names, with their weights if there are some."""
        if not isinstance(node.plain, dict):
            return read_values(self.reader, node, variable.domain, variable.name), ()
        read: list[tuple[Value, Fraction]] = []
        entries = _WEIGHTS.read(node, self.reader)
        for entry in entries:
            key = text_node(entry.name, entry.place, entry.node.end)
            key.plain = entry.name if key.plain is None else key.plain
            value = self.reader.value(key, variable.domain, variable.name, variable.domain.values)
            if value is not None and value in dict(read):
                self.reader.add(Slug.DUPLICATE_VALUE, f"`{format_value(value)}` has two weights", entry.place)
            elif value is not None and entry.value is not None:
                read.append((value, entry.value))
        if not entries and not node.incomplete:
            self.reader.add(Slug.EMPTY_DOMAIN, "a mapping of weights needs at least one value", node.place)
        elif len(read) == len(entries) and not any(weight for _, weight in read):
            message = f"the weights of `{variable.name}` are all 0, so no value could be drawn"
            self.reader.add(Slug.NOT_A_DISTRIBUTION, message, node.place, "give at least one value a weight above 0")
            read.clear()
        return tuple(value for value, _ in read), tuple(weight for _, weight in read)

    def _refuse_unsent(
        self, entry: Entry[YamlNode | None], values: tuple[Value, ...], sent: tuple[Value, ...] | None
    ) -> tuple[Value, ...]:
        """Return drawn values, of which `any` means those that are sent; note one that is never sent."""
        if sent is None:
            return values
        if entry.node.text == "any":
            return sent
        for value in (value for value in values if value not in sent):
            message = f"the resource never sends {format_value(value)} for `{entry.name}`"
            remedy = f"it sends {', '.join(map(format_value, sent))}"
            self.reader.add(Slug.VALUE_OUTSIDE_DOMAIN, message, entry.node.place, remedy)
        return values


class ResourceKeys(Keys):
    """A resource that requests are sent to. It owns the variables `<name>_req_trigger` and `<name>_req_state`."""

    request = DefaultKey(
        VARIABLES, "The variables whose values a request carries.", default=(), always_written=True, absent="`[]`"
    )
    measures = DefaultKey(
        SentType(),
        "The variables whose values a reply may carry. A list behind a variable holds the only values that are sent; "
        "others are refused. Simulated replies draw from it; a plain one measures the first.",
        default=SentVariables(()),
        always_written=True,
        absent="`[]`",
        source=_sent("measures"),
    )
    publishes = DefaultKey(
        SentType(),
        "The variables whose values the resource may send without a request, at any settled moment; as for `measures`.",
        default=SentVariables(()),
        absent="`[]`",
        source=_sent("publishes"),
    )
    shared = DefaultKey(
        _flag("shared"),
        "Whether another user can occupy the resource while no request to it is in flight.",
        default=False,
    )
    parallel = DefaultKey(
        _flag("parallel"),
        "Whether the device may work at several requests at once, so that this is no hazard.",
        default=False,
    )
    simulation = Key(
        MappingType(SimulationKeys, "simulation"),
        "How the simulated resource behaves.",
        absent="success after `0 s`",
        always_written=True,
    )
    ros = Key(
        NamedMappingType("scbm.nodes.bindings.binding_keys:RosKeys", "binding"),
        "How the real resource is reached.",
        source=lambda resource: None if resource.binding is None else resource.binding.written,
    )
    where = where_key()

    def resource(self, name: str) -> Resource:
        """Return the resource without its binding, which needs the actions of the whole model."""
        self._refuse_requests_in("measures", "measured")
        self._refuse_requests_in("publishes", "published")
        simulation = self.simulation
        written = self.as_written(name).measures
        measures, publishes = self.measures, self.publishes
        self._refuse_different_values(dict(measures.values), dict(publishes.values))
        simulated = Simulation() if simulation is None else simulation.simulation(written, measures)
        published = [(name, values) for name, values in publishes.values if name not in measures.names]
        return Resource(
            name,
            self.request,
            measures.names,
            simulated,
            publishes=publishes.names,
            values=tuple(sorted((*published, *measures.values))),
            shared=self.shared,
            lifted=self.node.origin,
            parallel=self.parallel,
        )

    def _refuse_different_values(
        self, measured: dict[str, tuple[Value, ...]], published: dict[str, tuple[Value, ...]]
    ) -> None:
        """Note a variable that has other values under `publishes` than under `measures`."""
        both = [name for name in self.publishes.names if name in self.measures.names]
        for name in both:
            variable = self.reader.scope.variables.get(name)
            every = () if variable is None else variable.domain.values
            if {*measured.get(name, every)} == {*published.get(name, every)}:
                continue
            message = f"`{name}` has other values under `publishes` than under `measures`"
            self.reader.add(Slug.CONTRADICTION, message, self.place("publishes"), "list the same values")

    def as_written(self, name: str) -> Resource:
        """Return a resource with all that its lists name, even if that is no variable: an error says so there."""
        request, measures, publishes = (self._listed(key) for key in ("request", "measures", "publishes"))
        return Resource(name, request, measures, publishes=publishes)

    def _listed(self, key: str) -> tuple[str, ...]:
        return tuple(name for name, _ in self._names_under(key))

    def _names_under(self, key: str) -> Iterator[tuple[str, Place]]:
        """Yield the names in the list or the mapping under a key, each with its place."""
        node = self.node.get(key)
        if node is None:
            return
        yield from node.key_places.items()
        yield from ((element.text, element.place) for element in node.elements if element.text is not None)

    def _refuse_requests_in(self, key: str, words: str) -> None:
        """Note listed variables that follow requests: a value from outside must not change a trigger or a state."""
        for name, place in self._names_under(key):
            variable = self.reader.scope.variables.get(name)
            if variable is not None and variable.role is Role.RESOURCE:
                message = f"`{variable.name}` follows the requests of a resource, and cannot be {words}"
                self.reader.add(Slug.NOT_ASSIGNABLE, message, place, "name a variable of the model")
