"""Expands `request` of operations to the request protocol, written as transitions (semantics 3.5).

The keys `request`, `with`, `guard`, `assumes`, `effects` and `on_timeout` stay in the tree, so that their shape is
checked as it is written. The transitions that they stand for are added beside them, with the places of these keys.
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
    from scbm.files.yaml.error_collector import ErrorCollector
    from scbm.files.yaml.source_text import Scalar

_AUTOMATIC = "automatic_transitions"


def expand_handshakes(document: YamlNode, report: ErrorCollector) -> YamlNode:
    """Return the tree with the protocol of each request; the same tree if no operation has the key `request`."""
    operations = document.get("operations")
    if operations is None:
        return document
    handshakes = {e.key: Handshake(e, document) for e in entries_of(operations) if "request" in e.node.items}
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
    automatic = _with_generated(document, handshakes.values(), report)
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


# operations


class Handshake:
    """An operation with a `request`, and the transitions that it stands for.

    Attributes:
        resource: the name of the resource.
    """

    def __init__(self, entry: MappingEntry, document: YamlNode) -> None:
        self._entry_of_operation, operation = entry, entry.node
        self._operation = operation
        self._request = operation.items["request"]
        self.resource = self._request.text or ""
        resources = document.get("resources")
        self._is_known = resources is not None and self.resource in resources.items
        variables = document.get("variables")
        self._variables = variables.items if variables is not None else {}

    def expanded(self) -> YamlNode:
        """Return the operation with its transitions."""
        made = [self._transition("pre", self._pre()), self._transition("post", self._post()), *self._timedout()]
        return with_entries(self._operation, [*entries_of(self._operation), *made])

    def _pre(self) -> Iterator[MappingEntry]:
        free = self._protocol("{0}_req_state == initial", "{0}_req_trigger == false")
        guard = [*free, *_parts(self._operation.get("guard")), *_parts(self._written("pre", "g"))]
        commands = self._assignments("with")
        payload = [*self._protocol("{0}_req_trigger <- true"), *commands, *_parts(self._written("pre", "a"))]
        yield self._entry("g", "guard", guard or [self._text("true")])
        yield self._entry("a", "with", payload)

    def _post(self) -> Iterator[MappingEntry]:
        ended = self._protocol("{0}_req_state <- initial", "{0}_req_trigger <- false")
        effects = [*self._assignments("assumes"), *_parts(self._operation.get("effects"))]
        effects = [*ended, *effects, *_parts(self._written("post", "a"))]
        replied = [*self._protocol("{0}_req_state == succeeded"), *self._assumptions(" == ")]
        replied += _parts(self._written("post", "gr"))
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

    def _assignments(self, key: str) -> Iterator[YamlNode]:
        """Yield an action for each variable and its value under a key."""
        for entry, value in self._values(key):
            target = Piece.copy(PlacedScalar(entry.key, entry.place))
            pieces = (target, Piece.instead(" <- ", value), Piece.copy(value))
            yield scalar_node(RewrittenScalar(pieces), entry.node.place, entry.end)

    def _assumptions(self, operator: str) -> list[YamlNode]:
        """Return a comparison for each assumed value; errors in it underline the value, as those in its action do."""
        return [
            scalar_node(
                RewrittenScalar((Piece.instead(f"{entry.key}{operator}", value), Piece.copy(value))),
                entry.node.place,
                entry.end,
            )
            for entry, value in self._values("assumes")
            if entry.key in self._variables
        ]

    def _values(self, key: str) -> Iterator[tuple[MappingEntry, Scalar]]:
        """Yield the entries under a key that have a value."""
        node = self._operation.get(key)
        for entry in entries_of(node) if node is not None else ():
            if entry.node.scalar is not None and entry.node.plain is not None:
                yield entry, entry.node.scalar

    def otherwise(self) -> Iterator[MappingEntry]:
        """Yield the automatic transition that fails the operation if the reply measures other values than assumed."""
        parts = [node.scalar for node in self._assumptions(" != ") if node.scalar is not None]
        if not parts or not self._is_known:
            return
        operation, place = self._entry_of_operation, self._place("assumes")
        pieces = [piece for part in parts for piece in (Piece.instead(" || ", part), Piece.copy(part))]
        executes = text_node(f"{operation.key}.state == executing", place, 0)
        differs = scalar_node(RewrittenScalar(pieces[1:]), place, 0)
        guard = list_node([executes, *self._protocol("{0}_req_state == succeeded"), differs], place, 0)
        guard.flattens = True
        ended = self._protocol("{0}_req_state <- initial", "{0}_req_trigger <- false")
        actions = list_node([text_node(f"{operation.key}.state <- failed", place, 0), *ended], place, 0)
        yield _automatic(operation, "otherwise", place, guard, actions)


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


# generated automatic transitions


def _with_generated(document: YamlNode, handshakes: Iterable[Handshake], report: ErrorCollector) -> MappingEntry | None:
    """Return the automatic transitions with those that handshakes stand for; `None` if none is added.

    There is one for the failed replies of each requested resource, and one for each operation that assumes something.
    One of the same name in the file replaces it.
    """
    resources, written = document.get("resources"), document.get(_AUTOMATIC)
    if resources is None or (written is not None and not isinstance(written.plain, dict)):
        return None
    requested = {handshake.resource for handshake in handshakes}
    failures = [_failure(entry) for entry in entries_of(resources) if entry.key in requested]
    others = [entry for handshake in handshakes for entry in handshake.otherwise()]
    known = () if written is None else written.items
    made = [entry for entry in (*failures, *others) if entry.key not in known]
    if not made:
        return None
    _refuse_collisions(document, made, report)
    if written is None:
        place = document.key_places["resources"]
        return MappingEntry(_AUTOMATIC, place, mapping_node(made, place, 0), 0)
    node = with_entries(written, [*entries_of(written), *made])
    return MappingEntry(_AUTOMATIC, document.key_places[_AUTOMATIC], node, document.value_ends[_AUTOMATIC])


def _failure(resource: MappingEntry) -> MappingEntry:
    """Return the automatic transition that takes a failed reply; it stands for the name of the resource."""
    place, state, trigger = resource.place, f"{resource.key}_req_state", f"{resource.key}_req_trigger"
    guard = text_node(f"{state} == failed && current.state == executing", place, 0)
    actions = ("current.state <- failed", f"{state} <- initial", f"{trigger} <- false")
    taken = list_node([text_node(action, place, 0) for action in actions], place, 0)
    return _automatic(resource, "failed", place, guard, taken)


def _automatic(entry: MappingEntry, suffix: str, place: Place, guard: YamlNode, actions: YamlNode) -> MappingEntry:
    """Return an automatic transition of a resource or an operation: `arm_failed`; for `arm[r]`, `arm_failed.r1`."""
    lifted = entry.node.origin
    is_instance = lifted is not None and entry.key.startswith(f"{lifted}.")
    base = lifted if lifted is not None and is_instance else entry.key
    name = f"{base}_{suffix}{entry.key.removeprefix(base)}"
    entries = (MappingEntry("g", place, guard, 0), MappingEntry("a", place, actions, 0))
    node = mapping_node(entries, place, 0, None if lifted is None else f"{lifted}_{suffix}")
    node.user = entry.node.user
    return MappingEntry(name, place, node, 0)


def _refuse_collisions(document: YamlNode, made: Iterable[MappingEntry], report: ErrorCollector) -> None:
    """Note operations and environment transitions with the name of a generated transition."""
    for section, what in (("operations", "an operation"), ("environment", "an environment transition")):
        node = document.get(section)
        for name in (entry.key for entry in made if node is not None and entry.key in node.items):
            assert node is not None  # noqa: S101 - the name is there
            takes = "failed replies" if name.partition(".")[0].endswith("_failed") else "other replies than assumed"
            message = f"`{name}` is {what}, and also the automatic transition that takes {takes}"
            remedy = f"choose another name, or write the automatic transition `{name}` by hand"
            report.add(Slug.DUPLICATE_NAME, message, node.key_places[name], remedy)
