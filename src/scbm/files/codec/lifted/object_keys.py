"""The keys of objects and parameters in a model file; the expansion reads them, and writes out what they mean."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scbm.files.codec.key_types import (
    PREDICATE_SCHEMA,
    MappingType,
    NamesType,
    RequirementType,
    ScalarListType,
    ScalarOrListType,
    ScalarOrMappingType,
    ScalarType,
    node_of,
    scalar_node,
)
from scbm.files.codec.keys import Key, Keys
from scbm.files.codec.value_reader import ValueReader
from scbm.files.expansion.stage_keys import REQUIREMENT_KEYS

if TYPE_CHECKING:
    from scbm.files.codec.keys import Data, Definitions, ShapeCheck, Spot
    from scbm.files.yaml.document import YamlNode
    from scbm.model.requirements import RequirementForm

_WORDS: dict[str, Data] = {"type": "array", "items": {"type": "string"}}
_OBJECTS: dict[str, Data] = {"anyOf": [_WORDS, {"type": "string", "pattern": r"^\d+\.\.\d+$"}]}


def _absent(_: object) -> None:
    """Return nothing: a model has no such part, as its file is expanded before."""


def where_key() -> Key[YamlNode]:
    """Return the key `where` of an entry with parameters."""
    return Key(
        ScalarOrListType("condition", "a condition over objects", PREDICATE_SCHEMA, "a condition", node_of),
        "With [parameters](#objects-and-parameters): which objects the entry is for; it reads tables and no variables.",
        absent="all objects",
        source=_absent,
    )


class TypeKeys(Keys):
    """A type of objects that may be a subtype of another one."""

    objects = Key(
        ScalarListType("list of names", "a list of names", _WORDS, "a name", node_of),
        "Its objects; those of its subtypes follow.",
        absent="`[]`",
    )
    of = Key(ScalarType("type", "the name of a type", {"type": "string"}, scalar_node), "The type that it is part of.")


class TableKeys(Keys):
    """A relation between objects that does not change."""

    of = Key(
        ScalarListType("list of types", "a list of types", _WORDS, "a type", node_of),
        "The types of its columns.",
        required=True,
    )
    rows = Key(
        ScalarListType(
            "list of rows",
            "a list of rows",
            {"type": "array", "items": {"anyOf": [_WORDS, {"type": "string"}]}},
            "a row",
            node_of,
        ),
        "The rows of objects for which the table holds, such as `[[a, b], [b, c]]`.",
        required=True,
    )


class LiftedRequirementType(RequirementType, frozen=True):
    """A requirement; with parameters and a condition it is written as a mapping."""

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note everything but a requirement; name the keys of a mapping that the expansion could not read."""
        if not isinstance(spot.node.plain, dict):
            super().check(spot, check)
            return
        unknown = [(key, child.place) for key, child in spot.entries() if key not in REQUIREMENT_KEYS]
        for key, place in unknown:
            check.unknown_key(key, place, REQUIREMENT_KEYS)
        if "requirement" in spot.node.items:
            remedy = f"write the requirement itself: `{spot.section}: always …`"
            check.wrong_shape(spot, self.expected, remedy)
        elif not unknown:
            check.missing_key("requirement", spot, REQUIREMENT_KEYS)

    def schema(self, definitions: Definitions) -> dict[str, Data]:
        """Return the JSON Schema of both."""
        mapping = {"requirement": super().schema(definitions), "where": PREDICATE_SCHEMA}
        whole = {"type": "object", "properties": mapping, "required": ["requirement"], "additionalProperties": False}
        return {"anyOf": [super().schema(definitions), whole]}


_REQUIREMENT = LiftedRequirementType("requirement", "a requirement", {"type": "string"}, ValueReader.sentence, str)
LIFTED_REQUIREMENTS: NamesType[RequirementForm | None] = NamesType(_REQUIREMENT, "name → requirement")

TYPES = NamesType(
    ScalarOrMappingType(TypeKeys, "list of objects, range, or type", "a list of objects", _OBJECTS),
    "name → objects, or type",
)
TABLES = NamesType(MappingType(TableKeys, "table"), "name → table")


def types_key() -> Key[object]:
    """Return the key `types`."""
    return Key(
        TYPES,
        "The types of objects, each with its objects in order, or with integers: `1..4`.",
        absent="no types",
        source=_absent,
    )


def tables_key() -> Key[object]:
    """Return the key `tables`."""
    return Key(TABLES, "Relations between objects, for conditions and guards.", absent="no tables", source=_absent)
