"""Writes data as YAML, in block style unless the data asks for another."""

from __future__ import annotations

from io import StringIO
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


def dump(data: dict[str, Any], *, short_in_flow: bool = False) -> str:
    """Return the data as YAML.

    Args:
        data: the root; the order of its keys is kept.
        short_in_flow: whether mappings and lists of scalars are written on one line.
    """
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
