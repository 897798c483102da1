"""Lifted twins of model texts: the same lines, with parameters on all entries, or as a part that a model uses.

The texts can be wrong in any way, also as YAML, so twins are made of lines and not of trees.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

PARAMETER = "thing_p"
OBJECTS = ("thing1_", "thing2_")

_ENTRIES = ("operations", "automatic_transitions", "environment", "goals", "requirements", "resources")
"""The sections whose entries get a parameter."""

_OF_PARTS = ("types", "tables", "variables", *_ENTRIES)

_HEADER = re.compile(r"(?m)^(\w+):")
_OBLIGATION = re.compile(r"(obligation: )((?:automatic/)?\w+)((?:/\w+)?)\b")
_SPACE = re.compile(r"\w+:[ ]*(?:&\w+ )?(?:#.*)?")
_QUOTED = r"\"[^\"\n]*\"|'[^'\n]*'"
_FLOW_KEY = re.compile(rf"({_QUOTED}|[\w.&-]+(?: [\w.&-]+)*)\s*:(?=\s)")


def _sections(text: str) -> Iterator[tuple[str, str]]:
    """Yield what stands before the first section, with an empty name, then each section with its header."""
    heads = [*_HEADER.finditer(text)]
    ends = [head.start() for head in heads[1:]] + [len(text)]
    yield "", text[: heads[0].start()] if heads else text
    yield from ((head[1], text[head.start() : end]) for head, end in zip(heads, ends, strict=False))


def _keys(section: str) -> list[tuple[int, int]]:
    """Return where the keys of the entries of a section begin and end."""
    match = _SPACE.match(section)
    begin = match.end() if match is not None else 0
    if section[begin : begin + 1] == "{":
        return [*_flow_keys(section, begin)]
    indentation = re.search(r"(?m)^( +)\S", section[begin:])
    if indentation is None:
        return []
    key = re.compile(rf"(?m)^{indentation[1]}({_QUOTED}|\S[^:#\n]*?):(?=\s|$)")
    return [match.span(1) for match in key.finditer(section, begin)]


def _flow_keys(section: str, begin: int) -> Iterator[tuple[int, int]]:
    depth = 0
    at = begin
    while at < len(section):
        character = section[at]
        depth += (character in "{[") - (character in "}]")
        match = _FLOW_KEY.match(section, at) if depth == 1 else None
        if match is not None and section[begin:at].rstrip()[-1:] in ("{", ","):
            yield match.span(1)
            at = match.end(1)
            continue
        quoted = re.compile(_QUOTED).match(section, at) if section[at - 1] in " {[," else None
        at = quoted.end() if quoted is not None else at + 1


def _names(text: str, section: str) -> list[str]:
    """Return the names of the entries of a section."""
    return [
        own[begin:end].strip("\"'") for name, own in _sections(text) if name == section for begin, end in _keys(own)
    ]


@dataclass(frozen=True)
class LiftedText:
    """A text with parameters, and the lines of its entries that have some."""

    text: str
    lines: frozenset[int]


def with_parameters(text: str) -> LiftedText:
    """Return a text whose entries have parameters: resources, and variables that are named once, an index.

    It has two objects for each parameter; one if it has bindings, as resources cannot share topics.
    """
    whole: list[str] = []
    lines: dict[int, None] = {}
    for name, section in _sections(text):
        own, first = section, "".join(whole).count("\n") + 1
        spans = [*_keys(section)]
        ends = [begin for begin, _ in spans[1:]] + [len(section.rstrip())]
        for (begin, end), stop in reversed([*zip(spans, ends, strict=False)]):
            index = _index(text, name, section[begin:end].strip("\"'"))
            if index:
                own = f"{own[:begin]}{_lifted_key(own[begin:end], index, own)}{own[end:]}"
                before = section[:begin].count("\n")
                lines |= dict.fromkeys(range(first + before, first + before + section[begin:stop].count("\n") + 1))
        if name == "waivers":
            own = _OBLIGATION.sub(rf'\1"\2[{PARAMETER} in thing_]\3"', own)
            lines |= dict.fromkeys(range(first, first + own.count("\n")))
        whole.append(_with_indices(own, text, PARAMETER if name in _ENTRIES else OBJECTS[0]))
    count = 1 if "ros:" in text else len(OBJECTS)
    return LiftedText(f"{''.join(whole)}\ntypes: {{thing_: [{', '.join(OBJECTS[:count])}]}}\n", frozenset(lines))


def _index(text: str, section: str, name: str) -> str:
    """Return the index that an entry of a section gets; nothing if it gets none."""
    if section in _ENTRIES:
        return f"[{PARAMETER} in thing_]"
    is_named_once = len(re.findall(rf"(?<![\w.]){re.escape(name)}(?![\w.])", text)) == 1
    is_escaped = len(name) > 3 and text.count(name[1:]) > 1  # a name may begin with an escape
    return "[thing_]" if section == "variables" and is_named_once and not is_escaped else ""


def _lifted_key(key: str, index: str, section: str) -> str:
    is_flow = "{" in section.partition("\n")[0]
    if key[:1] in ("'", '"'):
        return f"{key[:-1]}{index}{key[-1]}"
    return f'"{key}{index}"' if is_flow else f"{key}{index}"


def _with_indices(section: str, text: str, index: str) -> str:
    """Return a section with the index at all names of operations and resources."""
    for name in map(re.escape, _names(text, "operations")):
        section = re.sub(rf"(?<![\w.])({name})\.state\b", rf"\1.{index}.state", section)
        section = re.sub(rf"(current\.name [!=]= |current\.name <- )({name})\b(?!\.)", rf"\1\2.{index}", section)
    for name in map(re.escape, _names(text, "resources")):
        section = re.sub(rf"(?<![\w.])({name}_req_(?:state|trigger))\b", rf"\1.{index}", section)
        section = re.sub(rf"(request: \[?)({name})\b(?=[\],}}\n])", rf"\1\2.{index}", section)
    return section


def as_part(text: str, prefix: str | None) -> tuple[str, str]:
    """Return a model and the part with its sections, each at its lines: used with a prefix, or else included."""
    model, part = "", ""
    for name, section in _sections(text):
        blank = "\n" * section.count("\n")
        is_part = name in _OF_PARTS
        model += blank if is_part else section
        part += section.replace("behavior_model:", "part:") if is_part or name in ("", "behavior_model") else blank
    use = "include: part.yaml" if prefix is None else f"parts: {{{prefix}: {{use: part.yaml}}}}"
    return f"{model.rstrip()}\n{use}\n", part
