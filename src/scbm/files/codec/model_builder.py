"""From the tree of a document to a behavior model, or to everything that is wrong with it.

Works on any tree, also on one whose shape is wrong: what is missing or of the wrong sort is passed over here, as
`shape` tells of it, so that one error never hides another.
"""

from __future__ import annotations

import re
from dataclasses import replace
from fractions import Fraction
from typing import TYPE_CHECKING

from scbm.files.codec.bindings.binding_builder import BindingBuilder
from scbm.files.codec.common_parts import NAME, Parts
from scbm.files.codec.model_keys import ModelFile, OperationFile, ResourceFile, VariableFile
from scbm.files.language.grammar import KEYWORDS
from scbm.files.language.scope import Scope, Where
from scbm.files.language.spelling import nearest, suggestion
from scbm.model import Place, Slug
from scbm.model.behavior import BehaviorModel
from scbm.model.operations import Operation, Transition
from scbm.model.resources import Latency, LatencyShape, Outcome, Resource, Simulation
from scbm.model.values import Domain, Value, format_value
from scbm.model.variables import NO_OPERATION, Role, Variable, resource_variables, runner_variables

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.codec.key_types import FileType
    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.text_files import ErrorCollector
    from scbm.model.operations import Action

MAX_VALUES = 65_536
"""So many values may a domain have."""

_RANGE = re.compile(r"(-?\d{1,18})\s*\.\.\s*(-?\d{1,18})", re.ASCII)
_NUMBER = re.compile(r"\+?(\d{1,18}(\.\d{0,18})?|\.\d{1,18})(e[-+]?\d{1,2})?", re.ASCII | re.IGNORECASE)
_ENDS = re.compile(r"(-?\d{1,18})\s*(?:\.+|-|:|,|to|…)\s*(-?\d{1,18})", re.ASCII)
"""Ranges as other languages write them."""

_DECLARING: dict[str, type[FileType]] = {
    "variables": VariableFile,
    "resources": ResourceFile,
    "operations": OperationFile,
}
"""The sections whose keys are names that expressions use."""

_POINTS = {LatencyShape.FIXED: 1, LatencyShape.UNIFORM: 2, LatencyShape.TRIANGULAR: 3}
_RESERVED_OPERATIONS = (NO_OPERATION, "current", "plan", "automatic")


