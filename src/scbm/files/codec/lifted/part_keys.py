"""The keys of `include` and `parts` in a model file, and those of a file with a part."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.files.codec.key_types import NAME_NODE, MappingType, NamesType, ScalarOrListType, node_of
from scbm.files.codec.keys import Data, Definitions, Key, Keys, KeyType, ShapeCheck, Spot
from scbm.files.expansion.stage_keys import PartKeyNames
from scbm.files.yaml.document import YamlNode

if TYPE_CHECKING:
    from scbm.files.codec.value_reader import Entry, ValueReader


class AnyType(KeyType[YamlNode], frozen=True):
    """Anything: what it has to be depends on where the part uses it."""

    words: str = "anything"

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note nothing."""

    def read(self, node: YamlNode, reader: ValueReader) -> YamlNode:  # noqa: ARG002 - the node is the value
        """Return the node."""
        return node

    def write(self, value: object) -> Data:
        """Return the value itself."""
        return value

    def schema(self, definitions: Definitions) -> dict[str, Data]:  # noqa: ARG002 - refers to no definition
        """Return a schema that takes everything."""
        return {}


def _written_nowhere(_: object) -> None:
    """Return nothing: models are written without parts."""


_FILES = ScalarOrListType(
    "path, or list of paths",
    "the path of a part, or a list of paths",
    {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]},
    "the path of a part",
    node_of,
)


class PartUseKeys(Keys):
    """One use of a part, with names of its own."""

    use = Key(
        NAME_NODE,
        "The file of the part, relative to this one; or a part of the library, such as `scbm:gripper`.",
        required=True,
    )
    arguments = Key(
        NamesType(AnyType(), "parameter → anything"),
        "The arguments: a value for each parameter of the part.",
        name="with",
        absent="the defaults of the part",
    )


class PartParameterKeys(Keys):
    """A parameter of a part: a word that stands for something else in each use."""

    default = Key(AnyType(), "The argument, if a use gives none.", absent="each use has to give it")
    help = Key(NAME_NODE, "The purpose of the parameter.")


INCLUDE = Key(
    _FILES,
    "Files of parts whose sections are read as if they stood here, before the own ones.",
    source=_written_nowhere,
)
PARTS = Key(
    NamesType(MappingType(PartUseKeys), "name → use of a part"),
    "Parts, each with a name: what a part calls `door` is `NAME.door` here.",
    source=_written_nowhere,
)


def _as_in_a_model() -> Key[tuple[Entry[YamlNode], ...]]:
    """Return a section of a part. What it has to be is known only in a model: its words may be parameters."""
    return Key(NamesType(AnyType(), "mapping"), "As in a model.")


class PartKeys(Keys):
    """A part of models: a file that models and other parts use."""

    part = Key(NAME_NODE, "The name of the part.", required=True)
    parameters = Key(
        NamesType(MappingType(PartParameterKeys), "name → parameter"),
        "The parameters: each use gives a value, a time or a variable of the model for each.",
    )
    include = INCLUDE
    parts = PARTS
    types = _as_in_a_model()
    tables = _as_in_a_model()
    variables = _as_in_a_model()
    resources = _as_in_a_model()
    operations = _as_in_a_model()
    automatic_transitions = _as_in_a_model()
    environment = _as_in_a_model()
    goals = _as_in_a_model()
    requirements = _as_in_a_model()


PART_KEY_NAMES = PartKeyNames(
    part=tuple(PartKeys.declared), parameter=tuple(PartParameterKeys.declared), use=tuple(PartUseKeys.declared)
)
"""The names of these keys, for the expansion, which checks parts before it reads their sections."""
