"""Writes data as YAML, in block style unless the data asks for another."""

from __future__ import annotations

import re
from functools import lru_cache
from io import StringIO
from math import copysign
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from ruamel.yaml import YAML
from ruamel.yaml.representer import SafeRepresenter

if TYPE_CHECKING:
    from ruamel.yaml.nodes import MappingNode, ScalarNode, SequenceNode

_WIDTH = 1_000_000
"""The width at which lines are folded: never."""

_FOLDED_WIDTH = 110
"""The width at which `dump_folded` folds lists in brackets."""


class FlowMapping(dict[str, Any]):
    """A mapping that is written on one line, in braces."""


class FlowList(list[Any]):
    """A list that is written on one line, in brackets."""


class Quoted(str):
    """A text that is always written in quotes."""

    __slots__ = ()


class _Representer(SafeRepresenter):
    """Represents the styles above; repeats equal parts and writes no anchors."""

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ANN401, ARG002 - as ruamel declares it
        return True

    def flow_mapping(self, data: FlowMapping) -> MappingNode:
        """Return the node of a mapping in braces."""
        node: MappingNode = self.represent_mapping("tag:yaml.org,2002:map", data, flow_style=True)
        return node

    def flow_list(self, data: FlowList) -> SequenceNode:
        """Return the node of a list in brackets."""
        node: SequenceNode = self.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=True)
        return node

    def quoted(self, data: Quoted) -> ScalarNode:
        """Return the node of a text in quotes."""
        node: ScalarNode = self.represent_scalar("tag:yaml.org,2002:str", str(data), style='"')
        return node


_Representer.add_representer(FlowMapping, _Representer.flow_mapping)
_Representer.add_representer(FlowList, _Representer.flow_list)
_Representer.add_representer(Quoted, _Representer.quoted)


class _UnusualError(Exception):
    """The data has a part that only ruamel.yaml lays out."""


_PLAIN = re.compile(
    r"[a-zA-Z_][a-zA-Z0-9_.]{,40}(?: [a-zA-Z0-9_.=&|<>()-]{1,40}){,2}|\d{1,15}(?:\.\d{1,15})? (?:[num]?s|min|h)"
)
"""Some of the texts that need no quotes anywhere, unless they are words of YAML: they need no ruamel.yaml."""

_WORDS = ("true", "false", "null", "yes", "no", "on", "off", "y", "n")


def _scalar(value: Any, *, in_flow: bool, is_key: bool) -> str:  # noqa: ANN401 - a scalar of any type
    """Return a scalar as ruamel.yaml writes it in this place. Raises `_UnusualError` for a text that it may break."""
    sign = copysign(1, value) if type(value) is float else 1
    return _written(value, sign, in_flow=in_flow, is_key=is_key)


@lru_cache(50_000, typed=True)
def _written(value: Any, sign: float, *, in_flow: bool, is_key: bool) -> str:  # noqa: ANN401, ARG001 - see `_scalar`; the sign tells -0.0 from 0.0
    if type(value) is str and _PLAIN.fullmatch(value) and value.lower() not in _WORDS:
        return value
    if isinstance(value, str) and len(f"{value}.".splitlines()) > 1:
        raise _UnusualError
    data: dict[Any, Any] = {value: 0} if is_key else {0: value}
    text = dump_all(FlowMapping(data) if in_flow else data)
    before, behind = "" if is_key else "0: ", ": 0" if is_key else ""
    if in_flow:
        before, behind = f"{{{before}", f"{behind}}}"
    if text.startswith(("?", "{?")):
        raise _UnusualError
    return text.removesuffix("\n")[len(before) :].removesuffix(behind)


_SCALARS = frozenset({str, Quoted, bool, int, float, type(None)})
_COLLECTIONS = frozenset({dict, list, FlowMapping, FlowList})