class Builder:
    """Builds one model out of one document, noting every error in a report."""

    def __init__(self, document: YamlNode, report: ErrorCollector) -> None:
        self._document = document
        self._parts = Parts(report, Scope({}))

    @property
    def is_whole(self) -> bool:
        """Whether every text so far was resolved; if not, the report says why."""
        return self._parts.is_whole

    def model(self) -> BehaviorModel:
        """The model; only good if the report is empty afterwards."""
        variables = self._variables()
        self._parts.scope = Scope(self._all_names(variables), self._misses_names())
        self._refuse_ambiguous_symbols()
        resources = [self._resource(name, node) for name, node in self._named("resources")]
        operations = [self._operation(name, node) for name, node in self._named("operations")]
        automatic = [self._automatic(name, node) for name, node in self._named("automatic_transitions")]
        initial = self._parts.predicate(self._document.get("initial_states"), Where.WORLD)
        goals = [(name, self._parts.predicate(node, Where.WORLD)) for name, node in self._named("goals")]
        requirements = [self._parts.requirement(name, node) for name, node in self._named("requirements")]
        model = BehaviorModel(
            name=self._model_name(),
            variables=tuple(variable for variable in variables.values() if variable is not None),
            operations=tuple(operation for operation in operations if operation is not None),
            resources=tuple(resources),
            automatic_transitions=tuple(transition for transition in automatic if transition is not None),
            initial_states=initial,
            goals=tuple(goals),
            requirements=tuple(requirement for requirement in requirements if requirement is not None),
        )
        return self._bound(model)

    def _bound(self, model: BehaviorModel) -> BehaviorModel:
        """The model with the bindings of its resources. What they must know of its actions is known by now."""
        section = self._document.get("resources")
        if section is None or not any("ros" in node.items for node in section.items.values()):
            return model
        builder = BindingBuilder(self._parts, model)
        bindings = {
            name: builder.binding(_as_written(name, node), node.items["ros"], node.key_places["ros"])
            for name, node in section.items.items()
            if "ros" in node.items
        }
        resources = (replace(resource, binding=bindings.get(resource.name)) for resource in model.resources)
        return replace(model, resources=tuple(resources))

    # names

    def _model_name(self) -> str:
        node = self._document.get("behavior_model")
        if node is None or node.text is None or node.plain is None:
            return ""
        if not NAME.fullmatch(node.text):
            self._parts.refuse_name(node.text, node.place)
        return node.text

    def _named(self, section: str) -> Iterator[tuple[str, YamlNode]]:
        """The entries of a section whose keys are names; complains of names that are none."""
        mapping = self._document.get(section)
        if mapping is None:
            return
        for name, node in mapping.items.items():
            place = mapping.key_places[name]
            if not NAME.fullmatch(name):
                self._parts.refuse_name(name, place)
            elif name in KEYWORDS or (section == "operations" and name in _RESERVED_OPERATIONS):
                self._parts.add(Slug.RESERVED_NAME, f"`{name}` has a meaning of its own", place, "choose another name")
            yield name, node

    def _all_names(self, declared: dict[str, Variable | None]) -> dict[str, Variable | None]:
        """All variables: those declared, then what resources and operations bring; complains of duplicates."""
        names: dict[str, Variable | None] = dict(declared)
        owners = dict.fromkeys(declared, "declared in `variables`")
        for variable, owner, place in self._brought():
            if owners.get(variable.name) == owner:  # of an operation whose name is reserved, and told of
                continue
            if variable.name in names:
                message = f"`{variable.name}` is {owner}, and also {owners[variable.name]}"
                declared_place = self._key_places("variables").get(variable.name, place)
                self._parts.add(Slug.DUPLICATE_NAME, message, declared_place, "choose another name")
            else:
                names[variable.name] = variable
                owners[variable.name] = owner
        return names

    def _brought(self) -> Iterator[tuple[Variable, str, Place]]:
        """The variables that nobody declares: each with who it belongs to, and where that is named."""
        for resource, place in self._key_places("resources").items():
            for variable in resource_variables(resource):
                yield variable, f"owned by the resource `{resource}`", place
        places = self._key_places("operations")
        for variable in runner_variables(places):
            operation = variable.name.removesuffix(".state")
            yield variable, "kept by the runner", places.get(operation, self._document.place)

    def _misses_names(self) -> bool:
        """Whether something declares names that cannot be read as it is meant; its own error tells of it."""
        if self._document.incomplete or not self._document.items.keys() <= ModelFile.model_fields.keys():
            return True
        return any(self._is_unclear(section) for section in _DECLARING)

    def _is_unclear(self, section: str) -> bool:
        node = self._document.get(section)
        if node is None:
            return ModelFile.model_fields[section].is_required()
        others = {key for kind in _DECLARING.values() for key in kind.model_fields} - {
            *_DECLARING[section].model_fields
        }
        return (
            node.incomplete
            or not isinstance(node.plain, dict)
            or not all(NAME.fullmatch(name) for name in node.items)
            or any(not others.isdisjoint(entry.items) for entry in node.items.values())
        )

    def _refuse_ambiguous_symbols(self) -> None:
        """A name is either a variable or a value, wherever it stands."""
        section = self._document.get("variables")
        for name, node in section.items.items() if section is not None else ():
            domain = node.get("domain")
            for element in domain.elements if domain is not None else ():
                if self._parts.scope.variables.get(element.text or "") is not None:
                    message = f"the value `{element.text}` of `{name}` is also the name of a variable"
                    self._parts.add(Slug.AMBIGUOUS_SYMBOL, message, element.place, "rename one of them")
        values = {value: variable.name for variable, _, _ in self._brought() for value in variable.domain.values}
        places = {variable.name: place for variable, _, place in self._brought()}
        places |= self._key_places("operations") | self._key_places("variables")
        for name in self._parts.scope.variables:
            if name in values:
                message = f"the variable `{name}` has the name of a value of `{values[name]}`"
                self._parts.add(Slug.AMBIGUOUS_SYMBOL, message, places[name], "choose another name")

    def _key_places(self, section: str) -> dict[str, Place]:
        """Where each entry of a section is named."""
        mapping = self._document.get(section)
        return mapping.key_places if mapping is not None else {}

    # variables

    def _variables(self) -> dict[str, Variable | None]:
        return {name: self._variable(name, node) for name, node in self._named("variables")}

    def _variable(self, name: str, node: YamlNode) -> Variable | None:
        domain = self._domain(node.get("domain"))
        if domain is None:
            return None
        initial = self._parts.value(node.get("initial"), domain, name, domain.values)
        random = self._values(node.get("random"), domain, name)
        if initial is None:
            return Variable(name, domain, domain.values[0], (domain.values[0],))
        return Variable(name, domain, initial, random or (initial,))

    def _domain(self, node: YamlNode | None) -> Domain | None:
        if node is None:
            return None
        if isinstance(node.plain, list):
            return self._symbols(node)
        if node.text is None:
            return None
        if node.text == "bool":
            return Domain.boolean()
        match = _RANGE.fullmatch(node.text)
        if match is not None:
            return self._range(int(match[1]), int(match[2]), node)
        if node.plain is not None:
            self._parts.add(Slug.BAD_DOMAIN, f"`{node.text}` is not a domain", node.place, _domain_remedy(node.text))
        return None

    def _range(self, low: int, high: int, node: YamlNode) -> Domain | None:
        if low > high:
            message = f"no integer lies in {low}..{high}"
            self._parts.add(Slug.EMPTY_DOMAIN, message, node.place, f"write `{high}..{low}`")
            return None
        if high - low >= MAX_VALUES:
            message = f"a domain can have {MAX_VALUES} values, and this has {high - low + 1}"
            self._parts.add(Slug.DOMAIN_TOO_LARGE, message, node.place)
            return None
        return Domain.integers(low, high)

    def _symbols(self, node: YamlNode) -> Domain | None:
        if not node.elements:
            self._parts.add(Slug.EMPTY_DOMAIN, "a domain needs at least one value", node.place)
            return None
        if len(node.elements) > MAX_VALUES:
            message = f"a domain can have {MAX_VALUES} values, and this has {len(node.elements)}"
            self._parts.add(Slug.DOMAIN_TOO_LARGE, message, node.place)
            return None
        if self._refuse_list_of_others(node):
            return None
        symbols: dict[str, None] = {}
        sound = True
        for element in node.elements:
            if not self._is_symbol(element):
                sound = False
            elif element.text in symbols:
                self._parts.add(Slug.DUPLICATE_VALUE, f"`{element.text}` stands here twice", element.place)
            elif element.text is not None:
                symbols[element.text] = None
        return Domain(tuple(symbols)) if sound else None

    def _refuse_list_of_others(self, node: YamlNode) -> bool:
        """A list of integers or truth values is one mistake, not as many as it has elements."""
        values = [element.plain for element in node.elements]
        if all(isinstance(value, bool) for value in values):
            self._parts.add(Slug.BAD_DOMAIN, "a list of truth values is not a domain", node.place, "write `bool`")
            return True
        numbers = [value for value in values if isinstance(value, int) and not isinstance(value, bool)]
        if len(numbers) < len(values):
            return False
        remedy = f"write a range: `{min(numbers)}..{max(numbers)}`"
        self._parts.add(Slug.BAD_DOMAIN, "a list of numbers is not a domain", node.place, remedy)
        return True

    def _is_symbol(self, element: YamlNode) -> bool:
        """Whether an element of a domain is a symbol; complains if it is another scalar."""
        text = element.text
        if text is None or element.plain is None:
            return False
        if text in KEYWORDS:
            self._parts.add(
                Slug.RESERVED_NAME, f"`{text}` has a meaning of its own", element.place, "choose another word"
            )
        elif not isinstance(element.plain, str) or not NAME.fullmatch(text):
            remedy = "a symbol is a word of letters, digits and `_`, such as `box_a`"
            self._parts.add(Slug.BAD_DOMAIN, f"`{text}` is not a symbol", element.place, remedy)
        else:
            return True
        return False

    def _values(self, node: YamlNode | None, domain: Domain, name: str) -> tuple[Value, ...]:
        """The values of a domain that `any` or a list say; empty if nothing is said."""
        if node is None:
            return ()
        if not isinstance(node.plain, list):
            if node.text == "any":
                return domain.values
            if node.text is not None and node.plain is not None:
                message = f"expected `any` or a list of values, found `{node.text}`"
                is_value = node.text in map(format_value, domain.values)
                self._parts.add(
                    Slug.WRONG_SHAPE, message, node.place, f"write `[{node.text}]`" if is_value else "write `any`"
                )
            return ()
        if not node.elements:
            self._parts.add(Slug.EMPTY_DOMAIN, "a list of values needs at least one", node.place)
        values: dict[Value, None] = {}
        all_values = frozenset(domain.values)
        for element in node.elements:
            value = self._parts.value(element, domain, name, all_values)
            if value is not None and value in values:
                self._parts.add(Slug.DUPLICATE_VALUE, f"`{element.text}` stands here twice", element.place)
            elif value is not None:
                values[value] = None
        return tuple(values)

    # resources

    def _resource(self, name: str, node: YamlNode) -> Resource:
        request = self._parts.declared_names(node.get("request"))
        measures_node = node.get("measures")
        measures = self._parts.declared_names(measures_node)
        self._refuse_to_measure_requests(measures_node)
        written = _as_written(name, node).measures
        return Resource(name, request, measures, self._simulation(node.get("simulation"), written))

    def _refuse_to_measure_requests(self, node: YamlNode | None) -> None:
        """A measured value must not change a trigger or the state of a request."""
        for element in node.elements if node is not None else ():
            variable = self._parts.scope.variables.get(element.text or "")
            if variable is not None and variable.role is Role.RESOURCE:
                message = f"`{variable.name}` follows the requests of a resource, and cannot be measured"
                self._parts.add(Slug.NOT_ASSIGNABLE, message, element.place, "measure a variable of the model")

    def _simulation(self, node: YamlNode | None, measures: tuple[str, ...]) -> Simulation:
        if node is None:
            return Simulation()
        default = Simulation()
        latency = node.get("latency")
        outcomes = node.get("outcomes")
        return Simulation(
            default.latency if latency is None else self._latency(latency),
            default.outcomes if outcomes is None else self._outcomes(outcomes),
            self._measured(node.get("measured"), measures),
        )

    def _measured(self, node: YamlNode | None, measures: tuple[str, ...]) -> tuple[tuple[str, tuple[Value, ...]], ...]:
        drawn: list[tuple[str, tuple[Value, ...]]] = []
        for name, values in node.items.items() if node is not None else ():
            variable = self._parts.scope.variables.get(name)
            if name not in measures:
                assert node is not None  # noqa: S101 - its items are gone through
                message = f"this resource does not measure `{name}`"
                remedy = suggestion(name, measures, "it measures") or f"add `measures: [{name}]` to the resource"
                self._parts.add(Slug.UNKNOWN_VARIABLE, message, node.key_places[name], remedy)
            elif variable is not None:
                drawn.append((name, self._values(values, variable.domain, name)))
        return tuple(drawn)

    def _latency(self, node: YamlNode) -> Latency:
        default = Simulation().latency
        if not isinstance(node.plain, dict):
            value_ns = self._parts.duration(node)
            return default if value_ns is None else Latency(LatencyShape.FIXED, (value_ns,))
        if len(node.items) != 1:
            found = "here are several" if node.items else "here is none"
            remedy = f"write one of {', '.join(f'`{shape}`' for shape in LatencyShape)}"
            self._parts.add(Slug.BAD_LATENCY, f"a latency has one distribution, and {found}", node.place, remedy)
            return default
        key, points = next(iter(node.items.items()))
        return self._distribution(LatencyShape(key), points) or default if key in tuple(LatencyShape) else default

    def _distribution(self, shape: LatencyShape, points: YamlNode) -> Latency | None:
        if isinstance(points.plain, list) is (shape is LatencyShape.FIXED):
            return None
        nodes = [points] if shape is LatencyShape.FIXED else points.elements
        points_ns = [point_ns for node in nodes if (point_ns := self._parts.duration(node)) is not None]
        wanted = _POINTS[shape]
        if len(nodes) != wanted:
            message = f"`{shape}` takes {wanted} durations, and this is a list of {len(nodes)}"
            self._parts.add(Slug.BAD_LATENCY, message, points.place)
        elif len(points_ns) == wanted and points_ns != sorted(points_ns):
            message = f"the durations of `{shape}` must not fall"
            remedy = "write the shortest first"
            self._parts.add(Slug.BAD_LATENCY, message, points.place, remedy)
        return Latency(shape, tuple(points_ns)) if len(points_ns) == wanted else None

    def _outcomes(self, node: YamlNode) -> tuple[tuple[Outcome, Fraction], ...]:
        outcomes: list[tuple[Outcome, Fraction]] = []
        sound = isinstance(node.plain, dict) and not node.incomplete
        for key, value in node.items.items():
            if key not in tuple(Outcome) or value.text is None or value.plain is None:
                sound = False
                continue
            probability = Fraction(value.text) if _NUMBER.fullmatch(value.text) else None
            if probability is None or probability > 1:
                message = f"`{value.text}` is not a probability"
                self._parts.add(Slug.NOT_A_DISTRIBUTION, message, value.place, "write a number from 0 to 1")
                sound = False
                continue
            outcomes.append((Outcome(key), probability))
        total = sum(probability for _, probability in outcomes)
        if sound and total != 1:
            message = f"the probabilities add up to {float(total):g}, not to 1"
            self._parts.add(Slug.NOT_A_DISTRIBUTION, message, node.place)
        order = list(Outcome)
        return tuple(sorted(outcomes, key=lambda pair: order.index(pair[0])))

    # operations and transitions

    def _operation(self, name: str, node: YamlNode) -> Operation | None:
        pre = self._transition(node.get("pre"), f"start_{name}", Where.PLANNED, Where.RUNNING)
        post = self._transition(node.get("post"), f"complete_{name}", Where.PLANNED, Where.RUNNING)
        failed_node = node.get("failed")
        failed = self._transition(failed_node, f"fail_{name}", Where.RUNNING, Where.RUNNING)
        timedout = node.get("timedout")
        actions = self._actions((timedout,), (Where.RUNNING,))[0]
        deadline_ns = self._parts.duration(node.get("deadline"))
        disabled_deadline_ns = self._parts.duration(node.get("disabled_deadline"))
        if timedout is not None and timedout.elements and nearest("deadline", node.items) is None:
            message = f"`{name}` has no deadline, so it never times out"
            place = node.key_places["timedout"]
            self._parts.add(Slug.MISSING_KEY, message, place, "add `deadline: 10 s`, or leave out `timedout`")
        if pre is None or post is None:
            return None
        return Operation(name, pre, post, deadline_ns, failed, actions, disabled_deadline_ns)

    def _automatic(self, name: str, node: YamlNode) -> Transition | None:
        transition = self._transition(node, name, Where.AUTOMATIC, Where.AUTOMATIC)
        written = [part for key in ("a", "ar") if (part := node.get(key)) is not None and part.plain != []]
        if node.items and not written and not node.incomplete:
            place = self._document.items["automatic_transitions"].key_places[name]
            message = f"`{name}` has no actions, so it could never be taken"
            self._parts.add(Slug.AUTOMATIC_DOES_NOTHING, message, place, "add `a: [...]`")
        return transition

    def _transition(self, node: YamlNode | None, name: str, a_where: Where, ar_where: Where) -> Transition | None:
        if node is None:
            return None
        label = node.get("name")
        if label is not None and label.text is not None and label.plain is not None:
            name = label.text
            if not NAME.fullmatch(name):
                self._parts.refuse_name(name, label.place)
        g = self._parts.predicate(node.get("g"), Where.GUARD)
        gr = self._parts.predicate(node.get("gr"), Where.GUARD)
        a, ar = self._actions((node.get("a"), node.get("ar")), (a_where, ar_where))
        return Transition(name, g, gr, a, ar)

    def _actions(self, nodes: tuple[YamlNode | None, ...], wheres: tuple[Where, ...]) -> tuple[tuple[Action, ...], ...]:
        """The actions of one transition, list by list; complains of two assignments to one variable."""
        lists: list[tuple[Action, ...]] = []
        assigned: dict[str, str] = {}
        for node, where in zip(nodes, wheres, strict=True):
            actions: list[Action] = []
            for element in node.elements if node is not None else ():
                if element.scalar is None or element.plain is None:
                    continue
                action = self._parts.resolver(element.scalar, where).read_action(element.scalar.text)
                if action is None:
                    self._parts.is_whole = False
                    continue
                target = self._parts.alias(action.target)
                if target in assigned:
                    message = f"`{action.target}` is assigned twice; the actions of a transition happen at once"
                    remedy = f"the other is `{assigned[target]}`"
                    self._parts.add(Slug.ASSIGNED_TWICE, message, element.place, remedy)
                assigned.setdefault(target, str(action))
                actions.append(action)
            lists.append(tuple(actions))
        return tuple(lists)


def _as_written(name: str, node: YamlNode) -> Resource:
    """A resource with all that its lists name, also what is no variable: that is told of once, and where it stands."""
    written = []
    for key in ("request", "measures"):
        elements = listed.elements if (listed := node.get(key)) is not None else []
        written.append(tuple(element.text for element in elements if element.text is not None))
    return Resource(name, written[0], written[1])


def _domain_remedy(written: str) -> str:
    if nearest(written, ["bool", "boolean"]):
        return "write `bool`"
    ends = _ENDS.fullmatch(written)
    return f"write `{ends[1]}..{ends[2]}`" if ends else "write `bool`, `[a, b, c]` or `0..5`"
