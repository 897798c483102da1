"""The keys of a binding under `ros` of a resource, and of a file of bindings."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, TypeAlias

from scbm.files.codec.key_types import INTERFACES, NAME_NODE, MappingType, NamesType
from scbm.files.codec.keys import Key, Keys
from scbm.files.spelling import suggestion
from scbm.files.yaml.yaml_writer import Quoted
from scbm.model import Binding, Slug
from scbm.model.operations import Assign
from scbm.model.predicates import Constant
from scbm.model.sources import inputs, moved, published_by
from scbm.model.values import format_value
from scbm.nodes.bindings.action_keys import ActionKeys
from scbm.nodes.bindings.field_values import is_carried, listed_values, read_variable_value
from scbm.nodes.bindings.reading_keys import MeasuredTopicKeys
from scbm.nodes.bindings.ros_binding import (
    ActionCall,
    CallChoice,
    MeasuredTopic,
    RequestBinding,
    RosBinding,
    ServiceCall,
    TopicPair,
)
from scbm.nodes.bindings.ros_names import ROS_NAME, SharedNames
from scbm.nodes.bindings.service_keys import ServiceKeys
from scbm.nodes.bindings.type_names import library_of
from scbm.nodes.types.definitions import STRING
from scbm.nodes.types.type_library import has_library

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from scbm.files.codec.keys import ShapeCheck, Spot
    from scbm.files.codec.value_reader import Entry, ValueReader
    from scbm.files.yaml.document import YamlNode
    from scbm.model import Place
    from scbm.model.behavior import BehaviorModel
    from scbm.model.operations import Action
    from scbm.model.resources import Resource
    from scbm.model.values import Value
    from scbm.model.variables import Variable
    from scbm.nodes.types.type_library import TypeLibrary

    _Calls: TypeAlias = (
        tuple[Entry[tuple[Entry[ServiceKeys], ...]], ...] | tuple[Entry[tuple[Entry[ActionKeys], ...]], ...]
    )

_PLAIN = re.compile(r"[A-Za-z_/][\w./]*|-?\d+", re.ASCII)
"""The texts that need no quotes; a key that is a number is one of these, too."""


class TopicsKeys(Keys):
    """A pair of topics with the protocol of drivers."""

    request = Key(ROS_NAME, "The topic of requests.", required=True)
    reply = Key(ROS_NAME, "The topic of replies.", required=True)

    def pair(self, shared: SharedNames) -> TopicPair | None:
        """Return the pair; `None` if a name is wrong."""
        for key, name in (("request", self.request), ("reply", self.reply)):
            if name is not None:
                place = self.node.items[key].place
                shared.note("topic", name, STRING, place)
                if key == "request" or name != self.request:
                    shared.note_use(name, place, is_of_pair=True)
        if self.request is None or self.reply is None:
            return None
        if self.request == self.reply:
            message = f"`{self.request}` cannot carry both requests and replies"
            self.reader.add(Slug.BAD_BINDING, message, self.node.items["reply"].place, "write two topics")
        return TopicPair(self.request, self.reply)


class RosKeys(Keys):
    """How a real resource gets requests: by `service`, `services`, `action`, `actions` or `topics`, or not at all."""

    service = Key(
        MappingType(ServiceKeys, "service"),
        "One service for all requests.",
    )
    services = Key(
        NamesType(NamesType(MappingType(ServiceKeys), "value → service"), "variable → value → service"),
        "A service for each value of one variable that requests carry.",
    )
    action = Key(
        MappingType(ActionKeys, "action"),
        "One action for all requests.",
    )
    actions = Key(
        NamesType(NamesType(MappingType(ActionKeys), "value → action"), "variable → value → action"),
        "An action for each value of one variable that requests carry.",
    )
    topics = Key(
        MappingType(TopicsKeys),
        "Two topics with the protocol of drivers.",
    )
    measured = Key(
        NamesType(MappingType(MeasuredTopicKeys), "variable → measured topic"),
        "For variables that the resource publishes, and for inputs: the topic that brings the values of each.",
    )

    @classmethod
    def check(cls, spot: Spot, check: ShapeCheck) -> None:
        """Check the binding, unless nothing is known of types: it is kept as it is then."""
        if has_library():
            super().check(spot, check)


class BindingsKeys(Keys):
    """The bindings of the resources of a model, in a file of their own."""

    bindings_of = Key(NAME_NODE, "The name of the model.", required=True)
    interfaces = INTERFACES
    resources = Key(
        NamesType(MappingType(RosKeys), "resource → binding"),
        "The binding of each resource, as under `ros` in a model file.",
        required=True,
    )

    def bindings(self, model: BehaviorModel) -> dict[str, Binding]:
        """Return the bindings of the resources of a model; valid only if no error is noted."""
        self._refuse_other_models(model)
        known = {resource.name: resource for resource in model.resources}
        bound: dict[str, tuple[Resource, RosKeys, Place]] = {}
        for entry in self.resources or ():
            if entry.name in known:
                bound[entry.name] = (known[entry.name], entry.value, entry.place)
            else:
                message = f"there is no resource `{entry.name}`"
                remedy = suggestion(entry.name, known, "the resources are")
                self.reader.add(Slug.UNKNOWN_RESOURCE, message, entry.place, remedy)
        return read_all(self.reader, model, bound, self.interfaces)

    def _refuse_other_models(self, model: BehaviorModel) -> None:
        """Note that the file is for another model; raise `InputError` if it has no resource of this one."""
        node, section = self.bindings_of, self.node.get("resources")
        if node is None or node.text == model.name:
            return
        message = f"these are bindings of `{node.text}`, and the model is `{model.name}`"
        self.reader.add(Slug.BAD_BINDING, message, node.place)
        if section is None or all(resource.name not in section.items for resource in model.resources):
            self.reader.report.raise_any()


def read_all(
    reader: ValueReader,
    model: BehaviorModel,
    bound: Mapping[str, tuple[Resource, RosKeys, Place]],
    interfaces: Iterable[YamlNode],
) -> dict[str, Binding]:
    """Return the bindings of resources; valid only if no error is noted. Without types they are kept as written.

    Args:
        reader: reads values in the scope of the model.
        model: the model, whose other bindings stay.
        bound: the resources with their keys, and where these are named.
        interfaces: where the file finds types.
    """
    if not has_library():
        return {name: Binding(written_data(keys.node)) for name, (_, keys, _) in bound.items()}
    bindings = BindingReader(reader, model, library_of(reader, interfaces))
    for resource in model.resources:
        if resource.name not in bound:
            bindings.include(resource)
    return {name: bindings.binding(*each) for name, each in bound.items()}


def written_data(node: YamlNode) -> object:
    """Return what a node has, as it is written again: texts that are no plain words in quotes."""
    if isinstance(node.plain, dict):
        return {_quoted(key): written_data(child) for key, child in node.items.items()}
    if isinstance(node.plain, list):
        return [written_data(element) for element in node.elements]
    return _quoted(node.plain) if isinstance(node.plain, str) else node.plain


def _quoted(text: str) -> str:
    return text if _PLAIN.fullmatch(text) else Quoted(text)


class BindingReader:
    """Reads the bindings of the resources of one model, in which one name has one type."""

    def __init__(self, reader: ValueReader, model: BehaviorModel, library: TypeLibrary) -> None:
        """Made once for all bindings of a model.

        Args:
            reader: reads values in the scope of the model.
            model: its actions decide what is sent; its own bindings do not matter.
            library: the types that can be named.
        """
        self._reader = reader
        self._model = model
        self._shared = SharedNames(reader, library)
        self._from_outside = (*inputs(model), *moved(model))

    def include(self, resource: Resource) -> None:
        """Include the binding that a resource keeps: others must not contradict it."""
        if isinstance(resource.binding, RosBinding):
            self._shared.include(resource.name, resource.binding)

    def binding(self, resource: Resource, keys: RosKeys, place: Place) -> RosBinding:
        """Return the binding of a resource; valid only if no error is noted.

        Args:
            resource: the resource; it may name variables that do not exist, which is an error elsewhere.
            keys: the keys of the binding.
            place: the key that the binding stands under.
        """
        ways = [key for key in REQUEST_KEYS if keys.has(key)]
        for other in ways[1:]:
            message = f"a binding has one of {_listed('and')}, and this has `{ways[0]}` and `{other}`"
            self._reader.add(Slug.BAD_BINDING, message, keys.place(other), "keep one of them")
        if not ways and keys.is_clear:
            self._refuse_no_way(resource, keys, place)
        read = [read_requests(self, resource, keys) for read_requests in REQUEST_KEYS.values()]
        requests = next((request for request in read if request is not None), None)
        return RosBinding(written_data(keys.node), requests, tuple(self._measured(resource, keys)))

    def service(self, resource: Resource, keys: RosKeys) -> ServiceCall | None:
        """Return the service for all requests; `None` if there is none, or it is wrong."""
        return None if keys.service is None else keys.service.call(resource, self._shared)

    def pair(self, _: Resource, keys: RosKeys) -> TopicPair | None:
        """Return the pair of topics; `None` if there is none, or it is wrong."""
        return None if keys.topics is None else keys.topics.pair(self._shared)

    def _refuse_no_way(self, resource: Resource, keys: RosKeys, place: Place) -> None:
        """Note a binding that says nothing, or only what is measured although requests are sent."""
        if not keys.node.items:
            remedy = f"write {_listed('or')}; or `measured`, for a resource without requests"
            self._reader.add(Slug.BAD_BINDING, f"the binding of `{resource.name}` is empty", place, remedy)
            return
        for sender, actions in self._sending(resource):
            if any(action.target == resource.trigger for action in actions):
                message = f"{sender} sends requests to `{resource.name}`, and its binding does not say where"
                remedy = f"add {_listed('or')}"
                self._reader.add(Slug.UNBOUND_REQUEST, message, place, remedy)
                return

    def action(self, resource: Resource, keys: RosKeys) -> ActionCall | None:
        """Return the action for all requests; `None` if there is none, or it is wrong."""
        return None if keys.action is None else keys.action.call(resource, self._shared)

    # services and actions chosen by a variable

    def services(self, resource: Resource, keys: RosKeys) -> CallChoice | None:
        """Return the services for the values of a variable; `None` if there are none, or they are wrong."""
        return self._choice(resource, keys, "services", keys.services or ())

    def actions(self, resource: Resource, keys: RosKeys) -> CallChoice | None:
        """Return the actions for the values of a variable; `None` if there are none, or they are wrong."""
        return self._choice(resource, keys, "actions", keys.actions or ())

    def _choice(self, resource: Resource, keys: RosKeys, key: str, variables: _Calls) -> CallChoice | None:
        section = keys.node.get(key)
        if section is None or not isinstance(section.plain, dict):
            return None
        if len(variables) != 1 and not section.incomplete:
            found = "here are several" if variables else "here is none"
            message = f"{key} are chosen by one variable that requests carry, and {found}"
            remedy = f"write `{key}: {{<variable>: {{<value>: {{name: …, type: …}}}}}}`"
            self._reader.add(Slug.BAD_BINDING, message, keys.place(key), remedy)
        choices = [self._chosen(resource, entry, key[:-1], is_only=len(variables) == 1) for entry in variables]
        return choices[0] if len(choices) == 1 else None

    def _chosen(
        self,
        resource: Resource,
        entry: Entry[tuple[Entry[ServiceKeys], ...]] | Entry[tuple[Entry[ActionKeys], ...]],
        what: str,
        *,
        is_only: bool,
    ) -> CallChoice | None:
        """Return what is called for the values of one variable; it is read even if the variable cannot be."""
        carried = is_carried(self._reader, entry.name, resource, entry.place)
        variable = self._reader.scope.variables.get(entry.name) if carried else None
        calls = []
        for chosen in entry.value:
            value = read_variable_value(self._reader, chosen.name, variable, chosen.place)
            call = chosen.value.call(resource, self._shared)
            calls += [] if value is None or call is None else [(value, call)]
        if variable is not None and is_only and isinstance(entry.node.plain, dict) and not entry.node.incomplete:
            self._refuse_unbound(resource, variable, tuple(entry.node.items), entry.place, what)
        return CallChoice(entry.name, tuple(calls)) if carried else None

    def _refuse_unbound(
        self, resource: Resource, variable: Variable, bound: tuple[str, ...], place: Place, what: str
    ) -> None:
        """Note values that a transition may send, and that no service or action is bound to."""
        known = dict.fromkeys(bound)
        for sender, actions in self._sending(resource):
            sent = [format_value(value) for action in actions for value in self._assigned(action, variable)]
            missing = [text for text in sent if text not in known]
            if missing:
                known |= dict.fromkeys(missing)
                message = f"no {what} is bound to {listed_values(missing)}, which {sender} assigns to `{variable.name}`"
                remedy = f"add `{missing[0]}: {{name: …, type: …}}`"
                self._reader.add(Slug.UNBOUND_REQUEST, message, place, remedy)

    def _sending(self, resource: Resource) -> Iterator[tuple[str, tuple[Action, ...]]]:
        """Yield actions that happen at once, with their transition; not those that take the trigger back."""
        taken = [(f"`{transition.name}`", transition.running_actions) for transition in self._model.transitions]
        taken += [(f"`timedout` of `{operation.name}`", operation.timedout) for operation in self._model.operations]
        back = Assign(resource.trigger, Constant(False))
        yield from ((sender, actions) for sender, actions in taken if back not in actions)

    def _assigned(self, action: Action, variable: Variable) -> tuple[Value, ...]:
        """Return the values that an action may give a variable; all of its domain if that depends on the state."""
        if action.target != variable.name:
            return ()
        if isinstance(action, Assign) and isinstance(action.source, Constant):
            return (action.source.constant,)
        read = self._reader.scope.variables.get(action.reads()[0])
        return tuple(value for value in variable.domain.values if read is None or value in read.domain)

    # measured topics

    def _measured(self, resource: Resource, keys: RosKeys) -> Iterator[MeasuredTopic]:
        reliability: dict[str, bool] = {}
        unasked = tuple(dict.fromkeys((*published_by(resource, self._model), *self._from_outside)))
        for entry in keys.measured or ():
            measured = entry.value.measured(entry.name, resource, entry.place, self._shared, unasked)
            if measured is None:
                continue
            topic, is_best_effort = measured.topic, measured.is_best_effort
            if topic and reliability.setdefault(topic, is_best_effort) != is_best_effort:
                message = f"`{topic}` has `best_effort: true` for one variable, and not for another"
                remedy = "write the same `best_effort` for all variables of one topic"
                self._reader.add(Slug.BAD_BINDING, message, entry.place, remedy)
            yield measured


REQUEST_KEYS: dict[str, Callable[[BindingReader, Resource, RosKeys], RequestBinding | None]] = {
    "service": BindingReader.service,
    "services": BindingReader.services,
    "action": BindingReader.action,
    "actions": BindingReader.actions,
    "topics": BindingReader.pair,
}
"""The keys of `RosKeys` that say where requests go, with what reads them; a binding has one of them at most."""


def _listed(conjunction: str) -> str:
    *others, last = (f"`{key}`" for key in REQUEST_KEYS)
    return f"{', '.join(others)} {conjunction} {last}"


BINDINGS_OWNERS: tuple[tuple[type[Keys], str], ...] = (
    (RosKeys, "a resource"),
    (ServiceKeys, "a service"),
    (ActionKeys, "an action"),
    (MeasuredTopicKeys, "a measured topic"),
)
"""The words of messages for the mappings of a bindings file."""
