"""Expands `request` of operations to the request protocol, written as transitions (semantics 3.5).

The keys `request`, `with`, `guard`, `effects` and `on_timeout` stay in the tree, so that their shape is checked as it
is written. The transitions that they stand for are added beside them, with the places of these keys.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.files.expansion.expanded_nodes import (
    MappingEntry,
    Piece,
    PlacedScalar,
    RewrittenScalar,
    entries_of,
    list_node,
    mapping_node,
    scalar_node,
    text_node,
    with_entries,
)
from scbm.model import Place, Slug

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from scbm.files.yaml.document import YamlNode
    from scbm.files.yaml.text_files import ErrorCollector

_AUTOMATIC = "automatic_transitions"


def expand_handshakes(document: YamlNode, report: ErrorCollector) -> YamlNode:
    """Return the tree with the protocol of each request; the same tree if no operation has the key `request`."""
    operations = document.get("operations")
    if operations is None:
        return document
    handshakes = {name: Handshake(node, document) for name, node in operations.items.items() if _requests(node)}
    if not handshakes:
        return document
    expanded = with_entries(
        operations,
        [
            entry._replace(node=handshakes[entry.key].expanded()) if entry.key in handshakes else entry
            for entry in entries_of(operations)
        ],
    )
    replaced = {"operations": expanded}
    automatic = _with_failures(document, {shake.resource for shake in handshakes.values()}, report)
    if automatic is not None:
        replaced[_AUTOMATIC] = automatic.node
    entries = [entry._replace(node=replaced.pop(entry.key, entry.node)) for entry in entries_of(document)]
    return with_entries(document, [*entries, *([automatic] if automatic is not None and replaced else [])])


def misses_requests(document: YamlNode) -> bool:
    """Return whether an operation names no known resource under `request`: then generated transitions are missing."""
    operations, resources = document.get("operations"), document.get("resources")
    known = resources.items if resources is not None else {}
    requests = (node.get("request") for node in (operations.items.values() if operations is not None else ()))
    return any(request is not None and request.text not in known for request in requests)


def _requests(operation: YamlNode) -> bool:
    """Return whether an operation names a resource under `request`."""
    request = operation.get("request")
    return request is not None and request.text is not None and request.plain is not None


# operations


class Handshake:
    """An operation with a `request`, and the transitions that it stands for.

    Attributes:
        resource: the name of the resource.
    """

    def __init__(self, operation: YamlNode, document: YamlNode) -> None:
        self._operation = operation
        self._request = operation.items["request"]
        self.resource = self._request.text or ""
        resources = document.get("resources")
        self._is_known = resources is not None and self.resource in resources.items

    def expanded(self) -> YamlNode:
        """Return the operation with its transitions."""
        made = [self._transition("pre", self._pre()), self._transition("post", self._post()), *self._timedout()]
        return with_entries(self._operation, [*entries_of(self._operation), *made])

    def _pre(self) -> Iterator[MappingEntry]:
        free = self._protocol("{0}_req_state == initial", "{0}_req_trigger == false")
        guard = [*free, *_parts(self._operation.get("guard")), *_parts(self._written("pre", "g"))]
        payload = [*self._protocol("{0}_req_trigger <- true"), *self._payload(), *_parts(self._written("pre", "a"))]
        yield self._entry("g", "guard", guard or [self._text("true")])
        yield self._entry("a", "with", payload)

    def _post(self) -> Iterator[MappingEntry]:
        ended = self._protocol("{0}_req_state <- initial", "{0}_req_trigger <- false")
        effects = [*ended, *_parts(self._operation.get("effects")), *_parts(self._written("post", "a"))]
        replied = [*self._protocol("{0}_req_state == succeeded"), *_parts(self._written("post", "gr"))]
        yield self._entry("g", "effects", [*_parts(self._written("post", "g"))] or [self._text("true")])
        yield self._entry("gr", "request", replied or [self._text("true")])
        yield self._entry("a", "effects", effects)

    def _timedout(self) -> Iterator[MappingEntry]:
        written = self._operation.get("timedout")
        if written is not None and not isinstance(written.plain, list):
            return
        cleared = self._protocol("{0}_req_trigger <- false") if "deadline" in self._operation.items else ()
        actions = [*cleared, *_parts(self._operation.get("on_timeout")), *_parts(written)]
        if actions:
            yield self._entry("timedout", "timedout" if written is not None else "on_timeout", actions)

    def _transition(self, key: str, made: Iterable[MappingEntry]) -> MappingEntry:
        """Return a transition: what is written of it, with the protocol; what is no mapping stays as it is."""
        written = self._operation.get(key)
        if written is None:
            end = self._request.end
            return MappingEntry(key, self._place("request"), mapping_node(made, self._request.place, end), end)
        entry = MappingEntry(key, self._place(key), written, self._operation.value_ends[key])
        if not isinstance(written.plain, dict):
            return entry
        wrong = [entry.key for entry in entries_of(written) if not _is_list_of_scalars(entry.node)]
        kept = [each for each in made if each.key not in wrong]
        return entry._replace(node=with_entries(written, [*entries_of(written), *kept]))

    def _entry(self, key: str, source: str, elements: list[YamlNode]) -> MappingEntry:
        """Return a list under a key of a transition; it stands for the key `source` of the operation."""
        anchor = source if source in self._operation.items else "request"
        end = self._operation.value_ends[anchor]
        node = list_node(elements, self._place(anchor), end)
        node.flattens = True
        return MappingEntry(key, self._place(anchor), node, end)

    def _written(self, transition: str, key: str) -> YamlNode | None:
        node = self._operation.get(transition)
        return None if node is None else node.get(key)

    def _place(self, key: str) -> Place:
        return self._operation.key_places[key]

    def _protocol(self, *texts: str) -> tuple[YamlNode, ...]:
        """Return texts about the resource; none if the model has no such resource, which is an error of its own."""
        return tuple(self._text(text.format(self.resource)) for text in texts) if self._is_known else ()

    def _text(self, text: str) -> YamlNode:
        return text_node(text, self._request.place, self._request.end)

    def _payload(self) -> Iterator[YamlNode]:
        """Yield an assignment for each entry of `with`."""
        node = self._operation.get("with")
        for name, place, value, end in entries_of(node) if node is not None else ():
            if value.scalar is not None and value.plain is not None:
                target = Piece.copy(PlacedScalar(name, place))
                pieces = (target, Piece.instead(" <- ", value.scalar), Piece.copy(value.scalar))
                yield scalar_node(RewrittenScalar(pieces), value.place, end)


def _parts(node: YamlNode | None) -> Iterator[YamlNode]:
    """Yield the elements of a list, or a scalar itself; what is neither has an error of its own."""
    if node is None:
        return
    for part in node.elements if isinstance(node.plain, list) else (node,):
        if part.plain is not None and not isinstance(part.plain, (dict, list)):
            yield part


def _is_list_of_scalars(node: YamlNode) -> bool:
    """Return whether a node is a scalar or a list of scalars."""
    parts = node.elements if isinstance(node.plain, list) else [node]
    return len(parts) == len(list(_parts(node)))


# failed replies


def _with_failures(document: YamlNode, requested: set[str], report: ErrorCollector) -> MappingEntry | None:
    """Return the automatic transitions with one for each requested resource; `None` if none is added."""
    resources = document.get("resources")
    written = document.get(_AUTOMATIC)
    if resources is None or (written is not None and not isinstance(written.plain, dict)):
        return None
    names = {_failure_name(entry): entry for entry in entries_of(resources) if entry.key in requested}
    missing = [name for name in names if written is None or name not in written.items]
    if not missing:
        return None
    _refuse_collisions(document, missing, report)
    failures = [_failure(name, names[name]) for name in missing]
    if written is None:
        place = document.key_places["resources"]
        return MappingEntry(_AUTOMATIC, place, mapping_node(failures, place, 0), 0)
    node = with_entries(written, [*entries_of(written), *failures])
    return MappingEntry(_AUTOMATIC, document.key_places[_AUTOMATIC], node, document.value_ends[_AUTOMATIC])


def _failure_name(resource: MappingEntry) -> str:
    """Return the name of the transition for a resource: `arm_failed` for `arm`, `arm_failed.r1` for `arm[r]`."""
    lifted = resource.node.origin
    if lifted is None or not resource.key.startswith(f"{lifted}."):
        return f"{resource.key}_failed"
    return f"{lifted}_failed{resource.key.removeprefix(lifted)}"


def _failure(name: str, resource: MappingEntry) -> MappingEntry:
    """Return the automatic transition that takes a failed reply; it stands for the name of the resource."""
    place, state, trigger = resource.place, f"{resource.key}_req_state", f"{resource.key}_req_trigger"
    guard = text_node(f"{state} == failed && current.state == executing", place, 0)
    actions = ("current.state <- failed", f"{state} <- initial", f"{trigger} <- false")
    taken = list_node([text_node(action, place, 0) for action in actions], place, 0)
    origin = None if resource.node.origin is None else f"{resource.node.origin}_failed"
    entries = (MappingEntry("g", place, guard, 0), MappingEntry("a", place, taken, 0))
    node = mapping_node(entries, place, 0, origin)
    node.user = resource.node.user
    return MappingEntry(name, place, node, 0)


def _refuse_collisions(document: YamlNode, names: list[str], report: ErrorCollector) -> None:
    """Note operations and environment transitions with the name of a generated transition."""
    for section, what in (("operations", "an operation"), ("environment", "an environment transition")):
        node = document.get(section)
        for name in names if node is not None else ():
            if node is not None and name in node.items:
                message = f"`{name}` is {what}, and also the automatic transition that takes failed replies"
                remedy = f"choose another name, or write the automatic transition `{name}` by hand"
                report.add(Slug.DUPLICATE_NAME, message, node.key_places[name], remedy)
