"""Finds the definition of a type by its name: in files of interfaces, else among the types that `rosbags` knows."""

from __future__ import annotations

import os
import re
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scbm.files.spelling import nearest
from scbm.model import Diagnostic, InputError, Place, Slug
from scbm.nodes.types.definitions import (
    KNOWN,
    MAX_BYTES,
    ActionDefinition,
    ListShape,
    MessageDefinition,
    Primitive,
    ServiceDefinition,
)
from scbm.nodes.types.interface_files import PARTS, InterfaceFolder, WrittenField, WrittenMessage, read_interface

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from scbm.nodes.types.definitions import FieldShape
    from scbm.nodes.types.interface_files import Described

_NAME = re.compile(r"[a-z](_?[a-z0-9])*/(msg|srv|action)/[A-Z][A-Za-z0-9]*", re.ASCII)
_MAX_DEPTH = 50
"""Maximum depth of messages in messages."""


class UnknownTypeError(Exception):
    """There is no such type: a sentence that says where was looked, and a remedy if one is known."""

    def __init__(self, message: str, remedy: str | None) -> None:
        super().__init__(message)
        self.message = message
        self.remedy = remedy


class _WrongTypeError(Exception):
    """What is wrong with a definition, and the field of a file that it is wrong for, if it is one."""

    def __init__(self, message: str, user: WrittenField | None) -> None:
        super().__init__(message)
        self.user = user


def has_library() -> bool:
    """Return whether the extra `dds` is installed, without which no type is known."""
    return find_spec("rosbags") is not None


