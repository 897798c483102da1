"""Names of types in files, and their definitions in the library of the file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from scbm.files.codec.key_types import ScalarType, scalar_node
from scbm.files.yaml.source_text import SourceText
from scbm.model import InputError, Slug
from scbm.nodes.types.interface_files import InterfaceFolder
from scbm.nodes.types.type_library import TypeLibrary, UnknownTypeError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator

    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import YamlNode

T = TypeVar("T")

TYPE_NAME: ScalarType[YamlNode] = ScalarType(
    "type", "a type such as `sensor_msgs/msg/Range`", {"type": "string", "pattern": "/(msg|srv|action)/"}, scalar_node
)


def library_of(reader: ValueReader, interfaces: Iterable[YamlNode]) -> TypeLibrary:
    """Return the types that a file can name, whose `interfaces` are paths beside it; note paths without types."""
    return TypeLibrary(_folders(reader, interfaces))


def _folders(reader: ValueReader, interfaces: Iterable[YamlNode]) -> Iterator[InterfaceFolder]:
    for node in interfaces:
        folder = InterfaceFolder.of(node.text or "", Path(node.place.file).parent)
        fault = folder.fault()
        if fault is None:
            yield folder
        else:
            remedy = "name a folder with packages of ROS 2, one package, or one file in it"
            reader.add(Slug.BAD_ROS_TYPE, f"`{folder.shown}` {fault}", node.place, remedy)


def look_up(reader: ValueReader, node: YamlNode, find: Callable[[str], T]) -> T | None:
    """Return the definition of the type that a scalar names; `None` after an error."""
    if node.text is None:
        return None
    try:
        return find(node.text)
    except UnknownTypeError as error:
        reader.add(Slug.BAD_ROS_TYPE, error.message, node.place, error.remedy)
    except InputError as error:
        for found in error.diagnostics:
            reader.report.add_source(SourceText(found.source_line or "", found.place.file), node.place)
        reader.report.add_found(error.diagnostics, node.place)
    return None
