"""The keys of a service: how requests become calls of it, and its responses replies."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.files.codec.key_types import NamesType
from scbm.files.codec.keys import Key, Keys
from scbm.files.spelling import nearest
from scbm.model import Slug
from scbm.nodes.bindings.field_values import CONTENT, ContentType, FieldReader
from scbm.nodes.bindings.reading_keys import FIELD_READING
from scbm.nodes.bindings.ros_binding import ServiceCall
from scbm.nodes.bindings.ros_names import ROS_NAME, SharedNames
from scbm.nodes.bindings.type_names import TYPE_NAME
from scbm.nodes.types.definitions import Primitive

if TYPE_CHECKING:
    from collections.abc import Iterator

    from scbm.files.codec.value_reader import Entry
    from scbm.model import Place
    from scbm.model.resources import Resource
    from scbm.nodes.bindings.reading_keys import FieldReadingKeys
    from scbm.nodes.bindings.ros_binding import Reading
    from scbm.nodes.types.definitions import MessageDefinition, Scalar
    from scbm.nodes.types.field_paths import FieldPath

CONTENTS = NamesType(ContentType(), "field → content")
FIELD_VALUES = NamesType(CONTENT, "field → value")
FIELD_READINGS = NamesType(FIELD_READING, "variable → field or reading")
_SUCCESS = ("success", Primitive("bool"))


class ServiceKeys(Keys):
    """A service, and how requests become calls of it."""

    name = Key(ROS_NAME, "The name of the service, from the root: `/scanner/scan`.", required=True)
    type = Key(TYPE_NAME, "The type of the service: `std_srvs/srv/Trigger`.", required=True)
    request = Key(
        CONTENTS,
        "What fields of a request get, by their paths: a value, a variable that the request carries, a list of these, "
        "`{text: …}`, or `{variable: …, values: {<value>: <value of the field>}}`. Messages and lists that are left "
        "out are zero and empty.",
    )
    succeeded = Key(
        FIELD_VALUES,
        "The field values of a response that reports success; `{}` if every response does. Required if "
        "responses have no field `success` of type `bool`.",
        absent="`{success: true}`",
    )
    measured = Key(FIELD_READINGS, "For variables under `measures`: the field of the response that measures each.")

    def call(self, resource: Resource, shared: SharedNames) -> ServiceCall | None:
        """Return the service for requests to a resource; valid only if no error is noted."""
        if not isinstance(self.node.plain, dict):
            return None
        name = self.name
        kind = shared.service(self.type) if self.type is not None else None
        if kind is None:
            return None
        place = self.node.items["type"].place
        if name is not None:
            shared.note("service", name, kind, place)
        requests = FieldReader(self.reader, kind.request, f"a request of `{kind.name}`")
        responses = FieldReader(self.reader, kind.response, f"a response of `{kind.name}`")
        return ServiceCall(
            name or "",
            kind,
            requests.request(self.request, self.node.get("request"), resource, place),
            tuple(self._succeeded(kind.response, responses, place)),
            tuple(read_measured(self.measured, resource, responses)),
        )

    def _succeeded(
        self, response: MessageDefinition, responses: FieldReader, place: Place
    ) -> Iterator[tuple[FieldPath, Scalar]]:
        if self.has("succeeded"):
            yield from responses.succeeded(self.succeeded or ())
        elif _SUCCESS in response.fields:
            path = responses.leaf("success", place)
            assert path is not None  # noqa: S101 - the response has it
            yield path, True
        elif nearest("succeeded", self.node.items) is None:
            name = response.name.removesuffix("_Response")
            message = f"`succeeded` is missing: a response of `{name}` has no `success` of type bool"
            remedy = "add `succeeded: {<field>: <value>}`, or `succeeded: {}` if every response says so"
            self.reader.add(Slug.MISSING_KEY, message, place, remedy)


def read_measured(
    entries: tuple[Entry[FieldReadingKeys], ...] | None,
    resource: Resource,
    fields: FieldReader,
    *,
    is_published: bool = False,
) -> Iterator[Reading]:
    """Yield how fields of a message are measured: of a reply, or of one that a resource publishes without a request."""
    for entry in entries or ():
        field = entry.value.field_node
        path = None if field is None or field.text is None else fields.leaf(field.text, field.place)
        if path is not None:
            yield entry.value.reading(entry.name, resource, path, fields, entry.place, is_published=is_published)
