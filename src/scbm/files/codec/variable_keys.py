"""The keys of a variable in a model file, and its domain."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from scbm.files.codec.key_types import SCALAR_SCHEMA, ScalarOrListType, ScalarType, node_of, scalar_node
from scbm.files.codec.keys import Key, Keys, ShapeCheck, Spot
from scbm.files.codec.lifted.object_keys import where_key
from scbm.files.language.grammar import keywords
from scbm.files.language.scope import NAME
from scbm.files.spelling import nearest
from scbm.model import Slug
from scbm.model.values import Domain, Value, format_value
from scbm.model.variables import Variable, VariableSource

if TYPE_CHECKING:
    from scbm.files.codec.value_reader import ValueReader
    from scbm.files.yaml.document import YamlNode

MAX_VALUES = 65_536
"""The maximum number of values of a domain: indices of values fit 16 bits."""

_RANGE = re.compile(r"(-?\d{1,18})\s*\.\.\s*(-?\d{1,18})", re.ASCII)
_LONG_RANGE = re.compile(r"-?\d+\s*\.\.\s*-?\d+", re.ASCII)
_ENDS = re.compile(r"(-?\d{1,18})\s*(?:\.+|-|:|,|to|…)\s*(-?\d{1,18})", re.ASCII)
"""Ranges as other languages write them."""


# domains


def read_domain(reader: ValueReader, node: YamlNode) -> Domain | None:
    """Return the domain that a scalar or a list of symbols describes."""
    if isinstance(node.plain, list):
        return _symbols(reader, node)
    text = node.text or ""
    if text == "bool":
        return Domain.boolean()
    match = _RANGE.fullmatch(text)
    if match is not None:
        return _range(reader, int(match[1]), int(match[2]), node)
    if _LONG_RANGE.fullmatch(text):
        message = f"a domain can have {MAX_VALUES} values between numbers of 18 digits, and `{text}` is too large"
        reader.add(Slug.DOMAIN_TOO_LARGE, message, node.place)
        return None
    reader.add(Slug.BAD_DOMAIN, f"`{text}` is not a domain", node.place, _domain_remedy(text))
    return None


def domain_data(domain: Domain) -> str | list[Value]:
    """Return a domain as it is written."""
    return str(domain) if not isinstance(domain.values[0], str) else list(domain.values)


def _range(reader: ValueReader, low: int, high: int, node: YamlNode) -> Domain | None:
    if low > high:
        reader.add(Slug.EMPTY_DOMAIN, f"no integer lies in {low}..{high}", node.place, f"write `{high}..{low}`")
        return None
    return Domain.integers(low, high) if _is_small(reader, high - low + 1, node) else None


def _is_small(reader: ValueReader, count: int, node: YamlNode) -> bool:
    if count > MAX_VALUES:
        message = f"a domain can have {MAX_VALUES} values, and this has {count}"
        reader.add(Slug.DOMAIN_TOO_LARGE, message, node.place)
    return count <= MAX_VALUES


def _symbols(reader: ValueReader, node: YamlNode) -> Domain | None:
    if not node.elements:
        reader.add(Slug.EMPTY_DOMAIN, "a domain needs at least one value", node.place)
        return None
    if not _is_small(reader, len(node.elements), node) or _refuse_list_of_others(reader, node):
        return None
    symbols: dict[str, None] = {}
    sound = True
    for element in node.elements:
        if not _is_symbol(reader, element):
            sound = False
        elif element.text in symbols:
            reader.add(Slug.DUPLICATE_VALUE, f"`{element.text}` is listed twice", element.place)
        elif element.text is not None:
            symbols[element.text] = None
    return Domain(tuple(symbols)) if sound else None


def _refuse_list_of_others(reader: ValueReader, node: YamlNode) -> bool:
    """Note a list of integers or truth values: one mistake, not as many as it has elements."""
    values = [element.plain for element in node.elements]
    if all(isinstance(value, bool) for value in values):
        reader.add(Slug.BAD_DOMAIN, "a list of truth values is not a domain", node.place, "write `bool`")
        return True
    numbers = [value for value in values if isinstance(value, int) and not isinstance(value, bool)]
    if len(numbers) < len(values):
        return False
    remedy = f"write a range: `{min(numbers)}..{max(numbers)}`"
    reader.add(Slug.BAD_DOMAIN, "a list of numbers is not a domain", node.place, remedy)
    return True


def _is_symbol(reader: ValueReader, element: YamlNode) -> bool:
    """Return whether an element of a domain is a symbol; note an error if it is another scalar."""
    text = element.text
    if text is None or element.plain is None:
        return False
    if text in keywords():
        reader.add(Slug.RESERVED_NAME, f"`{text}` is a reserved word", element.place, "choose another word")
    elif not isinstance(element.plain, str) or not NAME.fullmatch(text):
        remedy = "a symbol is a word of letters, digits and `_`, such as `box_a`"
        reader.add(Slug.BAD_DOMAIN, f"`{text}` is not a symbol", element.place, remedy)
    else:
        return True
    return False


def _domain_remedy(written: str) -> str:
    if nearest(written, ["bool", "boolean"]):
        return "write `bool`"
    ends = _ENDS.fullmatch(written)
    return f"write `{ends[1]}..{ends[2]}`" if ends else "write `bool`, `[a, b, c]` or `0..5`"


# values of a domain


class _InitialType(ScalarType["YamlNode"], frozen=True):
    """The initial value of a variable."""

    def check(self, spot: Spot, check: ShapeCheck) -> None:
        """Note everything but a scalar; for a value of each object, say that entries have them."""
        if isinstance(spot.node.plain, dict):
            remedy = "write an entry for the objects of each value, such as `at[r in robot]: {…, where: r == r1}`"
            check.wrong_shape(spot, self.expected, remedy)
        else:
            super().check(spot, check)


_INITIAL = _InitialType("value", "a value", SCALAR_SCHEMA, scalar_node)


def read_values(reader: ValueReader, node: YamlNode, domain: Domain, name: str) -> tuple[Value, ...]:
    """Return the values of variable `name` that `any` or a list stands for; none if the node is wrong."""
    if not isinstance(node.plain, list):
        if node.text == "any":
            return domain.values
        message = f"expected `any` or a list of values, found `{node.text}`"
        is_value = (node.text or "") in map(format_value, domain.values)
        reader.add(Slug.WRONG_SHAPE, message, node.place, f"write `[{node.text}]`" if is_value else "write `any`")
        return ()
    if not node.elements:
        reader.add(Slug.EMPTY_DOMAIN, "a list of values needs at least one", node.place)
    values: dict[Value, None] = {}
    all_values = frozenset(domain.values)
    for element in node.elements:
        value = reader.value(element, domain, name, all_values)
        if value is not None and value in values:
            reader.add(Slug.DUPLICATE_VALUE, f"`{element.text}` is listed twice", element.place)
        elif value is not None:
            values[value] = None
    return tuple(values)


DOMAIN = ScalarOrListType(
    "domain",
    "`bool`, a list of symbols such as `[open, closed]`, or a range such as `0..5`",
    {
        "description": "`bool`, a list of symbols, an integer range `lo..hi`, or the name of a type.",
        "anyOf": [
            {"const": "bool"},
            {"type": "string", "pattern": r"^-?\d+\s*\.\.\s*-?\d+$"},
            {
                "type": "string",
                "pattern": r"^(?!(bool|boolean|int|integer|string|enum)$)[A-Za-z_]\w*$",
                "description": "The name of a type: its objects.",
            },
            {"type": "array", "items": {"type": "string"}, "minItems": 1, "uniqueItems": True},
        ],
    },
    "a symbol",
    read_domain,
    domain_data,
)
VALUES = ScalarOrListType(
    "`any` or a list of values",
    "`any` or a list of values",
    {"anyOf": [{"const": "any"}, {"type": "array", "items": SCALAR_SCHEMA, "minItems": 1}]},
    "a value",
    node_of,
    lambda values: values if values == "any" else list(values),
)


def _read_source(reader: ValueReader, node: YamlNode, text: str) -> VariableSource | None:
    word = reader.word(node, text, _SOURCES, "a source of a variable")
    return None if word is None else VariableSource(word)


_SOURCES = tuple(source.value for source in VariableSource)
_SOURCE = ScalarType(
    "source", "a source such as `input`", {"enum": list(_SOURCES)}, _read_source, lambda source: source.value
)


class VariableKeys(Keys):
    """A variable with a finite domain."""

    domain = Key(
        DOMAIN,
        "Its values: `bool`, a list of symbols such as `[open, closed]`, or a range of integers such as `0..5`.",
        required=True,
    )
    initial = Key(_INITIAL, "The nominal initial value.", required=True)
    random = Key(
        VALUES,
        "The values that random initial states draw from, each equally probable.",
        absent="the nominal value",
        source=lambda variable: None if variable.random == (variable.initial,) else variable.random,
    )
    source = Key(
        _SOURCE,
        "Who changes it: `input`, the environment; `state`, the model alone; `constant`, nothing.",
        absent="inferred, see semantics 9.1",
    )
    where = where_key()

    def variable(self, name: str) -> Variable | None:
        """Return the variable; `None` if its domain is wrong."""
        domain = self.domain
        if domain is None:
            return None
        initial = self.reader.value(self.initial, domain, name, domain.values)
        random = () if self.random is None else read_values(self.reader, self.random, domain, name)
        if initial is None:
            return Variable(name, domain, domain.values[0], (domain.values[0],))
        return Variable(name, domain, initial, random or (initial,), source=self.source)
