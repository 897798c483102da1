"""What the types of files are made of: scalars and lists that stand for names, values, predicates, durations.

Only the sort of YAML is checked here, as what the texts say is a matter of `parts`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    GetJsonSchemaHandler,
    TypeAdapter,
    ValidatorFunctionWrapHandler,
    WithJsonSchema,
    WrapValidator,
)
from pydantic_core import PydanticCustomError

from scbm.files.language.quantities import DURATION_PATTERN
from scbm.model import Slug

if TYPE_CHECKING:
    from collections.abc import Callable

    from pydantic.json_schema import JsonSchemaValue
    from pydantic_core import CoreSchema

_PREDICATE_HELP = (
    "A predicate: `==`, `!=`, `&&`, `||`, `!`, `->`, `in {a, b}`, `<` and its like on integers, `true`, `false`. "
    "A list is the conjunction of its elements."
)
SCALAR_SCHEMA: dict[str, Any] = {"type": ["boolean", "integer", "string"]}
"""What editors are told of a value of a variable."""


def _found(value: object) -> str:
    match value:
        case None:
            return "nothing"
        case dict():
            return "a mapping"
        case list():
            return "a list"
        case _:
            return f"`{str(value).lower() if isinstance(value, bool) else str(value)[:40]}`"


def wrong_shape(expected: str, value: object, remedy: str | None = None) -> PydanticCustomError:
    """What to raise where something else was expected."""
    context = {"expected": expected, "found": _found(value), "remedy": remedy}
    return PydanticCustomError(Slug.WRONG_SHAPE.value, "expected {expected}, found {found}", context)


def scalar(expected: str) -> BeforeValidator:
    """Takes any scalar."""

    def check(value: object) -> object:
        if value is None or isinstance(value, (dict, list)):
            raise wrong_shape(expected, value)
        return value

    return BeforeValidator(check)


@cache
def _scalars(expected: str) -> TypeAdapter[list[Any]]:
    """Made when it is asked for: it takes a millisecond, and there are many."""
    return TypeAdapter(list[Annotated[Any, scalar(expected)]])


def scalar_or_list(expected: str, expected_element: str) -> BeforeValidator:
    """Takes a scalar, or a list of them."""

    def check(value: object) -> object:
        if value is None or isinstance(value, dict):
            raise wrong_shape(expected, value)
        return _scalars(expected_element).validate_python(value) if isinstance(value, list) else value

    return BeforeValidator(check)


def list_of(expected: str, expected_element: str) -> BeforeValidator:
    """Takes a list of scalars."""

    def check(value: object) -> object:
        if not isinstance(value, list):
            remedy = f"write `[{value}]`" if isinstance(value, str) else None
            raise wrong_shape(expected, value, remedy)
        return _scalars(expected_element).validate_python(value)

    return BeforeValidator(check)


def scalar_or_mapping(expected: str) -> WrapValidator:
    """A scalar, or a mapping of a type with known keys."""

    def check(value: object, check_mapping: ValidatorFunctionWrapHandler) -> object:
        if value is None or isinstance(value, list):
            raise wrong_shape(expected, value)
        return check_mapping(value) if isinstance(value, dict) else value

    return WrapValidator(check)


@dataclass(frozen=True)
class Editors:
    """What editors are told, made of the schema of the mapping that stands there otherwise."""

    make: Callable[[JsonSchemaValue], JsonSchemaValue]

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        return self.make(handler(schema))


def text_schema(description: str, **more: object) -> WithJsonSchema:
    """What editors are told of a text."""
    return WithJsonSchema({"type": "string", "description": description, **more})


Name: TypeAlias = Annotated[Any, scalar("a name"), WithJsonSchema({"type": "string"})]
Value: TypeAlias = Annotated[Any, scalar("a value"), WithJsonSchema(SCALAR_SCHEMA)]
Predicate: TypeAlias = Annotated[
    Any,
    scalar_or_list("a predicate", "a predicate"),
    WithJsonSchema(
        {
            "description": _PREDICATE_HELP,
            "anyOf": [
                {"type": ["string", "boolean"]},
                {"type": "array", "items": {"type": ["string", "boolean"]}},
            ],
        }
    ),
]
Requirement: TypeAlias = Annotated[
    Any,
    scalar("a requirement"),
    text_schema("`always p`, `never p`, `p leads to q [within d]`, `p before q`, or `after p always q until r`."),
]
Names: TypeAlias = Annotated[
    Any, list_of("a list of names", "a name"), WithJsonSchema({"type": "array", "items": {"type": "string"}})
]
Duration: TypeAlias = Annotated[
    Any,
    scalar("a duration such as `10 s`"),
    text_schema("A number with a unit: `10 s`, `500 ms`, `2 minutes`.", pattern=DURATION_PATTERN),
]
Durations: TypeAlias = Annotated[
    Any,
    list_of("a list of durations", "a duration such as `10 s`"),
    WithJsonSchema({"type": "array", "items": {"type": "string", "pattern": DURATION_PATTERN}}),
]


class FileType(BaseModel):
    """A mapping with known keys."""

    model_config = ConfigDict(extra="forbid", use_attribute_docstrings=True, defer_build=True)

    @classmethod
    def keys(cls) -> dict[str, Any]:
        """Each key as it is written, with what stands under it. Some are words of Python, and have an alias."""
        return {field.alias or name: field.annotation for name, field in cls.model_fields.items()}


@dataclass(frozen=True)
class Shape:
    """The shape of a whole file, or of a text alone.

    Attributes:
        noun: what the text is called in messages.
        root: the type of the whole.
        owners: the types of its parts, each with what such a part is called; a key at the wrong place belongs there.
    """

    noun: str
    root: type[FileType]
    owners: tuple[tuple[type[FileType], str], ...]
