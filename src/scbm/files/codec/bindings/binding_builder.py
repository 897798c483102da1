"""From what stands under `ros` of a resource to a binding.

Works on any tree, as `builder` does: what is missing or of the wrong sort is passed over here.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.files.codec.binding_keys import RosFile
from scbm.files.codec.bindings.reading_builder import ReadingBuilder
from scbm.files.codec.bindings.ros_names import RosNames, TopicUses
from scbm.files.codec.bindings.service_builder import ServiceBuilder
from scbm.model import Slug
from scbm.model.bindings import Binding, MeasuredTopic, MessageType, ServiceChoice, TopicPair
from scbm.model.operations import Assign
from scbm.model.predicates import Constant
from scbm.model.values import format_value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.codec.common_parts import Parts
    from scbm.files.yaml.document import YamlNode
    from scbm.model import Place
    from scbm.model.behavior import BehaviorModel
    from scbm.model.operations import Action
    from scbm.model.resources import Resource
    from scbm.model.values import Value
    from scbm.model.variables import Variable

_WAYS = ("service", "services", "topics")
_MAX_SHOWN = 8


class BindingBuilder:
    """Reads the bindings of the resources of one model, noting every error in a report."""

    def __init__(self, parts: Parts, model: BehaviorModel) -> None:
        """Made once for all bindings of a model: one name has one type in all of them.

        Args:
            parts: reads the parts, in the scope of the model.
            model: whose actions decide what is sent; its own bindings are not looked at.
        """
        self._parts = parts
        self._model = model
        self._names = RosNames(parts)
        self._uses = TopicUses(parts)
        self._readings = ReadingBuilder(parts)
        self._services = ServiceBuilder(parts, self._names, self._readings)

    def know(self, resource: Resource) -> None:
        """A resource keeps the binding that it has, which others must not contradict."""
        if resource.binding is not None:
            self._names.know(resource.name, resource.binding)
            self._uses.know(resource.name, resource.binding)

    def binding(self, resource: Resource, node: YamlNode, place: Place) -> Binding:
        """The binding of a resource; only good if the report is empty afterwards.

        Args:
            resource: the resource; it may name variables of which is told elsewhere that there are none.
            node: what is said of it.
            place: the key that it stands under.
        """
        ways = [key for key in _WAYS if key in node.items]
        for other in ways[1:]:
            message = f"requests go one way, and here are `{ways[0]}` and `{other}`"
            self._parts.add(Slug.BAD_BINDING, message, node.key_places[other], "keep one of them")
        if (
            not ways
            and isinstance(node.plain, dict)
            and not node.incomplete
            and node.items.keys() <= RosFile.keys().keys()
        ):
            self._refuse_no_way(resource, node, place)
        call = self._services.call(resource, node.get("service"))
        choice = self._choice(resource, node)
        pair = self._pair(node.get("topics"))
        return Binding(call or choice or pair, tuple(self._measured(resource, node.get("measured"))))

    def _refuse_no_way(self, resource: Resource, node: YamlNode, place: Place) -> None:
        """Complains of a binding that says nothing, or only what is measured although requests are sent."""
        if not node.items:
            remedy = "write `service`, `services` or `topics`; or `measured`, for what gets no requests"
            self._parts.add(Slug.BAD_BINDING, f"the binding of `{resource.name}` says nothing", place, remedy)
            return
        for who, actions in self._sending(resource):
            if any(action.target == resource.trigger for action in actions):
                message = f"{who} sends requests to `{resource.name}`, and its binding does not say where"
                remedy = "add `service`, `services` or `topics`"
                self._parts.add(Slug.UNBOUND_REQUEST, message, place, remedy)
                return

    # ways of requests

    def _pair(self, node: YamlNode | None) -> TopicPair | None:
        if node is None:
            return None
        names = [self._topic(node.get(key), MessageType.STRING) for key in ("request", "reply")]
        request, reply = names
        for key, name in zip(("request", "reply"), dict.fromkeys(names), strict=False):
            if name is not None:
                self._uses.note(name, node.items[key].place, is_of_pair=True)
        if request is None or reply is None:
            return None
        if request == reply:
            message = f"`{request}` cannot carry both requests and replies"
            self._parts.add(Slug.BAD_BINDING, message, node.items["reply"].place, "write two topics")
        return TopicPair(request, reply)

    def _topic(self, node: YamlNode | None, kind: MessageType, place: Place | None = None) -> str | None:
        name = self._names.name(node)
        if name is not None and node is not None:
            self._names.note_topic(name, kind, place or node.place)
        return name

    def _choice(self, resource: Resource, node: YamlNode) -> ServiceChoice | None:
        services = node.get("services")
        if services is None or not isinstance(services.plain, dict):
            return None
        if len(services.items) != 1 and not services.incomplete:
            found = "here are several" if services.items else "here is none"
            message = f"services are chosen by one variable that requests carry, and {found}"
            remedy = "write `services: {<variable>: {<value>: {name: …, type: …}}}`"
            self._parts.add(Slug.BAD_BINDING, message, node.key_places["services"], remedy)
        choices = [self._chosen(resource, services, name) for name in services.items]
        return choices[0] if len(choices) == 1 else None

    def _chosen(self, resource: Resource, services: YamlNode, name: str) -> ServiceChoice | None:
        """The services for the values of one variable; they are read even if the variable cannot be."""
        chosen, place = services.items[name], services.key_places[name]
        is_carried = self._services.is_carried(name, resource, place)
        variable = self._parts.scope.variables.get(name) if is_carried else None
        calls = []
        for text, written in chosen.items.items():
            value = self._readings.value(text, variable, chosen.key_places[text])
            call = self._services.call(resource, written)
            calls += [] if value is None or call is None else [(value, call)]
        is_whole = len(services.items) == 1 and isinstance(chosen.plain, dict) and not chosen.incomplete
        if variable is not None and is_whole:
            self._refuse_unbound(resource, variable, chosen, place)
        return ServiceChoice(name, tuple(calls)) if is_carried else None

    # what is sent

    def _refuse_unbound(self, resource: Resource, variable: Variable, chosen: YamlNode, place: Place) -> None:
        """Complains of values that a transition may send, and that no service is bound to."""
        known = dict.fromkeys(chosen.items)
        for who, actions in self._sending(resource):
            sent = [format_value(value) for action in actions for value in self._assigned(action, variable)]
            missing = [text for text in sent if text not in known]
            if missing:
                known |= dict.fromkeys(missing)
                listed = ", ".join(f"`{text}`" for text in missing[:_MAX_SHOWN])
                listed += ", …" if len(missing) > _MAX_SHOWN else ""
                message = f"no service is bound to {listed}, which {who} assigns to `{variable.name}`"
                remedy = f"add `{missing[0]}: {{name: …, type: …}}`"
                self._parts.add(Slug.UNBOUND_REQUEST, message, place, remedy)

    def _sending(self, resource: Resource) -> Iterator[tuple[str, tuple[Action, ...]]]:
        """What happens at once, and who does it; but for what takes the trigger back, and so sends nothing."""
        taken = [(f"`{transition.name}`", transition.running_actions) for transition in self._model.transitions]
        taken += [(f"`timedout` of `{operation.name}`", operation.timedout) for operation in self._model.operations]
        back = Assign(resource.trigger, Constant(False))
        yield from ((who, actions) for who, actions in taken if back not in actions)

    def _assigned(self, action: Action, variable: Variable) -> tuple[Value, ...]:
        """The values that an action may give a variable, as far as that shows."""
        if action.target != variable.name:
            return ()
        if isinstance(action, Assign) and isinstance(action.source, Constant):
            return (action.source.constant,)
        read = self._parts.scope.variables.get(action.reads()[0])
        return tuple(value for value in variable.domain.values if read is None or value in read.domain)

    # what is measured

    def _measured(self, resource: Resource, node: YamlNode | None) -> Iterator[MeasuredTopic]:
        heard: dict[str, bool] = {}
        for name, written in node.items.items() if node is not None else ():
            assert node is not None  # noqa: S101 - its items are gone through
            type_node = written.get("type")
            kind = self._names.message_type(type_node)
            if kind is None or type_node is None:
                self._names.name(written.get("topic"))
                continue
            named = written.get("topic")
            topic = self._topic(named, kind, type_node.place)
            if topic is not None and named is not None and kind is MessageType.STRING:
                self._uses.note(topic, named.place, is_of_pair=False)
            reading = self._readings.reading(name, resource, kind.data, written, node.key_places[name])
            is_best_effort = self._is_best_effort(written)
            if topic is not None and heard.setdefault(topic, is_best_effort) != is_best_effort:
                message = f"`{topic}` is heard as best effort for one variable, and not for another"
                remedy = "say the same of `best_effort` for all that one topic measures"
                self._parts.add(Slug.BAD_BINDING, message, node.key_places[name], remedy)
            yield MeasuredTopic(topic or "", kind, reading, is_best_effort)

    def _is_best_effort(self, written: YamlNode) -> bool:
        node = written.get("best_effort")
        if node is None or node.plain is None:
            return False
        if not isinstance(node.plain, bool) and node.text is not None:
            message = f"`best_effort` is true or false, and here is `{node.text}`"
            self._parts.add(Slug.WRONG_TYPE, message, node.place)
        return node.plain is True