class _Layout:
    """Lays out mappings, lists and scalars as ruamel.yaml does. Raises `_UnusualError` for anything else."""

    def __init__(self, *, short_in_flow: bool) -> None:
        self._is_short = short_in_flow
        self._lines: list[str] = []

    def text(self, data: dict[str, Any]) -> str:
        """Return the text of a mapping."""
        if self._is_in_flow(data):
            return f"{self._flow(data)}\n"
        self._mapping(data, "", "")
        return "".join(f"{line}\n" for line in self._lines)

    def _is_in_flow(self, part: Any) -> bool:  # noqa: ANN401 - any part of the data
        kind = type(part)
        if kind not in _COLLECTIONS:
            raise _UnusualError
        if kind is FlowMapping or kind is FlowList or not part:
            return True
        if not self._is_short:
            return False
        parts = part.values() if kind is dict else part
        return all(type(each) in _SCALARS and type(each) is not Quoted for each in parts)

    def _flow(self, part: Any) -> str:  # noqa: ANN401 - any part of the data
        kind = type(part)
        if kind in _SCALARS:
            return _scalar(part, in_flow=True, is_key=False)
        if kind is dict or kind is FlowMapping:
            pairs = (f"{_scalar(key, in_flow=True, is_key=True)}: {self._flow(value)}" for key, value in part.items())
            return f"{{{', '.join(pairs)}}}"
        if kind not in _COLLECTIONS:
            raise _UnusualError
        return f"[{', '.join(self._element(each) for each in part)}]"

    def _element(self, part: Any) -> str:  # noqa: ANN401 - any part of the data
        """Return an element of a list in brackets: a mapping with one key has no braces there."""
        if isinstance(part, list) and not all(type(each) in _SCALARS for each in part):
            raise _UnusualError  # lists of lists of lists may have more blanks
        text = self._flow(part)
        return text[1:-1] if isinstance(part, dict) and len(part) == 1 else text

    def _mapping(self, data: dict[str, Any], first: str, rest: str) -> None:
        """Add the lines of a mapping, with the text before the first one and before the others."""
        before = first
        for key, value in data.items():
            begin = f"{before}{_scalar(key, in_flow=False, is_key=True)}:"
            before = rest
            kind = type(value)
            if kind in _SCALARS:
                self._lines.append(f"{begin} {_scalar(value, in_flow=False, is_key=False)}")
            elif self._is_in_flow(value):
                self._lines.append(f"{begin} {self._flow(value)}")
            elif kind is dict:
                self._lines.append(begin)
                self._mapping(value, f"{rest}  ", f"{rest}  ")
            elif kind is list:
                self._lines.append(begin)
                self._list(value, rest if self._is_short else f"{rest}  ")
            else:
                raise _UnusualError

    def _list(self, data: list[Any], indent: str) -> None:
        for part in data:
            kind = type(part)
            if kind in _SCALARS:
                self._lines.append(f"{indent}- {_scalar(part, in_flow=False, is_key=False)}")
            elif isinstance(part, list) and not all(type(each) in _SCALARS for each in part):
                raise _UnusualError  # lists of lists may have more blanks
            elif self._is_in_flow(part):
                self._lines.append(f"{indent}- {self._flow(part)}")
            elif kind is dict:
                self._mapping(part, f"{indent}- ", f"{indent}  ")
            else:
                raise _UnusualError


def dump(data: dict[str, Any], *, short_in_flow: bool = False) -> str:
    """Return the data as YAML, as `dump_all` does, in a tenth of its time.

    Args:
        data: the root; the order of its keys is kept.
        short_in_flow: whether mappings and lists of scalars are written on one line.
    """
    try:
        return _Layout(short_in_flow=short_in_flow).text(data)
    except _UnusualError:
        return dump_all(data, short_in_flow=short_in_flow)


def dump_all(data: dict[str, Any], *, short_in_flow: bool = False) -> str:
    """Return any data as YAML, by ruamel.yaml; see `dump`."""
    yaml = YAML(typ="safe", pure=True)
    yaml.Representer = _Representer
    yaml.default_flow_style = None if short_in_flow else False
    yaml.sort_base_mapping_type_on_output = False  # type: ignore[assignment] # ruamel declares it as None
    yaml.width = _WIDTH
    yaml.allow_unicode = True
    if not short_in_flow:
        yaml.indent(mapping=2, sequence=4, offset=2)
    stream = StringIO()
    yaml.dump(data, stream)
    return stream.getvalue()


def dump_folded(data: dict[str, Any]) -> str:
    """Return the data as `dump` does, with long lists in brackets folded into lines of at most 110 columns.

    Their elements are names: runs of blanks in an element may be lost.
    """
    lines = dump(data).split("\n")
    return "\n".join(folded for line in lines for folded in (_folded(line) if line.endswith("]") else [line]))


def _folded(line: str) -> list[str]:
    """Return a key with its list as lines; those after the first are indented by two more blanks."""
    indent = " " * (len(line) - len(line.lstrip(" ")) + 2)
    return wrap(line, _FOLDED_WIDTH, subsequent_indent=indent, break_long_words=False, break_on_hyphens=False)