class TypeLibrary:
    """The types that the bindings of a model can name. A type is read when it is asked for, once."""

    def __init__(self, folders: Iterable[InterfaceFolder] = ()) -> None:
        """Look in these folders first, then in the sourced workspace of ROS 2, if there is one, then in `rosbags`."""
        self.folders = tuple(folders)
        prefixes = [prefix for prefix in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep) if prefix]
        self._workspace = tuple(InterfaceFolder(Path(prefix) / "share", f"{prefix}/share") for prefix in prefixes)
        self._written: dict[str, Mapping[str, WrittenMessage] | None] = {}
        self._messages: dict[str, MessageDefinition] = {}

    def message(self, name: str) -> MessageDefinition:
        """Return the message with a name such as `sensor_msgs/msg/Range`.

        Raises:
            UnknownTypeError: there is none.
            InputError: its file has errors.
        """
        known = self._known(name)
        if isinstance(known, MessageDefinition):
            return known
        self._refuse_unknown(name, "msg")
        return self._complete(name)

    def service(self, name: str) -> ServiceDefinition:
        """Return the service with a name such as `std_srvs/srv/Trigger`. Raises as `message` does."""
        known = self._known(name)
        if isinstance(known, ServiceDefinition):
            return known
        self._refuse_unknown(name, "srv")
        return ServiceDefinition(name, *(self._complete(f"{name}{end}") for end in PARTS["srv"]))

    def action(self, name: str) -> ActionDefinition:
        """Return the action with a name such as `control_msgs/action/GripperCommand`. Raises as `message` does."""
        self._refuse_unknown(name, "action")
        return ActionDefinition(name, *(self._complete(f"{name}{end}") for end in PARTS["action"]))

    def _known(self, name: str) -> MessageDefinition | ServiceDefinition | None:
        """Return a definition that needs no look-up, unless a file has another one."""
        return KNOWN.get(name) if name in KNOWN and self._file_of(name) is None else None

    def _file_of(self, name: str) -> Path | None:
        files = (folder.file(name) for folder in (*self.folders, *self._workspace))
        return next((path for path in files if path is not None), None)

    def _refuse_unknown(self, name: str, kind: str) -> None:
        match = _NAME.fullmatch(name)
        if match is not None and match[2] == kind and self._parts_of(name) is not None:
            return
        known = [each for each in self._all_names() if each.split("/")[1] == kind]
        near = nearest(name, known) or next(
            (each for each in known if each.endswith(f"/{name.rsplit('/', maxsplit=1)[-1]}")), None
        )
        if match is None or match[2] != kind:
            raise UnknownTypeError(
                f"`{name}` is no name of a type such as `{_EXAMPLES[kind]}`",
                f"did you mean `{near}`?" if near else None,
            )
        places = [f"`{folder.shown}`" for folder in (*self.folders, *self._workspace)]
        where = ", ".join([*places, "the messages of ROS 2 that come with the extra `dds`"])
        remedy = f"did you mean `{near}`?" if near else "name the folder of its package under `interfaces`"
        raise UnknownTypeError(f"there is no type `{name}` in {where}", remedy)

    def _all_names(self) -> list[str]:
        of_files = [name for folder in (*self.folders, *self._workspace) for name in folder.types()]
        return [*of_files, *KNOWN, *_rosbags_messages()]

    # written definitions

    def _parts_of(self, name: str) -> Mapping[str, WrittenMessage] | None:
        """Return the messages that a type consists of, by the ends of their names; `None` for an unknown type."""
        if name not in self._written:
            path = self._file_of(name)
            self._written[name] = _rosbags_parts(name) if path is None else read_interface(path, name)
        return self._written[name]

    # complete definitions

    def _complete(self, name: str) -> MessageDefinition:
        try:
            return self._definition(name, (), None)
        except _WrongTypeError as error:
            user = error.user
            place = Place(name) if user is None or user.place is None else user.place
            line = None if user is None else user.line
            raise InputError([Diagnostic(Slug.BAD_ROS_TYPE, str(error), place, source_line=line)]) from None

    def _definition(self, name: str, path: tuple[str, ...], user: WrittenField | None) -> MessageDefinition:
        """Return the definition of a message that the messages of a path contain."""
        known = self._messages.get(name) or self._known(name)
        if isinstance(known, MessageDefinition):
            return known
        if name in path:
            raise _WrongTypeError(f"a message cannot contain itself: {' in '.join((name, *path[::-1]))}", user)
        if len(path) > _MAX_DEPTH:
            raise _WrongTypeError(f"messages are nested more than {_MAX_DEPTH} times", user)
        end = next((end for end in sorted(sum(PARTS.values(), ()), key=len, reverse=True) if name.endswith(end)), "")
        whole = name.removesuffix(end)
        parts = self._parts_of(whole) if _NAME.fullmatch(whole) else None
        if parts is None or end not in parts:
            near = nearest(name, self._all_names())
            hint = f"; did you mean `{near}`?" if near else ""
            raise _WrongTypeError(f"there is no type `{name}`{hint}", user)
        written = parts[end]
        fields = tuple((field.name, self._shape(field, field.type, (*path, name))) for field in written.fields)
        made = MessageDefinition(name, fields, written.constants)
        if _zero_bytes(made) > MAX_BYTES:
            raise _WrongTypeError(f"the arrays of `{name}` have more than {MAX_BYTES // 2**20} MiB", user)
        self._messages[name] = made
        return made

    def _shape(self, field: WrittenField, described: Described, path: tuple[str, ...]) -> FieldShape:
        from rosbags.interfaces import Nodetype  # noqa: PLC0415 - it may be missing

        node, rest = described
        if node == Nodetype.BASE:
            return Primitive(rest[0], rest[1])
        if node == Nodetype.NAME:
            if rest.endswith("/wstring"):
                raise _WrongTypeError(f"`wstring` is not supported, and `{field.name}` has this type", field)
            return self._definition(rest, path, field)
        element: Any = self._shape(field, rest[0], path)
        return ListShape(element, rest[1], is_array=node == Nodetype.ARRAY)


_EXAMPLES = {"msg": "sensor_msgs/msg/Range", "srv": "std_srvs/srv/Trigger", "action": "nav2_msgs/action/Spin"}


def _rosbags_messages() -> Mapping[str, Any]:
    from rosbags.typesys.stores.ros2_jazzy import FIELDDEFS  # noqa: PLC0415 - it takes a fifth of a second

    return FIELDDEFS


def _rosbags_parts(name: str) -> Mapping[str, WrittenMessage] | None:
    constants, fields = _rosbags_messages().get(name, (None, None))
    if fields is None:
        return None
    written = (WrittenField(each, described) for each, described in fields if each != _NO_FIELD)
    return {"": WrittenMessage(tuple(written), tuple((each, value) for each, _, value in constants))}


_NO_FIELD = "structure_needs_at_least_one_member"
"""The field that `rosbags` gives to messages without fields."""


def _zero_bytes(shape: FieldShape) -> int:
    """Return the least number of bytes of a value."""
    if isinstance(shape, ListShape):
        return _zero_bytes(shape.element) * shape.size if shape.is_array else 4
    return shape.size if isinstance(shape, Primitive) else sum(_zero_bytes(part) for _, part in shape.fields)
